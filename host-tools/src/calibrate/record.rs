//! The record of a calibration: journal, session and findings of a session's folder, computed from its raw logs.
//!
//! [`compute`] makes it from a folder; computed again from the same folder, the results are the same. Its file is a
//! [`StoredRecord`](super::stored_record::StoredRecord).

use super::{CalibrateError, DutKind, Findings, accel, drive, gyro};
use crate::acquire::calibration_session::Session;
use crate::acquire::calibration_session::journal::{Journal, JournalError, StepRecord, read_logs};
use std::path::{Path, PathBuf};

/// Why there is no record.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// Journal or logs.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The logs give no calibration.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// The file cannot be read.
    #[error("{path}: cannot be read: {message}")]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// Message of the operating system.
        message: String,
    },
    /// The file is not a record of a calibration.
    #[error("{path}: not a record of a calibration: {message}")]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
}

/// A computed calibration.
pub struct CalibrationRecord {
    /// What was run.
    pub journal: Journal,
    /// What was to be run.
    pub session: Session,
    /// The results.
    pub findings: Findings,
    /// When the results were computed.
    pub computed: String,
}

impl CalibrationRecord {
    /// All steps of the session are done.
    pub fn is_complete(&self) -> bool {
        self.journal.steps.len() == self.session.steps.len()
    }
}

/// Computes the record of a session's folder; each log is checked against the journal first.
///
/// # Errors
/// No session in the folder; a changed log; logs that give no calibration.
pub fn compute(folder: &Path) -> Result<CalibrationRecord, RecordError> {
    let (journal, session) = Journal::read(folder)?;
    let findings = findings(&journal.steps, &session, folder)?;
    Ok(CalibrationRecord { journal, session, findings, computed: crate::log::timestamp() })
}

/// Computes the findings of the recorded steps.
///
/// # Errors
/// As [`compute`].
pub fn findings(steps: &[StepRecord], session: &Session, folder: &Path) -> Result<Findings, RecordError> {
    let steps = read_logs(steps, folder)?;
    Ok(match session.dut_kind {
        DutKind::Gyro => gyro::calibrate(&steps, &gyro::GyroSettings::of(session)),
        DutKind::Accel => accel::calibrate(&steps, session),
        DutKind::Drive => drive::calibrate(&steps, session),
    }?)
}
