//! The processes behind an Allan deviation: which of the five this record shows, how strong, and how sure.
//!
//! In: overlapping variances at octaves, each with its factor. Out: squares of the coefficients with standard errors; for those that the record does not
//! show, what they are below. Generalised least squares with the covariances of [`super::confidence`], which follow from the coefficients, so some rounds of
//! both. Every set of the five with no negative square is tried; one more must pay [`PRICE`] and ln(points) in χ² (6 in BIC, as for effects). Standard errors
//! know that the set may be another.
//!
//! Short averages are the surest points and the first to break the law (a filter in the sensor, one step of its converter): where the five do not fit, the
//! shortest go, and that is said. Where nothing fits, errors grow by the root of χ² per degree of freedom, and that is said too.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::confidence::{Covariance, Squares, expected, parts};
use super::deviation::Variance;
use crate::statistics::Extremes;
use crate::statistics::distributions::chi_squared_tail;

/// What one process more must take from χ², beside ln(points).
const PRICE: f64 = 6.0;
/// A misfit that chance makes more often than this is none.
const CHANCE: f64 = 1e-4;
/// Fewest points of a fit.
pub const FEWEST_POINTS: usize = 4;
/// The shortest averages are given up as long as so many points remain.
const FEWEST_KEPT: usize = 6;
/// Rounds of fit and covariance.
const ROUNDS: usize = 6;
/// Averages of which one is longer by more than this factor are independent, but for a thousandth.
const RELATED: usize = 32;
/// One-sided 95 % of a normal distribution.
const ONE_SIDED_95: f64 = 1.645;

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Q², N², B², K², R² in rows; 0 where not shown.
    pub squares: Squares,
    /// Standard errors of the squares; `None` where not shown.
    pub sigmas: [Option<f64>; 5],
    /// With 95 % the square is below this.
    pub below: [f64; 5],
    /// The first point that was used.
    pub first: usize,
    /// χ² per degree of freedom; 1 is expected.
    pub misfit: f64,
    /// Chance does not explain the misfit: the five are not all there is.
    pub unexplained: bool,
}

/// Fits octaves; `None` for fewer than [`FEWEST_POINTS`].
pub fn fit(points: &[Variance], segments: &[(usize, usize)]) -> Option<Found> {
    if points.len() < FEWEST_POINTS || points.iter().any(|p| !(p.variance.is_finite() && p.variance > 0.0)) {
        return None;
    }
    let mut related = BTreeMap::new();
    for (i, one) in points.iter().enumerate() {
        for (j, other) in points.iter().enumerate().skip(i).take_while(|(_, p)| p.factor <= RELATED * one.factor) {
            related.insert((i, j), Covariance::new(one.factor, other.factor, segments));
        }
    }
    let mut whole = None;
    for first in 0..=(points.len() / 2).min(points.len().saturating_sub(FEWEST_KEPT)) {
        let Some(found) = from(first, points, &related) else { continue };
        if !found.unexplained {
            return Some(found);
        }
        whole = whole.or(Some(found));
    }
    whole
}

/// One set of processes, fitted.
struct Trial {
    squares: Squares,
    sigmas: [Option<f64>; 5],
    chi2: f64,
}

/// The fit of all points from `first` on.
fn from(first: usize, points: &[Variance], related: &BTreeMap<(usize, usize), Covariance>) -> Option<Found> {
    let points_used = &points[first..];
    let count = points_used.len();
    let price = PRICE + (count as f64).ln();
    // White noise through the first point, to begin with.
    let mut squares = [0.0, points_used[0].variance * points_used[0].factor as f64, 0.0, 0.0, 0.0];
    let mut last = None;
    for _ in 0..ROUNDS {
        let whiten = Whiten::new(first, points_used, related, &squares)?;
        let sets = (1_u32..32).filter(|set| (set.count_ones() as usize) < count);
        let mut trials: Vec<(u32, Trial)> =
            sets.filter_map(|set| Some((set, whiten.fit(set).filter(|t| t.squares.iter().all(|s| *s >= 0.0))?))).collect();
        let paid = |(set, trial): &(u32, Trial)| trial.chi2 + price * f64::from(set.count_ones());
        let best = (0..trials.len()).min_by(|a, b| paid(&trials[*a]).total_cmp(&paid(&trials[*b])))?;
        trials.swap(0, best);
        squares = trials[0].1.squares;
        last = Some((whiten, trials));
    }
    let (whiten, trials) = last?;
    let (set, trial) = &trials[0];
    let set = *set;
    let degrees = count - set.count_ones() as usize;
    let misfit = trial.chi2 / degrees as f64;
    let unexplained = chi_squared_tail(trial.chi2, degrees as f64) < CHANCE;
    let grow = if unexplained { misfit.sqrt() } else { 1.0 };
    let all = with_doubt(&trials, count);
    let sigmas: [Option<f64>; 5] = std::array::from_fn(|p| trial.sigmas[p].map(|_| all[p] * grow));
    let below = std::array::from_fn(|p| {
        let with = if set & 1 << p == 0 { whiten.fit(set | 1 << p) } else { None };
        let (value, sigma) = with.as_ref().map_or((squares[p], sigmas[p]), |t| (t.squares[p], t.sigmas[p].map(|s| s * grow)));
        value.max(0.0) + ONE_SIDED_95 * sigma.unwrap_or(f64::INFINITY)
    });
    Some(Found { squares, sigmas, below, first, misfit, unexplained })
}

/// Standard errors of the first trial's squares that also know that another set may be the true one: each set counts by what it pays, and a process
/// that it lacks is 0 in it. Flicker and a walk look alike in a short record; with either left out the other would seem surer than it is.
fn with_doubt(trials: &[(u32, Trial)], points: usize) -> [f64; 5] {
    let paid = |(set, trial): &(u32, Trial)| trial.chi2 + (PRICE + (points as f64).ln()) * f64::from(set.count_ones());
    let least = trials.iter().map(paid).min_or_infinity();
    let weights: Vec<f64> = trials.iter().map(|t| (-0.5 * (paid(t) - least)).exp()).collect();
    let total: f64 = weights.iter().sum();
    std::array::from_fn(|p| {
        let spread = |t: &Trial| t.sigmas[p].unwrap_or(0.0).powi(2) + (t.squares[p] - trials[0].1.squares[p]).powi(2);
        let sum: f64 = trials.iter().zip(&weights).map(|((_, t), w)| w * spread(t)).sum();
        (sum / total).sqrt()
    })
}

/// The points made independent and of variance 1.
struct Whiten {
    columns: DMatrix<f64>,
    seen: DVector<f64>,
}

impl Whiten {
    /// Under the noise `squares`, all relative to what it gives on average.
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

    /// Least squares of one set of processes; `None` where the points do not tell them apart.
    fn fit(&self, set: u32) -> Option<Trial> {
        let chosen: Vec<usize> = (0..5).filter(|p| set & 1 << p != 0).collect();
        // Columns of length 1: their sizes lie many tens apart.
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

/// The lower root of a covariance matrix; neighbours that go together too closely are loosened until there is one.
fn root(covariance: DMatrix<f64>) -> Option<DMatrix<f64>> {
    [0.0, 1e-9, 1e-6, 1e-3, 1e-2].iter().find_map(|loosen| {
        let mut tried = covariance.clone();
        (0..tried.nrows()).for_each(|i| tried[(i, i)] *= 1.0 + loosen);
        Cholesky::<f64, Dyn>::new(tried).map(|c| c.l())
    })
}
