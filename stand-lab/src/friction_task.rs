//! The drive of the friction work: drawn by seed, run at constant rates, evaluated by the current of its plateaus.
//!
//! At a constant rate the torque of the current equals the friction: K i = sign(ω) (c + s exp(−(ω/v)²)) + b ω. Three parameters are linear;
//! the Stribeck rate v is searched on a grid, then all four are refined by Gauss-Newton steps.

use std::collections::BTreeMap;
use std::path::Path;

use hal_sim::plant::Stand;
use hal_sim::session::SessionRequest;
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::Mode;

use super::LabError;
use super::course::FrictionTask;
use super::draw::Draw;
use identification::log::Log;
use identification::statistics::least_squares::{LeastSquares, least_squares};
use identification::statistics::uncertainty::{Contribution, Quantity};
use stand_acquire::simulation::simulate;
use stand_analysis::calibrate::plateaus::plateaus;

/// Ranges of the true values: friction of the data sheet within 30 %, a bump that the speed loop passes without stick-slip at the slowest
/// level.
const COULOMB_N_M: (f64, f64) = (6e-4, 1.2e-3);
const VISCOUS_N_M_S: (f64, f64) = (1.4e-5, 2.6e-5);
const STRIBECK_N_M: (f64, f64) = (6e-4, 1.4e-3);
const STRIBECK_RATE_RAD_S: (f64, f64) = (1.0, 2.5);
/// Time of a plateau that is left out, s.
const SETTLE_S: f64 = 0.5;
/// Slowest rate of a plateau that is used, rad/s: at rest the friction has any value up to its limit.
const MIN_RATE_RAD_S: f64 = 0.1;
/// Grid of the Stribeck rate, rad/s, and number of its points.
const GRID_RAD_S: (f64, f64) = (0.2, 10.0);
const GRID_POINTS: usize = 60;
/// Gauss-Newton steps. They converge quadratically from the best point of the grid.
const STEPS: usize = 20;

/// Log files: rates below and above the Stribeck bump.
pub(super) const LOGS: [&str; 2] = ["01-slow.parquet", "02-fast.parquet"];

/// Parameters of the friction law.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Friction {
    coulomb_N_m: f64,
    viscous_N_m_s: f64,
    stribeck_N_m: f64,
    stribeck_rate_rad_s: f64,
}

impl Friction {
    /// Torque at a rate, N m.
    fn torque_N_m(&self, rate_rad_s: f64) -> f64 {
        let bump = (-(rate_rad_s / self.stribeck_rate_rad_s).powi(2)).exp();
        rate_rad_s.signum() * (self.coulomb_N_m + self.stribeck_N_m * bump) + self.viscous_N_m_s * rate_rad_s
    }

    /// Derivatives of the torque by the four parameters.
    fn gradient(&self, rate_rad_s: f64) -> Vec<f64> {
        let (sign, ratio) = (rate_rad_s.signum(), rate_rad_s / self.stribeck_rate_rad_s);
        let bump = (-ratio * ratio).exp();
        vec![sign, rate_rad_s, sign * bump, sign * self.stribeck_N_m * bump * 2.0 * ratio * ratio / self.stribeck_rate_rad_s]
    }
}

/// The stand with this seed and its friction.
fn drawn(task: &FrictionTask, seed: u64) -> (Stand, Friction) {
    let mut draw = Draw::new(seed);
    let friction = Friction {
        coulomb_N_m: draw.between(COULOMB_N_M),
        viscous_N_m_s: draw.between(VISCOUS_N_M_S),
        stribeck_N_m: draw.between(STRIBECK_N_M),
        stribeck_rate_rad_s: draw.between(STRIBECK_RATE_RAD_S),
    };
    let mut stand = Stand::default();
    stand.drive.motor_constant_N_m_A = task.motor_constant_N_m_A * draw.factor(task.motor_constant_percent);
    let current_scale = task.current_percent / 100.0 * draw.between((-1.0, 1.0));
    let effects = [
        ("coulomb", vec![("coulomb_N_m", friction.coulomb_N_m)]),
        ("viscous", vec![("viscous_N_m_s", friction.viscous_N_m_s)]),
        ("stribeck", vec![("stribeck_N_m", friction.stribeck_N_m), ("stribeck_rate_rad_s", friction.stribeck_rate_rad_s)]),
        ("current-scale", vec![("current_scale", current_scale)]),
    ];
    for (id, parameters) in effects {
        stand.effects.insert(id.to_owned(), parameters.into_iter().map(|(name, value)| (name.to_owned(), value)).collect());
    }
    (stand, friction)
}

