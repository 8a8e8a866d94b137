//! How sure: the likelihood of whitened residuals, its probability by chance, and the price of parameters.
//!
//! Two models of one log are compared by n ln(RSS₀/RSS₁) per channel, the likelihood ratio where the noise's size is not known. Residuals
//! that remember are no independent witnesses, so both series first pass the same whitening filter, an autoregression fitted to the residuals
//! of the better model, and each model is taken at the parameters that suit the whitened residuals (generalised least squares). Increments and rates made from an encoder overlap: of those only every m-th is a witness.

use std::collections::VecDeque;
use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::identify::fit::normal_equations::InitialStates;
use crate::identify::fit::parameters::Dual;
use crate::identify::fit::simulate::{LawScalar, System, run};
use crate::identify::fit::{self, Parameters, PreparedLog};
use crate::statistics::distributions::ln_chi_squared_tail;

/// Most coefficients of a whitening filter, and rows that each of them needs.
const MOST_COEFFICIENTS: usize = 20;
const ROWS_PER_COEFFICIENT: usize = 50;
/// Relative floor of a sum of squares, so that a perfect model has a likelihood.
const FLOOR: f64 = 1e-12;

/// A whitening filter per channel.
pub struct Whitener {
    channels: Vec<Channel>,
}

struct Channel {
    /// Every so many rows are one witness.
    stride: usize,
    coefficients: Vec<f64>,
}

/// Whitened sums of squares of one model.
#[derive(Debug, Clone)]
pub struct Squares {
    /// Per channel and log: (sum, witnesses) of the fitted rows.
    fitted: Vec<Vec<(f64, f64)>>,
    /// The same of the held-out rows.
    held_out: Vec<Vec<(f64, f64)>>,
}

impl Whitener {
    /// The filter that whitens these residuals (per channel, a value per row).
    pub fn of(record: &PreparedLog, residuals: &[&[f64]]) -> Self {
        let channels = residuals
            .iter()
            .enumerate()
            .map(|(c, residual)| {
                let stride = fit::differencing_rows(record, c).max(1);
                let mut covariances = [0.0; MOST_COEFFICIENTS + 1];
                let mut n = 0usize;
                for run in runs(record, residual, stride) {
                    for (k, a) in run.iter().enumerate() {
                        n += 1;
                        for (lag, sum) in covariances.iter_mut().enumerate().take(k + 1) {
                            *sum += a * run[k - lag];
                        }
                    }
                }
                let most = MOST_COEFFICIENTS.min(n / ROWS_PER_COEFFICIENT);
                Channel { stride, coefficients: autoregression(&covariances[..=most], n) }
            })
            .collect();
        Whitener { channels }
    }

    /// Whitened sums of squares of a model on each of the `logs` (their rows), at the parameters that suit the whitened residuals best.
    ///
    /// The model was fitted to the residuals as they are. Where they remember, other parameters leave less of the whitened ones; one step of the
    /// linear model goes there, for every model alike.
    pub fn squares(
        &self,
        system: &System,
        parameters: &Parameters,
        starts: &InitialStates,
        record: &PreparedLog,
        logs: &[Range<usize>],
    ) -> Squares {
        match parameters.free().len() + starts.kinds.len() {
            0..=8 => self.squares_in::<8>(system, parameters, starts, record, logs),
            9..=12 => self.squares_in::<12>(system, parameters, starts, record, logs),
            13..=16 => self.squares_in::<16>(system, parameters, starts, record, logs),
            _ => self.squares_in::<32>(system, parameters, starts, record, logs),
        }
    }

