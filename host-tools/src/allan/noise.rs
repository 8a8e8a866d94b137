//! Fit of the five noise processes to an Allan deviation.
//!
//! Input: overlapping variances at octaves with their averaging factors. Output: squared coefficients with standard uncertainties, and upper limits for the
//! processes that are not significant. The method is generalised least squares. The covariances of [`super::confidence`] depend on the coefficients, so fit and
//! covariance are iterated. Every subset of the five with no negative square is tried; an additional process must reduce χ² by [`PENALTY`] + ln(points)
//! (a BIC difference of 6). The uncertainties include the choice of the subset.
//!
//! Short averages have the smallest uncertainty and deviate first (a filter in the sensor, one step of its converter). If the five processes do not fit, the
//! shortest averages are left out, which is reported. If no range fits, uncertainties are multiplied by √(χ²/ν), which is reported as well.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::confidence::{Covariance, Squares, expected, parts};
use super::deviation::Variance;
use crate::statistics::Extremes;
use crate::statistics::distributions::chi_squared_tail;

/// Required reduction of χ² by an additional process, besides ln(points).
const PENALTY: f64 = 6.0;
/// Significance level of the χ² test of the fit.
const SIGNIFICANCE: f64 = 1e-4;
/// Minimum number of points of a fit.
pub const MIN_POINTS: usize = 4;
/// Minimum number of points that remain when the shortest averages are left out.
const MIN_REMAINING_POINTS: usize = 6;
/// Iterations of fit and covariance.
const ITERATIONS: usize = 6;
/// Ratio of averaging factors above which two variances count as independent (correlation below 0.001).
const MAX_CORRELATED_RATIO: usize = 32;
/// One-sided 95 % quantile of the normal distribution.
const ONE_SIDED_95: f64 = 1.645;

/// A fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Q², N², B², K², R² in rows; 0 if not significant.
    pub squares: Squares,
    /// Standard uncertainties of the squares; `None` if not significant.
    pub sigmas: [Option<f64>; 5],
    /// Upper limits (95 %) of the squares.
    pub below: [f64; 5],
    /// Index of the first point used.
    pub first: usize,
    /// χ² per degree of freedom; 1 is expected.
    pub misfit: f64,
    /// The χ² test rejects the fit: the five processes do not explain the curve.
    pub unexplained: bool,
}

/// Fits variances at octaves; `None` for fewer than [`MIN_POINTS`].
pub fn fit(points: &[Variance], segments: &[(usize, usize)]) -> Option<Found> {
    if points.len() < MIN_POINTS || points.iter().any(|p| !(p.variance.is_finite() && p.variance > 0.0)) {
        return None;
    }
    let mut related = BTreeMap::new();
    for (i, one) in points.iter().enumerate() {
        for (j, other) in points.iter().enumerate().skip(i).take_while(|(_, p)| p.factor <= MAX_CORRELATED_RATIO * one.factor) {
            related.insert((i, j), Covariance::new(one.factor, other.factor, segments));
        }
    }
    let mut whole = None;
    for first in 0..=(points.len() / 2).min(points.len().saturating_sub(MIN_REMAINING_POINTS)) {
        let Some(found) = from(first, points, &related) else { continue };
        if !found.unexplained {
            return Some(found);
        }
        whole = whole.or(Some(found));
    }
    whole
}

/// Fit of one subset of the processes.
struct Trial {
    squares: Squares,
    sigmas: [Option<f64>; 5],
    chi2: f64,
}

/// Fit of the points from index `first`.
fn from(first: usize, points: &[Variance], related: &BTreeMap<(usize, usize), Covariance>) -> Option<Found> {
    let points_used = &points[first..];
    let count = points_used.len();
    let penalty = PENALTY + (count as f64).ln();
    // Start value: white noise through the first point.
    let mut squares = [0.0, points_used[0].variance * points_used[0].factor as f64, 0.0, 0.0, 0.0];
    let mut last = None;
    for _ in 0..ITERATIONS {
        let whiten = Whiten::new(first, points_used, related, &squares)?;
        let sets = (1_u32..32).filter(|set| (set.count_ones() as usize) < count);
        let mut trials: Vec<(u32, Trial)> =
            sets.filter_map(|set| Some((set, whiten.fit(set).filter(|t| t.squares.iter().all(|s| *s >= 0.0))?))).collect();
        let penalised = |(set, trial): &(u32, Trial)| trial.chi2 + penalty * f64::from(set.count_ones());
        let best = (0..trials.len()).min_by(|a, b| penalised(&trials[*a]).total_cmp(&penalised(&trials[*b])))?;
        trials.swap(0, best);
        squares = trials[0].1.squares;
        last = Some((whiten, trials));
    }
    let (whiten, trials) = last?;
    let (set, trial) = &trials[0];
    let set = *set;
    let degrees = count - set.count_ones() as usize;
    let misfit = trial.chi2 / degrees as f64;
    let unexplained = chi_squared_tail(trial.chi2, degrees as f64) < SIGNIFICANCE;
    let grow = if unexplained { misfit.sqrt() } else { 1.0 };
    let all = model_averaged_sigmas(&trials, count);
    let sigmas: [Option<f64>; 5] = std::array::from_fn(|p| trial.sigmas[p].map(|_| all[p] * grow));
    let below = std::array::from_fn(|p| {
        let with = if set & 1 << p == 0 { whiten.fit(set | 1 << p) } else { None };
        let (value, sigma) = with.as_ref().map_or((squares[p], sigmas[p]), |t| (t.squares[p], t.sigmas[p].map(|s| s * grow)));
        value.max(0.0) + ONE_SIDED_95 * sigma.unwrap_or(f64::INFINITY)
    });
    Some(Found { squares, sigmas, below, first, misfit, unexplained })
}

