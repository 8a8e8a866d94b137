//! Why there is no Allan deviation to tell, in one line.

use crate::log::LogError;

/// What is wrong with the input.
#[derive(Debug, thiserror::Error)]
pub enum AllanError {
    /// The log cannot be read, or has no such column.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The time was asked for.
    #[error("{log}: column t_s is the time itself; name the column of a sensor")]
    Time {
        /// The log.
        log: String,
    },
    /// Too few rows.
    #[error("{log}: {rows} rows{within} are too few: an Allan deviation takes {least} at least, and its coefficients some hundred")]
    Short {
        /// The log.
        log: String,
        /// How many there are.
        rows: usize,
        /// Between which times they were counted, or nothing.
        within: String,
        /// How many it takes.
        least: usize,
    },
    /// Gaps everywhere.
    #[error("{log}: no run of rows without a gap is longer than {rows}: nothing can be averaged")]
    Gaps {
        /// The log.
        log: String,
        /// The longest run.
        rows: usize,
    },
    /// Nothing moves.
    #[error("{log}: column {column} is {says}: there is no noise in it")]
    Still {
        /// The log.
        log: String,
        /// The column.
        column: String,
        /// How it does not move.
        says: String,
    },
    /// A stretch of time that makes no sense.
    #[error("--from {from_s} --to {to_s}: must be finite times, the second one later")]
    Window {
        /// Its begin, s.
        from_s: f64,
        /// Its end, s.
        to_s: f64,
    },
}
