//! Static curves: current over rate and rate over voltage, approached from both sides, for both signs; friction and dead band by straight
//! lines.

use super::reading_contributions;
use crate::calibrate::plateaus::{Plateau, plateaus};
use crate::calibrate::{AbsenceReason, Basis, Curve, CurveKind, Findings, Meaning, SeriesKind, Step};
use crate::calibrate::{Contribution, Quantity};
use identification::statistics::Extremes;
use identification::statistics::least_squares;
use stand_acquire::calibration_session::Session;

/// Fraction of the greatest rate below which the platform counts as at rest.
const REST_FRACTION: f64 = 0.01;
/// Fewest plateaus of a staircase.
const MIN_PLATEAUS: usize = 8;

/// Adds the results of the staircases in rate and voltage mode.
pub(super) fn add(steps: &[Step], session: &Session, findings: &mut Findings) {
    torque(steps, session, findings);
    voltage(steps, session, findings);
}

fn staircase<'s>(steps: &'s [Step], command: &str, mode: &str, session: &Session) -> Option<(&'s Step, Vec<Plateau>)> {
    steps
        .iter()
        .filter(|s| s.log.note("mode") == Some(mode) && s.added_inertia_kg_m2.is_none())
        .map(|s| (s, plateaus(&s.log, command, session.settle_s)))
        .max_by_key(|(_, found)| found.len())
        .filter(|(_, found)| found.len() >= MIN_PLATEAUS)
}

/// i = c/K sign Ω + b/K Ω + offset (+ hysteresis), in amperes: no motor constant is needed.
fn torque(steps: &[Step], session: &Session, findings: &mut Findings) {
    let Some((step, found)) = staircase(steps, "rate_cmd_rad_s", "rate", session) else {
        return findings.add_absent("no_load_current_A", AbsenceReason::NeedsRateStaircase);
    };
    let Some(i_A) = step.log.column("i_A") else { return };
    let greatest = found.iter().map(|p| p.rate_rad_s.abs()).max_or_zero();
    let moving: Vec<&Plateau> = found.iter().filter(|p| p.rate_rad_s.abs() > REST_FRACTION * greatest).collect();
    // Approached from a slower rate of the same sign: +½, from a faster one: −½.
    let approach = |p: &Plateau| if p.previous_setpoint.unwrap_or(0.0).abs() < p.setpoint.abs() { 0.5 } else { -0.5 };
    let rows: Vec<Vec<f64>> =
        moving.iter().map(|p| vec![p.rate_rad_s.signum(), p.rate_rad_s, 1.0, approach(p) * p.rate_rad_s.signum()]).collect();
    let y: Vec<f64> = moving.iter().map(|p| p.mean(i_A)).collect();
    let Some(fit) = least_squares(&rows, &y) else {
        return findings.add_absent("no_load_current_A", AbsenceReason::FrictionNotSeparable);
    };
    let quantity = |k: usize, name: &str, unit: &str, meaning: Meaning| {
        let value = fit.coefficients[k];
        let basis = Basis::PlateausAboutTwoLines { count: moving.len() };
        let mut contributions = vec![Contribution::type_a("noise and repeatability", fit.sigma(k), fit.dof, basis)];
        contributions.extend(reading_contributions(session, value, [0, 1]));
        Quantity::new(name, unit, value, contributions).meaning(meaning)
    };
    findings.quantities.extend([
        quantity(0, "no_load_current_A", "A", Meaning::NoLoadCurrent),
        quantity(1, "current_per_rate_A_s", "A s/rad", Meaning::CurrentPerRate),
        quantity(2, "current_asymmetry_A", "A", Meaning::CurrentAsymmetry),
        quantity(3, "current_hysteresis_A", "A", Meaning::CurrentHysteresis),
    ]);
    let line = |sign: f64| (1..=50).map(move |k| sign * f64::from(k) / 50.0);
    let at = |rate: f64| fit.coefficients[0] * rate.signum() + fit.coefficients[1] * rate + fit.coefficients[2];
    let mut curve: Vec<(f64, f64)> = line(-1.0).map(|part| part * greatest).map(|rate| (rate, at(rate))).collect();
    curve.reverse();
    curve.extend(line(1.0).map(|part| part * greatest).map(|rate| (rate, at(rate))));
    let of =
        |rising: bool| moving.iter().filter(|p| (approach(p) > 0.0) == rising).map(|p| (p.rate_rad_s, p.mean(i_A))).collect::<Vec<_>>();
    findings
        .curves
        .push(Curve { other_series: vec![(SeriesKind::FromFasterRate, of(false))], ..Curve::new(CurveKind::RateTorque, of(true), curve) });
}

