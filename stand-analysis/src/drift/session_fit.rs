//! Least squares over the cycles of a session whose drift moves.
//!
//! Input: the drift rate of each cycle with its time, its visit (an uninterrupted stay in one position) and the regressors of its position.
//! Output: estimates of linear combinations of the position's parameters, the trend, the inequality of the pulses, the scatter between
//! visits.
//!
//! Model of the rate of cycle i: x_i β + odd s_i w_i + even w_i + r (t_i − t̄) + walk(t_i) + white scatter. *odd* holds what changes its
//! sign with the sequence (lag of the torquer), *even* what does not (unequal pulses; only with two amplitudes w), r is the trend. The
//! random walk has a mean of zero over the session: the own drift is the mean over the cycles, and its own movement is no error of it.
//!
//! Two ratios of variances to that of the white scatter are not known: λ of the walk per cycle, and μ of an offset common to a visit (the
//! gyro was turned and levelled again). The result is averaged over both: for each pair of a grid the estimates are Student's with n − p
//! degrees of freedom; the weight is the restricted likelihood times λ^¼, times 10 for λ = 0, and times 10 for μ = 0. The weights were
//! chosen by simulation: steady drift, random walk, ramp and flicker noise are covered with 4 and with 10 cycles in each position
//! (docs/metrology-coverage.md).
//!
//! A walk and a trend explain offsets of few visits nearly as well as the offsets themselves, and the walk is no error of the own drift.
//! The likelihood does not decide between them, so the interval is never smaller than that of the offsets alone: variance between the
//! visits by the mean square of their k contrasts that all columns of the fit leave free (Henderson's method 3, Biometrics 9 (1953) 226),
//! with Student's t of their effective degrees of freedom, beside the scatter within the visits. With one contrast t is 12.7; it then
//! counts only if it differs from the scatter of the cycles at the 25 % level (preliminary test for pooling: Bancroft, Biometrics 20 (1964)
//! 427). The largest of these intervals and that for λ = μ = 0 is reported. Limits: an offset of the only visit to a position cannot be
//! told from the position and is not in the uncertainty ([`SessionFit::free_visits`]).

use super::inequality::MIN_AMPLITUDE_RATIO;
use identification::statistics::Extremes;
use identification::statistics::distributions::{chi_squared_tail, student_tail};
use identification::statistics::robust::median;
use identification::statistics::student_mixture::{Component, StudentMixture};
use identification::statistics::uncertainty::{COVERAGE_PROBABILITY, Estimate, Uncertainty, coverage_factor};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Most rows of the fit: longer sessions are averaged in groups of equal conditions.
const MAX_ROWS: usize = 400;
/// Grid of log₁₀ λ: first and last value, and step.
const LOG_RATIOS: (f64, f64, f64) = (-3.0, 5.0, 0.5);
/// Weight of λ = 0 and exponent of the weight of the others, see above.
const STEADY_WEIGHT: f64 = 10.0;
const RATIO_EXPONENT: f64 = 0.25;
/// Grid of log₁₀ μ, and the weight of μ = 0.
const LOG_VISIT_RATIOS: (f64, f64, f64) = (-1.5, 5.0, 0.5);
const NO_VISIT_SCATTER_WEIGHT: f64 = 10.0;
/// Smallest weight of a node, relative to the sum, that changes an interval of 95 %.
const MIN_WEIGHT: f64 = 1e-6;
/// Fewest degrees of freedom by the mixture: with fewer, the formula of Welch and Satterthwaite gives the sum with another source a smaller
/// U than this part.
const MIN_DOF: f64 = 4.0;
/// Singular value of the visits, relative to the greatest, from which they are not determined by the other columns.
const MIN_VISIT_PART: f64 = 1e-6;
/// Smallest eigenvalue of the scaled normal equations with which an additional column is separable.
const MIN_EIGENVALUE: f64 = 1e-4;
/// log₁₀ of the significance level of trend, walk and scatter between visits.
pub const LOG10_SIGNIFICANCE: f64 = -2.0;
/// Level of the preliminary test of a single contrast between visits.
const POOLING_SIGNIFICANCE: f64 = 0.25;
/// Coverage probability of the test of the trend.
const TREND_PROBABILITY: f64 = 0.99;

/// One cycle, or a mean of several.
#[derive(Debug, Clone, PartialEq)]
pub struct FitRow {
    /// Middle of the cycle, s.
    pub time_s: f64,
    /// What is fitted, in the unit of the result: a drift rate, rad/s, or the mean of another quantity over a period.
    pub reading: f64,
    /// Sign of the first pulse.
    pub sign: i8,
    /// Magnitude of the pulses, rad/s.
    pub amplitude_rad_s: f64,
    /// Regressors of the position.
    pub regressors: Vec<f64>,
    /// Number of the visit.
    pub visit: usize,
    /// Number of cycles.
    pub weight: f64,
}

