//! Estimation errors of an observer alone and in a closed loop with a regulator (docs/theory.md §1.4, §1.5).
//!
//! Errors follow e′ = (A − K C) e − e_r κ z + B M, z′ = C e, independent of the motion of the plant. The matrix exponential of one step is
//! computed with 77 digits and rounded, so that values after thousands of steps are accurate to nine digits.

use super::ObserverError;
use super::closed_loop::{Regulator, closed_loop_poles, has_steady_state};
use super::design::Design;
use super::discrete::held;
use super::exact::Matrix;
use super::moment::Moment;
use identification::statistics::Extremes;
use nalgebra::Complex;

/// Errors over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Times, s.
    pub t_s: Vec<f64>,
    /// Estimation error, true − estimated: one row per time, one column per state.
    pub errors: Vec<Vec<f64>>,
    /// Estimated moment, N m; 0 for a static observer.
    pub moment_N_m: Vec<f64>,
    /// Applied moment, N m.
    pub applied_N_m: Vec<f64>,
}

/// Initial error and disturbance of a simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disturbance {
    /// Initial error of the estimated angle, rad.
    pub angle_rad: f64,
    /// Moment from t = 0.
    pub moment: Moment,
}

/// Start of a closed-loop simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Initial angle, rad; the observer starts at this angle.
    pub angle_rad: f64,
    /// Moment from t = 0.
    pub moment: Moment,
    /// Time at which the loop is closed, s.
    pub closed_from_s: f64,
}

/// Simulation of one observer.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    /// Errors with the initial error and the moment.
    pub both: Trace,
    /// Errors with the moment alone.
    pub moment_only: Trace,
    /// Time after which the angle error stays below 1 % of its initial value, s.
    pub settled_s: Option<f64>,
    /// Time after which the rate error stays below 1 % of its maximum, s.
    pub rate_settled_s: Option<f64>,
    /// Largest angle error, rad, and rate error, rad/s.
    pub largest: [f64; 2],
    /// Errors at the end of the simulation, with the initial error and the moment.
    pub at_end: Vec<f64>,
    /// Rms angle error, rad, and rate error, rad/s, over the second half of the simulation.
    pub rms_second_half: [f64; 2],
    /// Steady-state errors under the constant part of the moment, for t → ∞.
    pub steady: Vec<f64>,
    /// Closed loop.
    pub closed: Option<ClosedTrace>,
}

/// A closed loop over time.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedTrace {
    /// Times, s.
    pub t_s: Vec<f64>,
    /// Angles, rad.
    pub angle_rad: Vec<f64>,
    /// Time at which the loop is closed, s.
    pub closed_from_s: f64,
    /// Poles of element and regulator, slowest first, 1/s.
    pub poles: Vec<Complex<f64>>,
    /// Steady angle for t → ∞ under the constant moment, rad; `None` if the loop is not damped.
    pub steady_rad: Option<f64>,
}

