//! Input and result of the evaluation: cycles with their conditions, own drift, apparent drift, azimuth.

use super::cycle::{Cycle, is_same_position};
use super::error::{DriftError, within};
use super::positions::PositionFit;
use hal_sim::gyro::Orientation;
use identification::log::LogWarning;
use identification::statistics::uncertainty::Estimate;
use stand_acquire::drift_session::DriftRecording;
use std::f64::consts::TAU;

/// A remark on the input.
#[derive(Debug, Clone, PartialEq)]
pub enum DriftWarning {
    /// K_m/H is not known, so the current corrects nothing.
    NoTorquerGain,
    /// The times between several logs are not known.
    UnknownTimesBetweenLogs,
    /// A warning of the log reader.
    Log(LogWarning),
    /// At a pole the azimuth is undefined.
    Pole,
    /// The drift has a linear trend.
    Trend {
        /// Axis of three.
        axis: Option<usize>,
        /// Trend, rad/s².
        rad_s2: Estimate,
    },
    /// The drift moves as a random walk.
    Walk {
        /// Axis of three.
        axis: Option<usize>,
        /// K, rad/s/√s.
        walk_rad_s_sqrt_s: f64,
    },
    /// Visits of one position differ by more than the scatter of their cycles.
    Visits {
        /// Axis of three.
        axis: Option<usize>,
        /// Standard deviation of a visit, rad/s.
        sigma_rad_s: f64,
    },
    /// Offsets of the visits are measured badly or not at all.
    FewVisits {
        /// Contrasts between the visits that the other columns leave free: 0 or 1.
        contrasts: usize,
    },
    /// Pulses of one amplitude do not show an asymmetry of the torquer; its bound is in the budget.
    OneAmplitude {
        /// Bound, relative.
        asymmetry_bound: f64,
    },
    /// Parts of the setup whose uncertainty is taken as zero.
    TakenAsExact(Vec<SetupPart>),
}

/// Part of the setup with an uncertainty that the user states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetupPart {
    /// The turn between positions.
    Turn,
    /// The level.
    Level,
    /// The gain of the angle sensor.
    AngleGain,
}

/// Bound of an asymmetry of the torquer that is not stated, relative: 1 %.
pub const DEFAULT_TORQUER_ASYMMETRY: f64 = 0.01;
/// Relative standard uncertainty of K_m/H that is not stated: 1 %.
pub const DEFAULT_TORQUER_GAIN_ERROR: f64 = 0.01;
/// Standard uncertainty of a latitude that is not stated, rad: 0.01°, 1 km.
pub const DEFAULT_LATITUDE_ERROR_RAD: f64 = 0.01 * std::f64::consts::PI / 180.0;

/// Standard uncertainties of the setup, from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetupUncertainties {
    /// Of the turn between positions, rad.
    pub turn_error_rad: f64,
    /// Of the level, rad.
    pub level_error_rad: f64,
    /// Of the angle sensor's gain K_k, relative.
    pub gain_error: f64,
    /// Of the torquer's gain K_m/H in the correction by the current, relative.
    pub torquer_gain_error: f64,
    /// Of the latitude, rad.
    pub latitude_error_rad: f64,
    /// Bound (half-width) of the relative asymmetry of the torquer, which pulses of one amplitude do not show.
    pub torquer_asymmetry: f64,
}

impl Default for SetupUncertainties {
    fn default() -> Self {
        Self {
            turn_error_rad: 0.0,
            level_error_rad: 0.0,
            gain_error: 0.0,
            torquer_gain_error: DEFAULT_TORQUER_GAIN_ERROR,
            latitude_error_rad: DEFAULT_LATITUDE_ERROR_RAD,
            torquer_asymmetry: DEFAULT_TORQUER_ASYMMETRY,
        }
    }
}

impl SetupUncertainties {
    /// Checks the values.
    ///
    /// # Errors
    /// A value out of its range.
    pub fn checked(self) -> Result<Self, DriftError> {
        within("turn_error_rad", self.turn_error_rad, 0.0, 1.0)?;
        within("level_error_rad", self.level_error_rad, 0.0, 1.0)?;
        within("gain_error", self.gain_error, 0.0, 1.0)?;
        within("torquer_gain_error", self.torquer_gain_error, 0.0, 1.0)?;
        within("latitude_error_rad", self.latitude_error_rad, 0.0, 1.0)?;
        within("torquer_asymmetry", self.torquer_asymmetry, 0.0, 1.0)?;
        Ok(self)
    }

    /// The parts whose uncertainty is zero.
    pub fn taken_as_exact(&self) -> Vec<SetupPart> {
        let parts =
            [(SetupPart::Turn, self.turn_error_rad), (SetupPart::Level, self.level_error_rad), (SetupPart::AngleGain, self.gain_error)];
        parts.into_iter().filter(|(_, u)| *u == 0.0).map(|(part, _)| part).collect()
    }
}

