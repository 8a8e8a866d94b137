//! The drive of the stand: static curves, parameters of its model, inertia by independent methods, frequency response, torque by harmonic
//! order (docs/theory.md §4).
//!
//! Input: steps with `u_V`, `i_A`, `theta_rad` (and `rate_cmd_rad_s` in rate mode). Output: [`Findings`]. The parameters of the model are
//! fitted by output error, as `stand fit` does. Results of static curves and coasting have names of their own, so that the methods can be
//! compared.

mod coast;
mod curves;
mod fitted_drive;
mod harmonics;
mod model;
mod sweep;

use super::{Basis, CalibrateError, Findings, Step};
use crate::calibrate::Contribution;
use identification::deadline::Deadline;
use stand_acquire::calibration_session::Session;

/// Clock of the stand. `sensitivity`: change of the result per relative frequency error.
pub(super) fn clock(session: &Session, sensitivity: f64) -> Contribution {
    super::crystal::clock(&session.assumptions, sensitivity)
}

/// Contributions of the stand's voltage and current readings to a quantity; `exponents` are the powers with which voltage and current enter
/// it.
pub(super) fn reading_contributions(session: &Session, value: f64, exponents: [i32; 2]) -> Vec<Contribution> {
    let assumed = &session.assumptions;
    [("supply reading", assumed.supply_percent, exponents[0]), ("current reading", assumed.current_percent, exponents[1])]
        .into_iter()
        .filter(|(_, _, exponent)| *exponent != 0)
        .map(|(source, percent, exponent)| {
            let basis = Basis::ReadingHalfWidth { half_width_percent: percent };
            Contribution::rectangular(source, percent / 100.0, "1", value * f64::from(exponent), basis)
        })
        .collect()
}

/// Calibrates the drive from the steps of a session.
///
/// # Errors
/// No log has voltage, current and angle; the logs determine no quantity; the deadline has passed.
pub fn calibrate(steps: &[Step], session: &Session, deadline: Deadline) -> Result<Findings, CalibrateError> {
    let has = |s: &Step| ["u_V", "i_A", "theta_rad"].iter().all(|name| s.log.column(name).is_some());
    if !steps.iter().any(has) {
        return Err(CalibrateError::DriveColumns);
    }
    let mut findings = Findings::default();
    let model = model::add(steps, session, deadline, &mut findings);
    // A fit that was ended by the deadline has proved nothing.
    CalibrateError::check(deadline)?;
    curves::add(steps, session, &mut findings);
    coast::add(steps, model.as_ref(), session, &mut findings);
    sweep::add(steps, session, &mut findings);
    harmonics::add(steps, model.as_ref(), session, &mut findings);
    if findings.quantities.is_empty() {
        return Err(CalibrateError::NoQuantities { absent: findings.absent });
    }
    let excited = steps.iter().find(|step| model::is_exciting(step)).or(steps.first());
    let log = excited.map_or(String::new(), |s| s.log.path().display().to_string());
    findings.remarks.push(crate::calibrate::Remark::NextCommands { log });
    Ok(findings)
}
