//! What an observer's errors do: alone, and in the closed loop of a regulator by the incomplete state vector (theory §1.4, §1.5).
//!
//! Errors follow e′ = (A − K C) e − e_r κ z + B M, z′ = C e, whatever the plant does. The exponential over one step is worked out in 77 digits
//! and rounded, so that a value after thousands of steps is good to nine.

use super::design::Design;
use super::discrete::held;
use super::exact::Matrix;
use crate::statistics::Extremes;

/// Errors over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Times, s.
    pub t_s: Vec<f64>,
    /// True minus estimated, a state in each column.
    pub errors: Vec<Vec<f64>>,
    /// Estimated moment, N m; 0 of a static observer.
    pub moment_N_m: Vec<f64>,
}

/// What is done to an observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disturbed {
    /// Error of the estimated angle at first, rad.
    pub angle_rad: f64,
    /// Moment from t = 0 on, N m.
    pub moment_N_m: f64,
}

/// A regulator M_K = −r₁ α̂ − r₂ α̂′, and − M̂ where the moment is fed forward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regulated {
    /// r₁, N m/rad.
    pub angle_N_m_rad: f64,
    /// r₂, N m s/rad.
    pub rate_N_m_s_rad: f64,
}

/// Where the closed loop begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Angle at first, rad; the observer begins at it.
    pub angle_rad: f64,
    /// Moment from t = 0 on, N m.
    pub moment_N_m: f64,
    /// From then on the loop is closed, s.
    pub closed_from_s: f64,
}

/// One observer, simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    /// With the initial error and the moment.
    pub both: Trace,
    /// With the moment alone.
    pub moment_only: Trace,
    /// From when on the angle's error stays below 1 % of the initial one, s.
    pub settled_s: Option<f64>,
    /// From when on the rate's error stays below 1 % of its own greatest, s.
    pub rate_settled_s: Option<f64>,
    /// Greatest error of the angle, rad, and of the rate, rad/s.
    pub greatest: [f64; 2],
    /// Where the errors end under the moment.
    pub rest: Vec<f64>,
    /// In the closed loop: times, s, and angles, rad.
    pub closed: Option<(Vec<f64>, Vec<f64>)>,
    /// Where the angle of the closed loop ends, rad.
    pub closed_rest_rad: Option<f64>,
}

impl Trace {
    /// The row nearest to a time.
    pub fn at(&self, t_s: f64) -> (&[f64], f64) {
        let k = self.t_s.iter().position(|t| *t >= t_s - 1e-9).unwrap_or(self.t_s.len() - 1);
        (&self.errors[k], self.moment_N_m[k])
    }
}

impl Design {
    /// Simulates the observer for `seconds`, a row every `step_s`.
    pub fn simulate(&self, disturbed: Disturbed, seconds: f64, step_s: f64) -> Simulated {
        let both = self.errors(disturbed, seconds, step_s);
        let moment_only = self.errors(Disturbed { angle_rad: 0.0, ..disturbed }, seconds, step_s);
        let column = |trace: &Trace, k: usize| -> Vec<f64> { trace.errors.iter().map(|e| e[k].abs()).collect() };
        let (angle, rate) = (column(&both, 0), column(&both, 1));
        let greatest = [&angle, &rate].map(|of| of.iter().copied().max_or_zero());
        let settled = |of: &[f64], band: f64| match of.iter().rposition(|e| *e > band) {
            None => Some(0.0),
            Some(k) => both.t_s.get(k + 1).copied(),
        };
        Simulated {
            settled_s: settled(&angle, 0.01 * disturbed.angle_rad.abs()),
            rate_settled_s: settled(&rate, 0.01 * greatest[1]),
            greatest,
            rest: self.rest(disturbed.moment_N_m),
            both,
            moment_only,
            closed: None,
            closed_rest_rad: None,
        }
    }

