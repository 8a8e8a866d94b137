//! Journal of a work: one line of JSON per entry, each with the SHA-256 of the line before it.
//!
//! A changed, removed or inserted line breaks the chain. Neither the last line nor a chain that was computed anew as a whole is protected
//! by it: the code of the last line, which `stand lab check` prints, protects both where the teacher notes it.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::LabError;
use super::seal::hexadecimal;
use identification::files;
use identification::log::timestamp;

/// Name of the file in the work folder.
pub const JOURNAL_FILE: &str = "lab-journal.jsonl";
/// Code before the first entry.
const FIRST_CODE: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// What was done.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// The work folder was written.
    Started {
        /// Identifier of the work.
        lab: String,
        /// The student.
        student: String,
        /// Number of the attempt.
        attempt: u32,
    },
    /// The answers were examined.
    Checked {
        /// All answers before the measurement are given.
        before_complete: bool,
        /// All answers are given.
        complete: bool,
    },
    /// `stand explain` was run on a log of the work.
    Explained {
        /// The log.
        log: String,
    },
    /// The true values were shown.
    Graded,
}

/// An entry.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Entry {
    /// From 1.
    pub number: usize,
    /// Date and time.
    pub time: String,
    /// What was done.
    #[serde(flatten)]
    pub event: Event,
    /// SHA-256 of the files that the entry concerns, by their paths in the work folder.
    pub files: BTreeMap<String, String>,
    /// SHA-256 of the line before.
    pub previous: String,
}

/// A journal whose chain is whole.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Journal {
    /// The entries, in order.
    pub entries: Vec<Entry>,
    /// SHA-256 of each line.
    pub codes: Vec<String>,
}

/// Where a chain is broken.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum ChainError {
    /// No entries.
    #[error("the journal is empty")]
    Empty,
    /// A line is no entry.
    #[error("line {line} of the journal is no entry: {message}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// A line does not follow the one before it.
    #[error("line {line} of the journal does not follow the line before it: a line was changed, removed or inserted")]
    Broken {
        /// Number of the line, from 1.
        line: usize,
    },
}

/// SHA-256 of bytes, in hexadecimal.
pub fn sha256_of(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// SHA-256 of a file in a work folder.
///
/// # Errors
/// The file cannot be read.
pub fn file_sha256(path: &Path) -> Result<String, LabError> {
    std::fs::read(path).map(|bytes| sha256_of(&bytes)).map_err(|source| LabError::file(path, "read", source))
}

impl Journal {
    /// Parses a journal and checks its chain.
    ///
    /// # Errors
    /// The first line that is no entry or does not follow the line before it.
    pub fn parse(text: &str) -> Result<Self, ChainError> {
        let (mut entries, mut codes): (Vec<Entry>, Vec<String>) = (Vec::new(), Vec::new());
        for (k, line) in text.lines().enumerate() {
            let entry: Entry = serde_json::from_str(line).map_err(|e| ChainError::Line { line: k + 1, message: e.to_string() })?;
            if entry.number != k + 1 || entry.previous != codes.last().map_or(FIRST_CODE, String::as_str) {
                return Err(ChainError::Broken { line: k + 1 });
            }
            entries.push(entry);
            codes.push(sha256_of(line.as_bytes()));
        }
        if entries.is_empty() { Err(ChainError::Empty) } else { Ok(Journal { entries, codes }) }
    }

    /// Reads the journal of a work folder. `Ok(Err(…))`: the file is there, and its chain is broken.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn read(folder: &Path) -> Result<Result<Self, ChainError>, LabError> {
        let path = folder.join(JOURNAL_FILE);
        let text = std::fs::read_to_string(&path).map_err(|source| LabError::file(&path, "read", source))?;
        Ok(Journal::parse(&text))
    }

    /// Code of the last entry.
    pub fn code(&self) -> &str {
        self.codes.last().map_or(FIRST_CODE, String::as_str)
    }
}