/// Additional columns, in their order behind those of the position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Column {
    Odd,
    Even,
    Trend,
}

/// The fit for one λ and μ.
#[derive(Debug, Clone, PartialEq)]
struct Node {
    walk_ratio: f64,
    visit_ratio: f64,
    weight: f64,
    log_likelihood: f64,
    coefficients: DVector<f64>,
    covariance: DMatrix<f64>,
    variance: f64,
}

/// Test of the scatter between the visits beyond that of the cycles and of the walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisitScatter {
    /// log₁₀ of the probability that cycles and walk alone leave as much.
    pub log10_p: f64,
    /// Most likely standard deviation of a visit, rad/s; 0 where the visits agree.
    pub sigma_rad_s: f64,
}

/// A fitted session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionFit {
    positions: usize,
    columns: Vec<Column>,
    nodes: Vec<Node>,
    dof: f64,
    /// Variance between the visits; `None` where the other columns determine it.
    between: Option<BetweenVisits>,
    /// Mean interval of the cycles, s.
    interval_s: f64,
    /// Duration of the session, s.
    duration_s: f64,
}

impl SessionFit {
    /// Fits the cycles. `None` if their positions do not determine the regressors' parameters.
    pub fn new(rows: &[FitRow]) -> Option<Self> {
        let rows = averaged(rows);
        let positions = rows.first()?.regressors.len();
        let weights: Vec<f64> = rows.iter().map(|row| row.weight).collect();
        let total: f64 = weights.iter().sum();
        let mean = |of: &dyn Fn(&FitRow) -> f64| rows.iter().map(|row| row.weight * of(row)).sum::<f64>() / total;
        let (middle_s, amplitude) = (mean(&|row| row.time_s), mean(&|row| row.amplitude_rad_s).max(f64::MIN_POSITIVE));
        let (begin_s, end_s) = rows.iter().map(|row| row.time_s).min_max();
        let value = |row: &FitRow, column: Column| match column {
            Column::Odd => f64::from(row.sign) * row.amplitude_rad_s / amplitude,
            Column::Even => row.amplitude_rad_s / amplitude,
            Column::Trend => (row.time_s - middle_s) / (end_s - begin_s),
        };
        let design = |columns: &[Column]| {
            DMatrix::from_fn(rows.len(), positions + columns.len(), |i, j| {
                let plain = rows[i].regressors.get(j).copied().unwrap_or_else(|| value(&rows[i], columns[j - positions]));
                plain * weights[i].sqrt()
            })
        };
        is_determined(&design(&[]), f64::EPSILON).then_some(())?;
        let mut columns = Vec::new();
        for column in [Column::Odd, Column::Trend, Column::Even] {
            // One degree of freedom remains.
            let has_room = rows.len() > positions + columns.len() + 1;
            let wanted = match column {
                Column::Odd => rows.iter().any(|row| row.sign != rows[0].sign),
                Column::Trend => end_s > begin_s,
                Column::Even => {
                    let (smallest, greatest) = rows.iter().map(|row| row.amplitude_rad_s).min_max();
                    greatest >= MIN_AMPLITUDE_RATIO * smallest && smallest > 0.0
                }
            };
            let more: Vec<Column> = columns.iter().copied().chain([column]).collect();
            if has_room && wanted && is_determined(&design(&more), MIN_EIGENVALUE) {
                columns = more;
            }
        }
        let x = design(&columns);
        let y = DVector::from_fn(rows.len(), |i, _| rows[i].reading * weights[i].sqrt());
        let mut times: Vec<f64> = rows.iter().map(|row| row.time_s).collect();
        times.sort_by(f64::total_cmp);
        let interval_s = median(times.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0)).unwrap_or(1.0);
        let dof = rows.len() as f64 - x.ncols() as f64;
        let walk = walk(&rows, total, interval_s).symmetric_eigen();
        let count = rows.iter().map(|row| row.visit).max().unwrap_or(0) + 1;
        let visits = DMatrix::from_fn(rows.len(), count, |i, v| if rows[i].visit == v { weights[i].sqrt() } else { 0.0 });
        let between = BetweenVisits::new(&x, &y, &visits);
        let [x, visits] = [x, visits].map(|m| walk.eigenvectors.tr_mul(&m));
        let y = walk.eigenvectors.tr_mul(&y);
        // Without a degree of freedom, or without times, only λ = 0; where the visits are determined by the positions, only μ = 0.
        let walk_ratios = ratios(LOG_RATIOS, dof > 0.0 && end_s > begin_s);
        let visit_ratios = ratios(LOG_VISIT_RATIOS, dof > 0.0 && between.is_some());
        let mut nodes = Vec::with_capacity(walk_ratios.len() * visit_ratios.len());
        for walk_ratio in &walk_ratios {
            let Some(whitened) = Whitened::new(&x, &y, &visits, &walk.eigenvalues, *walk_ratio) else { continue };
            nodes.extend(visit_ratios.iter().filter_map(|visit_ratio| whitened.node(*visit_ratio, dof)));
        }
        let greatest = nodes.iter().map(|node| node.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
        for node in &mut nodes {
            let of_walk = if node.walk_ratio == 0.0 { STEADY_WEIGHT } else { node.walk_ratio.powf(RATIO_EXPONENT) };
            let of_visits = if node.visit_ratio == 0.0 { NO_VISIT_SCATTER_WEIGHT } else { 1.0 };
            node.weight = of_walk * of_visits * (node.log_likelihood - greatest).exp();
        }
        Some(Self { positions, columns, nodes, dof, between, interval_s, duration_s: end_s - begin_s })
    }

