//! Coasting: the drive is switched off and the platform runs down; decelerations are torques over the inertia.
//!
//! J Ω′ = K i − b Ω − c sign Ω, integrated so that no signal is differentiated (docs/theory.md §4): Ω(t) = Ω₀ + (K/J)∫i − (b/J)∫Ω − (c/J)
//! t. A bridge that shorts the motor brakes with i = −K Ω/R; an open bridge gives i = 0.

use super::fitted_drive::Drive;
use super::reading_contributions;
use crate::calibrate::{AbsenceReason, Basis, Findings, Meaning, Step};
use crate::calibrate::{Contribution, Quantity};
use identification::log::Log;
use identification::statistics::least_squares;
use stand_acquire::calibration_session::Session;

/// Time after switching off from which rows are used, s.
const AFTER_S: f64 = 0.05;
/// Fraction of the initial rate down to which rows are used.
const MIN_RATE_FRACTION: f64 = 0.03;
/// Length of a mean rate, s.
const MEAN_S: f64 = 0.05;
/// Braking per viscous friction from which the braking current determines the inertia.
const MIN_BRAKING_RATIO: f64 = 5.0;

/// Adds the decay of the rate and the inertia by the braking current.
pub(super) fn add(steps: &[Step], drive: Option<&Drive>, session: &Session, findings: &mut Findings) {
    let name = "coast_decay_1_s";
    let Some((step, from_s)) = steps.iter().find_map(|s| Some((s, s.log.notes().number("drive_s")?))) else {
        return findings.add_absent(name, AbsenceReason::NeedsCoasting);
    };
    match coast(&step.log, from_s) {
        Some(found) => findings.quantities.extend(found.quantities(drive, session)),
        None => findings.add_absent(name, AbsenceReason::NotAtRestInRecord),
    }
}

struct Coast {
    /// b/J with its standard uncertainty, 1/s.
    decay_1_s: (f64, f64),
    /// c/J with its standard uncertainty, rad/s².
    coulomb_rad_s2: (f64, f64),
    /// Braking current per rate, A s/rad.
    braking_A_s: f64,
    dof: f64,
}

fn coast(log: &Log, from_s: f64) -> Option<Coast> {
    let (t_s, theta, i_A) = (log.t_s(), log.column("theta_rad")?, log.column("i_A")?);
    let begin = t_s.partition_point(|t| *t < t_s[0] + from_s + AFTER_S);
    let size = ((MEAN_S / log.median_dt_s().max(1e-9)) as usize).max(1);
    let rates: Vec<(f64, f64, f64)> = (begin..log.len().saturating_sub(size))
        .step_by(size)
        .map(|k| {
            let dt = t_s[k + size] - t_s[k];
            (0.5 * (t_s[k] + t_s[k + size]), (theta[k + size] - theta[k]) / dt, i_A[k..k + size].iter().sum::<f64>() / size as f64)
        })
        .collect();
    let first = rates.first()?.1.abs();
    let used = rates.iter().take_while(|(_, rate, _)| rate.abs() > MIN_RATE_FRACTION * first).count();
    if used < 10 || rates.len() == used {
        return None;
    }
    let rates = &rates[..used];
    let sign = rates[0].1.signum();
    // ∫Ω is the angle.
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
        coulomb_rad_s2: (fit.coefficients[2], fit.sigma(2)),
        braking_A_s: braking,
        dof: fit.dof,
    })
}

impl Coast {
    fn quantities(&self, drive: Option<&Drive>, session: &Session) -> Vec<Quantity> {
        let contribution = |u: f64| Contribution::type_a("noise", u, self.dof, Basis::IntegratedLaw);
        let mut found = vec![
            Quantity::new("coast_decay_1_s", "1/s", self.decay_1_s.0, vec![contribution(self.decay_1_s.1)]).meaning(Meaning::CoastDecay),
            Quantity::new("coast_dry_rad_s2", "rad/s²", self.coulomb_rad_s2.0, vec![contribution(self.coulomb_rad_s2.1)])
                .meaning(Meaning::CoastDeceleration),
        ];
        // The braking torque follows from K and the current: J = (K braking + b)/decay, with a small part b.
        if let Some(drive) = drive {
            let ((k, uk), (b, ub)) = (drive.motor_constant_N_m_A, drive.viscous_N_m_s);
            if self.braking_A_s * k > MIN_BRAKING_RATIO * b.abs() {
                let value = (k * self.braking_A_s + b) / self.decay_1_s.0;
                let mut contributions = vec![
                    contribution(value * self.decay_1_s.1 / self.decay_1_s.0),
                    Contribution::type_b("motor constant", uk, "N m/A", self.braking_A_s / self.decay_1_s.0, Basis::ModelFit),
                    Contribution::type_b("viscous friction", ub, "N m s/rad", 1.0 / self.decay_1_s.0, Basis::ModelFit),
                ];
                contributions.extend(reading_contributions(session, value, [1, 1]));
                found.push(Quantity::new("inertia_by_coasting_kg_m2", "kg m²", value, contributions).meaning(Meaning::InertiaByCoasting));
            }
        }
        found
    }
}
