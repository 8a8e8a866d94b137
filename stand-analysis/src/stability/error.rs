//! Errors of the evaluation of the rate stability.

use identification::parameters::NamesParameters;

/// Why a log gives no rate stability.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StabilityError {
    /// The column of the angle is missing.
    #[error("{log}: no column `theta_rad`; the rate stability follows from the angle of the platform")]
    Column {
        /// The log.
        log: String,
    },
    /// No plateau is long enough.
    #[error("{log}: no stretch of constant rate that contains two windows of 1°; record e.g. a constant rate of 1 rad/s")]
    NoPlateau {
        /// The log.
        log: String,
    },
    /// The settling time is invalid.
    #[error("settle_s = {0}: must be a number from 0")]
    Settle(f64),
    /// The limit is invalid.
    #[error("limit = {0}: must be above 0")]
    Limit(f64),
}

impl NamesParameters for StabilityError {
    fn parameters(&self) -> Vec<&str> {
        match self {
            StabilityError::Settle(_) => vec!["settle_s"],
            StabilityError::Limit(_) => vec!["limit"],
            _ => Vec::new(),
        }
    }
}