/// Adds an entry to the journal of a work folder; returns its code.
///
/// # Errors
/// The journal cannot be read or written, or its chain is broken: nothing is added to a broken chain.
pub fn append(folder: &Path, event: Event, hashes: BTreeMap<String, String>) -> Result<String, LabError> {
    let path = folder.join(JOURNAL_FILE);
    let failed = |action| move |source| LabError::file(&folder.join(JOURNAL_FILE), action, source);
    let _locked = if path.exists() { Some(files::lock(&path).map_err(failed("lock"))?) } else { None };
    let mut text = if path.exists() { std::fs::read_to_string(&path).map_err(failed("read"))? } else { String::new() };
    let (number, previous) = match Journal::parse(&text) {
        Ok(journal) => (journal.entries.len() + 1, journal.code().to_owned()),
        Err(ChainError::Empty) => (1, FIRST_CODE.to_owned()),
        Err(broken) => return Err(LabError::invalid(&path, broken.to_string())),
    };
    let entry = Entry { number, time: timestamp(), event, files: hashes, previous };
    let line = serde_json::to_string(&entry).map_err(|e| LabError::invalid(&path, e.to_string()))?;
    let code = sha256_of(line.as_bytes());
    text += &line;
    text.push('\n');
    files::replace(&path, |file| file.write_all(text.as_bytes())).map_err(failed("write"))?;
    Ok(code)
}

/// The work folder of a log in its folder `logs`, and the name of the log; `None` where that folder has no journal.
pub fn work_of(log: &Path) -> Option<(PathBuf, String)> {
    // Absolute, since a log that is named from within its folder has no parents.
    let log = std::fs::canonicalize(log).unwrap_or_else(|_| log.to_owned());
    let folder = log.parent().and_then(Path::parent).filter(|folder| folder.join(JOURNAL_FILE).is_file())?;
    Some((folder.to_owned(), log.file_name()?.to_string_lossy().into_owned()))
}

/// Records in the journal of its work that `stand explain` was run on `log`; nothing where the log belongs to no work.
///
/// # Errors
/// As [`append`].
pub fn record_explained(log: &Path) -> Result<(), LabError> {
    let Some((folder, log)) = work_of(log) else { return Ok(()) };
    append(&folder, Event::Explained { log }, BTreeMap::new()).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn three_entries() -> (tempfile::TempDir, String) {
        let folder = tempfile::tempdir().expect("a folder");
        let started = Event::Started { lab: "motor".to_owned(), student: "anna".to_owned(), attempt: 1 };
        let checked = |complete| Event::Checked { before_complete: true, complete };
        for event in [started, checked(false), checked(true)] {
            append(folder.path(), event, BTreeMap::from([("answers.toml".to_owned(), sha256_of(b"a"))])).expect("an entry");
        }
        let text = std::fs::read_to_string(folder.path().join(JOURNAL_FILE)).expect("a journal");
        (folder, text)
    }

    #[test]
    fn untouched_chain_is_whole() {
        let (_folder, text) = three_entries();
        let journal = Journal::parse(&text).expect("a whole chain");
        assert_eq!(journal.entries.len(), 3);
        assert_eq!(journal.code(), sha256_of(text.lines().last().expect("a line").as_bytes()));
    }

    #[test]
    fn changed_removed_and_inserted_lines_break_the_chain() {
        let (folder, text) = three_entries();
        let lines: Vec<&str> = text.lines().collect();
        let changed = text.replacen("\"complete\":false", "\"complete\":true", 1);
        assert_eq!(Journal::parse(&changed), Err(ChainError::Broken { line: 3 }));
        assert_eq!(Journal::parse(&[lines[0], lines[2]].join("\n")), Err(ChainError::Broken { line: 2 }));
        assert_eq!(Journal::parse(&[lines[0], lines[1], lines[1], lines[2]].join("\n")), Err(ChainError::Broken { line: 3 }));
        assert_eq!(Journal::parse(&[lines[1], lines[2]].join("\n")), Err(ChainError::Broken { line: 1 }));
        assert_eq!(Journal::parse(""), Err(ChainError::Empty));
        std::fs::write(folder.path().join(JOURNAL_FILE), changed).expect("written");
        assert!(append(folder.path(), Event::Graded, BTreeMap::new()).is_err(), "nothing is added to a broken chain");
    }

    #[test]
    fn explain_is_recorded_for_logs_of_a_work_only() {
        let (folder, _) = three_entries();
        std::fs::create_dir(folder.path().join("logs")).expect("a folder");
        std::fs::write(folder.path().join("logs/A.parquet"), "rows").expect("a log");
        record_explained(&folder.path().join("logs/../logs/A.parquet")).expect("recorded");
        record_explained(&folder.path().join("other/deeper/A.parquet")).expect("not of a work");
        let journal = Journal::read(folder.path()).expect("read").expect("whole");
        assert_eq!(journal.entries.len(), 4);
        assert_eq!(journal.entries[3].event, Event::Explained { log: "A.parquet".to_owned() });
    }
}
