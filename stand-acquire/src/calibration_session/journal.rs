//! Journal of a session: what has been done. The file is in the folder of the logs and is replaced atomically after each step.

use super::{ClockReading, DutKind, Mounting, Session, Step};
use identification::files;
use identification::log::{Log, LogError, timestamp};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Name of the journal's file.
pub const JOURNAL_FILE: &str = "journal.json";
/// Name of the session's file, as it was run.
pub const SESSION_FILE: &str = "session.toml";

/// A recorded step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepRecord {
    /// Its name.
    pub name: String,
    /// File name of its raw log.
    pub log: String,
    /// SHA-256 of that file.
    pub sha256: String,
    /// Number of rows.
    pub rows: u64,
    /// Rows lost on the serial line.
    pub lost_rows: u64,
    /// When it began.
    pub began: String,
    /// Mounting of the device under test.
    #[serde(rename = "mounted")]
    pub mounting: Mounting,
    /// Instruction to the operator and the operator's answer.
    #[serde(default, rename = "asked", skip_serializing_if = "Option::is_none")]
    pub instruction: Option<[String; 2]>,
    /// Moment of inertia added to the platform, kg m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub added_inertia_kg_m2: Option<f64>,
    /// The crystal compared with the clock reference of the session.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock: Option<ClockReading>,
}

/// The journal of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Journal {
    /// What is calibrated.
    #[serde(rename = "what")]
    pub dut_kind: DutKind,
    /// When the session began.
    pub began: String,
    /// Answer of the stand to `*IDN?`.
    pub stand: String,
    /// Seed of the simulated stand; `None`: a real one, or a journal of an older version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulated_seed: Option<u64>,
    /// Version of these tools.
    pub tools: String,
    /// The step being recorded.
    #[serde(default, rename = "under_way", skip_serializing_if = "Option::is_none")]
    pub current_step: Option<String>,
    /// The recorded steps, in their order.
    pub steps: Vec<StepRecord>,
    /// When and why the session was interrupted, and what remains of the interrupted step.
    pub interruptions: Vec<String>,
}

/// Why the folder of a session cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// A file that cannot be read.
    #[error("{path}: {message}")]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        message: String,
    },
    /// A file that cannot be written.
    #[error("{path}: cannot write: {message}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        message: String,
    },
    /// A log that has changed since it was recorded.
    #[error("{path}: the log has changed since it was recorded: its SHA-256 is {found}, in the journal {recorded}")]
    Hash {
        /// The file.
        path: PathBuf,
        /// Of the file.
        found: String,
        /// In the journal.
        recorded: String,
    },
    /// A log that cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
}

fn unreadable(path: &Path, message: impl std::fmt::Display) -> JournalError {
    JournalError::File { path: path.to_owned(), message: message.to_string() }
}

/// SHA-256 of a file, in hexadecimal.
///
/// # Errors
/// The file cannot be read.
pub fn sha256(path: &Path) -> Result<String, JournalError> {
    let mut file = std::fs::File::open(path).map_err(|e| unreadable(path, e))?;
    let (mut hash, mut buffer) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        let count = file.read(&mut buffer).map_err(|e| unreadable(path, e))?;
        if count == 0 {
            return Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect());
        }
        hash.update(&buffer[..count]);
    }
}

/// Replaces a file atomically: writes a temporary file, syncs it to the disk, renames it.
///
/// # Errors
/// The file cannot be written.
pub fn write_atomically(path: &Path, text: &str) -> Result<(), JournalError> {
    files::replace_text(path, text).map_err(|e| JournalError::Write { path: path.to_owned(), message: e.to_string() })
}

impl Journal {
    /// An empty journal.
    pub fn new(dut_kind: DutKind, stand: String) -> Self {
        let began = timestamp();
        Self {
            dut_kind,
            began,
            stand,
            simulated_seed: None,
            tools: env!("CARGO_PKG_VERSION").into(),
            current_step: None,
            steps: Vec::new(),
            interruptions: Vec::new(),
        }
    }

    /// Reads the journal and the session of a folder.
    ///
    /// # Errors
    /// A file is missing or invalid.
    pub fn read(folder: &Path) -> Result<(Self, Session), JournalError> {
        let path = folder.join(JOURNAL_FILE);
        let text = std::fs::read_to_string(&path).map_err(|e| unreadable(&path, format!("the folder has no session: {e}")))?;
        let journal = serde_json::from_str(&text).map_err(|e| unreadable(&path, e))?;
        let path = folder.join(SESSION_FILE);
        let text = std::fs::read_to_string(&path).map_err(|e| unreadable(&path, e))?;
        let session = Session::parse(&text).map_err(|e| unreadable(&path, e))?;
        Ok((journal, session))
    }

    /// Writes the journal into a folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), JournalError> {
        let path = folder.join(JOURNAL_FILE);
        let text = serde_json::to_string_pretty(self).map_err(|e| unreadable(&path, e))?;
        write_atomically(&path, &format!("{text}\n"))
    }
}

/// Reads the logs of the steps in a folder; each is checked against its SHA-256.
///
/// # Errors
/// A log is missing, unreadable or changed.
pub fn read_logs(steps: &[StepRecord], folder: &Path) -> Result<Vec<Step>, JournalError> {
    steps.iter().map(|step| read_log(step, folder)).collect()
}

/// Reads the log of one step, checked against its SHA-256.
///
/// # Errors
/// As [`read_logs`].
pub fn read_log(step: &StepRecord, folder: &Path) -> Result<Step, JournalError> {
    let path = folder.join(&step.log);
    let found = sha256(&path)?;
    if found != step.sha256 {
        return Err(JournalError::Hash { path, found, recorded: step.sha256.clone() });
    }
    let log = Log::read(&path)?;
    Ok(Step { name: step.name.clone(), log, mounting: step.mounting, added_inertia_kg_m2: step.added_inertia_kg_m2 })
}
