//! The drive of the work on disturbances of once per turn: a torque of harmonic order 1, and an encoder whose error has the orders 1 and 2.
//!
//! The drive turns at constant voltages, three of each sign. With the true angle θ and rate ω, the kinetic energy follows the torque: ½ J
//! d(ω²)/dθ = a sin(θ + φ) − D ω + const, D = K²/R + b. The component of ω² at order n is therefore T_n + (2j/n) β W_n, with T_n = 2 m_n/(j
//! n J) by the torque's component m_n, β = D/J, and the component W_n of ω itself. The rate by the encoder is ω (1 + e′(θ)): its square has
//! an additional component 2 j n ε_n Ω², Ω² the mean of ω². The part that does not depend on the rate is the torque, the part that grows as
//! Ω² is the encoder; the damping changes its sign with the direction. The encoder's error is removed from angle and rate, and the fit is
//! repeated, so that products of both errors do not remain.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

use hal_sim::plant::Stand;
use hal_sim::session::SessionRequest;
use nalgebra::Complex;
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::Mode;

use super::LabError;
use super::course::OncePerTurnTask;
use super::draw::Draw;
use identification::log::Log;
use identification::statistics::least_squares::{LeastSquares, least_squares};
use identification::statistics::uncertainty::{Contribution, Quantity};
use stand_acquire::simulation::simulate;

/// Ranges of the true values. At the slowest rate the largest torque changes the rate by 5 %.
const TORQUE_N_M: (f64, f64) = (2e-4, 8e-4);
const ERROR_1_RAD: (f64, f64) = (3e-3, 1e-2);
const ERROR_2_RAD: (f64, f64) = (1.5e-3, 4e-3);
/// Phases, degrees: far from 0 and 360, which are one angle and two numbers.
const PHASE_DEG: (f64, f64) = (30.0, 330.0);
/// Half-width of friction and motor constant, %.
const FRICTION_PERCENT: f64 = 20.0;
const MOTOR_CONSTANT_PERCENT: f64 = 5.0;
/// Sectors of a turn.
const SECTORS: usize = 40;
/// Iterations of the true angle; each reduces the error by the factor e, below 1e-2.
const ANGLE_ITERATIONS: usize = 4;
/// Edges of the encoder in a turn. Its angle is that of the last edge, so that its zero is known to one count.
const COUNTS: f64 = 20_000.0;
/// Fits; each reduces the error of the angle by the factor e, below 1e-2.
const FITS: usize = 6;
/// Coefficients of an order: real and imaginary part of the torque and of the encoder's error. That of β is last.
const PER_ORDER: usize = 4;

/// Log files, in the order of [`OncePerTurnTask::voltages_V`], forward and backward.
pub(super) const LOGS: [&str; 6] = [
    "01-slow-forward.parquet",
    "02-slow-backward.parquet",
    "03-medium-forward.parquet",
    "04-medium-backward.parquet",
    "05-fast-forward.parquet",
    "06-fast-backward.parquet",
];

/// a sin(nθ + φ).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sine {
    amplitude: f64,
    phase_rad: f64,
}

/// The disturbances.
struct Disturbances {
    /// N m.
    torque: Sine,
    /// Orders 1 and 2, rad.
    errors: [Sine; 2],
}

/// The stand with this seed and its disturbances.
fn drawn(task: &OncePerTurnTask, seed: u64) -> (Stand, Disturbances) {
    let mut draw = Draw::new(seed);
    let mut sine = |range| Sine { amplitude: draw.between(range), phase_rad: draw.between(PHASE_DEG).to_radians() };
    let (torque, errors) = (sine(TORQUE_N_M), [sine(ERROR_1_RAD), sine(ERROR_2_RAD)]);
    let mut stand = Stand::default();
    stand.drive.inertia_kg_m2 = task.inertia_kg_m2 * draw.factor(task.inertia_percent);
    stand.drive.motor_constant_N_m_A *= draw.factor(MOTOR_CONSTANT_PERCENT);
    for value in stand.effects.values_mut().flat_map(|parameters| parameters.values_mut()) {
        *value *= draw.factor(FRICTION_PERCENT);
    }
    let added = [
        ("unbalance", vec![("unbalance_N_m", torque.amplitude), ("unbalance_phase_rad", torque.phase_rad)]),
        ("encoder-eccentricity", error_parameters(errors[0], 1.0)),
        ("encoder-eccentricity#2", error_parameters(errors[1], 2.0)),
    ];
    for (id, parameters) in added {
        stand.effects.insert(id.to_owned(), parameters.into_iter().map(|(name, value)| (name.to_owned(), value)).collect());
    }
    (stand, Disturbances { torque, errors })
}

fn error_parameters(error: Sine, order: f64) -> Vec<(&'static str, f64)> {
    vec![("eccentricity_rad", error.amplitude), ("eccentricity_order", order), ("eccentricity_phase_rad", error.phase_rad)]
}