/// True values by the names of the quantities.
pub(super) fn truth(task: &FrictionTask, seed: u64) -> BTreeMap<String, f64> {
    let (_, f) = drawn(task, seed);
    [
        ("coulomb_N_m", f.coulomb_N_m),
        ("viscous_N_m_s", f.viscous_N_m_s),
        ("stribeck_N_m", f.stribeck_N_m),
        ("stribeck_rate_rad_s", f.stribeck_rate_rad_s),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .into()
}

/// Profile of log number `k` of [`LOGS`].
pub(super) fn profile(task: &FrictionTask, k: usize) -> ProfileConfig {
    let run = &task.runs[k];
    ProfileConfig { levels: run.levels, dwell_s: run.dwell_s, ..ProfileConfig::new(ProfileKind::Staircase, run.amplitude_rad_s, 1) }
}

/// Log number `k` of [`LOGS`], named `path`.
///
/// # Errors
/// The stand cannot be simulated.
pub(super) fn record(task: &FrictionTask, k: usize, (device, noise): (u64, u64), path: &Path) -> Result<Log, LabError> {
    let request = SessionRequest { mode: Mode::Rate, profile: profile(task, k), seconds: task.runs[k].seconds, seed: noise };
    Ok(simulate(&drawn(task, device).0, request, path)?)
}

/// Value and expanded uncertainty by the reference procedure; `None` where the plateaus do not determine the law.
pub(super) fn reference(task: &FrictionTask, logs: &[Log]) -> Option<BTreeMap<String, (f64, f64)>> {
    let (mut rates, mut torques) = (Vec::new(), Vec::new());
    for log in logs {
        let current = log.column("i_A")?;
        for plateau in plateaus(log, "rate_cmd_rad_s", SETTLE_S).iter().filter(|p| p.rate_rad_s.abs() > MIN_RATE_RAD_S) {
            rates.push(plateau.rate_rad_s);
            torques.push(task.motor_constant_N_m_A * plateau.mean(current));
        }
    }
    let (friction, fit) = fitted(&rates, &torques)?;
    let dof = rates.len() as f64 - 4.0;
    // A relative error of K or of the current is that of every torque; the Stribeck rate does not depend on it.
    let quantity = |name: &str, value: f64, k: usize, is_torque: bool| {
        let mut contributions = vec![Contribution::type_a("scatter", fit.sigma(k), dof, ())];
        if is_torque {
            for (source, percent) in [("motor constant", task.motor_constant_percent), ("current reading", task.current_percent)] {
                contributions.push(Contribution::rectangular(source, percent / 100.0, "1", value, ()));
            }
        }
        let quantity: Quantity<(), ()> = Quantity::new(name, "", value, contributions);
        (name.to_owned(), (value, quantity.expanded_u()))
    };
    Some(BTreeMap::from([
        quantity("coulomb_N_m", friction.coulomb_N_m, 0, true),
        quantity("viscous_N_m_s", friction.viscous_N_m_s, 1, true),
        quantity("stribeck_N_m", friction.stribeck_N_m, 2, true),
        quantity("stribeck_rate_rad_s", friction.stribeck_rate_rad_s, 3, false),
    ]))
}

/// The law that fits torques at constant rates best, with the least squares of its last step.
fn fitted(rates: &[f64], torques: &[f64]) -> Option<(Friction, LeastSquares)> {
    let start = |k: usize| {
        let part = k as f64 / (GRID_POINTS - 1) as f64;
        let stribeck_rate_rad_s = GRID_RAD_S.0 * (GRID_RAD_S.1 / GRID_RAD_S.0).powf(part);
        let unit = Friction { coulomb_N_m: 0.0, viscous_N_m_s: 0.0, stribeck_N_m: 1.0, stribeck_rate_rad_s };
        let rows: Vec<Vec<f64>> = rates.iter().map(|rate| unit.gradient(*rate)[..3].to_vec()).collect();
        let linear = least_squares(&rows, torques)?.coefficients;
        let friction = Friction { coulomb_N_m: linear[0], viscous_N_m_s: linear[1], stribeck_N_m: linear[2], stribeck_rate_rad_s };
        Some((sum_of_squares(&friction, rates, torques), friction))
    };
    let starts = (0..GRID_POINTS).filter_map(start);
    let (_, mut friction) = starts.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let mut last = None;
    for _ in 0..STEPS {
        let rows: Vec<Vec<f64>> = rates.iter().map(|rate| friction.gradient(*rate)).collect();
        let left: Vec<f64> = rates.iter().zip(torques).map(|(rate, torque)| torque - friction.torque_N_m(*rate)).collect();
        let step = least_squares(&rows, &left)?;
        friction.coulomb_N_m += step.coefficients[0];
        friction.viscous_N_m_s += step.coefficients[1];
        friction.stribeck_N_m += step.coefficients[2];
        friction.stribeck_rate_rad_s += step.coefficients[3];
        last = Some(step);
    }
    (friction.stribeck_rate_rad_s > 0.0).then_some(friction).zip(last)
}

fn sum_of_squares(friction: &Friction, rates: &[f64], torques: &[f64]) -> f64 {
    rates.iter().zip(torques).map(|(rate, torque)| (torque - friction.torque_N_m(*rate)).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_without_noise_is_found_again() {
        let law = Friction { coulomb_N_m: 9e-4, viscous_N_m_s: 2e-5, stribeck_N_m: 1e-3, stribeck_rate_rad_s: 1.5 };
        let rates: Vec<f64> = (1..=20).flat_map(|k| [0.5 * f64::from(k), -0.5 * f64::from(k)]).collect();
        let torques: Vec<f64> = rates.iter().map(|rate| law.torque_N_m(*rate)).collect();
        let (found, _) = fitted(&rates, &torques).expect("a fit");
        assert!((found.coulomb_N_m / law.coulomb_N_m - 1.0).abs() < 1e-9, "{found:?}");
        assert!((found.viscous_N_m_s / law.viscous_N_m_s - 1.0).abs() < 1e-9, "{found:?}");
        assert!((found.stribeck_N_m / law.stribeck_N_m - 1.0).abs() < 1e-9, "{found:?}");
        assert!((found.stribeck_rate_rad_s / law.stribeck_rate_rad_s - 1.0).abs() < 1e-9, "{found:?}");
    }
}
