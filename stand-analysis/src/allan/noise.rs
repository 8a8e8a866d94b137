//! Fit of the five noise processes to an Allan deviation.
//!
//! Input: overlapping variances at octaves with their averaging factors. Output: squared coefficients with 95 % and 68 % intervals, upper
//! limits for the processes that are not significant, and whether the five processes explain the curve.
//!
//! Method: maximum likelihood. The cube roots of the variances are normally distributed to a good approximation (Wilson and Hilferty), also
//! with few degrees of freedom; their correlations are those of [`super::confidence`] under the fitted noise. All five squares are fitted,
//! none negative. The interval of a coefficient is that of its profile likelihood: all values for which the other processes, refitted,
//! explain the curve nearly as well. So the interval contains that flicker noise and random walk replace each other in a short record. The
//! upper end of N is the larger one of the fits with and without quantisation noise, if that is not significant, and that of K of the fits
//! with and without a ramp: an absent process has a positive square in half of the records, by which its neighbour is too small. A process
//! is shown if the curve without it is less likely by [`PENALTY`] + ln(points) in −2 ln L (a BIC difference of 6).
//!
//! The intervals are conditional on the model: stationary noise of these five processes. Short averages have the smallest uncertainty and
//! deviate first (a filter in the sensor, one step of its converter), long ones by slow motions that are no noise. If the five processes do
//! not fit, the longest range of averages that they fit is used, which is reported. If no range fits, the intervals are widened by √(χ²/ν),
//! which is reported as well.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use identification::statistics::CovarianceRoot;
use identification::statistics::least_squares::normal_solution;

use super::confidence::{Covariance, Squares, expected, parts};
use super::deviation::Variance;
use identification::statistics::distributions::{chi_squared_quantile, chi_squared_tail};

/// Required reduction of −2 ln L by a process that is shown, besides ln(points).
const PENALTY: f64 = 6.0;
/// Significance level of the χ² test of the fit.
const SIGNIFICANCE: f64 = 1e-4;
/// Minimum number of points of a fit.
pub const MIN_POINTS: usize = 4;
/// Minimum number of points that remain when the shortest or longest averages are left out.
const MIN_REMAINING_POINTS: usize = 6;
/// Most iterations of a maximisation.
const ITERATIONS: usize = 40;
/// Change of −2 ln L below which a maximisation ends.
const TOLERANCE: f64 = 1e-4;
/// Halvings of a step that does not increase the likelihood.
const HALVINGS: usize = 6;
/// Most restarts from a better restricted maximum: more than there are processes.
const RESTARTS: usize = 8;
/// Bisections of an end of an interval: 1e-4 of its logarithmic range.
const BISECTIONS: usize = 14;
/// Factor by which the search for an upper end proceeds, and the number of its steps.
const EXPANSION: f64 = 1.5;
const EXPANSIONS: usize = 60;
/// Probabilities of the intervals.
const PROBABILITIES: [f64; 2] = [0.682_689_492_137, 0.95];

/// Interval of a squared coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intervals {
    /// 68 %.
    pub within_68: [f64; 2],
    /// 95 %.
    pub within_95: [f64; 2],
}

/// A fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Q², N², B², K², R² in rows: the most likely values, also of processes that are not significant.
    pub squares: Squares,
    /// Intervals of the squares; `None` if not significant.
    pub intervals: [Option<Intervals>; 5],
    /// Upper limits of the squares: upper ends of their 95 % intervals.
    pub below: [f64; 5],
    /// Indices of the points used.
    pub used: Range<usize>,
    /// χ² per degree of freedom; 1 is expected.
    pub misfit: f64,
    /// The χ² test rejects the fit: the five processes do not explain the curve.
    pub unexplained: bool,
    /// Flicker noise, random walk and ramp together are significant.
    pub slow_noise: bool,
}

/// Fits variances at octaves; `None` for fewer than [`MIN_POINTS`].
pub fn fit(points: &[Variance], segments: &[(usize, usize)]) -> Option<Found> {
    if points.len() < MIN_POINTS || points.iter().any(|p| !(p.variance.is_finite() && p.variance > 0.0)) {
        return None;
    }
    let mut related = BTreeMap::new();
    for (i, one) in points.iter().enumerate() {
        for (j, other) in points.iter().enumerate().skip(i) {
            related.insert((i, j), Covariance::new(one.factor, other.factor, segments));
        }
    }
    let rows = segments.iter().map(|(angles, count)| angles * count).sum();
    let mut whole = None;
    for used in ranges(points.len()) {
        let likelihood = Likelihood { first: used.start, points: &points[used], related: &related, rows };
        let Some(best) = likelihood.maximum(0, likelihood.white()) else { continue };
        if !likelihood.is_unexplained(&best) {
            return likelihood.found(&best);
        }
        whole = whole.or(Some((likelihood, best)));
    }
    let (likelihood, best) = whole?;
    likelihood.found(&best)
}

