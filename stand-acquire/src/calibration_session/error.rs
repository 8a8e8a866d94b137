//! Errors of a session.

use super::PlanError;
use super::journal::JournalError;
use crate::connection::ConnectionError;

/// Why a session ended early.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The serial line or the stand.
    #[error(transparent)]
    Stand(#[from] ConnectionError),
    /// The journal or a log.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The log cannot be written.
    #[error("{log}: cannot write: {message}")]
    Write {
        /// The log.
        log: String,
        /// Message of the operating system.
        message: String,
    },
    /// A fault latched.
    #[error("step `{step}`: the stand switched off: {fault}")]
    Fault {
        /// The step.
        step: String,
        /// The stand's description of the fault.
        fault: String,
    },
    /// No rows arrive.
    #[error("step `{step}`: the stand sends no rows")]
    Silent {
        /// The step.
        step: String,
    },
    /// No rows arrive because the stand has restarted.
    #[error("step `{step}`: the stand has restarted during the step: was its supply interrupted?")]
    Restarted {
        /// The step.
        step: String,
    },
    /// A needed column has no values.
    #[error("step `{step}`: the device under test sends no data: {columns} has no values")]
    Sensor {
        /// The step.
        step: String,
        /// The columns.
        columns: String,
    },
    /// The operator did not carry out the instruction.
    #[error("step `{step}`: not done: {instruction}")]
    NotDone {
        /// The step.
        step: String,
        /// The instruction.
        instruction: String,
    },
    /// The platform does not come to rest.
    #[error("step `{step}`: the platform does not come to rest")]
    Turning {
        /// The step.
        step: String,
    },
    /// The stand cannot run the session.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The simulated stand is invalid or does not end.
    #[error("{0}")]
    Simulated(String),
    /// Interrupted by the user.
    #[error("interrupted by the user")]
    Interrupted,
}