/// Ω = a (u ∓ u₀) + drift: u₀ is the voltage below which the platform does not move, extrapolated from the moving side.
fn voltage(steps: &[Step], session: &Session, findings: &mut Findings) {
    let Some((step, found)) = staircase(steps, "u_V", "voltage", session) else {
        return findings.add_absent("dead_band_V", AbsenceReason::NeedsVoltageStaircase);
    };
    let Some(u_V) = step.log.column("u_V") else { return };
    let greatest = found.iter().map(|p| p.rate_rad_s.abs()).max_or_zero();
    let moving: Vec<&Plateau> = found.iter().filter(|p| p.rate_rad_s.abs() > REST_FRACTION * greatest).collect();
    // Before the rate has settled, a part of u accelerates the rotor: the mean acceleration is a regressor. The slope of a line through the
    // rates is no substitute: plateaus are cut to whole turns, so that they show different parts of the exponential, whose slope and mean
    // acceleration differ.
    let omega = step.log.column("omega_rad_s");
    let acceleration: Option<Vec<f64>> = omega.map(|omega| {
        let rows = step.log.t_s().windows(2).zip(omega.windows(2));
        rows.map(|(t, w)| (w[1] - w[0]) / (t[1] - t[0])).chain([0.0]).collect()
    });
    let slope = |p: &Plateau| acceleration.as_ref().map_or(0.0, |a| p.mean(a));
    let rows: Vec<Vec<f64>> = moving.iter().map(|p| vec![p.rate_rad_s, p.rate_rad_s.signum(), slope(p), 1.0]).collect();
    let rows: Vec<Vec<f64>> = if omega.is_some() { rows } else { rows.into_iter().map(|r| vec![r[0], r[1], r[3]]).collect() };
    let y: Vec<f64> = moving.iter().map(|p| p.mean(u_V)).collect();
    let Some(fit) = least_squares(&rows, &y) else {
        return findings.add_absent("dead_band_V", AbsenceReason::HardlyMoved);
    };
    let contribution =
        |u: f64| Contribution::type_a("noise and repeatability", u, fit.dof, Basis::PlateausAboutTwoLines { count: moving.len() });
    let band = fit.coefficients[1];
    let mut contributions = vec![contribution(fit.sigma(1))];
    contributions.extend(reading_contributions(session, band, [1, 0]));
    findings.quantities.push(Quantity::new("dead_band_V", "V", band, contributions).meaning(Meaning::VoltageDeadBand));
    let per_volt = 1.0 / fit.coefficients[0];
    let mut contributions = vec![contribution(fit.sigma(0) * per_volt * per_volt)];
    contributions.extend(reading_contributions(session, per_volt, [-1, 0]));
    findings
        .quantities
        .push(Quantity::new("rate_per_voltage_rad_s_V", "rad/s/V", per_volt, contributions).meaning(Meaning::RatePerVoltage));
    let points =
        |rising: bool| found.iter().filter(|p| (p.direction() >= 0.0) == rising).map(|p| (p.mean(u_V), p.rate_rad_s)).collect::<Vec<_>>();
    let greatest_V = found.iter().map(|p| p.setpoint.abs()).max_or_zero();
    let line = (-100..=100).map(|k| f64::from(k) / 100.0 * greatest_V).map(|u| (u, per_volt * (u.abs() - band).max(0.0).copysign(u)));
    findings.curves.push(Curve {
        other_series: vec![(SeriesKind::FromAbove, points(false))],
        ..Curve::new(CurveKind::RateVoltage, points(true), line.collect())
    });
}
