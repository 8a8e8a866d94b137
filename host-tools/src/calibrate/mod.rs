//! Calibration: static and dynamic characteristics of the drive and of the sensors on the platform, each with its uncertainty (theory.md §4).
//!
//! In: the logs of a session's steps ([`Step`]), how the part was mounted in each, and what no log shows ([`Known`]: crystal, tilt, latitude). Out:
//! [`Quantity`](crate::statistics::uncertainty::Quantity) by quantity with its budget, what could not be found and why ([`Findings`]). [`session`] makes such logs on a
//! stand and leaves a record; from the record anybody computes the same again.
//!
//! * a *plateau* is a stretch of constant command after it has settled, cut to whole turns where it has them;
//! * *full scale* is the rate to which the per cents refer; by default the greatest that was run.

pub mod accel;
pub mod drive;
pub mod gyro;
pub mod kept;
pub mod lock_in;

pub mod part;
pub mod plateaus;
pub mod record;

pub mod response;
pub mod session;
pub mod trend;

use crate::log::Log;
use crate::report::finite;
use crate::statistics::uncertainty::Quantity;
use serde::{Deserialize, Serialize};

/// How the part under test lies on the platform.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lying {
    /// Its sensitive axis along the platform's.
    #[default]
    Flat,
    /// On its side.
    Side,
    /// On its other side: turned by 180° about its sensitive axis.
    OtherSide,
}

/// Where the part is mounted in a step; a person does that.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Mounted {
    /// From the platform's axis, m.
    pub radius_m: f64,
    /// Turned about the platform's axis, from outward towards the motion, degrees.
    pub turned_deg: f64,
    /// How far the platform's axis leans, degrees.
    pub tilt_deg: f64,
    /// How the part lies.
    pub lying: Lying,
}

impl Default for Mounted {
    fn default() -> Self {
        Self { radius_m: 0.05, turned_deg: 0.0, tilt_deg: 0.0, lying: Lying::Flat }
    }
}

/// What no log shows, as half-widths of rectangular distributions unless it says otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Known {
    /// The controller's crystal, parts per million.
    pub crystal_ppm: f64,
    /// Angle between the part's axis and the platform's, degrees.
    pub misalignment_deg: f64,
    /// The platform's axis off the vertical, beyond what a step says, degrees.
    pub level_deg: f64,
    /// Radius at which the part is mounted, m.
    pub radius_error_m: f64,
    /// Latitude, degrees, north positive; without it the Earth's rotation is part of the bias's uncertainty.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub latitude_deg: Option<f64>,
    /// Local gravity, m/s².
    pub gravity_m_s2: f64,
    /// The stand's current reading, per cent of what it shows.
    pub current_percent: f64,
    /// The stand's supply reading, per cent of what it shows.
    pub supply_percent: f64,
    /// The thermometer, K.
    pub temperature_K: f64,
    /// An accelerometer's scale, per cent off 1, where one radius alone was run.
    pub scale_percent: f64,
}

impl Default for Known {
    fn default() -> Self {
        Self {
            crystal_ppm: 50.0, // the NUCLEO's oscillator from the debugger: MCO of an 8 MHz crystal, ± 50 ppm over its life
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

/// The Earth's rotation, rad/s (IERS conventions 2010).
pub const EARTH_RAD_S: f64 = 7.292_115e-5;

/// A step that was recorded.
#[derive(Debug, Clone)]
pub struct Step {
    /// Its name in the session.
    pub name: String,
    /// What was recorded.
    pub log: Log,
    /// How the part was mounted.
    pub mounted: Mounted,
    /// A moment of inertia that was added to the platform, kg m².
    pub added_inertia_kg_m2: Option<f64>,
}

/// A curve for a person to see: a static characteristic, a frequency response.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    /// What it is.
    pub title: String,
    /// What its x is, with the unit.
    pub x: String,
    /// What its y is, with the unit.
    pub y: String,
    /// x is shown by its logarithm.
    pub is_log: bool,
    /// The points are bars from zero.
    pub has_bars: bool,
    /// Name of the measured points, where others are beside them.
    pub name: String,
    /// Measured points.
    pub points: Vec<(f64, f64)>,
    /// Other points beside them, each with its name.
    pub beside: Vec<(String, Vec<(f64, f64)>)>,
    /// What the result says, as a line.
    pub line: Vec<(f64, f64)>,
}

impl Curve {
    /// A frequency response: points measured, the line by the result.
    pub fn over_frequency(title: &str, y: &str, points: Vec<(f64, f64)>, line: Vec<(f64, f64)>) -> Self {
        Self { title: title.into(), x: "frequency, Hz".into(), y: y.into(), is_log: true, points, line, ..Self::default() }
    }

    /// What was measured, for whoever draws it anew: the title, both axes, the points of each series.
    fn json(&self) -> serde_json::Value {
        let pairs = |points: &[(f64, f64)]| points.iter().map(|(x, y)| serde_json::json!([finite(*x), finite(*y)])).collect::<Vec<_>>();
        let beside: Vec<_> = self.beside.iter().map(|(name, points)| serde_json::json!({"name": name, "points": pairs(points)})).collect();
        serde_json::json!({"title": self.title, "x": self.x, "y": self.y, "points": pairs(&self.points), "beside": beside, "line": pairs(&self.line)})
    }
}

/// What came of the logs.
#[derive(Debug, Clone, Default)]
pub struct Findings {
    /// The quantities.
    pub quantities: Vec<Quantity>,
    /// What was looked for and not found: name, and why or what to do.
    pub absent: Vec<(String, String)>,
    /// What a person should know of the whole.
    pub says: Vec<String>,
    /// What there is to see.
    pub curves: Vec<Curve>,
}

impl Findings {
    /// A quantity by its name.
    pub fn get(&self, name: &str) -> Option<&Quantity> {
        self.quantities.iter().find(|q| q.name == name)
    }

    fn lacks(&mut self, name: &str, why: impl Into<String>) {
        self.absent.push((name.to_owned(), why.into()));
    }
}

/// Why logs are no calibration.
#[derive(Debug, thiserror::Error)]
pub enum CalibrateError {
    /// No log of the session has this column.
    #[error("{what}: no log has the column {column}; {hint}")]
    Column {
        /// Which calibration.
        what: &'static str,
        /// The column.
        column: String,
        /// What to do.
        hint: &'static str,
    },
    /// Nothing to compute from.
    #[error("{what}: {says}")]
    TooLittle {
        /// Which calibration.
        what: &'static str,
        /// What is missing, and what to record.
        says: String,
    },
}
