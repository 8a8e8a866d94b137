//! The record of a calibration: one JSON file with all that another person needs to compute it again.
//!
//! It names the session as it was run, the raw logs with their SHA-256, what a person was asked and said, each interruption, and each result with its budget.
//! [`compute`] makes it from a session's folder; made again from the same folder, the results are the same. [`Record::of_json`] reads it.

use super::session::journal::{Journal, JournalError};
use super::session::{Session, What};
use super::{CalibrateError, Curve, Findings, gyro};
use crate::statistics::uncertainty::Quantity;
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
    let findings = findings(&journal, &session, folder)?;
    Ok(Record { journal, session, findings, date: super::session::journal::now() })
}

/// What the logs of these steps show.
///
/// # Errors
/// As [`compute`].
pub fn findings(journal: &Journal, session: &Session, folder: &Path) -> Result<Findings, RecordError> {
    let steps = journal.logs(folder)?;
    Ok(match session.what {
        What::Gyro => gyro::calibrate(&steps, &gyro::Given::of(session)),
        What::Accel => super::accel::calibrate(&steps, session),
        What::Drive => super::drive::calibrate(&steps, session),
    }?)
}

impl Record {
    /// A record from its JSON alone; the pictures are not in it.
    ///
    /// # Errors
    /// What it lacks, in words.
    pub fn of_json(all: &Value) -> Result<Self, String> {
        let about = all.get("record").ok_or("no record of a calibration: it has no `record`")?;
        let lacks = |what: &str, e: serde_json::Error| format!("record.{what}: {e}");
        let journal: Journal = serde_json::from_value(about.clone()).map_err(|e| format!("record: {e}"))?;
        let session: Session = serde_json::from_value(about["session"].clone()).map_err(|e| lacks("session", e))?;
        let quantities = all.as_object().into_iter().flatten().filter(|(name, _)| *name != "record");
        let quantities = quantities.map(|(name, q)| Quantity::of_json(name, q)).collect::<Result<_, _>>()?;
        let list = |key: &str| about[key].as_array().into_iter().flatten();
        let word = |v: &Value| v.as_str().unwrap_or_default().to_owned();
        let absent = list("absent").map(|a| (word(&a["name"]), word(&a["why"]))).collect();
        let findings = Findings { quantities, absent, says: list("says").map(word).collect(), curves: Vec::new() };
        Ok(Self { journal, session, findings, date: word(&about["computed"]) })
    }

    /// What is to be known of it beside the results: remarks, losses, interruptions.
    pub fn remarks(&self) -> Vec<String> {
        let lost = self.journal.steps.iter().filter(|done| done.lost_rows > 0);
        let lost = lost.map(|done| format!("step `{}`: {} rows were lost on the line, {} came", done.name, done.lost_rows, done.rows));
        self.findings.says.iter().cloned().chain(lost).chain(self.journal.interruptions.iter().cloned()).collect()
    }

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
            "curves": self.findings.curves.iter().map(Curve::json).collect::<Vec<_>>(),
        })
    }
}