/// A static and an astatic observer of one element under the same disturbance.
pub struct SideBySide<'a> {
    /// The designs.
    pub designs: [&'a Design; 2],
    /// The simulations.
    pub runs: [&'a Simulated; 2],
    /// Initial error and disturbance.
    pub disturbed: Disturbance,
}

impl Trace {
    /// The row nearest to a time.
    pub fn at(&self, t_s: f64) -> (&[f64], f64) {
        let k = self.t_s.iter().position(|t| *t >= t_s - 1e-9).unwrap_or(self.t_s.len() - 1);
        (&self.errors[k], self.moment_N_m[k])
    }
}

impl Design {
    /// Simulates the observer for `seconds` with one row per `step_s`.
    pub fn simulate(&self, disturbed: Disturbance, seconds: f64, step_s: f64) -> Simulated {
        let both = self.errors(disturbed, seconds, step_s);
        let moment_only = self.errors(Disturbance { angle_rad: 0.0, ..disturbed }, seconds, step_s);
        let column = |trace: &Trace, k: usize| -> Vec<f64> { trace.errors.iter().map(|e| e[k].abs()).collect() };
        let (angle, rate) = (column(&both, 0), column(&both, 1));
        let largest = [&angle, &rate].map(|of| of.iter().copied().max_or_zero());
        let settled = |of: &[f64], band: f64| match of.iter().rposition(|e| *e > band) {
            None => Some(0.0),
            Some(k) => both.t_s.get(k + 1).copied(),
        };
        let half = both.errors.len() / 2;
        let rms = |k: usize| {
            let squares: f64 = both.errors[half..].iter().map(|e| e[k] * e[k]).sum();
            (squares / (both.errors.len() - half) as f64).sqrt()
        };
        Simulated {
            at_end: both.errors.last().cloned().unwrap_or_default(),
            rms_second_half: [rms(0), rms(1)],
            settled_s: settled(&angle, 0.01 * disturbed.angle_rad.abs()),
            rate_settled_s: settled(&rate, 0.01 * largest[1]),
            largest,
            steady: self.steady_errors(disturbed.moment.constant_N_m),
            both,
            moment_only,
            closed: None,
        }
    }

    /// Estimation errors from the given initial error.
    pub fn errors(&self, disturbed: Disturbance, seconds: f64, step_s: f64) -> Trace {
        let (matrix, input) = self.error_system(1.0);
        let n = self.gains.len();
        let mut state = vec![0.0; matrix.len()];
        state[0] = disturbed.angle_rad;
        let moments = disturbed.moment.series(steps(seconds, step_s) + 1, step_s);
        let rows = propagate(&matrix, &input, state, &moments[..moments.len() - 1], step_s);
        let scale = self.integral.map_or(0.0, |channel| channel.moment_per_integral);
        let t_s = (0..rows.len()).map(|k| k as f64 * step_s).collect();
        let moment_N_m = rows.iter().map(|row| row.get(n).map_or(0.0, |z| scale * z)).collect();
        Trace { t_s, errors: rows.into_iter().map(|mut row| (row.truncate(n), row).1).collect(), moment_N_m, applied_N_m: moments }
    }

    /// Matrix of the error system, with the integral as the last state, and its input from a moment.
    fn error_system(&self, moment_N_m: f64) -> (Vec<Vec<f64>>, Vec<f64>) {
        let n = self.gains.len();
        let (mut matrix, _) = self.observer();
        // The integral acts on the error with the opposite sign: x̂ gains what e loses.
        if self.integral.is_some() {
            for row in matrix.iter_mut().take(n) {
                row[n] = -row[n];
            }
            matrix[n][0] = 1.0;
        }
        let mut input: Vec<f64> = self.request.plant.b().iter().map(|b| b * moment_N_m).collect();
        input.resize(matrix.len(), 0.0);
        (matrix, input)
    }

    /// Steady errors under a constant moment: e₁ = M d f/(J ω⁶) for a static observer with equal poles (docs/theory.md §1.4).
    fn steady_errors(&self, moment_N_m: f64) -> Vec<f64> {
        let (matrix, input) = self.error_system(moment_N_m);
        let mut steady = equilibrium(&matrix, &input);
        steady.truncate(self.gains.len());
        steady
    }

    /// Simulates the closed loop. An estimated moment is fed forward. The loop is closed at `start.closed_from_s`.
    ///
    /// # Errors
    /// The closed loop is unstable.
    pub fn regulate(&self, regulated: Regulator, start: Start, seconds: f64, step_s: f64) -> Result<ClosedTrace, ObserverError> {
        let poles = closed_loop_poles(&self.request.plant, regulated)?;
        let n = self.gains.len();
        let open = self.loop_matrix(None);
        let closed = self.loop_matrix(Some(regulated));
        let moment = self.request.plant.b();
        // State: plant, errors, integral. The moment acts on plant and errors alike.
        let input: Vec<f64> = moment.iter().chain(&moment).copied().chain(self.integral.map(|_| 0.0)).collect();
        let mut state = vec![0.0; input.len()];
        state[0] = start.angle_rad;
        let open_steps = steps(start.closed_from_s.min(seconds), step_s);
        let moments = start.moment.series(open_steps + steps(seconds - start.closed_from_s, step_s), step_s);
        let before = propagate(&open, &input, state, &moments[..open_steps], step_s);
        let last = before.last().cloned().unwrap_or_else(|| vec![0.0; input.len()]);
        let after = propagate(&closed, &input, last, &moments[open_steps..], step_s);
        let angle_rad: Vec<f64> = before.iter().chain(after.iter().skip(1)).map(|row| row[0]).collect();
        let t_s = (0..angle_rad.len()).map(|k| k as f64 * step_s).collect();
        let constant: Vec<f64> = input.iter().map(|input| input * start.moment.constant_N_m).collect();
        let steady = equilibrium(&closed, &constant);
        debug_assert_eq!(steady.len(), 2 * n + usize::from(self.integral.is_some()));
        let steady_rad = has_steady_state(&poles).then(|| steady[0]);
        Ok(ClosedTrace { t_s, angle_rad, closed_from_s: start.closed_from_s, poles, steady_rad })
    }

    /// Matrix of x′ = A x − B (R (x − e) + M̂) + B M together with the error system.
    fn loop_matrix(&self, regulated: Option<Regulator>) -> Vec<Vec<f64>> {
        let n = self.gains.len();
        let (a, b) = (self.request.plant.a(), self.request.plant.b());
        let (errors, _) = self.error_system(0.0);
        let mut gains = vec![0.0; n];
        let mut forward = 0.0;
        if let Some(r) = regulated {
            (gains[0], gains[1]) = (r.angle_N_m_rad, r.rate_N_m_s_rad);
            forward = self.integral.map_or(0.0, |channel| channel.moment_per_integral);
        }
        let size = n + errors.len();
        (0..size)
            .map(|i| {
                (0..size)
                    .map(|j| match (i < n, j < n) {
                        (true, true) => a[i][j] - b[i] * gains[j],
                        (true, false) if j < 2 * n => b[i] * gains[j - n],
                        (true, false) => -b[i] * forward,
                        (false, true) => 0.0,
                        (false, false) => errors[i - n][j - n],
                    })
                    .collect()
            })
            .collect()
    }
}

/// Number of steps.
fn steps(seconds: f64, step_s: f64) -> usize {
    (seconds / step_s).round().max(0.0) as usize
}

/// Solution of x′ = `matrix` x + `input` u from `state`, with u of each step: one row per step, the initial state included.
fn propagate(matrix: &[Vec<f64>], input: &[f64], state: Vec<f64>, u: &[f64], step_s: f64) -> Vec<Vec<f64>> {
    let (phi, gamma) = held(&Matrix::of(matrix), input, step_s);
    let phi = phi.rounded();
    let mut rows = Vec::with_capacity(u.len() + 1);
    rows.push(state);
    for (k, u) in u.iter().enumerate() {
        let before = &rows[k];
        let next = phi.iter().zip(&gamma).map(|(row, gamma)| row.iter().zip(before).map(|(p, x)| p * x).sum::<f64>() + gamma * u).collect();
        rows.push(next);
    }
    rows
}

/// Solution of `matrix` x + `input` = 0; NaN if the matrix is singular.
fn equilibrium(matrix: &[Vec<f64>], input: &[f64]) -> Vec<f64> {
    let right: Vec<_> = input.iter().map(|x| super::exact::exact(-x)).collect();
    let x = Matrix::of(matrix).solve(&right);
    x.map_or_else(|| vec![f64::NAN; input.len()], |x| x.iter().map(super::exact::rounded).collect())
}
