//! Errors of an Allan analysis.

use identification::log::LogError;
use identification::parameters::NamesParameters;

/// An error of the input.
#[derive(Debug, thiserror::Error)]
pub enum AllanError {
    /// The deadline has passed.
    #[error("interrupted by the user")]
    Interrupted,
    /// The log cannot be read, or has no such column.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The time column was requested.
    #[error("{log}: column t_s is the time; give the column of a sensor")]
    Time {
        /// The log.
        log: String,
    },
    /// Too few rows.
    #[error("{log}: {rows} rows{window} are too few: an Allan deviation needs at least {minimum} rows, its coefficients about one hundred")]
    Short {
        /// The log.
        log: String,
        /// Number of rows.
        rows: usize,
        /// The requested time range as text; empty without one.
        window: String,
        /// Required number of rows.
        minimum: usize,
    },
    /// No segment without a gap is long enough.
    #[error("{log}: the longest segment without a gap has {rows} rows: too short for an average")]
    Gaps {
        /// The log.
        log: String,
        /// Rows of the longest segment.
        rows: usize,
    },
    /// The column contains no noise.
    #[error("{log}: column {column} {why}: it contains no noise")]
    Still {
        /// The log.
        log: String,
        /// The column.
        column: String,
        /// The finding.
        why: Still,
    },
    /// An invalid time range.
    #[error("time range {from_s} s to {to_s} s: both must be finite, and the end later than the begin")]
    Window {
        /// Begin, s.
        from_s: f64,
        /// End, s.
        to_s: f64,
    },
}

impl NamesParameters for AllanError {
    fn parameters(&self) -> Vec<&str> {
        match self {
            AllanError::Window { .. } => vec!["from_s", "to_s"],
            _ => Vec::new(),
        }
    }
}

/// A column without noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Still {
    /// The same value in every row.
    Constant(f64),
    /// A straight line.
    StraightLine,
}

impl std::fmt::Display for Still {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Constant(value) => write!(f, "is {value} in every row"),
            Self::StraightLine => write!(f, "is a straight line"),
        }
    }
}