    fn squares_in<const N: usize>(
        &self,
        system: &System,
        parameters: &Parameters,
        starts: &InitialStates,
        record: &PreparedLog,
        logs: &[Range<usize>],
    ) -> Squares
    where
        Dual<N>: LawScalar,
    {
        let rig = system.rig::<Dual<N>>(parameters, record.driven);
        let free = parameters.free().len();
        let lanes = free + starts.kinds.len();
        let mut cells: Vec<Cell<N>> = Vec::new();
        let mut key: Vec<(usize, usize, bool, usize)> = Vec::new();
        for (segment, rows) in record.segments.iter().enumerate() {
            let Some(log) = logs.iter().position(|l| l.contains(&rows.start)) else { continue };
            let first = cells.len();
            for channel in 0..self.channels.len() {
                for held in [false, true] {
                    cells.push(Cell::new());
                    key.push((channel, log, held, segment));
                }
            }
            let mut past: Vec<VecDeque<(f64, [f64; N])>> = vec![VecDeque::new(); self.channels.len()];
            run(&rig, record, segment, (&starts.kinds, &starts.values[segment]), free, &mut |c, row, value: &Dual<N>| {
                let filter = &self.channels[c];
                if !(row - rows.start).is_multiple_of(filter.stride) {
                    return true;
                }
                let Some(target) = record.target(c, row, rows.start).filter(|_| value.re.is_finite()) else { return true };
                let residual = target - value.re;
                let mut slopes = [0.0; N];
                if let Some(eps) = value.eps.0.as_ref() {
                    slopes.copy_from_slice(eps.as_slice());
                }
                let p = filter.coefficients.len();
                let queue = &mut past[c];
                if queue.len() >= p {
                    let (mut e, mut d) = (residual, slopes);
                    for (a, (r, s)) in filter.coefficients.iter().zip(queue.iter().rev()) {
                        e -= a * r;
                        for n in 0..N {
                            d[n] -= a * s[n];
                        }
                    }
                    cells[first + 2 * c + usize::from(record.held_out(row))].add(e, &d);
                }
                if p > 0 {
                    if queue.len() == p {
                        queue.pop_front();
                    }
                    queue.push_back((residual, slopes));
                }
                true
            });
        }
        let steps = self.steps(&cells, &key, free, lanes, record.segments.len());
        let mut fitted = vec![vec![(0.0, 0.0); logs.len()]; self.channels.len()];
        let mut held_out = fitted.clone();
        for (cell, &(channel, log, held, segment)) in cells.iter().zip(&key) {
            let sums = if held { &mut held_out } else { &mut fitted };
            let after = steps.as_ref().map_or(cell.square, |steps| cell.after(&steps[segment], lanes));
            let sum = &mut sums[channel][log];
            sum.0 += after.max(0.0);
            sum.1 += cell.rows;
        }
        Squares { fitted, held_out }
    }

    /// The step of each segment's lanes that is best for the fitted rows, every channel weighted by its own whitened size; `None` where it is
    /// not determined, or would go further than the linear model can be believed.
    fn steps<const N: usize>(
        &self,
        cells: &[Cell<N>],
        key: &[(usize, usize, bool, usize)],
        free: usize,
        lanes: usize,
        segments: usize,
    ) -> Option<Vec<Vec<f64>>> {
        let mut sizes = vec![(0.0, 0.0); self.channels.len()];
        for (cell, k) in cells.iter().zip(key).filter(|(_, k)| !k.2) {
            sizes[k.0].0 += cell.square;
            sizes[k.0].1 += cell.rows;
        }
        let states = lanes - free;
        let whole = free + states * segments;
        let mut information = DMatrix::<f64>::zeros(whole, whole);
        let mut gradient = DVector::<f64>::zeros(whole);
        let place = |lane: usize, segment: usize| if lane < free { lane } else { free + segment * states + lane - free };
        for (cell, k) in cells.iter().zip(key).filter(|(_, k)| !k.2) {
            let weight = sizes[k.0].1 / sizes[k.0].0.max(f64::MIN_POSITIVE);
            for i in 0..lanes {
                gradient[place(i, k.3)] += weight * cell.g[i];
                for j in 0..lanes {
                    information[(place(i, k.3), place(j, k.3))] += weight * cell.h[i][j];
                }
            }
        }
        for k in 0..whole {
            let d = information[(k, k)];
            information[(k, k)] = if d > 0.0 { d * (1.0 + 1e-9) } else { 1.0 };
        }
        let step = Cholesky::new(information)?.solve(&gradient);
        step.iter().all(|s| s.is_finite()).then(|| (0..segments).map(|s| (0..lanes).map(|lane| step[place(lane, s)]).collect()).collect())
    }
}

/// Whitened sums of one channel on one segment, fitted or held out.
struct Cell<const N: usize> {
    square: f64,
    rows: f64,
    g: [f64; N],
    h: [[f64; N]; N],
}

impl<const N: usize> Cell<N> {
    fn new() -> Self {
        Cell { square: 0.0, rows: 0.0, g: [0.0; N], h: [[0.0; N]; N] }
    }

    fn add(&mut self, e: f64, d: &[f64; N]) {
        self.square += e * e;
        self.rows += 1.0;
        for i in 0..N {
            self.g[i] += d[i] * e;
            for j in 0..N {
                self.h[i][j] += d[i] * d[j];
            }
        }
    }

    /// Sum of squares after a step of the lanes, by the linear model.
    fn after(&self, step: &[f64], lanes: usize) -> f64 {
        let mut square = self.square;
        for i in 0..lanes {
            square -= 2.0 * self.g[i] * step[i];
            for j in 0..lanes {
                square += step[i] * self.h[i][j] * step[j];
            }
        }
        square
    }
}