/// Standard uncertainties of the best subset's squares, averaged over all subsets with weights exp(−BIC/2); a process is 0 in a subset without it.
/// Flicker noise and random walk are hard to separate in a short record: without model averaging the uncertainty of the selected one would be too small.
fn model_averaged_sigmas(trials: &[(u32, Trial)], points: usize) -> [f64; 5] {
    let penalised = |(set, trial): &(u32, Trial)| trial.chi2 + (PENALTY + (points as f64).ln()) * f64::from(set.count_ones());
    let least = trials.iter().map(penalised).min_or_infinity();
    let weights: Vec<f64> = trials.iter().map(|t| (-0.5 * (penalised(t) - least)).exp()).collect();
    let total: f64 = weights.iter().sum();
    std::array::from_fn(|p| {
        let spread = |t: &Trial| t.sigmas[p].unwrap_or(0.0).powi(2) + (t.squares[p] - trials[0].1.squares[p]).powi(2);
        let sum: f64 = trials.iter().zip(&weights).map(|((_, t), w)| w * spread(t)).sum();
        (sum / total).sqrt()
    })
}

/// Whitened points: independent, with unit variance.
struct Whiten {
    columns: DMatrix<f64>,
    seen: DVector<f64>,
}

impl Whiten {
    /// Whitens by the covariance under the noise `squares`; points are relative to their expectation.
    fn new(first: usize, points: &[Variance], related: &BTreeMap<(usize, usize), Covariance>, squares: &Squares) -> Option<Self> {
        let count = points.len();
        let means: Vec<f64> = points.iter().map(|p| expected(squares, p.factor)).collect();
        let mut covariance = DMatrix::zeros(count, count);
        for ((i, j), pair) in related.range((first, first)..).filter(|((i, _), _)| *i >= first) {
            let (i, j) = (i - first, j - first);
            covariance[(i, j)] = pair.of(squares) / means[i] / means[j];
            covariance[(j, i)] = covariance[(i, j)];
        }
        let root = root(covariance)?;
        let columns = DMatrix::from_fn(count, 5, |i, p| parts(points[i].factor)[p] / means[i]);
        let seen = DVector::from_fn(count, |i, _| points[i].variance / means[i]);
        Some(Self { columns: root.solve_lower_triangular(&columns)?, seen: root.solve_lower_triangular(&seen)? })
    }

    /// Least squares of one subset; `None` if the points do not determine it.
    fn fit(&self, set: u32) -> Option<Trial> {
        let chosen: Vec<usize> = (0..5).filter(|p| set & 1 << p != 0).collect();
        // Columns are normalised: their norms differ by many orders of magnitude.
        let sizes: Vec<f64> = chosen.iter().map(|p| self.columns.column(*p).norm()).collect();
        let design = DMatrix::from_fn(self.seen.len(), chosen.len(), |i, k| self.columns[(i, chosen[k])] / sizes[k]);
        let normal = Cholesky::new(design.tr_mul(&design))?;
        let solution = normal.solve(&design.tr_mul(&self.seen));
        let inverse = normal.inverse();
        let chi2 = (&self.seen - &design * &solution).norm_squared();
        let (mut squares, mut sigmas) = ([0.0; 5], [None; 5]);
        for (k, p) in chosen.iter().enumerate() {
            squares[*p] = solution[k] / sizes[k];
            sigmas[*p] = Some(inverse[(k, k)].sqrt() / sizes[k]);
        }
        (chi2.is_finite() && squares.iter().all(|s| s.is_finite())).then_some(Trial { squares, sigmas, chi2 })
    }
}

/// Cholesky factor of a covariance matrix; its diagonal is increased until it is positive definite.
fn root(covariance: DMatrix<f64>) -> Option<DMatrix<f64>> {
    [0.0, 1e-9, 1e-6, 1e-3, 1e-2].iter().find_map(|loosen| {
        let mut tried = covariance.clone();
        (0..tried.nrows()).for_each(|i| tried[(i, i)] *= 1.0 + loosen);
        Cholesky::<f64, Dyn>::new(tried).map(|c| c.l())
    })
}
