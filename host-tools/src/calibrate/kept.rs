//! Records that are kept: found below a folder, read from their JSON alone, checked against the raw logs beside them.
//!
//! In: `record.json` of sessions' folders. Out: [`Kept`] by date; whether the logs are still those that were recorded, and whether computing again by the
//! record's own session gives the same values ([`Kept::checked`]): what another person can do who has nothing else.

use super::record::{self, FILE, Record, RecordError};
use super::session::journal::sha256;
use crate::report::finite;
use crate::statistics::Extremes;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Values that agree to this part of themselves are the same.
pub const SAME: f64 = 1e-12;

/// A record and its file.
pub struct Kept {
    /// Its file.
    pub path: PathBuf,
    /// What is in it.
    pub record: Record,
}

/// What came of looking at the logs again.
#[derive(Debug, Clone, PartialEq)]
pub struct Checked {
    /// Each raw log, and what is wrong with it.
    pub logs: Vec<(String, Option<String>)>,
    /// Greatest difference of a value or a standard uncertainty that was computed again, as a part of itself; or why it was not.
    pub again: Result<f64, String>,
}

impl Checked {
    /// The logs are those that were recorded, and give the same values.
    pub fn is_well(&self) -> bool {
        self.logs.iter().all(|(_, wrong)| wrong.is_none()) && self.again.as_ref().is_ok_and(|apart| *apart <= SAME)
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        json!({
            "logs": self.logs.iter().map(|(log, wrong)| json!({"log": log, "as_recorded": wrong.is_none(), "says": wrong})).collect::<Vec<_>>(),
            "same_results": self.again.as_ref().is_ok_and(|apart| *apart <= SAME),
            "greatest_difference": self.again.as_ref().map_or(Value::Null, |apart| finite(*apart)),
            "says": self.again.as_ref().err(),
        })
    }
}

impl Kept {
    /// Reads a record; of a session's folder, the one in it.
    ///
    /// # Errors
    /// It is not there, or is none; the file is named.
    pub fn read(path: &Path) -> Result<Self, RecordError> {
        let path = if path.is_dir() { path.join(FILE) } else { path.to_owned() };
        let wrong = |says: String| RecordError::File { path: path.clone(), says };
        let text = std::fs::read_to_string(&path).map_err(|e| wrong(format!("cannot be read: {e}")))?;
        let all: Value = serde_json::from_str(&text).map_err(|e| wrong(format!("this is no record: {e}")))?;
        let record = Record::of_json(&all).map_err(|says| wrong(format!("this is no record: {says}")))?;
        Ok(Self { path, record })
    }

    /// The moment when its session began.
    pub fn at(&self) -> Option<jiff::Timestamp> {
        self.record.journal.began.parse().ok()
    }

    /// Holds the record against the logs beside it.
    pub fn checked(&self) -> Checked {
        let folder = self.path.parent().unwrap_or(Path::new("."));
        let Record { journal, session, findings, .. } = &self.record;
        let log = |done: &super::session::journal::Done| {
            let wrong = match sha256(&folder.join(&done.log)) {
                Ok(found) if found == done.sha256 => None,
                Ok(found) => Some(format!("was changed: its SHA-256 is {found}")),
                Err(_) => Some("is not there".to_owned()),
            };
            (done.log.clone(), wrong)
        };
        let logs: Vec<_> = journal.steps.iter().map(log).collect();
        let again = match logs.iter().find(|(_, wrong)| wrong.is_some()) {
            Some((log, wrong)) => Err(format!("{log} {}", wrong.as_deref().unwrap_or_default())),
            None => record::findings(journal, session, folder).map_err(|e| e.to_string()).and_then(|again| apart(findings, &again)),
        };
        Checked { logs, again }
    }
}

/// Greatest difference of what both have.
fn apart(one: &super::Findings, other: &super::Findings) -> Result<f64, String> {
    let missing =
        |of: &super::Findings, from: &super::Findings| from.quantities.iter().find(|q| of.get(&q.name).is_none()).map(|q| q.name.clone());
    if let Some(name) = missing(one, other).or_else(|| missing(other, one)) {
        return Err(format!("{name} is in one of both only: another version of these tools?"));
    }
    let relative = |a: f64, b: f64| if a == b { 0.0 } else { (a - b).abs() / a.abs().max(b.abs()) };
    let pairs = one.quantities.iter().filter_map(|q| Some((q, other.get(&q.name)?)));
    Ok(pairs.flat_map(|(a, b)| [relative(a.value, b.value), relative(a.sigma(), b.sigma())]).max_or_zero())
}

/// All records below a folder by date, and what is none though its name says so.
///
/// # Errors
/// The folder itself cannot be read.
pub fn below(folder: &Path) -> Result<(Vec<Kept>, Vec<RecordError>), RecordError> {
    let (mut kept, mut passed) = (Vec::new(), Vec::new());
    let mut ahead = vec![folder.to_owned()];
    while let Some(here) = ahead.pop() {
        let of = |e: std::io::Error| RecordError::File { path: here.clone(), says: format!("cannot be read: {e}") };
        let entries = match std::fs::read_dir(&here) {
            Ok(entries) => entries,
            Err(e) if here == folder => return Err(of(e)),
            Err(e) => {
                passed.push(of(e));
                continue;
            }
        };
        for entry in entries.flatten() {
            // Not through links: they may lead round in a circle.
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                ahead.push(entry.path());
            } else if entry.file_name() == FILE {
                match Kept::read(&entry.path()) {
                    Ok(record) => kept.push(record),
                    Err(error) => passed.push(error),
                }
            }
        }
    }
    kept.sort_by(|a, b| (a.at(), &a.path).cmp(&(b.at(), &b.path)));
    passed.sort_by_key(ToString::to_string);
    Ok((kept, passed))
}
