//! The journal of a session: what was done so far, in the folder with the logs; written anew after each step, whole or not at all.

use super::{Session, What};
use crate::calibrate::{Mounted, Step};
use crate::log::{Log, LogError};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::io::Read;
use std::path::{Path, PathBuf};

/// The journal's file.
pub const FILE: &str = "journal.json";
/// The session's file, as it was run.
pub const SESSION: &str = "session.toml";

/// A step that was run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Done {
    /// Its name.
    pub name: String,
    /// Its raw log, in the folder.
    pub log: String,
    /// SHA-256 of that file.
    pub sha256: String,
    /// Its rows.
    pub rows: u64,
    /// Rows that were lost on the line.
    pub lost_rows: u64,
    /// When it began.
    pub began: String,
    /// How the part was mounted.
    pub mounted: Mounted,
    /// What a person was asked to do, and said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub asked: Option<[String; 2]>,
    /// A moment of inertia that was added, kg m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub added_inertia_kg_m2: Option<f64>,
}

/// What has happened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Journal {
    /// What is calibrated.
    pub what: What,
    /// When the session began.
    pub began: String,
    /// The stand's answer to `*IDN?`.
    pub stand: String,
    /// Version of these tools.
    pub tools: String,
    /// The step that is being recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub under_way: Option<String>,
    /// The steps that are done, in their order.
    pub steps: Vec<Done>,
    /// When and why it was broken off, and what is left of the step that was under way.
    pub interruptions: Vec<String>,
}

/// Why a folder is no session's.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// A file that cannot be read or written.
    #[error("{path}: {says}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        says: String,
    },
    /// A file that cannot be written.
    #[error("{path}: cannot write: {says}")]
    Write {
        /// Which.
        path: PathBuf,
        /// Why.
        says: String,
    },
    /// A log that is not what the journal says.
    #[error("{path}: this is not the log that was recorded: its SHA-256 is {found}, the journal has {kept}")]
    Hash {
        /// Which.
        path: PathBuf,
        /// Of the file.
        found: String,
        /// In the journal.
        kept: String,
    },
    /// A log that cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
}

fn of_file(path: &Path, says: impl std::fmt::Display) -> JournalError {
    JournalError::File { path: path.to_owned(), says: says.to_string() }
}

/// SHA-256 of a file, in hexadecimal.
///
/// # Errors
/// It cannot be read.
pub fn sha256(path: &Path) -> Result<String, JournalError> {
    let mut file = std::fs::File::open(path).map_err(|e| of_file(path, e))?;
    let (mut hash, mut part) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        let count = file.read(&mut part).map_err(|e| of_file(path, e))?;
        if count == 0 {
            return Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect());
        }
        hash.update(&part[..count]);
    }
}

/// Writes a file whole, or leaves what was there: to a neighbour, onto the disk, then renamed.
///
/// # Errors
/// It cannot be written.
pub fn write_whole(path: &Path, text: &str) -> Result<(), JournalError> {
    use std::io::Write;
    let beside = path.with_extension("part");
    let write = || {
        let mut file = std::fs::File::create(&beside)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        std::fs::rename(&beside, path)
    };
    write().map_err(|e: std::io::Error| {
        let _ = std::fs::remove_file(&beside);
        JournalError::Write { path: path.to_owned(), says: e.to_string() }
    })
}

impl Journal {
    /// An empty one.
    pub fn new(what: What, stand: String) -> Self {
        let began = now();
        Self { what, began, stand, tools: env!("CARGO_PKG_VERSION").into(), under_way: None, steps: Vec::new(), interruptions: Vec::new() }
    }

    /// Reads that of a folder, with the session that was run.
    ///
    /// # Errors
    /// It is not there, or is none.
    pub fn read(folder: &Path) -> Result<(Self, Session), JournalError> {
        let path = folder.join(FILE);
        let text = std::fs::read_to_string(&path).map_err(|e| of_file(&path, format!("no session was begun here: {e}")))?;
        let journal = serde_json::from_str(&text).map_err(|e| of_file(&path, e))?;
        let path = folder.join(SESSION);
        let text = std::fs::read_to_string(&path).map_err(|e| of_file(&path, e))?;
        let session = Session::parse(&text).map_err(|e| of_file(&path, e))?;
        Ok((journal, session))
    }

    /// Writes it.
    ///
    /// # Errors
    /// The disk.
    pub fn write(&self, folder: &Path) -> Result<(), JournalError> {
        let path = folder.join(FILE);
        let text = serde_json::to_string_pretty(self).map_err(|e| of_file(&path, e))?;
        write_whole(&path, &format!("{text}\n"))
    }

    /// The logs of the steps that are done, each checked against its hash.
    ///
    /// # Errors
    /// A log that is not there, cannot be read, or was changed.
    pub fn logs(&self, folder: &Path) -> Result<Vec<Step>, JournalError> {
        self.steps
            .iter()
            .map(|done| {
                let path = folder.join(&done.log);
                let found = sha256(&path)?;
                if found != done.sha256 {
                    return Err(JournalError::Hash { path, found, kept: done.sha256.clone() });
                }
                let log = Log::read(&path)?;
                Ok(Step { name: done.name.clone(), log, mounted: done.mounted, added_inertia_kg_m2: done.added_inertia_kg_m2 })
            })
            .collect()
    }
}

/// The date with its zone, for journals and notes.
pub fn now() -> String {
    jiff::Zoned::now().strftime("%Y-%m-%dT%H:%M:%S%:z").to_string()
}