/// Runs of finite values, every `stride`-th row of a segment.
fn runs(record: &PreparedLog, residual: &[f64], stride: usize) -> Vec<Vec<f64>> {
    let mut list = Vec::new();
    for rows in &record.segments {
        let mut run = Vec::new();
        for row in rows.clone().step_by(stride) {
            if residual[row].is_finite() {
                run.push(residual[row]);
            } else if !run.is_empty() {
                list.push(std::mem::take(&mut run));
            }
        }
        list.push(run);
    }
    list
}

/// Levinson and Durbin's recursion on sums of products, at the order with the smallest BIC.
fn autoregression(covariances: &[f64], n: usize) -> Vec<f64> {
    let Some(&power) = covariances.first().filter(|p| **p > 0.0) else { return Vec::new() };
    let mut coefficients: Vec<f64> = Vec::new();
    let mut innovation = power;
    let mut best = (0.0, Vec::new());
    for lag in 1..covariances.len() {
        let predicted: f64 = coefficients.iter().enumerate().map(|(k, a)| a * covariances[lag - 1 - k]).sum();
        let reflection = (covariances[lag] - predicted) / innovation;
        if !reflection.is_finite() || reflection.abs() >= 1.0 {
            break;
        }
        let before = coefficients.clone();
        for k in 0..lag - 1 {
            coefficients[k] = before[k] - reflection * before[lag - 2 - k];
        }
        coefficients.push(reflection);
        innovation *= 1.0 - reflection * reflection;
        let bic = n as f64 * (innovation / power).ln() + lag as f64 * (n.max(2) as f64).ln();
        if bic < best.0 {
            best = (bic, coefficients.clone());
        }
    }
    best.1
}

fn likelihood(before: &[Vec<(f64, f64)>], after: &[Vec<(f64, f64)>], log: Option<usize>) -> f64 {
    before
        .iter()
        .zip(after)
        .map(|(b, a)| {
            let sum = |list: &[(f64, f64)]| {
                list.iter().enumerate().filter(|(k, _)| log.is_none_or(|l| l == *k)).fold((0.0, 0.0), |(s, n), (_, (q, m))| (s + q, n + m))
            };
            let ((b, n), (a, _)) = (sum(b), sum(a));
            let floor = FLOOR * b.max(a);
            if n > 0.0 && floor > 0.0 { n * (b.max(floor) / a.max(floor)).ln() } else { 0.0 }
        })
        .sum()
}

impl Squares {
    /// Twice the logarithm of the likelihood ratio of `after` to this one, over the fitted rows.
    pub fn gain(&self, after: &Squares) -> f64 {
        likelihood(&self.fitted, &after.fitted, None)
    }

    /// The same over the rows that no fit saw; 0 where nothing was held out.
    pub fn held_out_gain(&self, after: &Squares) -> f64 {
        likelihood(&self.held_out, &after.held_out, None)
    }

    /// Twice the logarithm of the likelihood ratio on one log alone, fitted and held-out rows together.
    pub fn gain_on(&self, after: &Squares, log: usize) -> f64 {
        likelihood(&self.fitted, &after.fitted, Some(log)) + likelihood(&self.held_out, &after.held_out, Some(log))
    }

    /// There are rows that no fit saw.
    pub fn holds_rows_out(&self) -> bool {
        self.held_out.iter().flatten().any(|(_, n)| *n > 0.0)
    }

    /// Witnesses among the fitted rows.
    pub fn witnesses(&self) -> f64 {
        self.fitted.iter().flatten().map(|(_, n)| n).sum()
    }
}

/// BIC with `parameters` more, minus that without, at a likelihood gain.
pub fn delta_bic(gain: f64, parameters: usize, witnesses: f64) -> f64 {
    parameters as f64 * witnesses.max(2.0).ln() - gain
}

/// Natural logarithm of P(χ²_k > x), also where the probability is no number any more.
pub fn ln_chance(x: f64, k: usize) -> f64 {
    ln_chi_squared_tail(x, k as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_autoregression_is_found_from_its_own_covariances() {
        // x_k = 0.6 x_{k−1} − 0.2 x_{k−2} + e: the Yule–Walker equations give the covariances.
        let rho1 = 0.6 / 1.2;
        let rho2 = 0.6 * rho1 - 0.2;
        let rho3 = 0.6 * rho2 - 0.2 * rho1;
        let found = autoregression(&[1.0, rho1, rho2, rho3], 100_000);
        assert_eq!(found.len(), 2);
        assert!((found[0] - 0.6).abs() < 1e-12 && (found[1] + 0.2).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn a_chance_goes_on_below_the_smallest_number() {
        // P(χ²_2 > x) is exp(−x/2) exactly.
        for x in [1.0, 40.0, 5000.0] {
            assert!((ln_chance(x, 2) + 0.5 * x).abs() < 1e-9 * x.max(1.0));
        }
    }
}