    /// Estimate of a linear combination of the parameters of the positions.
    pub fn estimate(&self, combination: &[f64]) -> Estimate {
        let mut all = combination.to_vec();
        all.resize(self.positions + self.columns.len(), 0.0);
        self.combination(&DVector::from_vec(all))
    }

    /// Test of the scatter between visits; `None` with one visit to each position.
    pub fn visits(&self) -> Option<VisitScatter> {
        let best = self.most_likely(|_| true)?;
        let without = self.most_likely(|node| node.visit_ratio == 0.0)?;
        (self.between.is_some() && self.dof > 0.0).then(|| VisitScatter {
            log10_p: log10_p_at_bound(best.log_likelihood - without.log_likelihood),
            sigma_rad_s: (best.visit_ratio * best.variance).sqrt(),
        })
    }

    /// Number of contrasts between the visits that the other columns leave free: degrees of freedom of the scatter between visits.
    pub fn free_visits(&self) -> usize {
        self.between.as_ref().map_or(0, |between| between.contrasts)
    }

    /// The node of the greatest likelihood among some.
    fn most_likely(&self, of: impl Fn(&Node) -> bool) -> Option<&Node> {
        self.nodes.iter().filter(|node| of(node)).max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))
    }

    /// Part of the rate that is even in the pulses, at the mean amplitude, rad/s.
    pub fn even(&self) -> Option<Estimate> {
        self.additional(Column::Even)
    }

    /// Part of the rate that is odd in the pulses, at the mean amplitude, rad/s.
    pub fn odd(&self) -> Option<Estimate> {
        self.additional(Column::Odd)
    }

    /// Trend of the drift, rad/s².
    pub fn trend(&self) -> Option<Estimate> {
        self.additional(Column::Trend).map(|change| change.scaled(1.0 / self.duration_s))
    }

    /// The trend differs from zero at the 1 % level.
    pub fn has_trend(&self) -> bool {
        let factor = |uncertainty: Uncertainty| uncertainty.u * coverage_factor(uncertainty.dof, TREND_PROBABILITY);
        self.trend().is_some_and(|trend| trend.uncertainty.is_some_and(|uncertainty| trend.value.abs() > factor(uncertainty)))
    }

    /// Random walk K of the drift, rad/s/√s, where it is significant.
    pub fn walk_rad_s_sqrt_s(&self) -> Option<f64> {
        let best = self.most_likely(|_| true)?;
        let steady = self.most_likely(|node| node.walk_ratio == 0.0)?;
        let is_significant = log10_p_at_bound(best.log_likelihood - steady.log_likelihood) < LOG10_SIGNIFICANCE;
        is_significant.then(|| (best.walk_ratio * best.variance / self.interval_s).sqrt())
    }

    fn additional(&self, column: Column) -> Option<Estimate> {
        let place = self.columns.iter().position(|c| *c == column)?;
        let mut all = DVector::zeros(self.positions + self.columns.len());
        all[self.positions + place] = 1.0;
        Some(self.combination(&all))
    }

    /// Probability with which noise makes a combination of the regressors' parameters differ from zero as much, averaged over the ratios of
    /// walk and visits by their weights; two-sided. Unlike the interval of an estimate it does not allow for visits that the combination may
    /// contain: for differences within a visit.
    pub fn probability_within_visits(&self, combination: &[f64]) -> f64 {
        let mut all = combination.to_vec();
        all.resize(self.positions + self.columns.len(), 0.0);
        let all = DVector::from_vec(all);
        let tail = |node: &Node| {
            let scale = all.dot(&(&node.covariance * &all)).max(0.0).sqrt();
            2.0 * student_tail((all.dot(&node.coefficients) / scale).abs(), self.dof)
        };
        self.nodes.iter().map(|node| node.weight * tail(node)).sum::<f64>() / self.nodes.iter().map(|node| node.weight).sum::<f64>()
    }

    fn combination(&self, combination: &DVector<f64>) -> Estimate {
        let component = |node: &Node| Component {
            weight: node.weight,
            location: combination.dot(&node.coefficients),
            scale: combination.dot(&(&node.covariance * combination)).max(0.0).sqrt(),
        };
        let total: f64 = self.nodes.iter().map(|node| node.weight).sum();
        let counts = |(k, node): &(usize, &Node)| *k == 0 || node.weight > MIN_WEIGHT * total;
        let components: Vec<Component> = self.nodes.iter().enumerate().filter(counts).map(|(_, node)| component(node)).collect();
        let steady = components.first().copied();
        let Some(mixture) = StudentMixture::new(components, self.dof) else {
            return Estimate { value: steady.map_or(f64::NAN, |c| c.location), uncertainty: None };
        };
        let alone = steady.map(|c| Uncertainty::student(c.scale, self.dof));
        // U stays. Not more degrees of freedom than the cycles have, and not fewer than MIN_DOF by the tails of unlikely nodes.
        let averaged = mixture.uncertainty();
        let dof = averaged.dof.clamp(self.dof.min(MIN_DOF), self.dof);
        let averaged = Uncertainty::student(averaged.expanded() / coverage_factor(dof, COVERAGE_PROBABILITY), dof);
        let wider = alone.filter(|alone| alone.expanded() > averaged.expanded()).unwrap_or(averaged);
        let value = mixture.mean();
        // The interval of the offsets is about the estimate by least squares.
        let by_visits = self.between.as_ref().filter(|between| between.counts()).map(|between| {
            let (estimate, uncertainty) = between.estimate(combination);
            let expanded = uncertainty.expanded() + (estimate - value).abs();
            let dof = uncertainty.dof.clamp(self.dof.min(MIN_DOF), self.dof);
            Uncertainty::student(expanded / coverage_factor(dof, COVERAGE_PROBABILITY), dof)
        });
        let widest = by_visits.filter(|by_visits| by_visits.expanded() > wider.expanded()).unwrap_or(wider);
        Estimate { value, uncertainty: Some(widest) }
    }
}