/// Names of the quantities in the order of torque, error of order 1, error of order 2: amplitude, phase.
const NAMES: [[&str; 2]; 3] =
    [["torque_N_m", "torque_phase_deg"], ["error_1_rad", "error_1_phase_deg"], ["error_2_rad", "error_2_phase_deg"]];

/// True values by the names of the quantities.
pub(super) fn truth(task: &OncePerTurnTask, seed: u64) -> BTreeMap<String, f64> {
    let Disturbances { torque, errors } = drawn(task, seed).1;
    let sines = [torque, errors[0], errors[1]].into_iter().zip(NAMES);
    sines.flat_map(|(sine, [size, phase])| [(size.to_owned(), sine.amplitude), (phase.to_owned(), sine.phase_rad.to_degrees())]).collect()
}

/// Profile of log number `k` of [`LOGS`].
pub(super) fn profile(task: &OncePerTurnTask, k: usize) -> ProfileConfig {
    let voltage_V = task.voltages_V[k / 2] * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
    ProfileConfig::new(ProfileKind::Constant, voltage_V, 1)
}

/// Log number `k` of [`LOGS`], named `path`.
///
/// # Errors
/// The stand cannot be simulated.
pub(super) fn record(task: &OncePerTurnTask, k: usize, (device, noise): (u64, u64), path: &Path) -> Result<Log, LabError> {
    let request = SessionRequest { mode: Mode::Voltage, profile: profile(task, k), seconds: task.seconds, seed: noise };
    Ok(simulate(&drawn(task, device).0, request, path)?)
}

/// Rows of a log after settling.
struct Run(Vec<TurnRow>);

struct TurnRow {
    t_s: f64,
    /// Angle by the encoder, rad.
    theta: f64,
}

/// Components over the true angle, orders 0 to 2: ω = Σ W_n e^{jnθ}, ω² = Σ C_n e^{jnθ}.
struct Components {
    /// W_n, rad/s.
    rate: [Complex<f64>; 3],
    /// C_n, rad²/s².
    squared: [Complex<f64>; 3],
}

impl Run {
    fn of(log: &Log, settle_s: f64) -> Option<Self> {
        let rows = log.t_s().iter().zip(log.column("theta_rad")?).map(|(t_s, theta)| TurnRow { t_s: *t_s, theta: *theta });
        Some(Run(rows.filter(|row| row.t_s >= settle_s).collect()))
    }

    /// By the mean time in each sector of the turn, over whole turns, for an encoder with the errors Σ 2 Re ε_n (e^{jnθ} − 1): both angles
    /// are zero at the index. `None` for less than a turn.
    fn components(&self, errors: &[Complex<f64>; 2]) -> Option<Components> {
        let width = TAU / SECTORS as f64;
        let (first, last) = (self.0.first()?, self.0.last()?);
        let sign = (last.theta - first.theta).signum();
        let in_sectors = |shown: f64| {
            let mut theta = shown;
            for _ in 0..ANGLE_ITERATIONS {
                let turned = (1..).zip(errors).map(|(n, error)| 2.0 * (error * (Complex::cis(f64::from(n) * theta) - 1.0)).re);
                theta = shown - turned.sum::<f64>();
            }
            sign * theta / width
        };
        let mut before = (first.t_s, in_sectors(first.theta));
        let start = before.1.floor() + 1.0;
        let mut passed_s = Vec::new();
        for row in &self.0[1..] {
            let now = (row.t_s, in_sectors(row.theta));
            loop {
                let limit = start + passed_s.len() as f64;
                if now.1 < limit {
                    break;
                }
                passed_s.push(before.0 + (now.0 - before.0) * (limit - before.1) / (now.1 - before.1));
            }
            before = now;
        }
        let turns = passed_s.len().checked_sub(1)? / SECTORS;
        let zero = [Complex::new(0.0, 0.0); 3];
        let mut components = Components { rate: zero, squared: zero };
        for k in 0..SECTORS {
            let durations_s: f64 = (0..turns).map(|turn| passed_s[turn * SECTORS + k + 1] - passed_s[turn * SECTORS + k]).sum();
            let rate = sign * width * turns as f64 / durations_s;
            let middle = sign * (start + k as f64 + 0.5) * width;
            for (n, (of_rate, of_square)) in (0..).map(f64::from).zip(components.rate.iter_mut().zip(&mut components.squared)) {
                // The mean over a sector reduces a component.
                let half = 0.5 * n * width;
                let reduction = if half > 0.0 { half.sin() / half } else { 1.0 };
                let share = Complex::from_polar(1.0 / (reduction * SECTORS as f64), -n * middle);
                *of_rate += share * rate;
                *of_square += share * rate * rate;
            }
        }
        (turns > 0).then_some(components)
    }
}

