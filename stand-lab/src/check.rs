//! Check of the answers without the true values: formats, units, completeness. The journal keeps the hash of the answers.

use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use super::LabError;
use super::answers::{ANSWERS_FILE, AnswerProblem, Answers};
use super::course::When;
use super::journal::{Event, JOURNAL_FILE, Journal, append, record_explained, work_of};
use super::work::{Work, hashes};

/// Result of a check.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Checked {
    /// All answers before the measurement are given and well formed.
    pub before_complete: bool,
    /// All answers are.
    pub complete: bool,
    /// What is missing or malformed.
    pub problems: Vec<AnswerProblem>,
    /// SHA-256 of the answers.
    pub answers_sha256: String,
    /// Code of the journal's last entry.
    pub code: String,
}

/// The answers in a work folder.
///
/// # Errors
/// The file cannot be read, or is no table of answers.
pub fn read_answers(folder: &Path) -> Result<Answers, LabError> {
    let path = folder.join(ANSWERS_FILE);
    let text = std::fs::read_to_string(&path).map_err(|source| LabError::file(&path, "read", source))?;
    Answers::parse(&text).map_err(|message| LabError::invalid(&path, message))
}

/// Refuses `stand explain` on a log of a hunt while the student's own answers are not recorded complete. Allowed once the true values were
/// shown.
///
/// # Errors
/// [`LabError::ExplainedTooEarly`]; the work or its journal cannot be read.
pub fn check_explain(log: &Path) -> Result<(), LabError> {
    let Some((folder, _)) = work_of(log) else { return Ok(()) };
    let work = Work::read(&folder)?;
    if work.lab()?.hunt().is_none() {
        return Ok(());
    }
    let journal = Journal::read(&folder)?.map_err(|error| LabError::invalid(&folder.join(JOURNAL_FILE), error.to_string()))?;
    let permits = |event: &Event| matches!(event, Event::Checked { before_complete: true, .. } | Event::Graded);
    if journal.entries.iter().any(|entry| permits(&entry.event)) {
        return Ok(());
    }
    Err(LabError::ExplainedTooEarly { lab: work.lab, folder, log: log.to_owned() })
}

/// Records in the journals of their works that an explanation of the logs begins; refuses it, and records nothing, where a work asks for
/// the student's own answers first.
///
/// # Errors
/// As [`check_explain`] and [`record_explained`].
pub fn begin_explain(logs: &[impl AsRef<Path>]) -> Result<(), LabError> {
    logs.iter().try_for_each(|log| check_explain(log.as_ref()))?;
    logs.iter().try_for_each(|log| record_explained(log.as_ref()))
}

/// Checks the answers in a work folder and records the check in its journal.
///
/// # Errors
/// A file cannot be read or written; a journal whose chain is broken.
pub fn check(folder: &Path) -> Result<Checked, LabError> {
    let lab = Work::read(folder)?.lab()?;
    let files = hashes(folder, [ANSWERS_FILE])?;
    let answers = read_answers(folder)?;
    let problems = answers.problems(&lab, When::After);
    let before_complete = answers.problems(&lab, When::Before).is_empty();
    let answers_sha256 = files[ANSWERS_FILE].clone();
    let code = append(folder, Event::Checked { before_complete, complete: problems.is_empty() }, files)?;
    Ok(Checked { before_complete, complete: problems.is_empty(), problems, answers_sha256, code })
}
