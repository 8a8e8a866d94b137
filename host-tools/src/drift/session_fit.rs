//! Least squares over the cycles of a session whose drift moves.
//!
//! Input: the drift rate of each cycle with its time, its visit (an uninterrupted stay in one position) and the regressors of its position. Output:
//! estimates of linear combinations of the position's parameters, the trend, the inequality of the pulses, the scatter between visits.
//!
//! Model of the rate of cycle i: x_i β + odd s_i w_i + even w_i + r (t_i − t̄) + walk(t_i) + white scatter. *odd* holds what changes its sign with
//! the sequence (lag of the torquer), *even* what does not (unequal pulses; only with two amplitudes w), r is the trend. The random walk has a mean of zero
//! over the session: the own drift is the mean over the cycles, and its own movement is no error of it.
//!
//! The ratio λ of the variance of the walk per cycle to that of the white scatter is not known. The result is averaged over λ: for each λ of a grid the
//! estimates are Student's with n − p degrees of freedom; the weight is the restricted likelihood times λ^¼, and times 10 for λ = 0. The weights
//! were chosen by simulation: steady drift, random walk, ramp and flicker noise are covered with 4 and with 10 cycles in each position
//! (docs/metrology-coverage.md). The larger of this interval and that for λ = 0 is reported. Limits: a drift that jumps between visits is not a walk;
//! it shows as scatter between visits, which is tested and, where significant, added.

use super::inequality::MIN_AMPLITUDE_RATIO;
use crate::statistics::Extremes;
use crate::statistics::distributions::log10_f_tail;
use crate::statistics::robust::median;
use crate::statistics::student_mixture::{Component, StudentMixture};
use crate::statistics::uncertainty::{COVERAGE_PROBABILITY, Contribution, Estimate, Quantity, Uncertainty, coverage_factor};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Most rows of the fit: longer sessions are averaged in groups of equal conditions.
const MAX_ROWS: usize = 400;
/// Grid of log₁₀ λ: first and last value, and step.
const LOG_RATIOS: (f64, f64, f64) = (-3.0, 5.0, 0.5);
/// Weight of λ = 0 and exponent of the weight of the others, see above.
const STEADY_WEIGHT: f64 = 10.0;
const RATIO_EXPONENT: f64 = 0.25;
/// Smallest eigenvalue of the scaled normal equations with which an additional column is separable.
const MIN_EIGENVALUE: f64 = 1e-4;
/// log₁₀ of the significance level of trend, walk and scatter between visits.
pub const LOG10_SIGNIFICANCE: f64 = -2.0;
/// Coverage probability of the test of the trend.
const TREND_PROBABILITY: f64 = 0.99;
/// Difference of −2 ln L from which a walk is reported: 1 % for one degree of freedom at its bound.
const WALK_LIKELIHOOD_RATIO: f64 = 5.41;

