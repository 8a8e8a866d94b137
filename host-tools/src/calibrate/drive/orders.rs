//! What comes round with the angle: the torque by order, from a slow turn that the loop holds.
//!
//! T_cog = J Ω′ − K i by order n: at a rate that is nearly constant the angle's own ripple of that order is lock-in material too, Ω′ = −(n Ω)² Θ_n.

use super::model::Drive;
use super::readings;
use crate::calibrate::session::Session;
use crate::calibrate::{Curve, Findings, Step};
use crate::statistics::robust::median;
use crate::statistics::uncertainty::{Part, Quantity};
use std::f64::consts::TAU;

/// Highest order that is looked at.
const ORDERS: usize = 72;
/// An order is there where it is so many times its own uncertainty.
const SEEN: f64 = 6.0;
/// Less than this part of the largest order is no order of its own: the sampling of a ripple makes as much of it.
const LEAST: f64 = 0.02;
/// So many go into the model.
const IN_MODEL: usize = 3;

/// One order: its torque is re sin nθ + im cos nθ.
#[derive(Clone, Copy)]
struct Order {
    order: usize,
    re: f64,
    im: f64,
    /// From turn to turn.
    u: f64,
    /// What of it the platform's own ripple says, by its inertia, N m.
    by_inertia: f64,
}

impl Order {
    fn size(&self) -> f64 {
        self.re.hypot(self.im)
    }
}

/// What a slow turn shows.
struct Orders {
    all: Vec<Order>,
    /// Turn-to-turn scatter that the orders have in common: that of few turns is itself uncertain.
    level: f64,
    turns: usize,
}

impl Orders {
    /// Those that stand out, the largest first.
    fn seen(&self) -> Vec<Order> {
        let mut seen: Vec<Order> = self.all.iter().filter(|o| o.size() > SEEN * o.u.max(self.level)).copied().collect();
        seen.sort_by(|a, b| b.size().total_cmp(&a.size()));
        let least = LEAST * seen.first().map_or(0.0, Order::size);
        seen.retain(|o| o.size() > least);
        seen
    }
}

fn slow_turn(steps: &[Step]) -> Option<&Step> {
    let is_slow =
        |s: &&Step| s.log.note("profile") == Some("constant") && s.log.note("mode") == Some("rate") && s.log.note("drive_s").is_none();
    steps.iter().find(is_slow)
}

fn orders(step: &Step, drive: &Drive, session: &Session) -> Result<Orders, String> {
    let (Some(theta), Some(i_A)) = (step.log.column("theta_rad"), step.log.column("i_A")) else {
        return Err("the slow turn has no angle or no current".into());
    };
    let t_s = step.log.t_s();
    let from = t_s.partition_point(|t| *t < t_s[0] + session.settle_s);
    let went = theta.last().map_or(0.0, |last| last - theta[from]);
    let turns = (went.abs() / TAU).floor() as usize;
    if turns < 3 {
        return Err(format!("{turns} whole turns are too few: three or more"));
    }
    // Turn by turn: what all turns have in common is the order, what differs its uncertainty.
    let sign = went.signum();
    let bounds: Vec<usize> = (0..=turns)
        .map(|n| (from..theta.len()).find(|k| (theta[*k] - theta[from]) * sign >= n as f64 * TAU).unwrap_or(theta.len() - 1))
        .collect();
    let (k, j) = (drive.motor_constant_N_m_A.0, drive.inertia_kg_m2.0);
    let mut all: Vec<Order> = Vec::new();
    for order in 1..=ORDERS {
        let n = order as f64;
        let phasors: Vec<[f64; 4]> = bounds
            .windows(2)
            .map(|w| {
                let rows = w[0]..w[1];
                let count = rows.len() as f64;
                let rate = (theta[w[1]] - theta[w[0]]) / (t_s[w[1]] - t_s[w[0]]);
                let acceleration = (n * rate).powi(2);
                let mean_i = i_A[rows.clone()].iter().sum::<f64>() / count;
                let mut sums = [0.0; 4];
                for row in rows {
                    let ripple = theta[row] - theta[w[0]] - rate * (t_s[row] - t_s[w[0]]);
                    let (motor, inertia) = (-k * (i_A[row] - mean_i), -j * acceleration * ripple);
                    let (sin, cos) = (n * theta[row]).sin_cos();
                    let each = [(motor + inertia) * sin, (motor + inertia) * cos, inertia * sin, inertia * cos];
                    for (sum, part) in sums.iter_mut().zip(each) {
                        *sum += 2.0 / count * part;
                    }
                }
                sums
            })
            .collect();
        let m = phasors.len() as f64;
        let [re, im, of_re, of_im] = [0, 1, 2, 3].map(|k| phasors.iter().map(|p| p[k]).sum::<f64>() / m);
        let spread: f64 = phasors.iter().map(|p| (p[0] - re).powi(2) + (p[1] - im).powi(2)).sum();
        let u = (spread / (2.0 * (m - 1.0)) / m).sqrt();
        all.push(Order { order, re, im, u, by_inertia: of_re.hypot(of_im) });
    }
    let level = median(all.iter().map(|o| o.u)).unwrap_or(f64::NAN);
    Ok(Orders { all, level, turns })
}