/// 0 and the powers of ten of a grid, or 0 only.
fn ratios((first, last, step): (f64, f64, f64), has_grid: bool) -> Vec<f64> {
    let count = if has_grid { ((last - first) / step).round() as i32 + 1 } else { 0 };
    std::iter::once(0.0).chain((0..count).map(|k| 10_f64.powf(first + step * f64::from(k)))).collect()
}

/// log₁₀ of the probability of this gain of ln L by a variance that is zero: half of χ² with one degree of freedom.
fn log10_p_at_bound(gain: f64) -> f64 {
    (0.5 * chi_squared_tail(2.0 * gain.max(0.0), 1.0)).log10()
}

/// The rows explained by the columns and by random offsets of the visits alone.
#[derive(Debug, Clone, PartialEq)]
struct BetweenVisits {
    /// Estimates of all columns by least squares.
    coefficients: DVector<f64>,
    /// Effect of the offset of each visit on each coefficient.
    of_offsets: DMatrix<f64>,
    /// Effect on the coefficients of the rows without the means of their visits: the sum of the squares of a row is the factor of the
    /// variance.
    of_rows: DMatrix<f64>,
    /// Variance of a visit by the contrasts; it has that of the mean of the cycles in it.
    variance: f64,
    /// Number of contrasts.
    contrasts: usize,
    /// Degrees of freedom of `variance` by Welch and Satterthwaite: the contrasts have different parts of the offsets, and the one that
    /// compares the trend between the visits with that within them has hardly any.
    dof: f64,
    /// Variance of a row within the visits, with its degrees of freedom; `None` without one.
    within: Option<(f64, f64)>,
    /// Mean square of the contrasts.
    mean_square: f64,
}

impl BetweenVisits {
    /// `None` if the columns `x` determine the visits, or leave no degree of freedom.
    fn new(x: &DMatrix<f64>, y: &DVector<f64>, visits: &DMatrix<f64>) -> Option<Self> {
        let basis = orthonormal(x, f64::EPSILON * x.norm());
        let free = orthonormal(&(visits - &basis * basis.tr_mul(visits)), MIN_VISIT_PART * visits.norm());
        let contrasts = free.ncols();
        (contrasts > 0).then_some(())?;
        let gain = x.clone().pseudo_inverse(f64::EPSILON * x.norm()).ok()?;
        let coefficients = &gain * y;
        let residual = y - x * &coefficients;
        let square = free.tr_mul(&residual).norm_squared();
        let within_dof = x.nrows() as f64 - x.ncols() as f64 - contrasts as f64;
        let within = (within_dof > 0.0).then(|| ((residual.norm_squared() - square).max(0.0) / within_dof, within_dof));
        let means = orthonormal(visits, f64::EPSILON * visits.norm());
        let parts = free.tr_mul(visits).svd(false, false).singular_values.map(|part| part * part);
        Some(Self {
            dof: parts.sum().powi(2) / parts.norm_squared(),
            of_offsets: &gain * visits,
            of_rows: &gain - (&gain * &means) * means.transpose(),
            // E square = contrasts σ² + τ² trace.
            variance: square / parts.sum(),
            contrasts,
            within,
            mean_square: square / contrasts as f64,
            coefficients,
        })
    }

