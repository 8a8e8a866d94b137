//! A rate gyro on the platform: static and dynamic characteristics (IEEE Std 1431 and 528 have the terms).
//!
//! In: the steps of a session; the sensor's column is `gyro_rad_s`, or another by name. Out: [`Findings`]. What a step is good for is told by what it
//! has: plateaus of both signs (static), a sine (dynamic), whole turns that begin and end at rest, a tilted stand, another radius, the part on its side,
//! a warming part at rest.
//!
//! * *scale*: slope of the straight line of least squares through the characteristic over ± full scale;
//! * *nonlinearity*: the greatest departure of the fitted curve b + sΩ + c₂Ω² + c₃Ω³ from that line, per cent of full scale;
//! * *asymmetry*: slope at positive less slope at negative rates, per cent of their mean;
//! * *hysteresis*: what is shown when come to from below less when from above, per cent of full scale.

mod bands;
mod characteristic;
mod dynamic;
mod mounted;
mod still;
mod turns;

pub use characteristic::{Characteristic, characteristic};
pub(super) use dynamic::along_chirp;

use super::session::Session;
use super::{CalibrateError, Findings, Known, Lying, Step};
use crate::log::Log;

/// What is to be calibrated, beyond the logs.
#[derive(Debug, Clone, PartialEq)]
pub struct Given {
    /// The sensor's column.
    pub column: String,
    /// Full scale, rad/s; else the greatest rate that was run.
    pub full_scale_rad_s: Option<f64>,
    /// Left out at the begin of each plateau, s.
    pub settle_s: f64,
    /// What no log shows.
    pub known: Known,
}

impl Default for Given {
    fn default() -> Self {
        Self { column: "gyro_rad_s".into(), full_scale_rad_s: None, settle_s: 0.5, known: Known::default() }
    }
}

impl Given {
    /// What a session's file says.
    pub fn of(session: &Session) -> Self {
        let usual = Self::default();
        Self {
            column: session.column.clone().unwrap_or(usual.column),
            full_scale_rad_s: session.full_scale_rad_s,
            settle_s: session.settle_s,
            known: session.known,
        }
    }
}

/// What a step's log has of the sensor.
fn samples<'l>(log: &'l Log, given: &Given) -> Option<&'l [f64]> {
    log.column(&given.column)
}

/// Computes all that the steps show.
///
/// # Errors
/// No log has the sensor's column; no log has plateaus.
pub fn calibrate(steps: &[Step], given: &Given) -> Result<Findings, CalibrateError> {
    if !steps.iter().any(|step| step.log.column(&given.column).is_some()) {
        return Err(CalibrateError::Column {
            what: "gyro",
            column: given.column.clone(),
            hint: "--column omega_rad_s calibrates the stand's own rate sensor",
        });
    }
    let mut findings = Findings::default();
    let upright: Vec<&Step> = steps.iter().filter(|s| s.mounted.lying == Lying::Flat && s.mounted.tilt_deg == 0.0).collect();
    let radius_m = upright.first().map_or(0.0, |s| s.mounted.radius_m);
    let here: Vec<&Step> = upright.iter().copied().filter(|s| s.mounted.radius_m == radius_m).collect();
    let full_scale = characteristic::add(&here, given, &mut findings)?;
    turns::add(&here, given, &mut findings);
    bands::add(&here, given, &mut findings);
    dynamic::add(&here, given, &mut findings);
    still::add(&here, given, &mut findings);
    mounted::add(steps, radius_m, full_scale, given, &mut findings);
    Ok(findings)
}
