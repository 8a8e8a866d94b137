//! Rate stability of the platform over parts of a turn and over whole turns.
//!
//! Input: a log with `theta_rad`, and `turn_s` for whole turns by index and crystal. Output: for each plateau of constant rate its mean
//! rate, and the standard deviation of the mean rates over windows of 1°, 10°, 360° and whole turns, relative to the mean, with
//! uncertainty, resolution and the comparison with a limit.
//!
//! [`plateaus`] finds the stretches of constant rate, [`windows`] evaluates one. Limits: the encoder's angle at the rows has the resolution
//! of a count, which is reported for each width; the crystal is common to all windows and enters the mean rate only.

pub mod error;
pub mod plateaus;
pub mod windows;

pub use error::StabilityError;
pub use windows::{Verdict, Width, WidthResult};

use identification::log::Log;
use identification::statistics::uncertainty::Estimate;

/// Options of the evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StabilitySettings {
    /// Time at the beginning of each plateau that is left out, s.
    pub settle_s: f64,
    /// Largest accepted relative standard deviation.
    pub limit: Option<f64>,
}

impl Default for StabilitySettings {
    fn default() -> Self {
        Self { settle_s: 1.0, limit: None }
    }
}

/// Stability of one plateau.
#[derive(Debug, Clone, PartialEq)]
pub struct PlateauStability {
    /// Begin of the evaluated part, s.
    pub start_s: f64,
    /// Its duration, s.
    pub duration_s: f64,
    /// Number of whole turns evaluated; 0: less than one.
    pub turns: usize,
    /// Setpoint, rad/s, if the log has it.
    pub command_rad_s: Option<f64>,
    /// Mean rate, rad/s; its uncertainty contains the crystal.
    pub mean_rad_s: Estimate,
    /// The widths, in the order 1°, 10°, 360°, whole turns; those that the plateau contains twice.
    pub widths: Vec<WidthResult>,
}

/// Rate stability of all plateaus of a log.
///
/// # Errors
/// `theta_rad` is missing, a number is out of its range, or no plateau contains two windows of 1°.
pub fn of_log(log: &Log, settings: StabilitySettings) -> Result<Vec<PlateauStability>, StabilityError> {
    let name = || log.path().display().to_string();
    if !(settings.settle_s.is_finite() && settings.settle_s >= 0.0) {
        return Err(StabilityError::Settle(settings.settle_s));
    }
    if let Some(limit) = settings.limit
        && !(limit.is_finite() && limit > 0.0)
    {
        return Err(StabilityError::Limit(limit));
    }
    let theta = log.column("theta_rad").ok_or_else(|| StabilityError::Column { log: name() })?;
    let found = plateaus::of_log(log, theta, settings.settle_s);
    let results: Vec<PlateauStability> =
        found.into_iter().filter_map(|plateau| windows::evaluate(log, theta, &plateau, settings.limit)).collect();
    if results.is_empty() { Err(StabilityError::NoPlateau { log: name() }) } else { Ok(results) }
}
