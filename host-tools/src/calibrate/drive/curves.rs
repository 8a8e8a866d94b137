//! Static curves: torque over the rate, rate over the voltage, both ways and signs; friction and dead band by straight lines through them.

use super::readings;
use crate::calibrate::plateaus::{Plateau, plateaus};
use crate::calibrate::session::Session;
use crate::calibrate::{Curve, Findings, Step};
use crate::statistics::Extremes;
use crate::statistics::least_squares;
use crate::statistics::uncertainty::{Part, Quantity};

/// Slower than this part of the greatest rate it is at rest.
const AT_REST: f64 = 0.01;

/// Adds what the staircases show.
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
        .filter(|(_, found)| found.len() >= 8)
}

/// i = c/K sign Ω + b/K Ω + offset (+ hysteresis): in amperes, so that no motor constant is needed; with it the torques are the model's.
fn torque(steps: &[Step], session: &Session, findings: &mut Findings) {
    let Some((step, found)) = staircase(steps, "rate_cmd_rad_s", "rate", session) else {
        return findings.lacks("no_load_current_A", "it takes a staircase in rate mode");
    };
    let Some(i_A) = step.log.column("i_A") else { return };
    let greatest = found.iter().map(|p| p.rate_rad_s.abs()).max_or_zero();
    let moving: Vec<&Plateau> = found.iter().filter(|p| p.rate_rad_s.abs() > AT_REST * greatest).collect();
    // Come to from a slower rate of the same sign, or from a faster one.
    let way = |p: &Plateau| if p.before.unwrap_or(0.0).abs() < p.asked.abs() { 0.5 } else { -0.5 };
    let rows: Vec<Vec<f64>> =
        moving.iter().map(|p| vec![p.rate_rad_s.signum(), p.rate_rad_s, 1.0, way(p) * p.rate_rad_s.signum()]).collect();
    let y: Vec<f64> = moving.iter().map(|p| p.mean(i_A)).collect();
    let Some(fit) = least_squares(&rows, &y) else {
        return findings.lacks("no_load_current_A", "the plateaus of the staircase do not tell friction by sign and by rate apart");
    };
    let part = |k: usize| {
        Part::measured(
            "noise and repeatability",
            fit.sigma(k),
            fit.dof,
            format!("scatter of {} plateaus about two straight lines", moving.len()),
        )
    };
    let quantity = |k: usize, name: &str, unit: &str, says: &str| {
        let value = fit.coefficients[k];
        let mut parts = vec![part(k)];
        parts.extend(readings(session, value, [0, 1]));
        Quantity::new(name, unit, value, parts).saying(says)
    };
    findings.quantities.extend([
        quantity(0, "no_load_current_A", "A", "dry friction over the motor constant: of the rate–torque curve towards rest"),
        quantity(1, "current_per_rate_A_s", "A s/rad", "viscous friction over the motor constant: the curve's slope"),
        quantity(
            2,
            "current_asymmetry_A",
            "A",
            "what is the same in both directions: asymmetric friction, a load, or the current sensor's offset",
        ),
        quantity(3, "current_hysteresis_A", "A", "come to from slower less from faster: warming, or friction with a memory"),
    ]);
    let line = |sign: f64| (1..=50).map(move |k| sign * f64::from(k) / 50.0);
    let at = |rate: f64| fit.coefficients[0] * rate.signum() + fit.coefficients[1] * rate + fit.coefficients[2];
    let mut curve: Vec<(f64, f64)> = line(-1.0).map(|part| part * greatest).map(|rate| (rate, at(rate))).collect();
    curve.reverse();
    curve.extend(line(1.0).map(|part| part * greatest).map(|rate| (rate, at(rate))));
    let of = |rising: bool| moving.iter().filter(|p| (way(p) > 0.0) == rising).map(|p| (p.rate_rad_s, p.mean(i_A))).collect::<Vec<_>>();
    findings.curves.push(Curve {
        title: "Rate–torque: the current that holds a rate".into(),
        x: "rate, rad/s".into(),
        y: "current, A".into(),
        name: "come to from a slower rate".into(),
        points: of(true),
        beside: vec![("come to from a faster rate".into(), of(false))],
        line: curve,
        ..Curve::default()
    });
}

/// Ω = a (u ∓ u₀) + drift: the voltage below which it does not move, from the moving side.
fn voltage(steps: &[Step], session: &Session, findings: &mut Findings) {
    let Some((step, found)) = staircase(steps, "u_V", "voltage", session) else {
        return findings.lacks("dead_band_V", "it takes a staircase in voltage mode");
    };
    let Some(u_V) = step.log.column("u_V") else { return };
    let greatest = found.iter().map(|p| p.rate_rad_s.abs()).max_or_zero();
    let moving: Vec<&Plateau> = found.iter().filter(|p| p.rate_rad_s.abs() > AT_REST * greatest).collect();
    // What is not settled yet shows as a slope of the rate within the plateau: u goes partly into J Ω′.
    let omega = step.log.column("omega_rad_s");
    let slope = |p: &Plateau| omega.map_or(0.0, |omega| p.slope(step.log.t_s(), omega));
    let rows: Vec<Vec<f64>> = moving.iter().map(|p| vec![p.rate_rad_s, p.rate_rad_s.signum(), slope(p), 1.0]).collect();
    let rows: Vec<Vec<f64>> = if omega.is_some() { rows } else { rows.into_iter().map(|r| vec![r[0], r[1], r[3]]).collect() };
    let y: Vec<f64> = moving.iter().map(|p| p.mean(u_V)).collect();
    let Some(fit) = least_squares(&rows, &y) else {
        return findings.lacks("dead_band_V", "the platform hardly moved in the staircase of voltages: make its amplitude larger");
    };
    let part = |u: f64| {
        Part::measured("noise and repeatability", u, fit.dof, format!("scatter of {} plateaus about two straight lines", moving.len()))
    };
    let band = fit.coefficients[1];
    let mut parts = vec![part(fit.sigma(1))];
    parts.extend(readings(session, band, [1, 0]));
    findings.quantities.push(Quantity::new("dead_band_V", "V", band, parts).saying(
        "± the voltage at which the rate–voltage lines reach rest: R times no-load current, and what brushes and bridge keep back",
    ));
    let per_volt = 1.0 / fit.coefficients[0];
    let mut parts = vec![part(fit.sigma(0) * per_volt * per_volt)];
    parts.extend(readings(session, per_volt, [-1, 0]));
    findings
        .quantities
        .push(Quantity::new("rate_per_voltage_rad_s_V", "rad/s/V", per_volt, parts).saying("slope of the rate–voltage curve, settled"));
    let points =
        |rising: bool| found.iter().filter(|p| (p.direction() >= 0.0) == rising).map(|p| (p.mean(u_V), p.rate_rad_s)).collect::<Vec<_>>();
    let most = found.iter().map(|p| p.asked.abs()).max_or_zero();
    findings.curves.push(Curve {
        title: "Rate–voltage".into(),
        x: "voltage, V".into(),
        y: "rate, rad/s".into(),
        name: "come to from below".into(),
        points: points(true),
        beside: vec![("come to from above".into(), points(false))],
        line: (-100..=100).map(|k| f64::from(k) / 100.0 * most).map(|u| (u, per_volt * (u.abs() - band).max(0.0).copysign(u))).collect(),
        ..Curve::default()
    });
}
