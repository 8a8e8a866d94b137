//! Calibration: static and dynamic characteristics of the drive and of sensors on the platform, each with its uncertainty budget.
//!
//! Input: the logs of a session's steps ([`Step`]), the mounting in each step ([`Mounting`]), and what no log contains ([`Assumptions`]: crystal,
//! tilt, latitude). Output: [`Findings`]: quantities with budgets, absent quantities with reasons, curves. [`session`] records such logs on a stand;
//! [`record`] keeps the result with the logs, so that anybody can compute it again.
//!
//! Terms: a *plateau* is a stretch of constant setpoint after settling, cut to whole turns where it has any. *Full scale* is the rate to which
//! percentages refer; by default the greatest rate that was run. The *dut* is the device under test.

pub mod accel;
pub mod archive;
pub mod drawn_dut;
pub mod drive;
pub mod gyro;
pub mod lock_in;
pub mod note;
pub mod plateaus;
pub mod record;
pub mod response;
pub mod session;
pub mod stored_record;
pub mod trend;

use crate::log::Log;
use crate::statistics::uncertainty;
pub use note::{AbsenceReason, Basis, Meaning, Remark};
use serde::{Deserialize, Serialize};

/// A quantity of a calibration.
pub type Quantity = uncertainty::Quantity<Basis, Meaning>;
/// A line of its uncertainty budget.
pub type Contribution = uncertainty::Contribution<Basis>;

/// What is calibrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DutKind {
    /// A rate gyro.
    Gyro,
    /// An accelerometer, as a rate sensor at a radius.
    Accel,
    /// The drive of the stand.
    Drive,
}

impl DutKind {
    /// Its name on the command line and in records.
    pub fn name(self) -> &'static str {
        match self {
            DutKind::Gyro => "gyro",
            DutKind::Accel => "accel",
            DutKind::Drive => "drive",
        }
    }
}

/// Orientation of the device under test on the platform.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Orientation {
    /// Sensitive axis parallel to the platform's axis.
    #[default]
    Flat,
    /// On its side: sensitive axis across, y axis along the platform's axis.
    Side,
    /// On its other side: turned by 180° about its sensitive axis.
    OtherSide,
}

/// Mounting of the device under test in a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Mounting {
    /// Distance from the platform's axis, m.
    pub radius_m: f64,
    /// Rotation about the platform's axis, from outward towards the motion, degrees.
    pub turned_deg: f64,
    /// Tilt of the platform's axis, degrees.
    pub tilt_deg: f64,
    /// Orientation.
    #[serde(rename = "lying")]
    pub orientation: Orientation,
}

impl Default for Mounting {
    fn default() -> Self {
        Self { radius_m: 0.05, turned_deg: 0.0, tilt_deg: 0.0, orientation: Orientation::Flat }
    }
}

/// Knowledge that no log contains: half-widths of rectangular distributions, unless stated otherwise (type B).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Assumptions {
    /// Frequency error of the controller's crystal, ppm.
    pub crystal_ppm: f64,
    /// Angle between the sensitive axis of the device under test and the platform's axis, degrees.
    pub misalignment_deg: f64,
    /// Angle between the platform's axis and the vertical, beside the tilt of a step, degrees.
    pub level_deg: f64,
    /// Radius of the mounting, m.
    pub radius_error_m: f64,
    /// Latitude, degrees, north positive (a value, not a half-width); without it the Earth's rotation adds to the uncertainty of the bias.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub latitude_deg: Option<f64>,
    /// Local gravity, m/s² (a value).
    pub gravity_m_s2: f64,
    /// Current reading of the stand, % of the reading.
    pub current_percent: f64,
    /// Supply reading of the stand, % of the reading.
    pub supply_percent: f64,
    /// Thermometer, over the range used, K.
    pub temperature_K: f64,
    /// Scale of an accelerometer, % of 1; used where only one radius was run.
    pub scale_percent: f64,
}

impl Default for Assumptions {
    fn default() -> Self {
        Self {
            crystal_ppm: 50.0, // NUCLEO: MCO of the debugger's 8 MHz crystal, ± 50 ppm over life
            misalignment_deg: 0.5,
            level_deg: 0.2,
            radius_error_m: 5e-4,
            latitude_deg: None,
            gravity_m_s2: 9.806_65,
            current_percent: 1.0,
            supply_percent: 0.5,
            temperature_K: 1.0,
            scale_percent: 1.0,
        }
    }
}

/// Rotation rate of the Earth, rad/s (IERS conventions 2010).
pub const EARTH_RAD_S: f64 = 7.292_115e-5;

/// A recorded step.
#[derive(Debug, Clone)]
pub struct Step {
    /// Its name in the session.
    pub name: String,
    /// Its log.
    pub log: Log,
    /// Mounting of the device under test.
    pub mounting: Mounting,
    /// Moment of inertia added to the platform, kg m².
    pub added_inertia_kg_m2: Option<f64>,
}

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
#[derive(Debug, Clone, PartialEq)]
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
    /// Too few plateaus for the static characteristic.
    #[error("gyro: {count} plateaus are too few; record longer")]
    TooFewPlateaus {
        /// Number.
        count: usize,
    },
    /// No quantity of the drive was found.
    #[error("drive: the logs determine no quantity of the drive; record the default session (`stand calibrate drive`)")]
    NoQuantities {
        /// Why each was not found.
        absent: Vec<Absence>,
    },
}
