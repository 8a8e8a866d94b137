//! Coasting: the drive is taken off and the platform runs out. What slows it divided by the inertia, whatever the motor does meanwhile.
//!
//! J Ω′ = K i − b Ω − c sign Ω over the record, integrated, so that nothing is differentiated (theory.md §4): Ω(t) = Ω₀ + (K/J)∫i − (b/J)∫Ω − (c/J) t. Where the bridge
//! shorts the motor while it is off, i is −K Ω/R and brakes; where it opens, i is nothing.

use super::model::Drive;
use super::readings;
use crate::calibrate::session::Session;
use crate::calibrate::{Findings, Step};
use crate::log::Log;
use crate::statistics::least_squares;
use crate::statistics::uncertainty::{Part, Quantity};

/// From so long after the drive went off, s; down to so much of the rate it then had.
const AFTER_S: f64 = 0.05;
const DOWN_TO: f64 = 0.03;

/// Adds the decay and the inertia that follows.
pub(super) fn add(steps: &[Step], drive: Option<&Drive>, session: &Session, findings: &mut Findings) {
    let name = "coast_decay_1_s";
    let Some((step, from_s)) = steps.iter().find_map(|s| Some((s, s.log.note("drive_s")?.parse::<f64>().ok()?))) else {
        return findings.lacks(name, "it takes a step whose drive ends before the record does (drive_s)");
    };
    match coast(&step.log, from_s) {
        Some(found) => findings.quantities.extend(found.quantities(drive, session)),
        None => findings.lacks(name, "the platform did not run out in sight: drive it faster, or record longer"),
    }
}

struct Coast {
    decay_1_s: (f64, f64),
    dry_rad_s2: (f64, f64),
    /// Torque of the motor per rate while it runs out, over the motor constant: A s/rad.
    braking_A_s: f64,
    dof: f64,
}

fn coast(log: &Log, from_s: f64) -> Option<Coast> {
    let (t_s, theta, i_A) = (log.t_s(), log.column("theta_rad")?, log.column("i_A")?);
    let begin = t_s.partition_point(|t| *t < t_s[0] + from_s + AFTER_S);
    // Means over 50 ms: θ differences.
    let size = ((0.05 / log.median_dt_s().max(1e-9)) as usize).max(1);
    let rates: Vec<(f64, f64, f64)> = (begin..log.len().saturating_sub(size))
        .step_by(size)
        .map(|k| {
            let dt = t_s[k + size] - t_s[k];
            (0.5 * (t_s[k] + t_s[k + size]), (theta[k + size] - theta[k]) / dt, i_A[k..k + size].iter().sum::<f64>() / size as f64)
        })
        .collect();
    let first = rates.first()?.1.abs();
    let used = rates.iter().take_while(|(_, rate, _)| rate.abs() > DOWN_TO * first).count();
    if used < 10 || rates.len() == used {
        return None;
    }
    let rates = &rates[..used];
    let sign = rates[0].1.signum();
    // ∫Ω is the angle itself.
    let rows: Vec<Vec<f64>> = rates
        .iter()
        .enumerate()
        .map(|(k, (t, ..))| {
            let angle: f64 = rates[..k].iter().zip(&rates[1..=k]).map(|(a, b)| 0.5 * (a.1 + b.1) * (b.0 - a.0)).sum();
            vec![1.0, -angle * sign, -(t - rates[0].0)]
        })
        .collect();
    let y: Vec<f64> = rates.iter().map(|(_, rate, _)| rate * sign).collect();
    let fit = least_squares(&rows, &y)?;
    let braking = -rates.iter().map(|(_, rate, i)| i * rate).sum::<f64>() / rates.iter().map(|(_, rate, _)| rate * rate).sum::<f64>();
    Some(Coast {
        decay_1_s: (fit.coefficients[1], fit.sigma(1)),
        dry_rad_s2: (fit.coefficients[2], fit.sigma(2)),
        braking_A_s: braking,
        dof: fit.dof,
    })
}

impl Coast {
    fn quantities(&self, drive: Option<&Drive>, session: &Session) -> Vec<Quantity> {
        let part = |u: f64| Part::measured("noise", u, self.dof, "scatter about the integrated law");
        let mut found = vec![
            Quantity::new("coast_decay_1_s", "1/s", self.decay_1_s.0, vec![part(self.decay_1_s.1)])
                .saying("viscous friction, and the motor's braking where its bridge shorts it, over the inertia"),
            Quantity::new("coast_dry_rad_s2", "rad/s²", self.dry_rad_s2.0, vec![part(self.dry_rad_s2.1)])
                .saying("dry friction over the inertia"),
        ];
        // Where the motor brakes, its torque is known by K and the current: J = (K braking + b)/decay. Friction is a small part of it.
        if let Some(drive) = drive {
            let ((k, uk), (b, ub)) = (drive.motor_constant_N_m_A, drive.viscous_N_m_s);
            if self.braking_A_s * k > 5.0 * b.abs() {
                let value = (k * self.braking_A_s + b) / self.decay_1_s.0;
                let mut parts = vec![
                    part(value * self.decay_1_s.1 / self.decay_1_s.0),
                    Part::known("motor constant", uk, "N m/A", self.braking_A_s / self.decay_1_s.0, "by the model's fit"),
                    Part::known("viscous friction", ub, "N m s/rad", 1.0 / self.decay_1_s.0, "by the model's fit"),
                ];
                parts.extend(readings(session, value, [1, 1]));
                found.push(
                    Quantity::new("inertia_by_coasting_kg_m2", "kg m²", value, parts)
                        .saying("braked by the shorted motor: its current times the motor constant over the decay"),
                );
            }
        }
        found
    }
}
