//! Calibration: static and dynamic characteristics of the drive and of sensors on the platform, each with its uncertainty budget.
//!
//! Input: the logs of a session's steps ([`Step`]), the mounting in each step ([`Mounting`]), and what no log contains ([`Assumptions`]:
//! crystal, tilt, latitude). Output: [`Findings`]: quantities with budgets, absent quantities with reasons, curves. Such logs are recorded
//! by [`stand_acquire::calibration_session`]; [`record`] computes the result from a session's folder, [`archive`] recomputes and compares
//! it.
//!
//! Terms: a *plateau* is a stretch of constant setpoint after settling, cut to whole turns where it has any. *Full scale* is the rate to
//! which percentages refer; by default the greatest rate that was run. The *dut* is the device under test.

pub mod accel;
pub mod by_hand;
mod chirp;
pub mod crystal;
pub mod drive;
pub mod gyro;
pub mod lock_in;
pub mod note;
pub mod plateaus;
mod plausibility;
mod positions_fit;
pub mod response;
pub mod response_function;
pub mod session;
pub mod step_table;

use identification::deadline::Deadline;
use identification::statistics::uncertainty;
pub use note::{AbsenceReason, Basis, Meaning, Remark};
use response_function::ResponseFunction;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
pub use stand_acquire::calibration_session::{Assumptions, DutKind, MeasuredCrystal, Mounting, Orientation, Step};

/// A quantity of a calibration.
pub type Quantity = uncertainty::Quantity<Basis, Meaning>;
/// A line of its uncertainty budget.
pub type Contribution = uncertainty::Contribution<Basis>;

/// What a curve shows; determines its title, axes and style.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveKind {
    /// Departure of a static characteristic from its straight line, % of full scale, over the rate, rad/s.
    LineDeparture,
    /// Output minus output at rest, rad/s, over small rates, rad/s.
    SmallRates,
    /// Gain of the device under test over frequency, Hz.
    Gain,
    /// Phase of the device under test, degrees, over frequency, Hz.
    Phase,
    /// Coherence over frequency, Hz.
    Coherence,
    /// Deviation of all rate readings from the encoder, rad/s, over the rate, rad/s.
    RateReadings,
    /// Current, A, over the rate, rad/s.
    RateTorque,
    /// Rate, rad/s, over the voltage, V.
    RateVoltage,
    /// Torque amplitude, N m, by harmonic order.
    TorqueSpectrum,
    /// Gain from voltage to rate, dB, over frequency, Hz.
    DriveGain,
    /// Phase from voltage to rate, degrees, over frequency, Hz.
    DrivePhase,
}

/// What a series of measured points is, beside the main one of its curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeriesKind {
    /// Plateaus approached from a faster rate.
    FromFasterRate,
    /// Plateaus approached from above.
    FromAbove,
    /// The rate gyro.
    RateGyro,
    /// The accelerometer, with the sign of the encoder.
    Accelerometer,
    /// The back-EMF.
    BackEmf,
}

/// A measured curve and the line of the result through it.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// What it shows.
    pub kind: CurveKind,
    /// Measured points.
    pub points: Vec<(f64, f64)>,
    /// Other series of measured points.
    pub other_series: Vec<(SeriesKind, Vec<(f64, f64)>)>,
    /// The line by the result; for a spectrum the detection limit.
    pub line: Vec<(f64, f64)>,
}

impl Curve {
    /// A curve with one series of points.
    pub fn new(kind: CurveKind, points: Vec<(f64, f64)>, line: Vec<(f64, f64)>) -> Self {
        Self { kind, points, other_series: Vec::new(), line }
    }
}

/// A quantity that was not found.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Absence {
    /// Name of the quantity.
    pub quantity: String,
    /// Why.
    pub reason: AbsenceReason,
}

/// The result of a calibration.
#[derive(Debug, Clone, Default)]
pub struct Findings {
    /// The quantities.
    pub quantities: Vec<Quantity>,
    /// Quantities that were not found.
    pub absent: Vec<Absence>,
    /// Remarks on the whole.
    pub remarks: Vec<Remark>,
    /// Curves.
    pub curves: Vec<Curve>,
    /// Output of the device as a function of its input.
    pub response_function: Option<ResponseFunction>,
    /// Gain and phase by frequency.
    pub frequency_response: Vec<FrequencyPoint>,
    /// Frequency of the stand's crystal, where a clock reference has measured it; times and rates are corrected for it.
    pub crystal: Option<MeasuredCrystal>,
}