/// Ranges of points by their number, the largest first; among equal ones that without the shortest averages, then that without the longest.
fn ranges(points: usize) -> impl Iterator<Item = Range<usize>> {
    let most = (points / 2).min(points.saturating_sub(MIN_REMAINING_POINTS));
    (0..=most).flat_map(move |dropped| {
        let at_both_ends = (1..dropped).map(move |first| (first, dropped - first));
        let at_one_end = [(dropped, 0), (0, dropped)].into_iter().take(1 + usize::from(dropped > 0));
        at_one_end.chain(at_both_ends).map(move |(first, last)| first..points - last)
    })
}

/// Squares with their −2 ln L and χ².
#[derive(Debug, Clone, Copy, PartialEq)]
struct Solution {
    squares: Squares,
    minus_2_ln: f64,
    chi2: f64,
}

/// Squares that are held at their start value, as bits.
type Held = u32;
/// Processes with the neighbour at the end of the scale of slopes that most sensors do not show: N with Q, K with R.
const ABSENT_NEIGHBOURS: [(usize, usize); 2] = [(1, 0), (3, 4)];
/// B², K² and R².
const SLOW_SQUARES: Held = 0b1_1100;

/// Likelihood of the points from index `first`.
#[derive(Clone, Copy)]
struct Likelihood<'a> {
    first: usize,
    points: &'a [Variance],
    related: &'a BTreeMap<(usize, usize), Covariance>,
    /// Rows of the record.
    rows: usize,
}

/// Cube roots of the variances relative to their expectation, with the factor of their covariance.
struct Whitened {
    means: Vec<f64>,
    ratios: DVector<f64>,
    root: CovarianceRoot,
}