    /// The offsets count in the uncertainty: always with several contrasts, with one if it is significant.
    fn counts(&self) -> bool {
        let p = |(variance, dof): (f64, f64)| 2.0 * student_tail((self.mean_square / variance).sqrt(), dof);
        self.contrasts > 1 || self.within.is_none_or(|within| p(within) < POOLING_SIGNIFICANCE)
    }

    /// A linear combination with its uncertainty: U² is the sum of both U², each with its own degrees of freedom.
    fn estimate(&self, combination: &DVector<f64>) -> (f64, Uncertainty) {
        let between = Uncertainty::student((self.variance * self.of_offsets.tr_mul(combination).norm_squared()).sqrt(), self.dof);
        let of_rows = self.of_rows.tr_mul(combination).norm_squared();
        let within = self.within.map(|(variance, dof)| Uncertainty::student((variance * of_rows).sqrt(), dof));
        let expanded = between.expanded().hypot(within.map_or(0.0, |within| within.expanded()));
        let dof = match within {
            Some(within) if within.u > between.u => within.dof,
            _ => between.dof,
        };
        (combination.dot(&self.coefficients), Uncertainty::student(expanded / coverage_factor(dof, COVERAGE_PROBABILITY), dof))
    }
}

/// Orthonormal basis of the columns; singular values below `least` are zero.
fn orthonormal(columns: &DMatrix<f64>, least: f64) -> DMatrix<f64> {
    let svd = columns.clone().svd(true, false);
    let kept: Vec<usize> = (0..svd.singular_values.len()).filter(|k| svd.singular_values[*k] > least).collect();
    let u = svd.u.unwrap_or_else(|| DMatrix::zeros(columns.nrows(), 0));
    u.select_columns(&kept)
}

/// The scaled normal equations have no eigenvalue below this.
fn is_determined(x: &DMatrix<f64>, min_eigenvalue: f64) -> bool {
    let normal = x.tr_mul(x);
    let size: Vec<f64> = (0..normal.ncols()).map(|j| normal[(j, j)].sqrt()).collect();
    if x.nrows() < x.ncols() || size.iter().any(|s| !s.is_finite() || *s <= 0.0) {
        return false;
    }
    let scaled = DMatrix::from_fn(size.len(), size.len(), |i, j| normal[(i, j)] / (size[i] * size[j]));
    scaled.symmetric_eigen().eigenvalues.min() > min_eigenvalue
}

/// Covariance of the walk with a step of variance 1 per interval and mean zero over the session, times the roots of the weights on both
/// sides.
fn walk(rows: &[FitRow], total: f64, interval_s: f64) -> DMatrix<f64> {
    let n = rows.len();
    let begin_s = rows.iter().map(|row| row.time_s).min_or_infinity();
    let plain = DMatrix::from_fn(n, n, |i, j| (rows[i].time_s.min(rows[j].time_s) - begin_s) / interval_s);
    let shares = DVector::from_fn(n, |i, _| rows[i].weight / total);
    let means = &plain * &shares;
    let mean = shares.dot(&means);
    DMatrix::from_fn(n, n, |i, j| (plain[(i, j)] - means[i] - means[j] + mean) * (rows[i].weight * rows[j].weight).sqrt())
}

/// The rows for one λ, independent but for the offsets of the visits.
struct Whitened {
    walk_ratio: f64,
    x: DMatrix<f64>,
    y: DVector<f64>,
    /// Singular vectors and values of the visits.
    visits: DMatrix<f64>,
    visit_sizes: DVector<f64>,
    ln_spread: f64,
}

