//! A session ready to be run: from the beginning, or continued from its journal.

use super::journal::{Journal, JournalError};
use super::{DutKind, PlanError, Session, default_session};
use std::path::{Path, PathBuf};

/// A session, the text that its folder keeps, and what of it is done.
#[derive(Debug, Clone)]
pub struct PreparedSession {
    /// The session.
    pub session: Session,
    /// Content of the session file; empty where the folder has the file already.
    pub text: String,
    /// Journal of an interrupted session.
    pub begun: Option<Journal>,
    /// Seed of the simulated stand, for the journal; `None`: a real one.
    pub simulated_seed: Option<u64>,
}

/// Entries that replace those of a session file.
#[derive(Debug, Clone, Copy, Default)]
pub struct SessionChanges<'a> {
    /// Serial number of the device under test.
    pub serial: Option<&'a str>,
    /// The operator.
    pub operator: Option<&'a str>,
}

impl PreparedSession {
    /// Prepares the session of a session file; without a file (`None`) the default session for `dut_kind`.
    ///
    /// # Errors
    /// The session is invalid, or is for another kind of device.
    pub fn new(text: Option<&str>, dut_kind: DutKind, changes: SessionChanges) -> Result<Self, PlanError> {
        let text = text.unwrap_or(default_session(dut_kind));
        let mut session = Session::parse(text)?;
        if session.dut_kind != dut_kind {
            let message = format!("what = \"{}\", expected \"{}\"", session.dut_kind.name(), dut_kind.name());
            return Err(PlanError::Session(message));
        }
        let mut document: toml_edit::DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| PlanError::Toml(e.to_string()))?;
        let entries = [("serial", changes.serial, &mut session.serial), ("operator", changes.operator, &mut session.operator)];
        for (key, value, entry) in entries {
            if let Some(value) = value {
                document[key] = toml_edit::value(value);
                value.clone_into(entry);
            }
        }
        Ok(Self { session, text: document.to_string(), begun: None, simulated_seed: None })
    }

    /// Reads the interrupted session of a folder.
    ///
    /// # Errors
    /// The folder has no session, or a file is invalid.
    pub fn resume(folder: &Path) -> Result<Self, JournalError> {
        let (journal, session) = Journal::read(folder)?;
        Ok(Self { session, text: String::new(), begun: Some(journal), simulated_seed: None })
    }
}

/// Default folder of a session: the kind of the device and, where it is known, its serial number.
pub fn default_folder(dut_kind: DutKind, serial: Option<&str>) -> PathBuf {
    let serial = serial.filter(|serial| !serial.is_empty()).map_or(String::new(), |serial| format!("-{serial}"));
    PathBuf::from(format!("calibration-{}{serial}", dut_kind.name()))
}
