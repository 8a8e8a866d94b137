//! What comes round with the angle: the torque by order, from a slow turn that the loop holds.
//!
//! T_cog = J Ω′ − K i by order n: at a rate that is nearly constant the angle's own ripple of that order is lock-in material too, Ω′ = −(n Ω)² Θ_n.

use super::model::Drive;
use super::readings;
use crate::calibrate::session::Session;
use crate::calibrate::{Curve, Findings, Step};
use crate::uncertainty::{Part, Quantity};
use std::f64::consts::TAU;

/// Highest order that is looked at.
const ORDERS: usize = 72;
/// An order is there where it is so many times its own uncertainty.
const SEEN: f64 = 6.0;

/// Adds the orders that stand out.
pub(super) fn add(steps: &[Step], drive: Option<&Drive>, session: &Session, findings: &mut Findings) {
    let is_slow =
        |s: &&Step| s.log.note("profile") == Some("constant") && s.log.note("mode") == Some("rate") && s.log.note("drive_s").is_none();
    let (Some(step), Some(drive)) = (steps.iter().find(is_slow), drive) else {
        return findings.lacks("cogging_N_m", "it takes a slow constant rate of several turns, and the model's motor constant");
    };
    if !step.log.theta_zero_is_index() {
        findings.says.push("the index was not seen: the phases of the orders are from an arbitrary zero".into());
    }
    let (Some(theta), Some(i_A)) = (step.log.column("theta_rad"), step.log.column("i_A")) else { return };
    let t_s = step.log.t_s();
    let from = t_s.partition_point(|t| *t < t_s[0] + session.settle_s);
    let went = theta.last().map_or(0.0, |last| last - theta[from]);
    let turns = (went.abs() / TAU).floor() as usize;
    if turns < 3 {
        return findings.lacks("cogging_N_m", format!("{turns} whole turns are too few: three or more"));
    }
    // Turn by turn: what all turns have in common is the order, what differs its uncertainty.
    let sign = went.signum();
    let bounds: Vec<usize> = (0..=turns)
        .map(|n| (from..theta.len()).find(|k| (theta[*k] - theta[from]) * sign >= n as f64 * TAU).unwrap_or(theta.len() - 1))
        .collect();
    let (k, j) = (drive.motor_constant_N_m_A.0, drive.inertia_kg_m2.0);
    let mut found: Vec<(usize, f64, f64, f64)> = Vec::new();
    for order in 1..=ORDERS {
        let n = order as f64;
        let phasors: Vec<(f64, f64)> = bounds
            .windows(2)
            .map(|w| {
                let rows = w[0]..w[1];
                let count = rows.len() as f64;
                let rate = (theta[w[1]] - theta[w[0]]) / (t_s[w[1]] - t_s[w[0]]);
                let acceleration = (n * rate).powi(2);
                let mean_i = i_A[rows.clone()].iter().sum::<f64>() / count;
                let (mut re, mut im) = (0.0, 0.0);
                for row in rows {
                    let ripple = theta[row] - theta[w[0]] - rate * (t_s[row] - t_s[w[0]]);
                    let torque = -k * (i_A[row] - mean_i) - j * acceleration * ripple;
                    let (sin, cos) = (n * theta[row]).sin_cos();
                    re += 2.0 / count * torque * sin;
                    im += 2.0 / count * torque * cos;
                }
                (re, im)
            })
            .collect();
        let m = phasors.len() as f64;
        let mean = phasors.iter().fold((0.0, 0.0), |(a, b), (re, im)| (a + re / m, b + im / m));
        let spread: f64 = phasors.iter().map(|(re, im)| (re - mean.0).powi(2) + (im - mean.1).powi(2)).sum();
        let u = (spread / (2.0 * (m - 1.0)) / m).sqrt();
        found.push((order, mean.0, mean.1, u));
    }
    // A turn-to-turn scatter of few turns is itself uncertain: the orders' common level stands for those below it.
    let mut levels: Vec<f64> = found.iter().map(|f| f.3).collect();
    levels.sort_by(f64::total_cmp);
    let level = levels[levels.len() / 2];
    let mut seen: Vec<_> = found.iter().filter(|(_, re, im, u)| re.hypot(*im) > SEEN * u.max(level)).collect();
    seen.sort_by(|a, b| b.1.hypot(b.2).total_cmp(&a.1.hypot(a.2)));
    if seen.is_empty() {
        findings.lacks("cogging_N_m", format!("no order up to {ORDERS} stands out of {} N m", crate::report::significant(SEEN * level, 2)));
    }
    for (order, re, im, u) in seen.into_iter().take(8) {
        let value = re.hypot(*im);
        let dof = 2.0 * (turns as f64 - 1.0);
        let mut parts = vec![Part::measured("turn to turn", u.max(level), dof, format!("{turns} turns"))];
        parts.extend(readings(session, value, [1, 1]));
        let phase = im.atan2(*re).rem_euclid(TAU);
        findings.quantities.push(Quantity::new(&format!("order_{order}_N_m"), "N m", value, parts).saying(format!(
            "torque that comes {order} times a turn, phase {phase:.3} rad; `stand explain` tells cogging from ripple of the torque"
        )));
    }
    findings.curves.push(Curve {
        title: "Torque by order".into(),
        x: "order, per turn".into(),
        y: "amplitude, N m".into(),
        has_bars: true,
        points: found.iter().map(|(order, re, im, _)| (*order as f64, re.hypot(*im))).collect(),
        line: found.iter().map(|(order, _, _, u)| (*order as f64, SEEN * u.max(level))).collect(),
        ..Curve::default()
    });
}