impl Likelihood<'_> {
    fn whitened(&self, squares: &Squares) -> Option<Whitened> {
        let count = self.points.len();
        let means: Vec<f64> = self.points.iter().map(|p| expected(squares, p.factor)).collect();
        if means.iter().any(|mean| !(mean.is_finite() && *mean > 0.0)) {
            return None;
        }
        let mut covariance = DMatrix::zeros(count, count);
        for ((i, j), pair) in self.related.iter().filter(|((i, j), _)| *i >= self.first && *j < self.first + count) {
            let (i, j) = (i - self.first, j - self.first);
            // Of the cube root: a ninth of that of the variance.
            covariance[(i, j)] = pair.of(squares) / means[i] / means[j] / 9.0;
            covariance[(j, i)] = covariance[(i, j)];
        }
        let ratios = DVector::from_fn(count, |i, _| (self.points[i].variance / means[i]).cbrt());
        Some(Whitened { means, ratios, root: root(covariance)? })
    }

    /// −2 ln L and χ² of these squares.
    fn solution(&self, squares: Squares, whitened: &Whitened) -> Option<Solution> {
        let Whitened { means, ratios, root } = whitened;
        // Mean of the cube root: 1 − 2/(9 ν), and 2/(9 ν) is its variance.
        let off = DMatrix::from_fn(ratios.len(), 1, |i, _| ratios[i] - 1.0 + root.variance(i));
        let chi2 = root.whiten(&off)?.norm_squared();
        let ln_means: f64 = means.iter().map(|mean| mean.ln()).sum::<f64>() * 2.0 / 3.0;
        let minus_2_ln = chi2 + root.ln_determinant() + ln_means;
        minus_2_ln.is_finite().then_some(Solution { squares, minus_2_ln, chi2 })
    }

    fn at(&self, squares: Squares) -> Option<Solution> {
        self.solution(squares, &self.whitened(&squares)?)
    }

    /// White noise through the first point.
    fn white(&self) -> Squares {
        [0.0, self.points[0].variance * self.points[0].factor as f64, 0.0, 0.0, 0.0]
    }

    /// Most likely squares, none negative, from a start; those in `held` stay.
    fn maximum(&self, held: Held, start: Squares) -> Option<Solution> {
        let mut squares = start;
        if expected(&squares, self.points[0].factor) <= 0.0 {
            // Anything positive that may move.
            squares[usize::from(held & 0b10 == 0)] = self.white()[1];
        }
        let mut best = self.at(squares)?;
        for _ in 0..ITERATIONS {
            let Some(step) = self.step(&best.squares, held) else { break };
            let mut share = 1.0;
            let mut better = None;
            for _ in 0..HALVINGS {
                let tried: Squares = std::array::from_fn(|p| best.squares[p] + share * (step[p] - best.squares[p]));
                better = self.at(tried).filter(|found| found.minus_2_ln < best.minus_2_ln);
                if better.is_some() {
                    break;
                }
                share *= 0.5;
            }
            let Some(better) = better else { break };
            let gain = best.minus_2_ln - better.minus_2_ln;
            best = better;
            if gain < TOLERANCE {
                break;
            }
        }
        Some(best)
    }

    /// One step of Gauss and Newton: least squares of the cube roots, linear in the squares, none of which becomes negative.
    fn step(&self, squares: &Squares, held: Held) -> Option<Squares> {
        let Whitened { means, ratios, root } = self.whitened(squares)?;
        let slope = |i: usize, p: usize| ratios[i] / 3.0 * parts(self.points[i].factor)[p] / means[i];
        let columns = root.whiten(&DMatrix::from_fn(means.len(), 5, slope))?;
        let off = DMatrix::from_fn(means.len(), 1, |i, _| {
            ratios[i] - 1.0 + (0..5).filter(|p| held & 1 << p == 0).map(|p| slope(i, p) * squares[p]).sum::<f64>()
        });
        let right = root.whiten(&off)?.column(0).into_owned();
        let mut best: Option<(f64, Squares)> = None;
        // The subset of positive squares is the best of all subsets whose solution is positive.
        for set in (1..32_u32).filter(|set| set & held == 0 && (set.count_ones() as usize) < means.len()) {
            let Some((chi2, mut found)) = least_squares(&columns, &right, set) else { continue };
            (0..5).filter(|p| held & 1 << p != 0).for_each(|p| found[p] = squares[p]);
            if found.iter().all(|s| *s >= 0.0) && best.as_ref().is_none_or(|(least, _)| chi2 < *least) {
                best = Some((chi2, found));
            }
        }
        best.map(|(_, found)| found)
    }

    fn degrees(&self, best: &Solution) -> f64 {
        (self.points.len() - best.squares.iter().filter(|s| **s > 0.0).count()).max(1) as f64
    }

    fn is_unexplained(&self, best: &Solution) -> bool {
        chi_squared_tail(best.chi2, self.degrees(best)) < SIGNIFICANCE
    }

    /// The result at the most likely squares.
    fn found(&self, best: &Solution) -> Option<Found> {
        let misfit = best.chi2 / self.degrees(best);
        let unexplained = self.is_unexplained(best);
        let grow = if unexplained { misfit.max(1.0) } else { 1.0 };
        let needed = (PENALTY + (self.points.len() as f64).ln()) * grow;
        let mut best = *best;
        let mut without = self.each_without(&best);
        // A restricted maximum can be better than the first, which was a local one. Then other processes are present, and their absence is
        // tested.
        for _ in 0..RESTARTS {
            let better = without.iter().flatten().min_by(|a, b| a.minus_2_ln.total_cmp(&b.minus_2_ln));
            let Some(better) = better.filter(|better| better.minus_2_ln < best.minus_2_ln) else { break };
            best = *better;
            without = self.each_without(&best);
        }
        let is_shown =
            |p: usize| best.squares[p] > 0.0 && without[p].as_ref().is_none_or(|found| found.minus_2_ln - best.minus_2_ln > needed);
        let intervals = std::array::from_fn(|p| {
            is_shown(p).then(|| {
                let [within_68, within_95] = PROBABILITIES.map(|probability| {
                    let quantile = chi_squared_quantile(probability, 1.0);
                    let limit = grow * quantile;
                    // No square is known better than the variance of as many independent rows.
                    let least = best.squares[p] * (2.0 * quantile / self.rows as f64).sqrt();
                    let upper = self.upper(&best, p, limit, 0);
                    // Without the absent neighbour as well: a square of it that is positive by chance takes from this one, and none is
                    // negative.
                    let neighbour = ABSENT_NEIGHBOURS.iter().find(|(shown, absent)| *shown == p && !is_shown(*absent));
                    let upper_without = neighbour
                        .and_then(|(_, absent)| without[*absent].as_ref().map(|without| self.upper(without, p, limit, 1 << absent)));
                    let lower = self.lower(&best, p, limit).min((best.squares[p] - least).max(0.0));
                    [lower, upper.max(upper_without.unwrap_or(0.0)).max(best.squares[p] + least)]
                });
                Intervals { within_68, within_95 }
            })
        });
        // The upper end of the interval of 95 % with two sides: a coefficient is not shown where its estimate is low by chance, too.
        let below = std::array::from_fn(|p| self.upper(&best, p, grow * chi_squared_quantile(PROBABILITIES[1], 1.0), 0));
        let fast = self.maximum(SLOW_SQUARES, self.white());
        let slow_noise = fast.is_none_or(|found| found.minus_2_ln - best.minus_2_ln > needed);
        Some(Found {
            squares: best.squares,
            intervals,
            below,
            used: self.first..self.first + self.points.len(),
            misfit,
            unexplained,
            slow_noise,
        })
    }

    /// The maxima without each of the processes that are present.
    fn each_without(&self, best: &Solution) -> [Option<Solution>; 5] {
        std::array::from_fn(|p| if best.squares[p] > 0.0 { self.maximum(1 << p, with(best.squares, p, 0.0)) } else { None })
    }

    /// Excess of the profile −2 ln L at a held square; those in `held` stay as well.
    fn excess(&self, best: &Solution, p: usize, value: f64, held: Held, start: &mut Squares) -> f64 {
        match self.maximum(held | 1 << p, with(*start, p, value)) {
            Some(found) => {
                *start = found.squares;
                found.minus_2_ln - best.minus_2_ln
            }
            None => f64::INFINITY,
        }
    }

    fn lower(&self, best: &Solution, p: usize, limit: f64) -> f64 {
        let mut start = best.squares;
        let (mut low, mut high) = (0.0, best.squares[p]);
        if self.excess(best, p, low, 0, &mut start) < limit {
            return 0.0;
        }
        start = best.squares;
        // Logarithmic once the lower end is above zero.
        for _ in 0..BISECTIONS {
            let middle = if low > 0.0 { (low * high).sqrt() } else { 0.5 * (low + high) };
            if self.excess(best, p, middle, 0, &mut start) < limit { high = middle } else { low = middle }
        }
        low
    }

    fn upper(&self, best: &Solution, p: usize, limit: f64, held: Held) -> f64 {
        let mut start = best.squares;
        // From zero: the square that alone makes the variance at the point where it contributes most.
        let alone = self.points.iter().map(|point| point.variance / parts(point.factor)[p]).fold(f64::INFINITY, f64::min);
        let mut low = best.squares[p];
        let mut high = if low > 0.0 { low * EXPANSION } else { 0.1 * alone };
        let mut steps = 0;
        while self.excess(best, p, high, held, &mut start) < limit {
            (low, high) = (high, high * EXPANSION);
            steps += 1;
            if steps > EXPANSIONS {
                return f64::INFINITY;
            }
        }
        start = best.squares;
        for _ in 0..BISECTIONS {
            let middle = if low > 0.0 { (low * high).sqrt() } else { 0.5 * (low + high) };
            if self.excess(best, p, middle, held, &mut start) < limit { low = middle } else { high = middle }
        }
        high
    }
}

