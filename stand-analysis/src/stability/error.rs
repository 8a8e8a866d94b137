//! Errors of the evaluation of the rate stability.

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
    #[error("{log}: no stretch of constant rate that contains two windows of 1°; record e.g. `--profile constant --amplitude 1`")]
    NoPlateau {
        /// The log.
        log: String,
    },
    /// The settling time is invalid.
    #[error("--settle {0}: must be a number of seconds from 0")]
    Settle(f64),
    /// The limit is invalid.
    #[error("--limit {0}: must be above 0")]
    Limit(f64),
}
