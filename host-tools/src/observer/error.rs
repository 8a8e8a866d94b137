//! Why there is no observer, in one line.

use stand_firmware::config::ConfigError;

/// What is wrong with what was asked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ObserverError {
    /// No preset and no file.
    #[error("`{0}` is neither a preset ({presets}) nor a file that ends with .toml", presets = super::PRESETS.join(", "))]
    Unknown(String),
    /// The file is no model.
    #[error("{0}: {1}")]
    File(String, String),
    /// A number that makes no sense.
    #[error(transparent)]
    Parameter(#[from] ConfigError),
    /// A pole that no observer can have.
    #[error("pole {0}: {1}")]
    Pole(String, &'static str),
    /// As many poles as states.
    #[error("there are {got} poles, and {what} observer takes {wanted}")]
    Count {
        /// What was given.
        got: usize,
        /// What is needed.
        wanted: usize,
        /// Of what.
        what: &'static str,
    },
    /// The angle does not tell all states.
    #[error("the model is singular: the angle tells {rank} of its {states} states apart (condition {condition:.1e}); {hint}")]
    Singular {
        /// Rank of the observability matrix.
        rank: usize,
        /// States.
        states: usize,
        /// Its condition number.
        condition: f64,
        /// Which parameter to look at.
        hint: &'static str,
    },
    /// An integral channel that cannot find a constant disturbance.
    #[error("an integral channel in row {0} leaves a pole at 0: it cannot remove the offset; rows that can: {1}")]
    Row(usize, String),
    /// An integral gain that is not stable.
    #[error("the integral gain {gain} in row {row} is not stable (pole at {pole:+.3e} 1/s); stable is 0 < gain < {most:.4e}")]
    Unstable {
        /// The gain.
        gain: f64,
        /// Its row, from 1.
        row: usize,
        /// Greatest real part.
        pole: f64,
        /// Up to where it is stable.
        most: f64,
    },
    /// The discrete form is not stable.
    #[error("at a step of {step_s} s this observer is not stable: {why}")]
    Step {
        /// The step.
        step_s: f64,
        /// By the firmware's words.
        why: String,
    },
    /// Something else about the words.
    #[error("{0}")]
    Words(String),
}
