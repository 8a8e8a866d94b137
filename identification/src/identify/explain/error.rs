//! Why there is no explanation.

use super::fitted::given::GivenError;
use super::fitted::join_logs::JoinError;
use super::search::unfinished::StateError;
use crate::identify::fit::FitError;
use crate::log::Log;
use crate::log::plausible::Defect;
use crate::recording::prepare::PrepareError;

/// Why there is no explanation.
#[derive(Debug, thiserror::Error)]
pub enum ExplainError {
    /// A log lacks what the model needs.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The model cannot be simulated along the logs.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// A log is not a plausible record of a drive (verdict `bad-log`).
    #[error("{}: {}", .log.path().display(), .findings.iter().map(|d| d.code().name()).collect::<Vec<_>>().join(", "))]
    BadLog {
        /// The log.
        log: Box<Log>,
        /// What is wrong with it.
        findings: Vec<Defect>,
    },
    /// The logs cannot be fitted together.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// A search cannot be continued from its state.
    #[error(transparent)]
    State(#[from] StateError),
}

impl From<GivenError> for ExplainError {
    fn from(error: GivenError) -> Self {
        match error {
            GivenError::Prepare(error) => error.into(),
            GivenError::Fit(error) => error.into(),
        }
    }
}
