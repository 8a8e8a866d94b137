//! The record of a calibration: journal, session and findings of a session's folder, computed from its raw logs.
//!
//! [`compute`] makes it from a folder; computed again from the same folder, the results are the same. Its file is a
//! [`StoredRecord`](super::stored_record::StoredRecord).

use identification::deadline::Deadline;
use identification::log::Log;
use serde::Deserialize;
use stand_acquire::calibration_session::journal::{Journal, JournalError, StepRecord, read_log, read_logs, sha256};
use stand_acquire::calibration_session::{Limits, Session};
use stand_analysis::calibrate::session::{of_session, of_steps};
use stand_analysis::calibrate::step_table::{StepTableError, read_steps};
use stand_analysis::calibrate::{Assumptions, CalibrateError, DutKind, Findings};
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
    /// The table of steps.
    #[error(transparent)]
    StepTable(#[from] StepTableError),
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
    compute_until(folder, Deadline::NEVER)
}

/// As [`compute`], ended by a deadline: between the logs, and during the fits of a drive. The computation itself takes less than a second
/// for a default session.
///
/// # Errors
/// As [`compute`]; [`CalibrateError::Interrupted`] after the deadline.
pub fn compute_until(folder: &Path, deadline: Deadline) -> Result<CalibrationRecord, RecordError> {
    let (journal, session) = Journal::read(folder)?;
    let mut logs = Vec::with_capacity(journal.steps.len());
    for step in &journal.steps {
        CalibrateError::check(deadline)?;
        logs.push(read_log(step, folder)?);
    }
    CalibrateError::check(deadline)?;
    let findings = of_session(&logs, &journal.steps, &session, deadline)?;
    Ok(CalibrationRecord { journal, session, findings, computed: identification::log::timestamp() })
}

/// Computes the findings of the recorded steps.
///
/// # Errors
/// As [`compute`].
pub fn findings(steps: &[StepRecord], session: &Session, folder: &Path) -> Result<Findings, RecordError> {
    Ok(of_session(&read_logs(steps, folder)?, steps, session, Deadline::NEVER)?)
}

/// What a user knows of a session that another program recorded.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ForeignSession {
    /// Type of the device under test.
    pub sensor: String,
    /// Its serial number.
    pub serial: String,
    /// The operator.
    pub operator: String,
    /// Log column of the device under test.
    pub column: Option<String>,
    /// Full scale, rad/s.
    pub full_scale_rad_s: Option<f64>,
    /// Band about the final output at rest that ends the warm-up, rad/s.
    pub warm_up_band_rad_s: Option<f64>,
    /// Settling time at the beginning of each step of the table, s.
    pub settle_s: f64,
    /// Knowledge that no log contains; `crystal_ppm` is the relative half-width of the stated rates.
    #[serde(rename = "known")]
    pub assumptions: Assumptions,
}

/// Computes the record of logs without a journal by a table of steps.
///
/// # Errors
/// The table or a log cannot be read; the logs give no calibration.
pub fn compute_foreign(table: &Path, folder: &Path, dut_kind: DutKind, known: ForeignSession) -> Result<CalibrationRecord, RecordError> {
    let steps = read_steps(table, folder, |path| Log::read(path))?;
    let ForeignSession { sensor, serial, operator, column, full_scale_rad_s, warm_up_band_rad_s, settle_s, assumptions } = known;
    let session = Session {
        dut_kind,
        sensor,
        serial,
        operator,
        column,
        full_scale_rad_s,
        warm_up_band_rad_s,
        settle_s,
        assumptions,
        clock_reference: None,
        limits: Limits::default(),
        steps: Vec::new(),
    };
    let findings = of_steps(&steps, &session, Deadline::NEVER)?;
    let mut journal = Journal::new(dut_kind, format!("rates of {}", table.display()));
    for step in &steps {
        let sha256 = sha256(step.log.path())?;
        journal.steps.push(StepRecord {
            name: step.name.clone(),
            log: step.name.clone(),
            sha256,
            rows: step.log.len() as u64,
            lost_rows: 0,
            began: step.log.note("date").unwrap_or_default().to_owned(),
            mounting: step.mounting,
            instruction: None,
            added_inertia_kg_m2: None,
            clock: None,
        });
    }
    Ok(CalibrationRecord { journal, session, findings, computed: identification::log::timestamp() })
}
