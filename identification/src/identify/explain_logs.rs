//! Explanations of log files: several logs together, or each log of a folder separately, in parallel.

use std::path::{Path, PathBuf};
use std::time::Instant;

use rayon::prelude::*;

use super::explain::{self, ExplainError, Explanation, Options, Progress};
use crate::log::plausible::Defect;
use crate::log::{Log, LogError, import};
use crate::model::Model;

/// Result for one log, or for several logs together.
pub enum LogExplanation {
    /// The explanation.
    Explained(Box<Explanation>),
    /// The log is not a plausible record of a drive.
    ImplausibleLog(Box<Log>, Vec<Defect>),
}

/// Why there is no explanation.
#[derive(Debug, thiserror::Error)]
pub enum ExplainLogsError {
    /// A log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The model does not fit the logs.
    #[error(transparent)]
    Explain(ExplainError),
    /// The folder cannot be read.
    #[error("{folder}: cannot read the folder: {source}")]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// The folder contains no logs.
    #[error("{folder}: this folder has no logs (files with the ending .csv or .parquet, or with an import file)")]
    NoLogs {
        /// The folder.
        folder: PathBuf,
    },
}

/// Reads the log at `path` with the columns that the expressions of `model` use, and with the rate that the model compares.
///
/// # Errors
/// The log cannot be read, or lacks the column of the rate.
pub fn read_for(path: &Path, model: &Model) -> Result<Log, LogError> {
    let columns: Vec<&str> = model.columns().iter().map(String::as_str).chain(model.rate_column()).collect();
    let log = Log::read_also(path, &columns)?;
    match model.rate_column() {
        Some(column) => log.with_rate(column),
        None => Ok(log),
    }
}

/// Reads `paths` and explains the logs together; `progress` receives the current stage.
///
/// # Errors
/// A log cannot be read, or lacks a column that the model needs.
pub fn explain_together(
    paths: &[PathBuf],
    model: &Model,
    options: Options,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<LogExplanation, ExplainLogsError> {
    let logs = paths.iter().map(|path| read_for(path, model)).collect::<Result<Vec<_>, _>>()?;
    match explain::explain_with(options, logs, model, progress) {
        Ok(explanation) => Ok(LogExplanation::Explained(Box::new(explanation))),
        Err(ExplainError::BadLog { log, findings }) => Ok(LogExplanation::ImplausibleLog(log, findings)),
        Err(error) => Err(ExplainLogsError::Explain(error)),
    }
}

/// One log of a folder.
pub struct FolderEntry {
    /// The log file.
    pub path: PathBuf,
    /// Its explanation, or why there is none.
    pub result: Result<LogExplanation, ExplainLogsError>,
    /// Computing time, s.
    pub seconds: f64,
}

/// Explains each log of `folder` separately, sorted by name; `options` is called before, and `finished` after each log.
///
/// # Errors
/// The folder cannot be read or contains no logs.
pub fn explain_folder(
    folder: &Path,
    model: &Model,
    options: &(dyn Fn() -> Options<'static> + Sync),
    finished: &(dyn Fn(&FolderEntry) + Sync),
) -> Result<Vec<FolderEntry>, ExplainLogsError> {
    let entries = logs_in(folder)?
        .into_par_iter()
        .map(|path| {
            let begin = Instant::now();
            let result = explain_together(std::slice::from_ref(&path), model, options(), &|_| ());
            let entry = FolderEntry { path, result, seconds: begin.elapsed().as_secs_f64() };
            finished(&entry);
            entry
        })
        .collect();
    Ok(entries)
}

/// The log files of a folder, sorted by name: those with the endings of the project, and those with an import file.
///
/// # Errors
/// The folder cannot be read or contains no logs.
pub fn logs_in(folder: &Path) -> Result<Vec<PathBuf>, ExplainLogsError> {
    let entries = std::fs::read_dir(folder).map_err(|source| ExplainLogsError::Folder { folder: folder.to_owned(), source })?;
    let ending = |p: &Path| p.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).unwrap_or_default();
    let is_log = |p: &Path| match ending(p).as_str() {
        "csv" | "parquet" => true,
        other => import::ENDINGS.contains(&other) && import::file_of(p).is_file(),
    };
    let mut logs: Vec<PathBuf> = entries.filter_map(Result::ok).map(|e| e.path()).filter(|p| p.is_file() && is_log(p)).collect();
    logs.sort();
    if logs.is_empty() { Err(ExplainLogsError::NoLogs { folder: folder.to_owned() }) } else { Ok(logs) }
}
