//! A rate gyro on the platform: static and dynamic characteristics (terms of IEEE Std 1431 and 528).
//!
//! Input: the steps of a session; the output of the device under test is the column `gyro_rad_s` or another by name. Output: [`Findings`].
//! The content of a step determines its use: plateaus of both signs (static), a sine or chirp (dynamic), whole turns between rests, a
//! tilted stand, another radius, the device under test on its side, warming at rest.
//!
//! * *scale*: slope of the least-squares line through the characteristic over ± full scale;
//! * *nonlinearity*: greatest departure of the fitted curve b + sΩ + c₂Ω² + c₃Ω³ from that line, % of full scale;
//! * *asymmetry*: slope at positive minus slope at negative rates, % of their mean;
//! * *encoder*: error of the stand's encoder within a turn, by runs of both senses; it enters the budgets of the characteristic;
//! * *hysteresis*: output approached from below minus from above, % of full scale.

mod bands;
mod characteristic;
mod clipping;
mod dynamic;
mod encoder;
mod influences;
mod mounted;
mod points;
mod static_quantities;
mod still;
mod turn_on;
mod turns;

pub use characteristic::{Characteristic, characteristic};
pub use points::Point;

use super::{Assumptions, CalibrateError, Findings, Orientation, Step};
use identification::log::Log;
use stand_acquire::calibration_session::Session;

/// Settings of the calibration of a rate gyro.
#[derive(Debug, Clone, PartialEq)]
pub struct GyroSettings {
    /// Column of the device under test.
    pub column: String,
    /// Full scale, rad/s; `None` for the greatest rate that was run.
    pub full_scale_rad_s: Option<f64>,
    /// Band about the final output at rest that ends the warm-up, rad/s; `None`: no warm-up time.
    pub warm_up_band_rad_s: Option<f64>,
    /// Settling time at the beginning of each plateau, s.
    pub settle_s: f64,
    /// Knowledge that no log contains.
    pub assumptions: Assumptions,
}

impl Default for GyroSettings {
    fn default() -> Self {
        Self {
            column: "gyro_rad_s".into(),
            full_scale_rad_s: None,
            warm_up_band_rad_s: None,
            settle_s: 0.5,
            assumptions: Assumptions::default(),
        }
    }
}

impl GyroSettings {
    /// The settings of a session.
    pub fn of(session: &Session) -> Self {
        let default = Self::default();
        Self {
            column: session.column.clone().unwrap_or(default.column),
            full_scale_rad_s: session.full_scale_rad_s,
            warm_up_band_rad_s: session.warm_up_band_rad_s,
            settle_s: session.settle_s,
            assumptions: session.assumptions,
        }
    }
}

/// Output of the device under test in a log.
fn dut_output<'l>(log: &'l Log, settings: &GyroSettings) -> Option<&'l [f64]> {
    log.column(&settings.column)
}

/// Calibrates a rate gyro from the steps of a session.
///
/// # Errors
/// No log has the column of the device under test, or plateaus of both signs.
pub fn calibrate(steps: &[Step], settings: &GyroSettings) -> Result<Findings, CalibrateError> {
    if !steps.iter().any(|step| step.log.column(&settings.column).is_some()) {
        return Err(CalibrateError::GyroColumn { column: settings.column.clone() });
    }
    let mut findings = Findings::default();
    let (used, clipped) = clipping::without_clipped(&steps.iter().collect::<Vec<_>>(), settings);
    findings.remarks.extend(clipped);
    let upright: Vec<&Step> =
        used.iter().copied().filter(|s| s.mounting.orientation == Orientation::Flat && s.mounting.tilt_deg == 0.0).collect();
    let radius_m = upright.first().map_or(0.0, |s| s.mounting.radius_m);
    let at_radius: Vec<&Step> = upright.iter().copied().filter(|s| s.mounting.radius_m == radius_m).collect();
    let mut of_encoder = Findings::default();
    let encoder = encoder::add(&at_radius, settings, &mut of_encoder);
    let found = static_quantities::add(&at_radius, radius_m, encoder, settings, &mut findings)?;
    turns::add(&at_radius, settings, &mut findings);
    findings.quantities.extend(of_encoder.quantities);
    findings.absent.extend(of_encoder.absent);
    bands::add(&at_radius, settings, &mut findings);
    dynamic::add(&at_radius, &found, settings, &mut findings);
    still::add(&at_radius, settings, &mut findings);
    turn_on::add(&at_radius, settings, &mut findings);
    mounted::add(&used, radius_m, found.full_scale_rad_s, settings, &mut findings);
    Ok(findings)
}