/// One cycle, or a mean of several.
#[derive(Debug, Clone, PartialEq)]
pub struct FitRow {
    /// Middle of the cycle, s.
    pub time_s: f64,
    /// Drift rate, rad/s.
    pub rate_rad_s: f64,
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

/// The fit for one λ.
#[derive(Debug, Clone, PartialEq)]
struct Node {
    ratio: f64,
    weight: f64,
    log_likelihood: f64,
    coefficients: DVector<f64>,
    covariance: DMatrix<f64>,
    variance: f64,
}

/// Scatter between the visits beyond that of the cycles.
#[derive(Debug, Clone, PartialEq)]
pub struct VisitScatter {
    /// log₁₀ of the probability that the scatter of the cycles alone leaves as much.
    pub log10_p: f64,
    /// Standard deviation of a visit, rad/s; 0 where the visits agree.
    pub sigma_rad_s: f64,
    /// Degrees of freedom.
    pub dof: f64,
    /// Weight of each visit in each coefficient.
    gains: DMatrix<f64>,
}

/// A fitted session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionFit {
    positions: usize,
    columns: Vec<Column>,
    nodes: Vec<Node>,
    dof: f64,
    visits: Option<VisitScatter>,
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
            let has_room = rows.len() > positions + columns.len();
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
        let y = DVector::from_fn(rows.len(), |i, _| rows[i].rate_rad_s * weights[i].sqrt());
        let mut times: Vec<f64> = rows.iter().map(|row| row.time_s).collect();
        times.sort_by(f64::total_cmp);
        let interval_s = median(times.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0)).unwrap_or(1.0);
        let dof = rows.len() as f64 - x.ncols() as f64;
        let walk = walk(&rows, total, interval_s).symmetric_eigen();
        let (x, y) = (walk.eigenvectors.tr_mul(&x), walk.eigenvectors.tr_mul(&y));
        let last = ((LOG_RATIOS.1 - LOG_RATIOS.0) / LOG_RATIOS.2).round() as i32;
        let ratios = (0..=last).map(|k| 10_f64.powf(LOG_RATIOS.0 + LOG_RATIOS.2 * f64::from(k)));
        // Without a degree of freedom, or without times, only λ = 0.
        let ratios = std::iter::once(0.0).chain(ratios.filter(|_| dof > 0.0 && end_s > begin_s));
        let mut nodes: Vec<Node> = ratios.filter_map(|ratio| node(&x, &y, &walk.eigenvalues, ratio, dof)).collect();
        let greatest = nodes.iter().map(|node| node.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
        for node in &mut nodes {
            let prior = if node.ratio == 0.0 { STEADY_WEIGHT } else { node.ratio.powf(RATIO_EXPONENT) };
            node.weight = prior * (node.log_likelihood - greatest).exp();
        }
        let mut fit = Self { positions, columns, nodes, dof, visits: None, interval_s, duration_s: end_s - begin_s };
        fit.visits = fit.visit_scatter(&rows, &weights, &walk.eigenvectors, &walk.eigenvalues, &x, &y);
        Some(fit)
    }

    /// Estimate of a linear combination of the parameters of the positions, with the scatter between visits where it is significant.
    pub fn estimate(&self, combination: &[f64]) -> Estimate {
        let mut all = combination.to_vec();
        all.resize(self.positions + self.columns.len(), 0.0);
        let within = self.combination(&DVector::from_vec(all.clone()));
        let Some((visits, uncertainty)) = self.significant_visits().zip(within.uncertainty) else { return within };
        let gain = visits.gains.tr_mul(&DVector::from_vec(all)).norm();
        let contributions = vec![
            Contribution::type_a("cycles", uncertainty.u, uncertainty.dof, ()),
            Contribution::type_a("visits", gain * visits.sigma_rad_s, visits.dof, ()),
        ];
        Quantity::<(), ()>::new("rate", "rad/s", within.value, contributions).estimate()
    }

    /// The same without the scatter between visits.
    pub fn within_visits(&self, combination: &[f64]) -> Estimate {
        let mut all = combination.to_vec();
        all.resize(self.positions + self.columns.len(), 0.0);
        self.combination(&DVector::from_vec(all))
    }

    /// Standard uncertainty by the scatter between visits with its degrees of freedom, where it is significant.
    pub fn between_visits(&self, combination: &[f64]) -> Option<(f64, f64)> {
        let mut all = combination.to_vec();
        all.resize(self.positions + self.columns.len(), 0.0);
        let visits = self.significant_visits()?;
        Some((visits.gains.tr_mul(&DVector::from_vec(all)).norm() * visits.sigma_rad_s, visits.dof))
    }

    /// Test of the scatter between visits; `None` with one visit to each position.
    pub fn visits(&self) -> Option<&VisitScatter> {
        self.visits.as_ref()
    }

    fn significant_visits(&self) -> Option<&VisitScatter> {
        self.visits.as_ref().filter(|visits| visits.log10_p < LOG10_SIGNIFICANCE)
    }

    /// Part of the rate that is even in the pulses, relative to the mean amplitude: −ε/2 times the mean amplitude, rad/s.
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
        let steady = self.nodes.first()?;
        let best = self.nodes.iter().max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))?;
        let ratio = 2.0 * (best.log_likelihood - steady.log_likelihood);
        (best.ratio > 0.0 && ratio > WALK_LIKELIHOOD_RATIO).then(|| (best.ratio * best.variance / self.interval_s).sqrt())
    }

    fn additional(&self, column: Column) -> Option<Estimate> {
        let place = self.columns.iter().position(|c| *c == column)?;
        let mut all = DVector::zeros(self.positions + self.columns.len());
        all[self.positions + place] = 1.0;
        Some(self.combination(&all))
    }

    fn combination(&self, combination: &DVector<f64>) -> Estimate {
        let component = |node: &Node| Component {
            weight: node.weight,
            location: combination.dot(&node.coefficients),
            scale: combination.dot(&(&node.covariance * combination)).max(0.0).sqrt(),
        };
        let components: Vec<Component> = self.nodes.iter().map(component).collect();
        let steady = components.first().copied();
        let Some(mixture) = StudentMixture::new(components, self.dof) else {
            return Estimate { value: steady.map_or(f64::NAN, |c| c.location), uncertainty: None };
        };
        let alone = steady.map(|c| Uncertainty::student(c.scale, self.dof));
        // Not more degrees of freedom than the cycles have: U stays.
        let averaged = mixture.uncertainty();
        let averaged = if averaged.dof > self.dof {
            let k = coverage_factor(self.dof, COVERAGE_PROBABILITY);
            Uncertainty::student(averaged.expanded() / k, self.dof)
        } else {
            averaged
        };
        let wider = alone.filter(|alone| alone.expanded() > averaged.expanded()).unwrap_or(averaged);
        Estimate { value: mixture.mean(), uncertainty: Some(wider) }
    }

    /// Scatter between visits under the most likely λ: F test of one mean for each visit.
    fn visit_scatter(
        &self,
        rows: &[FitRow],
        weights: &[f64],
        eigenvectors: &DMatrix<f64>,
        eigenvalues: &DVector<f64>,
        x: &DMatrix<f64>,
        y: &DVector<f64>,
    ) -> Option<VisitScatter> {
        let best = self.nodes.iter().max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))?;
        let visits = rows.iter().map(|row| row.visit).max()? + 1;
        let members = DMatrix::from_fn(rows.len(), visits, |i, v| if rows[i].visit == v { weights[i].sqrt() } else { 0.0 });
        let whiten =
            |m: DMatrix<f64>| DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)] / (1.0 + best.ratio * eigenvalues[i]).sqrt());
        let (x, z) = (whiten(x.clone()), whiten(eigenvectors.tr_mul(&members)));
        let y = DVector::from_fn(y.len(), |i, _| y[i] / (1.0 + best.ratio * eigenvalues[i]).sqrt());
        // Columns of the visits that the model does not explain.
        let normal = Cholesky::<f64, Dyn>::new(x.tr_mul(&x))?;
        let project = |m: &DMatrix<f64>| m - &x * normal.solve(&x.tr_mul(m));
        let free = project(&z);
        let residual = &y - &x * normal.solve(&x.tr_mul(&y));
        let svd = free.clone().svd(true, false);
        let basis = svd.u?;
        let used: Vec<usize> = (0..svd.singular_values.len()).filter(|k| svd.singular_values[*k] > 1e-6 * z.norm()).collect();
        let explained: f64 = used.iter().map(|k| basis.column(*k).dot(&residual).powi(2)).sum();
        let (q, dof) = (used.len() as f64, self.dof - used.len() as f64);
        if q < 1.0 || dof < 1.0 {
            return None;
        }
        let within = (residual.norm_squared() - explained).max(0.0) / dof;
        let statistic = explained / q / within.max(f64::MIN_POSITIVE);
        let variance = ((explained - q * within) / free.norm_squared()).max(0.0);
        let gains = normal.solve(&x.tr_mul(&z));
        Some(VisitScatter { log10_p: log10_f_tail(statistic, q, dof), sigma_rad_s: variance.sqrt(), dof: q, gains })
    }
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