/// Component of a sin(nθ + φ) at e^{jnθ}: a e^{jφ}/(2j). The amplitude and the phase from 0 to 2π of a component.
fn amplitude_and_phase(component: Complex<f64>) -> (f64, f64) {
    let phasor = component * Complex::new(0.0, 2.0);
    (phasor.norm(), phasor.arg().rem_euclid(TAU))
}

/// Value and expanded uncertainty by the reference procedure; `None` where the logs do not determine the disturbances.
pub(super) fn reference(task: &OncePerTurnTask, logs: &[Log]) -> Option<BTreeMap<String, (f64, f64)>> {
    let runs = logs.iter().map(|log| Run::of(log, task.settle_s)).collect::<Option<Vec<_>>>()?;
    let mut errors = [Complex::new(0.0, 0.0); 2];
    let mut last = None;
    for _ in 0..FITS {
        let components = runs.iter().map(|run| run.components(&errors)).collect::<Option<Vec<_>>>()?;
        let fit = fitted(&components)?;
        for (error, found) in errors.iter_mut().zip(fit.coefficients.chunks(PER_ORDER)) {
            *error += Complex::new(found[2], found[3]);
        }
        last = Some(fit);
    }
    let fit = last?;
    let torque = Complex::new(fit.coefficients[0], fit.coefficients[1]);
    // m₁ of T₁.
    let torque_component = torque * Complex::new(0.0, 0.5 * task.inertia_kg_m2);
    let mut result = BTreeMap::new();
    for (k, component) in [torque_component, errors[0], errors[1]].into_iter().enumerate() {
        let (amplitude, phase_rad) = amplitude_and_phase(component);
        // Amplitude and phase change along and across the component.
        let (first, coefficient) = if k == 0 { (0, torque) } else { (PER_ORDER * (k - 1) + 2, component) };
        let unit = coefficient / coefficient.norm();
        let sigma = |along: Complex<f64>| {
            let mut gradient = vec![0.0; first + 2];
            (gradient[first], gradient[first + 1]) = (along.re, along.im);
            fit.sigma_of(&gradient) / coefficient.norm()
        };
        let mut budget = vec![Contribution::type_a("fit", amplitude * sigma(unit), fit.dof, ())];
        if k == 0 {
            budget.push(Contribution::rectangular("inertia", task.inertia_percent / 100.0, "1", amplitude, ()));
        }
        let size: Quantity<(), ()> = Quantity::new(NAMES[k][0], "", amplitude, budget);
        let across = sigma(unit * Complex::i()).to_degrees();
        let count_deg = 360.0 / COUNTS * if k == 2 { 2.0 } else { 1.0 };
        let budget =
            vec![Contribution::type_a("fit", across, fit.dof, ()), Contribution::rectangular("resolution", count_deg, "", 1.0, ())];
        let phase: Quantity<(), ()> = Quantity::new(NAMES[k][1], "deg", phase_rad.to_degrees(), budget);
        for quantity in [size, phase] {
            result.insert(quantity.name.clone(), (quantity.value, quantity.expanded_u()));
        }
    }
    Some(result)
}

/// Fits T_n, ε_n and β to the components of all runs. Rows are in the unit of an angle, in which the encoder's resolution is the same at
/// every rate.
fn fitted(runs: &[Components]) -> Option<LeastSquares> {
    let (mut rows, mut values) = (Vec::new(), Vec::new());
    for run in runs {
        let mean = run.squared[0].re;
        for n in 1..run.squared.len() {
            let order = n as f64;
            let columns = [
                Complex::new(1.0 / mean, 0.0),
                Complex::new(0.0, 1.0 / mean),
                Complex::new(0.0, 2.0 * order),
                Complex::new(-2.0 * order, 0.0),
                run.rate[n] * Complex::new(0.0, 2.0 / order) / mean,
            ];
            for part in [|z: &Complex<f64>| z.re, |z: &Complex<f64>| z.im] {
                let mut row = vec![0.0; PER_ORDER * (run.squared.len() - 1) + 1];
                for (k, column) in columns.iter().enumerate() {
                    let place = if k < PER_ORDER { PER_ORDER * (n - 1) + k } else { row.len() - 1 };
                    row[place] = part(column);
                }
                rows.push(row);
                values.push(part(&(run.squared[n] / mean)));
            }
        }
    }
    least_squares(&rows, &values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phase_of_a_component_is_that_of_the_sine() {
        for (amplitude, phase) in [(2.0, 0.5), (0.3, 3.0), (1.0, 6.0)] {
            let component = Complex::from_polar(amplitude, phase) / Complex::new(0.0, 2.0);
            let (found, angle) = amplitude_and_phase(component);
            assert!((found - amplitude).abs() < 1e-12 && (angle - phase).abs() < 1e-12);
        }
    }
}