impl Whitened {
    /// Rows in the eigenvectors of the walk.
    fn new(x: &DMatrix<f64>, y: &DVector<f64>, visits: &DMatrix<f64>, eigenvalues: &DVector<f64>, walk_ratio: f64) -> Option<Self> {
        let spread = eigenvalues.map(|value| 1.0 + walk_ratio * value.max(0.0));
        let whiten = |m: &DMatrix<f64>| DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)] / spread[i].sqrt());
        let svd = whiten(visits).svd(true, false);
        Some(Self {
            walk_ratio,
            x: whiten(x),
            y: DVector::from_fn(y.len(), |i, _| y[i] / spread[i].sqrt()),
            visits: svd.u?,
            visit_sizes: svd.singular_values,
            ln_spread: spread.iter().map(|s| s.ln()).sum(),
        })
    }

    /// The fit for one μ; its weight is not set.
    fn node(&self, visit_ratio: f64, dof: f64) -> Option<Node> {
        let spread = self.visit_sizes.map(|size| 1.0 + visit_ratio * size * size);
        // (1 + μ Z Zᵀ)^(−1/2) changes the directions of the visits only.
        let shrink = DMatrix::from_diagonal(&spread.map(|s| 1.0 / s.sqrt() - 1.0));
        let whitened = &self.x + &self.visits * (&shrink * self.visits.tr_mul(&self.x));
        let right = &self.y + &self.visits * (&shrink * self.visits.tr_mul(&self.y));
        // Scaled columns: rates and shares differ by orders of magnitude.
        let size: Vec<f64> = (0..whitened.ncols()).map(|j| whitened.column(j).norm()).collect();
        let scaled = DMatrix::from_fn(whitened.nrows(), whitened.ncols(), |i, j| whitened[(i, j)] / size[j]);
        let normal = Cholesky::<f64, Dyn>::new(scaled.tr_mul(&scaled))?;
        let solution = normal.solve(&scaled.tr_mul(&right));
        let inverse = normal.inverse();
        // Rounding errors of exact data must not make the likelihood infinite.
        let floor = (1e-12 * right.amax()).powi(2);
        let variance = if dof > 0.0 { ((&right - &scaled * &solution).norm_squared() / dof).max(floor) } else { 0.0 };
        let ln_determinant =
            2.0 * normal.l().diagonal().iter().map(|d| d.ln()).sum::<f64>() + 2.0 * size.iter().map(|s| s.ln()).sum::<f64>();
        let ln_spread = self.ln_spread + spread.iter().map(|s| s.ln()).sum::<f64>();
        let log_likelihood = if dof > 0.0 { -0.5 * (ln_spread + ln_determinant + dof * variance.max(f64::MIN_POSITIVE).ln()) } else { 0.0 };
        Some(Node {
            walk_ratio: self.walk_ratio,
            visit_ratio,
            weight: 0.0,
            log_likelihood,
            coefficients: DVector::from_fn(size.len(), |j, _| solution[j] / size[j]),
            covariance: DMatrix::from_fn(size.len(), size.len(), |i, j| variance * inverse[(i, j)] / (size[i] * size[j])),
            variance,
        })
    }
}

