//! The record of a calibration: one JSON file with all that another person needs to compute it again.
//!
//! It names the session as it was run, the raw logs with their SHA-256, what a person was asked and said, each interruption, and each result with its budget.
//! [`compute`] makes it from a session's folder; made again from the same folder, the results are the same.

use super::session::journal::{Journal, JournalError};
use super::session::{Session, What};
use super::{CalibrateError, Findings, gyro};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The record's file in a session's folder.
pub const FILE: &str = "record.json";

/// Why there is no record.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// Journal and logs.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// What the logs do not show.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// A file that is no record.
    #[error("{path}: {says}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        says: String,
    },
}

/// A session's folder, computed.
pub struct Record {
    /// What has happened.
    pub journal: Journal,
    /// What was run.
    pub session: Session,
    /// The results.
    pub findings: Findings,
    /// When they were computed.
    pub date: String,
}

/// Computes what the logs of a session's folder show; each log is checked against the journal first.
///
/// # Errors
/// No session there; a log that was changed; logs that show nothing.
pub fn compute(folder: &Path) -> Result<Record, RecordError> {
    let (journal, session) = Journal::read(folder)?;
    let steps = journal.logs(folder)?;
    let findings = match session.what {
        What::Gyro => gyro::calibrate(&steps, &gyro::Given::of(&session)),
        What::Accel => super::accel::calibrate(&steps, &session),
        What::Drive => super::drive::calibrate(&steps, &session),
    }?;
    Ok(Record { journal, session, findings, date: super::session::journal::now() })
}

impl Record {
    /// Whether all steps are done.
    pub fn is_whole(&self) -> bool {
        self.journal.steps.len() == self.session.steps.len()
    }

    /// The answer of `stand calibrate --json`: each quantity by its name, and the whole record around it.
    pub fn json(&self) -> Value {
        let mut all = serde_json::Map::new();
        for q in &self.findings.quantities {
            all.insert(q.name.clone(), q.json());
        }
        all.insert("record".into(), self.about());
        Value::Object(all)
    }

    fn about(&self) -> Value {
        let j = &self.journal;
        json!({
            "what": self.session.what.name(),
            "sensor": self.session.sensor, "serial": self.session.serial, "operator": self.session.operator,
            "began": j.began, "computed": self.date, "stand": j.stand, "tools": j.tools,
            "whole": self.is_whole(),
            "statement": Session::statement(),
            "session": serde_json::to_value(&self.session).unwrap_or(Value::Null),
            "steps": serde_json::to_value(&j.steps).unwrap_or(Value::Null),
            "interruptions": j.interruptions,
            "absent": self.findings.absent.iter().map(|(name, why)| json!({"name": name, "why": why})).collect::<Vec<_>>(),
            "says": self.findings.says,
        })
    }
}

/// What a folder of records shows of one record.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    /// Its file.
    pub path: PathBuf,
    /// gyro, accel or drive.
    pub what: String,
    /// Of the part.
    pub serial: String,
    /// When the session began.
    pub began: String,
    /// All steps were done.
    pub is_whole: bool,
    /// Name, value, standard uncertainty, degrees of freedom, unit.
    pub results: Vec<(String, f64, f64, f64, String)>,
}

/// Reads a record's file.
///
/// # Errors
/// It is not there, or is none; the file is named.
pub fn read(path: &Path) -> Result<Kept, RecordError> {
    let wrong = |says: String| RecordError::File { path: path.to_owned(), says };
    let text = std::fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
    let all: Value = serde_json::from_str(&text).map_err(|e| wrong(format!("no record: {e}")))?;
    let about = all.get("record").ok_or_else(|| wrong("no record of a calibration: it has no `record`".into()))?;
    let word = |key: &str| about.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
    let quantities = all.as_object().into_iter().flatten().filter(|(name, _)| *name != "record");
    let results = quantities
        .filter_map(|(name, q)| {
            let number = |key: &str| q.get(key).and_then(Value::as_f64);
            let dof = number("dof").unwrap_or(f64::INFINITY);
            Some((name.clone(), number("value")?, number("sigma")?, dof, q.get("unit")?.as_str()?.to_owned()))
        })
        .collect();
    let is_whole = about.get("whole").and_then(Value::as_bool).unwrap_or(false);
    Ok(Kept { path: path.to_owned(), what: word("what"), serial: word("serial"), began: word("began"), is_whole, results })
}
