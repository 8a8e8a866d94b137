//! The device under test, its mounting, the user's knowledge of both, and a recorded step.

use identification::log::Log;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is calibrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// Output of a gyro per acceleration across its axis, °/s/g: the centripetal acceleration at a radius makes an error proportional to
    /// Ω².
    pub g_sensitivity_deg_s_g: f64,
    /// Frequency of the crystal by a clock reference, in place of `crystal_ppm`: not in a session file, but found in its logs.
    #[serde(skip)]
    pub measured_crystal: Option<MeasuredCrystal>,
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
            g_sensitivity_deg_s_g: 0.1, // upper end of the data sheets of MEMS gyros: 0.03 (ADXRS450) to 0.1 (ADXRS620)
            measured_crystal: None,
        }
    }
}

/// Frequency of the controller's crystal by a clock reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredCrystal {
    /// Relative frequency error; positive: fast.
    pub relative_error: f64,
    /// Its standard uncertainty.
    pub u: f64,
    /// Degrees of freedom.
    pub dof: f64,
    /// Time with pulses of the reference, s.
    pub seconds: f64,
    /// Half-width of the reference's frequency error, ppm.
    pub reference_ppm: f64,
}

/// Note of a log whose step begins with a start of the sensor under test.
pub const RESTART_NOTE: &str = "sensor_restart";

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