/// The squares with another value of one.
fn with(mut squares: Squares, p: usize, value: f64) -> Squares {
    squares[p] = value;
    squares
}

/// χ² and solution of one subset of the columns; `None` if the points do not determine it.
fn least_squares(columns: &DMatrix<f64>, right: &DVector<f64>, set: u32) -> Option<(f64, Squares)> {
    let chosen: Vec<usize> = (0..5).filter(|p| set & 1 << p != 0).collect();
    // Columns are normalised: their norms differ by many orders of magnitude.
    let sizes: Vec<f64> = chosen.iter().map(|p| columns.column(*p).norm()).collect();
    let design = DMatrix::from_fn(right.len(), chosen.len(), |i, k| columns[(i, chosen[k])] / sizes[k]);
    let (solution, chi2) = normal_solution(&design, right)?;
    let mut squares = [0.0; 5];
    for (k, p) in chosen.iter().enumerate() {
        squares[*p] = solution[k] / sizes[k];
    }
    (chi2.is_finite() && squares.iter().all(|s| s.is_finite())).then_some((chi2, squares))
}

/// Cholesky factor of a covariance matrix; its diagonal is increased by rounding errors at most. A greater increase would change with the
/// squares, and with it the determinant: the likelihood would have maxima where the matrix is singular.
fn root(covariance: DMatrix<f64>) -> Option<CovarianceRoot> {
    [0.0, 1e-9, 1e-6].iter().find_map(|loosen| {
        let mut tried = covariance.clone();
        (0..tried.nrows()).for_each(|i| tried[(i, i)] *= 1.0 + loosen);
        CovarianceRoot::of(tried)
    })
}