/// Gain and phase at one frequency, with expanded uncertainties.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FrequencyPoint {
    /// Frequency, Hz.
    pub frequency_Hz: f64,
    /// Mean rate of the platform, rad/s.
    pub mean_rad_s: f64,
    /// Rate amplitude of the platform, rad/s.
    pub amplitude_rad_s: f64,
    /// Output over rate.
    pub gain: f64,
    /// Its expanded uncertainty.
    #[serde(rename = "U_gain")]
    pub gain_U: f64,
    /// Phase, degrees; negative for a delayed output.
    pub phase_deg: f64,
    /// Its expanded uncertainty, degrees.
    #[serde(rename = "U_phase_deg")]
    pub phase_U_deg: f64,
}

impl Findings {
    /// A quantity by its name.
    pub fn get(&self, name: &str) -> Option<&Quantity> {
        self.quantities.iter().find(|q| q.name == name)
    }

    fn add_absent(&mut self, quantity: &str, reason: AbsenceReason) {
        self.absent.push(Absence { quantity: quantity.to_owned(), reason });
    }
}

/// Why the logs of a session give no calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrateError {
    /// No log has the column of the rate gyro.
    #[error("gyro: no log has the column {column}; column = \"omega_rad_s\" in the session calibrates the rate sensor of the stand")]
    GyroColumn {
        /// The column.
        column: String,
    },
    /// A log cannot be made with the times of the clock reference.
    #[error("{0}")]
    Log(String),
    /// No log has the columns of the accelerometer.
    #[error("accel: no log has the columns accel_x_m_s2 and accel_y_m_s2; the stand needs an accelerometer")]
    AccelColumns,
    /// No log has the columns of the drive.
    #[error("drive: no log has the columns u_V, i_A and theta_rad; `stand calibrate drive` records them")]
    DriveColumns,
    /// The platform hardly turned.
    #[error("accel: the platform hardly turned; record a staircase and a sine in rate mode")]
    HardlyTurned,
    /// No log has plateaus of both signs.
    #[error("gyro: no log has plateaus of both signs; record a staircase in rate mode (profile staircase)")]
    NoPlateaus,
    /// The steps with plateaus of both signs are clipped.
    #[error(
        "gyro: step `{step}` is clipped: the output stays at {limit_rad_s:.3} rad/s while the rate goes on; record it at lower rates, within the range of the device"
    )]
    Clipped {
        /// The first clipped step.
        step: String,
        /// Limit of the output, rad/s.
        limit_rad_s: f64,
    },
    /// Too few plateaus for the static characteristic.
    #[error("gyro: {count} plateaus are too few; record longer")]
    TooFewPlateaus {
        /// Number.
        count: usize,
    },
    /// Crystal and clock reference differ by more than their bounds.
    #[error(
        "clock: by the reference `{reference}` the crystal of the stand is off by {error_ppm:+.1} ppm, but the session states ± {crystal_ppm} ppm for the crystal and ± {reference_ppm} ppm for the reference; correct known.crystal_ppm or [clock_reference] in the session.toml of the folder, whichever is wrong, and evaluate the folder again"
    )]
    ClocksDisagree {
        /// Name of the reference.
        reference: String,
        /// Relative frequency error by the reference, ppm.
        error_ppm: f64,
        /// Half-width of the crystal, ppm.
        crystal_ppm: f64,
        /// Half-width of the reference, ppm.
        reference_ppm: f64,
    },
    /// More than 10 % of the edges on the input of the clock reference are not pulses of one sequence.
    #[error(
        "clock: {rejected} edges on the input of the reference `{reference}` are not a whole number of seconds from a pulse, {pulses} are: interference, a reference that was interrupted for more than 40 s or changed its phase, or a crystal that is off by more than 200 ppm, beyond the ± {crystal_ppm} ppm of the session; an evaluation of the folder without [clock_reference] in its session.toml uses this bound, unchecked"
    )]
    ReferenceRejected {
        /// Name of the reference.
        reference: String,
        /// Edges that are no pulses.
        rejected: f64,
        /// Pulses.
        pulses: f64,
        /// Half-width of the crystal, ppm.
        crystal_ppm: f64,
    },
    /// No quantity of the drive was found.
    #[error("drive: the logs determine no quantity of the drive; record the default session (`stand calibrate drive`)")]
    NoQuantities {
        /// Why each was not found.
        absent: Vec<Absence>,
    },
    /// The deadline has passed.
    #[error("interrupted by the user")]
    Interrupted,
}

impl CalibrateError {
    /// Between two parts of a computation.
    /// Ends a computation whose deadline has passed.
    ///
    /// # Errors
    /// [`CalibrateError::Interrupted`].
    pub fn check(deadline: Deadline) -> Result<(), Self> {
        if deadline.has_passed() { Err(Self::Interrupted) } else { Ok(()) }
    }

    /// No plateaus remain because steps are clipped.
    fn of_clipped(remark: Remark) -> Self {
        match remark {
            Remark::Clipped { step, limit_rad_s, .. } => Self::Clipped { step, limit_rad_s },
            _ => Self::NoPlateaus,
        }
    }
}