/// Covariance of the walk with a step of variance 1 per interval and mean zero over the session, times the roots of the weights on both sides.
fn walk(rows: &[FitRow], total: f64, interval_s: f64) -> DMatrix<f64> {
    let n = rows.len();
    let begin_s = rows.iter().map(|row| row.time_s).min_or_infinity();
    let plain = DMatrix::from_fn(n, n, |i, j| (rows[i].time_s.min(rows[j].time_s) - begin_s) / interval_s);
    let shares = DVector::from_fn(n, |i, _| rows[i].weight / total);
    let means = &plain * &shares;
    let mean = shares.dot(&means);
    DMatrix::from_fn(n, n, |i, j| (plain[(i, j)] - means[i] - means[j] + mean) * (rows[i].weight * rows[j].weight).sqrt())
}

/// The fit for one λ, in the eigenvectors of the walk; the weight is not set.
fn node(x: &DMatrix<f64>, y: &DVector<f64>, eigenvalues: &DVector<f64>, ratio: f64, dof: f64) -> Option<Node> {
    let spread = eigenvalues.map(|value| 1.0 + ratio * value.max(0.0));
    let whitened = DMatrix::from_fn(x.nrows(), x.ncols(), |i, j| x[(i, j)] / spread[i].sqrt());
    let right = DVector::from_fn(y.len(), |i, _| y[i] / spread[i].sqrt());
    // Scaled columns: rates and shares differ by orders of magnitude.
    let size: Vec<f64> = (0..whitened.ncols()).map(|j| whitened.column(j).norm()).collect();
    let scaled = DMatrix::from_fn(x.nrows(), x.ncols(), |i, j| whitened[(i, j)] / size[j]);
    let normal = Cholesky::<f64, Dyn>::new(scaled.tr_mul(&scaled))?;
    let solution = normal.solve(&scaled.tr_mul(&right));
    let inverse = normal.inverse();
    // Rounding errors of exact data must not make the likelihood infinite.
    let floor = (1e-12 * right.amax()).powi(2);
    let variance = if dof > 0.0 { ((&right - &scaled * &solution).norm_squared() / dof).max(floor) } else { 0.0 };
    let ln_determinant = 2.0 * normal.l().diagonal().iter().map(|d| d.ln()).sum::<f64>() + 2.0 * size.iter().map(|s| s.ln()).sum::<f64>();
    let log_likelihood = if dof > 0.0 {
        -0.5 * (spread.iter().map(|s| s.ln()).sum::<f64>() + ln_determinant + dof * variance.max(f64::MIN_POSITIVE).ln())
    } else {
        0.0
    };
    Some(Node {
        ratio,
        weight: 0.0,
        log_likelihood,
        coefficients: DVector::from_fn(size.len(), |j, _| solution[j] / size[j]),
        covariance: DMatrix::from_fn(size.len(), size.len(), |i, j| variance * inverse[(i, j)] / (size[i] * size[j])),
        variance,
    })
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
                (mean.time_s, mean.rate_rad_s, mean.amplitude_rad_s) =
                    (add(mean.time_s, row.time_s), add(mean.rate_rad_s, row.rate_rad_s), add(mean.amplitude_rad_s, row.amplitude_rad_s));
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

    /// A session in the order A B B A: own drift 1.5, apparent −0.9, odd part 0.1, and a function of time.
    fn session(cycles: usize, amplitudes: &[f64], sigma: f64, seed: u64, moves: impl Fn(f64) -> f64) -> Vec<FitRow> {
        let mut noise = Noise::new(seed, 0, 1.0);
        let mut rows = Vec::new();
        let mut t = 0.0;
        for (visit, sign_of_position) in [1.0, -1.0, -1.0, 1.0].into_iter().enumerate() {
            for amplitude in amplitudes {
                for k in 0..cycles / 2 {
                    let sign = if k % 2 == 0 { 1 } else { -1 };
                    let rate = 1.5 - 0.9 * sign_of_position + 0.1 * f64::from(sign) * amplitude + moves(t) + sigma * noise.draw();
                    rows.push(FitRow {
                        time_s: t,
                        rate_rad_s: rate,
                        sign,
                        amplitude_rad_s: *amplitude,
                        regressors: vec![1.0, sign_of_position],
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
        let fit = SessionFit::new(&session(4, &[1.0], 0.0, 1, |t| 1e-3 * (t - 165.0))).unwrap();
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

    /// A random walk whose step per cycle is six times the scatter: the interval of the apparent drift follows it.
    #[test]
    fn a_random_walk_is_covered_and_reported() {
        let (mut own, mut apparent, mut reported, count) = (0, 0, 0, 200);
        for seed in 0..count {
            let mut step = Noise::new(900 + seed, 1, 0.06);
            let mut level = 0.0;
            let levels: Vec<f64> = (0..60)
                .map(|_| {
                    level += step.draw();
                    level
                })
                .collect();
            let rows = session(10, &[1.0], 0.01, 500 + seed, |t| levels[(t / 15.0) as usize]);
            let mean = rows.iter().map(|row| levels[(row.time_s / 15.0) as usize]).sum::<f64>() / rows.len() as f64;
            let fit = SessionFit::new(&rows).unwrap();
            own += u32::from(fit.estimate(&[1.0, 0.0]).covers(1.5 + mean));
            apparent += u32::from(fit.estimate(&[0.0, 1.0]).covers(-0.9));
            reported += u32::from(fit.walk_rad_s_sqrt_s().is_some_and(|k| (0.5..2.0).contains(&(k * 15_f64.sqrt() / 0.06))));
        }
        assert!(own >= 181 && apparent >= 181 && reported > 160, "{own} {apparent} {reported}");
    }

    #[test]
    fn a_jump_between_visits_is_scatter_between_visits() {
        // The last visit is off by 0.2, 20 times the scatter.
        let mut rows = session(10, &[1.0], 0.01, 7, |_| 0.0);
        rows.iter_mut().filter(|row| row.visit == 3).for_each(|row| row.rate_rad_s += 0.2);
        let fit = SessionFit::new(&rows).unwrap();
        let visits = fit.visits().unwrap();
        let apparent = fit.estimate(&[0.0, 1.0]);
        let without = fit.within_visits(&[0.0, 1.0]);
        assert!(apparent.covers(-0.9), "{apparent:?} {visits:?}");
        assert!(apparent.expanded() >= without.expanded());
        let calm = SessionFit::new(&session(10, &[1.0], 0.01, 7, |_| 0.0)).unwrap();
        assert!(calm.visits().unwrap().log10_p > LOG10_SIGNIFICANCE && calm.between_visits(&[1.0, 0.0]).is_none());
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
