//! Reasons why an observer cannot be designed.

use identification::parameters::NamesParameters;
use stand_firmware::config::ConfigError;

/// An error of an observer request.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ObserverError {
    /// Neither a preset nor a file.
    #[error("`{0}` is neither a preset ({presets}) nor a file that ends with .toml", presets = super::PRESETS.join(", "))]
    Unknown(String),
    /// The file cannot be read as an element: file and message.
    #[error("{0}: {1}")]
    File(String, String),
    /// A parameter out of range.
    #[error(transparent)]
    Parameter(#[from] ConfigError),
    /// An invalid pole: the text and the reason.
    #[error("pole {0}: {1}")]
    Pole(String, &'static str),
    /// The number of poles differs from the number of states.
    #[error("{got} poles are given; the {what} observer needs {wanted}")]
    Count {
        /// Number given.
        got: usize,
        /// Number needed.
        wanted: usize,
        /// Kind of observer.
        what: &'static str,
    },
    /// The angle does not make all states observable.
    #[error("the model is not observable: the angle determines {rank} of its {states} states (condition number {condition:.1e}); {hint}")]
    Singular {
        /// Rank of the observability matrix.
        rank: usize,
        /// States.
        states: usize,
        /// Its condition number.
        condition: f64,
        /// Parameter to check.
        hint: &'static str,
    },
    /// An integral channel that cannot find a constant disturbance.
    #[error("an integral channel in row {0} leaves a pole at 0 and cannot remove the offset; possible rows: {1}")]
    Row(usize, String),
    /// The row of the integral channel does not exist.
    #[error("integral channel in row {row}: the rows are 1 to {states}")]
    RowRange {
        /// Row requested.
        row: usize,
        /// Number of states.
        states: usize,
    },
    /// An unstable integral gain.
    #[error("the integral gain {gain} in row {row} is unstable (pole at {pole:+.3e} 1/s); the stable range is 0 < gain < {most:.4e}")]
    Unstable {
        /// The gain.
        gain: f64,
        /// Its row, from 1.
        row: usize,
        /// Largest real part of the poles, 1/s.
        pole: f64,
        /// Upper end of the stable range.
        most: f64,
    },
    /// An unstable closed loop.
    #[error(
        "the closed loop with the regulator gains {angle} N m/rad and {rate} N m s/rad is unstable: pole at {re:+.4} ± {im:.4}i 1/s; there is no steady state"
    )]
    UnstableLoop {
        /// Real part of the pole, 1/s.
        re: f64,
        /// Magnitude of its imaginary part, 1/s.
        im: f64,
        /// r₁, N m/rad.
        angle: f64,
        /// r₂, N m s/rad.
        rate: f64,
    },
    /// The discrete form is rejected.
    #[error("the discrete observer with a step of {step_s} s is rejected: {why}")]
    Step {
        /// The step, s.
        step_s: f64,
        /// The reason.
        why: String,
    },
    /// The magnitude of equal poles is not positive.
    #[error("omega = {0}: the poles are placed at −omega, which requires omega > 0 rad/s")]
    Omega(f64),
    /// The integral gain is not finite.
    #[error("the integral gain {0} is not a finite number")]
    Gain(f64),
    /// The step of the discrete form is out of range.
    #[error("the step {0} s is out of range: 0 < step ≤ 10 s")]
    StepRange(f64),
    /// A request needs a discrete form.
    #[error("the observer has no discrete form; give a step")]
    NoDiscreteForm,
    /// A record without enough rows.
    #[error("{rows} rows are too few: the observer alone needs {settling} rows to settle")]
    TooFewRows {
        /// Rows of the record.
        rows: usize,
        /// Rows until the observer has settled.
        settling: usize,
    },
    /// A record without enough periods.
    #[error("the record holds {periods} periods of {vibration_Hz:.4} Hz after settling; a mean needs {needed}")]
    TooFewPeriods {
        /// Whole periods after settling.
        periods: f64,
        /// Frequency of the vibration, Hz.
        vibration_Hz: f64,
        /// Periods needed.
        needed: f64,
    },
    /// The roll angle does not vibrate.
    #[error("gamma_rad shows no vibration")]
    NoVibration,
    /// A vibration frequency outside the range of the sampling.
    #[error("vibration frequency {vibration_Hz} Hz: must be above 0 and below half the sampling rate, {nyquist_Hz} Hz")]
    VibrationRange {
        /// Frequency given or found, Hz.
        vibration_Hz: f64,
        /// Half the sampling rate, Hz.
        nyquist_Hz: f64,
    },
    /// An uncertainty of the roll channel or the element is no number from 0.
    #[error("{name} = {value}: must be a number from 0")]
    Uncertainty {
        /// The uncertainty.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// The vibration correction needs the four-state element.
    #[error("the vibration correction uses the four-state element: give a model with [four_state]")]
    NotFourState,
}

impl NamesParameters for ObserverError {
    fn parameters(&self) -> Vec<&str> {
        match self {
            ObserverError::Uncertainty { name, .. } => vec![name],
            ObserverError::VibrationRange { .. } => vec!["vibration_Hz"],
            _ => Vec::new(),
        }
    }
}