    /// Errors from these beginnings.
    pub fn errors(&self, disturbed: Disturbed, seconds: f64, step_s: f64) -> Trace {
        let (matrix, input) = self.error_system(disturbed.moment_N_m);
        let n = self.gains.len();
        let mut state = vec![0.0; matrix.len()];
        state[0] = disturbed.angle_rad;
        let rows = walk(&matrix, &input, state, seconds, step_s);
        let scale = self.integral.map_or(0.0, |channel| channel.moment_per_integral);
        let t_s = (0..rows.len()).map(|k| k as f64 * step_s).collect();
        let moment_N_m = rows.iter().map(|row| row.get(n).map_or(0.0, |z| scale * z)).collect();
        Trace { t_s, errors: rows.into_iter().map(|mut row| (row.truncate(n), row).1).collect(), moment_N_m }
    }

    /// The errors' matrix, the integral as the last state, and what a moment puts in.
    fn error_system(&self, moment_N_m: f64) -> (Vec<Vec<f64>>, Vec<f64>) {
        let n = self.gains.len();
        let (mut matrix, _) = self.observer();
        // For errors the integral acts the other way about: x̂ gains what e loses.
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

    /// Where errors end under a constant moment: e₁ = M d f/(J ω⁶) of a static observer with equal poles (theory §1.4).
    fn rest(&self, moment_N_m: f64) -> Vec<f64> {
        let (matrix, input) = self.error_system(moment_N_m);
        let mut rest = at_rest(&matrix, &input);
        rest.truncate(self.gains.len());
        rest
    }

    /// The angle in the closed loop, and where it ends; with the estimated moment fed forward if there is one. The loop is closed from
    /// `start.closed_from_s` on.
    pub fn regulate(&self, regulated: Regulated, start: Start, seconds: f64, step_s: f64) -> (Vec<f64>, Vec<f64>, f64) {
        let n = self.gains.len();
        let open = self.loop_matrix(None);
        let closed = self.loop_matrix(Some(regulated));
        let moment: Vec<f64> = self.request.plant.b().iter().map(|b| b * start.moment_N_m).collect();
        // Plant, errors, integral: the moment acts on plant and errors alike.
        let input: Vec<f64> = moment.iter().chain(&moment).copied().chain(self.integral.map(|_| 0.0)).collect();
        let mut state = vec![0.0; input.len()];
        state[0] = start.angle_rad;
        let before = walk(&open, &input, state, start.closed_from_s.min(seconds), step_s);
        let last = before.last().cloned().unwrap_or_else(|| vec![0.0; input.len()]);
        let after = walk(&closed, &input, last, seconds - start.closed_from_s, step_s);
        let angles: Vec<f64> = before.iter().chain(after.iter().skip(1)).map(|row| row[0]).collect();
        let t_s = (0..angles.len()).map(|k| k as f64 * step_s).collect();
        let rest = at_rest(&closed, &input);
        debug_assert_eq!(rest.len(), 2 * n + usize::from(self.integral.is_some()));
        (t_s, angles, rest[0])
    }

    /// x′ = A x − B (R (x − e) + M̂) + B M; the errors as alone.
    fn loop_matrix(&self, regulated: Option<Regulated>) -> Vec<Vec<f64>> {
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

/// x′ = `matrix` x + `input` from `state`, a row every step, the first included.
fn walk(matrix: &[Vec<f64>], input: &[f64], state: Vec<f64>, seconds: f64, step_s: f64) -> Vec<Vec<f64>> {
    let (phi, gamma) = held(&Matrix::of(matrix), input, step_s);
    let phi = phi.rounded();
    let steps = (seconds / step_s).round().max(0.0) as usize;
    let mut rows = Vec::with_capacity(steps + 1);
    rows.push(state);
    for k in 0..steps {
        let before = &rows[k];
        let next = phi.iter().zip(&gamma).map(|(row, gamma)| row.iter().zip(before).map(|(p, x)| p * x).sum::<f64>() + gamma).collect();
        rows.push(next);
    }
    rows
}

/// Where `matrix` x + `input` = 0; no numbers where that is nowhere.
fn at_rest(matrix: &[Vec<f64>], input: &[f64]) -> Vec<f64> {
    let right: Vec<_> = input.iter().map(|x| super::exact::exact(-x)).collect();
    let x = Matrix::of(matrix).solve(&right);
    x.map_or_else(|| vec![f64::NAN; input.len()], |x| x.iter().map(super::exact::rounded).collect())
}