/// Cycles and the conditions under which they were measured.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// Name: the log, the port.
    pub name: String,
    /// The cycles.
    pub cycles: Vec<Cycle>,
    /// Three axes; otherwise one.
    pub has_three_axes: bool,
    /// Latitude, degrees.
    pub latitude_deg: Option<f64>,
    /// Standard uncertainties of the setup.
    pub uncertainties: SetupUncertainties,
    /// Remarks on the input.
    pub warnings: Vec<DriftWarning>,
}

impl Measurement {
    /// The measurement of a drift session; `name` is that of the stand.
    ///
    /// # Errors
    /// An uncertainty out of its range.
    pub fn of_recording(
        name: String,
        recording: &DriftRecording,
        latitude_deg: Option<f64>,
        uncertainties: SetupUncertainties,
    ) -> Result<Self, DriftError> {
        Ok(Self {
            name,
            cycles: recording.cycles.iter().map(|cycle| Cycle::of_report(cycle, &recording.scales)).collect(),
            has_three_axes: false,
            latitude_deg,
            uncertainties: uncertainties.checked()?,
            warnings: Vec::new(),
        })
    }

    /// The cycles without a defect.
    pub fn valid_cycles(&self) -> Vec<&Cycle> {
        self.cycles.iter().filter(|cycle| cycle.defect.is_none()).collect()
    }

    /// The positions of the valid cycles, in their order.
    pub fn positions(&self) -> Vec<Orientation> {
        let mut positions: Vec<Orientation> = Vec::new();
        for cycle in self.valid_cycles() {
            if !positions.iter().any(|position| is_same_position(position, &cycle.position)) {
                positions.push(cycle.position);
            }
        }
        positions
    }
}

/// Own drift, apparent drift and azimuth.
#[derive(Debug, Clone, PartialEq)]
pub struct SeparatedDrift {
    /// Own drift ω_d, rad/s: one entry, or x, y, z.
    pub own_rad_s: Vec<Estimate>,
    /// Apparent drift ω_a in the first position, rad/s: one entry, or x, y, z.
    pub apparent_rad_s: Vec<Estimate>,
    /// Azimuth A, rad, where it is determined.
    pub azimuth_rad: Option<Estimate>,
    /// Its limit near the meridian, where noise makes the apparent drift exceed the horizontal Earth rate.
    pub azimuth_limit: Option<AzimuthLimit>,
    /// Fit over the positions of a single-axis gyroscope.
    pub position_fit: Option<PositionFit>,
    /// Relative excess ε of a negative pulse for each axis; empty for pulses of one amplitude.
    pub inequality: Vec<Estimate>,
    /// Movement of the drift during the session, for each axis.
    pub movement: Vec<Movement>,
}

/// An azimuth near the meridian: |A − `near_rad`| < `within_rad`, with a probability of 95 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AzimuthLimit {
    /// 0 (north) or π (south).
    pub near_rad: f64,
    /// Largest distance from it.
    pub within_rad: f64,
}

impl AzimuthLimit {
    /// From an apparent drift that exceeds the horizontal Earth rate by less than its expanded uncertainty, which contains that of the rate;
    /// `None` for others.
    pub fn of(apparent: Estimate, horizontal_rad_s: f64) -> Option<Self> {
        let expanded = apparent.uncertainty?.expanded() / horizontal_rad_s;
        let cosine = -apparent.value / horizontal_rad_s;
        let least = cosine.abs() - expanded;
        (cosine.abs() > 1.0 && least <= 1.0)
            .then(|| AzimuthLimit { near_rad: if cosine > 0.0 { 0.0 } else { std::f64::consts::PI }, within_rad: least.max(-1.0).acos() })
    }
}

/// Movement of the drift during a session.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Movement {
    /// Linear trend, rad/s², where the cycles determine it.
    pub trend: Option<Estimate>,
    /// The trend is significant at the 1 % level.
    pub has_trend: bool,
    /// Random walk K, rad/s/√s, where it is significant at the 1 % level.
    pub walk_rad_s_sqrt_s: Option<f64>,
    /// log₁₀ of the probability that the scatter of the cycles explains the differences between visits of one position.
    pub log10_p_visits: Option<f64>,
    /// Standard deviation of a visit beyond the scatter of its cycles, rad/s.
    pub visit_sigma_rad_s: Option<f64>,
    /// Contrasts between the visits from which their scatter is estimated.
    pub free_visits: usize,
}

impl SeparatedDrift {
    /// The second azimuth with the same apparent drift, rad: two positions half a turn apart determine only the cosine.
    pub fn second_azimuth_rad(&self) -> Option<f64> {
        let is_cosine_only = self.position_fit.as_ref().is_some_and(|fit| fit.sine.is_none());
        self.azimuth_rad.filter(|_| is_cosine_only).map(|azimuth| TAU - azimuth.value)
    }
}