/// At most [`MAX_ROWS`] rows: successive cycles of one visit, sequence and amplitude are averaged.
fn averaged(rows: &[FitRow]) -> Vec<FitRow> {
    let group = rows.len().div_ceil(MAX_ROWS);
    if group <= 1 {
        return rows.to_vec();
    }
    // Open groups of one visit, by sign and amplitude.
    let mut means: Vec<FitRow> = Vec::new();
    let mut open: Vec<FitRow> = Vec::new();
    for row in rows {
        if open.first().is_some_and(|first| first.visit != row.visit) {
            means.append(&mut open);
        }
        let same = |other: &FitRow| other.sign == row.sign && (other.amplitude_rad_s / row.amplitude_rad_s - 1.0).abs() < 0.05;
        match open.iter().position(same) {
            Some(k) => {
                let mean = &mut open[k];
                let weight = mean.weight + row.weight;
                let add = |old: f64, new: f64| (old * mean.weight + new * row.weight) / weight;
                (mean.time_s, mean.reading, mean.amplitude_rad_s) =
                    (add(mean.time_s, row.time_s), add(mean.reading, row.reading), add(mean.amplitude_rad_s, row.amplitude_rad_s));
                mean.weight = weight;
                if weight >= group as f64 {
                    means.push(open.remove(k));
                }
            }
            None => open.push(row.clone()),
        }
    }
    means.append(&mut open);
    means
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::peripherals::Noise;

    /// A session in the order A B B A, turned away and back between both visits to B: own drift 1.5, apparent −0.9, odd part 0.1, and a
    /// function of time.
    fn session(cycles: usize, amplitudes: &[f64], sigma: f64, seed: u64, moves: impl Fn(f64) -> f64) -> Vec<FitRow> {
        session_of(&[1.0, -1.0, -1.0, 1.0], cycles, amplitudes, sigma, seed, moves)
    }

    /// As [`session`], with the visits as of `drift run`: A B A B A, half as many cycles in the first and in the last.
    fn two_rounds(sigma: f64, seed: u64, offsets: [f64; 5]) -> Vec<FitRow> {
        let mut rows = session_of(&[1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0], 4, &[1.0], sigma, seed, |_| 0.0);
        for row in &mut rows {
            row.visit = row.visit.div_ceil(2);
            row.reading += offsets[row.visit];
        }
        rows
    }

    fn session_of(order: &[f64], cycles: usize, amplitudes: &[f64], sigma: f64, seed: u64, moves: impl Fn(f64) -> f64) -> Vec<FitRow> {
        let mut noise = Noise::new(seed, 0, 1.0);
        let mut rows = Vec::new();
        let mut t = 0.0;
        for (visit, sign_of_position) in order.iter().enumerate() {
            for amplitude in amplitudes {
                for k in 0..cycles / 2 {
                    let sign = if k % 2 == 0 { 1 } else { -1 };
                    let rate = 1.5 - 0.9 * sign_of_position + 0.1 * f64::from(sign) * amplitude + moves(t) + sigma * noise.draw();
                    rows.push(FitRow {
                        time_s: t,
                        reading: rate,
                        sign,
                        amplitude_rad_s: *amplitude,
                        regressors: vec![1.0, *sign_of_position],
                        visit,
                        weight: 1.0,
                    });
                    t += 15.0;
                }
            }
            t += if visit % 2 == 0 { 60.0 } else { 0.0 };
        }
        rows
    }

    #[test]
    fn exact_data_give_the_parameters() {
        // 112.5 s is the mean time of the cycles.
        let fit = SessionFit::new(&session(4, &[1.0], 0.0, 1, |t| 1e-3 * (t - 112.5))).unwrap();
        let (own, apparent) = (fit.estimate(&[1.0, 0.0]), fit.estimate(&[0.0, 1.0]));
        assert!((own.value - 1.5).abs() < 1e-9 && (apparent.value + 0.9).abs() < 1e-9, "{own:?} {apparent:?}");
        assert!((fit.trend().unwrap().value - 1e-3).abs() < 1e-9 && fit.has_trend());
        assert!(own.expanded().unwrap() < 1e-8 && fit.even().is_none());
    }

    /// Steady drift: Student's t, and no warning beyond the level of its test.
    #[test]
    fn intervals_of_a_steady_drift_have_their_coverage() {
        let (mut own, mut apparent, mut trends, mut walks, count) = (0, 0, 0, 0, 200);
        for seed in 0..count {
            let fit = SessionFit::new(&session(4, &[1.0], 0.01, 100 + seed, |_| 0.0)).unwrap();
            own += u32::from(fit.estimate(&[1.0, 0.0]).covers(1.5));
            apparent += u32::from(fit.estimate(&[0.0, 1.0]).covers(-0.9));
            trends += u32::from(fit.has_trend());
            walks += u32::from(fit.walk_rad_s_sqrt_s().is_some());
        }
        // 95 % of 200 with three standard errors: 181 at least.
        assert!(own >= 181 && apparent >= 181, "{own} {apparent}");
        assert!(trends <= 8 && walks <= 8, "{trends} {walks}");
    }

    /// A session whose drift walks by `step` per cycle, with the true mean over its cycles.
    fn walking(cycles: usize, step: f64, seed: u64) -> (Vec<FitRow>, f64) {
        let mut step = Noise::new(900 + seed, 1, step);
        let mut level = 0.0;
        let levels: Vec<f64> = (0..2 * cycles + 20)
            .map(|_| {
                level += step.draw();
                level
            })
            .collect();
        let rows = session(cycles, &[1.0], 0.01, 500 + seed, |t| levels[(t / 15.0) as usize]);
        let mean = rows.iter().map(|row| levels[(row.time_s / 15.0) as usize]).sum::<f64>() / rows.len() as f64;
        (rows, 1.5 + mean)
    }

    /// A random walk whose step per cycle is six times the scatter: the interval of the apparent drift follows it.
    #[test]
    fn a_random_walk_is_covered() {
        let (mut own, mut apparent, count) = (0, 0, 200);
        for seed in 0..count {
            let (rows, truth) = walking(10, 0.06, seed);
            let fit = SessionFit::new(&rows).unwrap();
            own += u32::from(fit.estimate(&[1.0, 0.0]).covers(truth));
            apparent += u32::from(fit.estimate(&[0.0, 1.0]).covers(-0.9));
        }
        assert!(own >= 181 && apparent >= 181, "{own} {apparent}");
    }

    /// 20 cycles leave 16 degrees of freedom: with them the expected gain of −2 ln L by the walk is about 9, and chance hides it in half of
    /// the sessions.
    #[test]
    fn a_random_walk_is_reported_in_a_longer_session() {
        let is_reported = |seed: &u64| {
            let fit = SessionFit::new(&walking(40, 0.06, *seed).0).unwrap();
            fit.walk_rad_s_sqrt_s().is_some_and(|k| (0.5..2.0).contains(&(k * 15_f64.sqrt() / 0.06)))
        };
        let reported = (0..50).filter(is_reported).count();
        assert!(reported >= 48, "{reported}");
    }

    /// Offsets of the visits, 20 times the scatter of a cycle.
    #[test]
    fn offsets_of_the_visits_widen_the_interval_and_are_reported() {
        let expanded = |fit: &SessionFit| fit.estimate(&[0.0, 1.0]).expanded().unwrap();
        let calm = SessionFit::new(&session(10, &[1.0], 0.01, 7, |_| 0.0)).unwrap();
        assert!(calm.visits().unwrap().log10_p > LOG10_SIGNIFICANCE);
        let (mut reported, mut wide) = (0, 0);
        for seed in 0..40 {
            let mut offset = Noise::new(seed, 5, 0.2);
            let offsets: Vec<f64> = (0..4).map(|_| offset.draw()).collect();
            let mut rows = session(10, &[1.0], 0.01, 700 + seed, |_| 0.0);
            rows.iter_mut().for_each(|row| row.reading += offsets[row.visit]);
            let fit = SessionFit::new(&rows).unwrap();
            reported += u32::from(fit.visits().unwrap().log10_p < LOG10_SIGNIFICANCE);
            wide += u32::from(expanded(&fit) > 5.0 * expanded(&calm));
        }
        assert!(reported > 30 && wide > 30, "{reported} {wide}");
    }

    /// Counts the sessions whose own and apparent drift are covered.
    fn covered(sessions: impl Iterator<Item = Vec<FitRow>>) -> [u32; 2] {
        sessions.fold([0; 2], |[own, apparent], rows| {
            let fit = SessionFit::new(&rows).unwrap();
            assert_eq!(fit.free_visits(), 3);
            let is_covered = |combination: [f64; 2], truth: f64| u32::from(fit.estimate(&combination).covers(truth));
            [own + is_covered([1.0, 0.0], 1.5), apparent + is_covered([0.0, 1.0], -0.9)]
        })
    }

    /// Offsets of half, one, three and twenty times the scatter of a cycle.
    #[test]
    fn offsets_of_the_visits_are_covered() {
        for (k, size) in [0.005, 0.01, 0.03, 0.2].into_iter().enumerate() {
            let sessions = (0..200).map(|seed| {
                let mut offset = Noise::new(seed, 40 + k as u32, size);
                two_rounds(0.01, 3000 + seed, std::array::from_fn(|_| offset.draw()))
            });
            // 95 % of 200 less three standard errors: 181 at least.
            let found = covered(sessions);
            assert!(found.iter().all(|count| *count >= 181), "{size}: {found:?}");
        }
    }

    /// One visit is off by 20 times the scatter of a cycle, whichever visit.
    #[test]
    fn one_visit_that_is_off_is_covered() {
        for visit in 0..5 {
            let mut offsets = [0.0; 5];
            offsets[visit] = 0.2;
            let found = covered((0..40).map(|seed| two_rounds(0.01, 4000 + seed, offsets)));
            assert!(found.iter().all(|count| *count >= 38), "{visit}: {found:?}");
        }
    }

    /// A B A: the difference of both visits to A is the only measure of the offsets. The own drift is wrong by 5 times the scatter of a
    /// cycle.
    #[test]
    fn one_contrast_has_students_t_of_one_degree_of_freedom() {
        let mut count = 0;
        for seed in 0..40 {
            let mut rows = session(10, &[1.0], 0.01, 5000 + seed, |_| 0.0);
            for row in &mut rows {
                row.reading += if row.visit == 3 { 0.2 } else { 0.0 };
                row.visit = row.visit.div_ceil(2);
            }
            let fit = SessionFit::new(&rows).unwrap();
            assert_eq!(fit.free_visits(), 1);
            count += u32::from(fit.estimate(&[1.0, 0.0]).covers(1.5));
        }
        assert!(count >= 38, "{count}");
    }

    #[test]
    fn long_sessions_are_averaged_in_groups() {
        let rows = session(2000, &[1.0, 0.4], 0.01, 3, |_| 0.0);
        assert_eq!(rows.len(), 8000);
        let groups = averaged(&rows);
        assert!(
            groups.len() <= MAX_ROWS + 16 && (groups.iter().map(|row| row.weight).sum::<f64>() - 8000.0).abs() < 1e-6,
            "{}",
            groups.len()
        );
        let fit = SessionFit::new(&rows).unwrap();
        let own = fit.estimate(&[1.0, 0.0]);
        assert!(own.covers(1.5) && own.expanded().unwrap() < 0.002, "{own:?}");
        assert!(fit.even().is_some_and(|even| even.covers(0.0)));
    }

    #[test]
    fn too_few_cycles_have_no_uncertainty() {
        let rows: Vec<FitRow> = session(2, &[1.0], 0.01, 3, |_| 0.0);
        assert!(SessionFit::new(&[rows[0].clone(), rows[3].clone()]).is_none(), "one position");
        let two = SessionFit::new(&rows[..2]).unwrap();
        let own = two.estimate(&[1.0, 0.0]);
        assert!(own.uncertainty.is_none() && (own.value - 1.6).abs() < 0.1, "{own:?}");
    }
}