/// The orders that a model of the drive must have: order, amplitude in N m, phase.
pub(super) fn strongest(steps: &[Step], drive: &Drive, session: &Session) -> Vec<(usize, f64, f64)> {
    let found = slow_turn(steps).and_then(|step| orders(step, drive, session).ok());
    let seen = found.map(|found| found.seen()).unwrap_or_default();
    seen.iter().take(IN_MODEL).map(|o| (o.order, o.size(), o.im.atan2(o.re).rem_euclid(TAU))).collect()
}

/// Adds the orders that stand out.
pub(super) fn add(steps: &[Step], drive: Option<&Drive>, session: &Session, findings: &mut Findings) {
    let (Some(step), Some(drive)) = (slow_turn(steps), drive) else {
        return findings.lacks("cogging_N_m", "it takes a slow constant rate of several turns, and the model's motor constant");
    };
    let found = match orders(step, drive, session) {
        Ok(found) => found,
        Err(why) => return findings.lacks("cogging_N_m", why),
    };
    if !step.log.theta_zero_is_index() {
        findings.says.push("the index was not seen: the phases of the orders are from an arbitrary zero".into());
    }
    let seen = found.seen();
    if seen.is_empty() {
        let least = crate::report::significant(SEEN * found.level, 2);
        findings.lacks("cogging_N_m", format!("no order up to {ORDERS} stands out of {least} N m"));
    }
    let (k, j) = (drive.motor_constant_N_m_A, drive.inertia_kg_m2);
    for o in seen.into_iter().take(8) {
        let value = o.size();
        let dof = 2.0 * (found.turns as f64 - 1.0);
        let mut parts = vec![
            Part::measured("turn to turn", o.u.max(found.level), dof, format!("{} turns", found.turns)),
            Part::known("motor constant", k.1 / k.0, "1", value, "by the model's fit"),
            Part::known("inertia", j.1 / j.0, "1", o.by_inertia, "by the model's fit, on the ripple of the rate"),
        ];
        parts.extend(readings(session, value, [1, 1]));
        let phase = o.im.atan2(o.re).rem_euclid(TAU);
        findings.quantities.push(Quantity::new(&format!("order_{}_N_m", o.order), "N m", value, parts).saying(format!(
            "torque that comes {} times a turn, phase {phase:.3} rad; `stand explain` tells cogging from ripple of the torque",
            o.order
        )));
    }
    findings.curves.push(Curve {
        title: "Torque by order".into(),
        x: "order, per turn".into(),
        y: "amplitude, N m".into(),
        has_bars: true,
        points: found.all.iter().map(|o| (o.order as f64, o.size())).collect(),
        line: found.all.iter().map(|o| (o.order as f64, SEEN * o.u.max(found.level))).collect(),
        ..Curve::default()
    });
}
