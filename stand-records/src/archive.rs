//! Record files below a folder: found, read, and verified against the raw logs beside them.
//!
//! Verification needs the folder only: the logs must have the recorded SHA-256, and computing again by the recorded session must give the
//! same values.

use super::record::{RecordError, findings};
use super::stored_record::{RECORD_FILE, StoredRecord};
use identification::statistics::Extremes;
use serde_json::Value;
use stand_acquire::calibration_session::journal::{StepRecord, sha256};
use stand_analysis::calibrate::Findings;
use std::path::{Path, PathBuf};

/// Relative difference up to which a recomputed value counts as the same.
pub const MAX_RELATIVE_DIFFERENCE: f64 = 1e-12;

/// A record with the path of its file.
pub struct ArchivedRecord {
    /// The file.
    pub path: PathBuf,
    /// Its content.
    pub record: StoredRecord,
}

/// State of a raw log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogState {
    /// The SHA-256 is that of the record.
    AsRecorded,
    /// The file has changed.
    Changed {
        /// SHA-256 of the file.
        sha256: String,
    },
    /// The file cannot be read.
    Missing,
}

/// Why a record was not computed again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NotRecomputed {
    /// A log is not as recorded.
    Log {
        /// Its file name.
        log: String,
        /// Its state.
        state: LogState,
    },
    /// A quantity is in only one of both results.
    Quantity {
        /// Its name.
        name: String,
    },
    /// The computation failed.
    Failed {
        /// Message of the error.
        message: String,
    },
}

/// Result of verifying a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Verification {
    /// Raw logs and their states.
    pub logs: Vec<(String, LogState)>,
    /// Greatest relative difference of a value or standard uncertainty that was computed again.
    pub difference: Result<f64, NotRecomputed>,
}

impl Verification {
    /// The recomputed results are those of the record.
    pub fn is_same(&self) -> bool {
        self.difference.as_ref().is_ok_and(|difference| *difference <= MAX_RELATIVE_DIFFERENCE)
    }
}

impl ArchivedRecord {
    /// Reads a record file, or the one in a session's folder.
    ///
    /// # Errors
    /// The file cannot be read or is not a record; with its path.
    pub fn read(path: &Path) -> Result<Self, RecordError> {
        let path = if path.is_dir() { path.join(RECORD_FILE) } else { path.to_owned() };
        let text = std::fs::read_to_string(&path).map_err(|e| RecordError::Read { path: path.clone(), message: e.to_string() })?;
        let invalid = |message: String| RecordError::Invalid { path: path.clone(), message };
        let all: Value = serde_json::from_str(&text).map_err(|e| invalid(e.to_string()))?;
        let record = StoredRecord::from_json(&all).map_err(invalid)?;
        Ok(Self { path, record })
    }

    /// Start of the session.
    pub fn began(&self) -> Option<jiff::Timestamp> {
        self.record.header.began.parse().ok()
    }

    /// Verifies the record against the logs in its folder.
    pub fn verify(&self) -> Verification {
        let folder = self.path.parent().unwrap_or(Path::new("."));
        let header = &self.record.header;
        let log = |step: &StepRecord| {
            let state = match sha256(&folder.join(&step.log)) {
                Ok(sha256) if sha256 == step.sha256 => LogState::AsRecorded,
                Ok(sha256) => LogState::Changed { sha256 },
                Err(_) => LogState::Missing,
            };
            (step.log.clone(), state)
        };
        let logs: Vec<_> = header.steps.iter().map(log).collect();
        let difference = match logs.iter().find(|(_, state)| *state != LogState::AsRecorded) {
            Some((log, state)) => Err(NotRecomputed::Log { log: log.clone(), state: state.clone() }),
            None => findings(&header.steps, &header.session, folder)
                .map_err(|e| NotRecomputed::Failed { message: e.to_string() })
                .and_then(|findings| difference(&self.record, &findings)),
        };
        Verification { logs, difference }
    }
}

/// Greatest relative difference of the values and standard uncertainties.
fn difference(record: &StoredRecord, again: &Findings) -> Result<f64, NotRecomputed> {
    let lost = record.quantities.iter().map(|q| &q.name).find(|name| again.get(name).is_none());
    let added = again.quantities.iter().map(|q| &q.name).find(|name| record.get(name).is_none());
    if let Some(name) = lost.or(added) {
        return Err(NotRecomputed::Quantity { name: name.clone() });
    }
    let relative = |a: f64, b: f64| if a == b { 0.0 } else { (a - b).abs() / a.abs().max(b.abs()) };
    let pairs = record.quantities.iter().filter_map(|q| Some((q, again.get(&q.name)?)));
    Ok(pairs.flat_map(|(a, b)| [relative(a.value, b.value), relative(a.combined_u(), b.combined_u())]).max_or_zero())
}

/// All records below a folder by date, and the errors of record files that cannot be read.
///
/// # Errors
/// The folder itself cannot be read.
pub fn find_records(folder: &Path) -> Result<(Vec<ArchivedRecord>, Vec<RecordError>), RecordError> {
    let (mut records, mut skipped) = (Vec::new(), Vec::new());
    let mut folders = vec![folder.to_owned()];
    while let Some(here) = folders.pop() {
        let unreadable = |e: std::io::Error| RecordError::Read { path: here.clone(), message: e.to_string() };
        let entries = match std::fs::read_dir(&here) {
            Ok(entries) => entries,
            Err(e) if here == folder => return Err(unreadable(e)),
            Err(e) => {
                skipped.push(unreadable(e));
                continue;
            }
        };
        for entry in entries.flatten() {
            // Links are not followed: they may form a circle.
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                folders.push(entry.path());
            } else if entry.file_name() == RECORD_FILE {
                match ArchivedRecord::read(&entry.path()) {
                    Ok(record) => records.push(record),
                    Err(error) => skipped.push(error),
                }
            }
        }
    }
    records.sort_by(|a, b| (a.began(), &a.path).cmp(&(b.began(), &b.path)));
    skipped.sort_by_key(ToString::to_string);
    Ok((records, skipped))
}
