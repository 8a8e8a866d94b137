//! The stand's own drive: static curves, the parameters of its model, inertia by other ways beside it, frequency response, cogging by order (theory.md §4).
//!
//! In: steps with `u_V`, `i_A`, `theta_rad` (and `rate_cmd_rad_s` in rate mode). Out: [`Findings`]. The parameters of the model are fitted by output error, as
//! `stand fit` does; what the static curves and the coasting say stands beside them under names of its own, so that two ways may disagree in sight.

mod coast;
mod curves;
mod model;
mod orders;
mod sweep;

use super::session::Session;
use super::{CalibrateError, Findings, Step};
use crate::statistics::uncertainty::Part;

/// What the stand's own readings add to a quantity's uncertainty: `by` are the powers with which voltage and current enter it.
pub(super) fn readings(session: &Session, value: f64, by: [i32; 2]) -> Vec<Part> {
    let known = &session.known;
    [("supply reading", known.supply_percent, by[0]), ("current reading", known.current_percent, by[1])]
        .into_iter()
        .filter(|(_, _, power)| *power != 0)
        .map(|(of, percent, power)| {
            Part::within(of, percent / 100.0, "1", value * f64::from(power), format!("± {percent} % of what it shows"))
        })
        .collect()
}

/// Computes what the steps show.
///
/// # Errors
/// No log has voltage, current and angle; none shows anything.
pub fn calibrate(steps: &[Step], session: &Session) -> Result<Findings, CalibrateError> {
    let has = |s: &Step| ["u_V", "i_A", "theta_rad"].iter().all(|name| s.log.column(name).is_some());
    if !steps.iter().any(has) {
        return Err(CalibrateError::Column {
            what: "drive",
            column: "u_V, i_A and theta_rad".into(),
            hint: "`stand calibrate drive` records them",
        });
    }
    let mut findings = Findings::default();
    let found = model::add(steps, session, &mut findings);
    curves::add(steps, session, &mut findings);
    coast::add(steps, found.as_ref(), session, &mut findings);
    sweep::add(steps, session, &mut findings);
    orders::add(steps, found.as_ref(), session, &mut findings);
    if findings.quantities.is_empty() {
        let says = findings.absent.first().map_or(String::new(), |(name, why)| format!("{name}: {why}"));
        return Err(CalibrateError::TooLittle { what: "drive", says });
    }
    // The step that shows most of the drive.
    let first =
        steps.iter().find(|step| model::is_rich(step)).or(steps.first()).map_or(String::new(), |s| s.log.path().display().to_string());
    findings.says.push(format!(
        "one command further: `stand compare {first} --model M` and `stand explain {first} --model M` say what this model lacks"
    ));
    Ok(findings)
}
