//! Likelihood of whitened residuals, and BIC.
//!
//! Two models of the same logs are compared by n ln(RSS₀/RSS₁), summed over the channels: the likelihood ratio where the variance of the
//! noise is not known. Correlated residuals are not independent samples. Both series therefore pass the same whitening filter, an
//! autoregression fitted to the residuals of the better model (Box, Jenkins, Time Series Analysis), and each model is evaluated at the
//! parameters that are best for the whitened residuals (generalised least squares). Increments and rates computed from an encoder overlap:
//! of these only every m-th row is used.

use std::collections::VecDeque;
use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::identify::explain::criteria::WhiteningCriteria;
use crate::identify::fit::InitialStates;
use crate::identify::fit::normal_equations::MAX_UNKNOWNS;
use crate::identify::fit::parameters::Dual;
use crate::identify::fit::simulate::run;
use crate::identify::fit::system::{FitScalar, System};
use crate::identify::fit::{self, Parameters};
use crate::recording::PreparedLog;

/// A whitening filter per channel.
pub struct Whitener {
    filters: Vec<Filter>,
    min_square_ratio: f64,
}

/// Whitening filter of one channel.
struct Filter {
    /// One row out of this many is an independent sample.
    stride: usize,
    coefficients: Vec<f64>,
}

/// Whitened sums of squares of one model.
#[derive(Debug, Clone)]
pub struct WhitenedSums {
    /// By channel and log: (sum of squares, number of samples) of the fitted rows.
    fitted: Vec<Vec<(f64, f64)>>,
    /// By channel and log: (sum of squares, number of samples) of the held-out rows.
    held_out: Vec<Vec<(f64, f64)>>,
    min_square_ratio: f64,
}

impl Whitener {
    /// The filter that whitens these residuals (by channel, a value per row).
    pub fn of(data: &PreparedLog, residuals: &[&[f64]], criteria: &WhiteningCriteria) -> Self {
        let filters = residuals
            .iter()
            .enumerate()
            .map(|(c, residual)| {
                let stride = fit::differencing_rows(data, c).max(1);
                let mut covariances = vec![0.0; criteria.max_order + 1];
                let mut n = 0usize;
                for run in finite_runs(data, residual, stride) {
                    for (k, a) in run.iter().enumerate() {
                        n += 1;
                        for (lag, sum) in covariances.iter_mut().enumerate().take(k + 1) {
                            *sum += a * run[k - lag];
                        }
                    }
                }
                let order = criteria.max_order.min(n / criteria.rows_per_coefficient);
                Filter { stride, coefficients: autoregression(&covariances[..=order], n) }
            })
            .collect();
        Whitener { filters, min_square_ratio: criteria.min_square_ratio }
    }

    /// Changes nothing: every row of each of so many channels is a sample.
    pub fn plain(channels: usize) -> Self {
        let filters = (0..channels).map(|_| Filter { stride: 1, coefficients: Vec::new() }).collect();
        Whitener { filters, min_square_ratio: WhiteningCriteria::default().min_square_ratio }
    }

    /// Every how many rows of a channel is an independent sample.
    pub fn stride(&self, channel: usize) -> usize {
        self.filters[channel].stride
    }

    /// Innovations of a channel's residual at every [`Whitener::stride`]-th row of each segment; segments are separated by NaN.
    pub fn innovations(&self, data: &PreparedLog, channel: usize, residual: &[f64]) -> Vec<f64> {
        let Filter { stride, coefficients } = &self.filters[channel];
        let mut list = Vec::new();
        for rows in &data.segments {
            list.extend(rows.clone().step_by(*stride).map(|row| residual[row]));
            list.push(f64::NAN);
        }
        filtered(&list, coefficients)
    }

    /// Innovations of a series by its own autoregression; NaN separates its parts.
    pub fn innovations_of(series: &[f64]) -> Vec<f64> {
        let criteria = WhiteningCriteria::default();
        let mut covariances = vec![0.0; criteria.max_order + 1];
        for run in series.split(|v| !v.is_finite()) {
            for (lag, sum) in covariances.iter_mut().enumerate() {
                *sum += run.iter().zip(run.get(lag..).unwrap_or(&[])).map(|(a, b)| a * b).sum::<f64>();
            }
        }
        let n = series.iter().filter(|v| v.is_finite()).count();
        let order = criteria.max_order.min(n / criteria.rows_per_coefficient);
        filtered(series, &autoregression(&covariances[..=order], n))
    }

    /// Whitened sums of squares of a model on each of the logs (`log_rows`), at the parameters that are best for the whitened residuals.
    ///
    /// The model was fitted to the residuals themselves. Where these are correlated, other parameters leave less of the whitened residuals;
    /// one step of the linear model goes there, in the same way for every model.
    pub fn sums(
        &self,
        system: &System,
        parameters: &Parameters,
        starts: &InitialStates,
        data: &PreparedLog,
        log_rows: &[Range<usize>],
    ) -> WhitenedSums {
        match parameters.free().len() + starts.kinds.len() {
            0..=8 => self.sums_in::<8>(system, parameters, starts, data, log_rows),
            9..=12 => self.sums_in::<12>(system, parameters, starts, data, log_rows),
            13..=16 => self.sums_in::<16>(system, parameters, starts, data, log_rows),
            _ => self.sums_in::<32>(system, parameters, starts, data, log_rows),
        }
    }

    /// Information of the fitted rows about the unknowns, by each of the `views` of one simulation.
    pub fn information(
        system: &System,
        parameters: &Parameters,
        starts: &InitialStates,
        data: &PreparedLog,
        log_rows: &[Range<usize>],
        views: &[View],
    ) -> Vec<(DMatrix<f64>, Vec<DVector<f64>>)> {
        let products = products::<MAX_UNKNOWNS>(system, parameters, starts, data, log_rows, views);
        let of_view = |(view, products): (&View, &Products<MAX_UNKNOWNS>)| {
            let (information, _, gradients) = view.whitener.equations(products);
            (information, gradients)
        };
        views.iter().zip(&products).map(of_view).collect()
    }

    /// Residuals by channel at the unknowns that are best for the whitened residuals, by one step of the linear model; NaN where a row is
    /// not compared. `None` where the step is not determined. Under coloured noise the fit to the residuals themselves is a few standard
    /// errors away from there, and what that leaves depends on the motion.
    pub fn residuals_at_best(
        &self,
        system: &System,
        parameters: &Parameters,
        starts: &InitialStates,
        data: &PreparedLog,
        log_rows: &[Range<usize>],
    ) -> Option<Vec<Vec<f64>>> {
        let products = products::<MAX_UNKNOWNS>(system, parameters, starts, data, log_rows, &[self.view()]);
        let steps = self.steps(products.first()?)?;
        let rig = system.rig::<Dual<MAX_UNKNOWNS>>(parameters, data.driven);
        let mut residuals = vec![vec![f64::NAN; data.len()]; self.filters.len()];
        for (segment, (rows, step)) in data.segments.iter().zip(&steps).enumerate() {
            let states = (starts.kinds.as_slice(), starts.values[segment].as_slice());
            run(&rig, data, segment, states, parameters.free().len(), &mut |c, row, value: &Dual<MAX_UNKNOWNS>| {
                if let Some(target) = data.target(c, row, rows.start) {
                    let moved: f64 = value.slopes.iter().zip(step).map(|(d, s)| d * s).sum();
                    residuals[c][row] = target - value.re - moved;
                }
                true
            });
        }
        Some(residuals)
    }

    /// The residuals through this filter, without changes of the readings.
    fn view(&self) -> View<'_> {
        View { whitener: self, changes: &[] }
    }

    fn sums_in<const N: usize>(
        &self,
        system: &System,
        parameters: &Parameters,
        starts: &InitialStates,
        data: &PreparedLog,
        log_rows: &[Range<usize>],
    ) -> WhitenedSums
    where
        Dual<N>: FitScalar,
    {
        let products = products::<N>(system, parameters, starts, data, log_rows, &[self.view()]).remove(0);
        let steps = self.steps(&products);
        let mut fitted = vec![vec![(0.0, 0.0); log_rows.len()]; self.filters.len()];
        let mut held_out = fitted.clone();
        for (cell, key) in products.cells.iter().zip(&products.keys) {
            let sums = if key.held_out { &mut held_out } else { &mut fitted };
            let after = steps.as_ref().map_or(cell.square, |steps| cell.after(&steps[key.segment], products.lanes));
            let sum = &mut sums[key.channel][key.log];
            sum.0 += after.max(0.0);
            sum.1 += cell.rows;
        }
        WhitenedSums { fitted, held_out, min_square_ratio: self.min_square_ratio }
    }

    /// Step of each segment's unknowns that is best for the fitted rows; `None` where the step is not determined.
    fn steps<const N: usize>(&self, products: &Products<N>) -> Option<Vec<Vec<f64>>> {
        let (mut information, gradient, _) = self.equations(products);
        for k in 0..information.nrows() {
            let d = information[(k, k)];
            information[(k, k)] = if d > 0.0 { d * (1.0 + RIDGE) } else { 1.0 };
        }
        let step = Cholesky::new(information)?.solve(&gradient);
        let of_segment = |segment: usize| (0..products.lanes).map(|lane| step[products.index(lane, segment)]).collect();
        step.iter().all(|s| s.is_finite()).then(|| (0..products.segments).map(of_segment).collect())
    }

    /// Normal equations of the fitted rows, each channel weighted by its own whitened variance: information, gradient by the residuals,
    /// gradients by the changes.
    fn equations<const N: usize>(&self, products: &Products<N>) -> (DMatrix<f64>, DVector<f64>, Vec<DVector<f64>>) {
        let mut sizes = vec![(0.0, 0.0); self.filters.len()];
        for (cell, key) in products.fitted() {
            sizes[key.channel].0 += cell.square;
            sizes[key.channel].1 += cell.rows;
        }
        let whole = products.free + (products.lanes - products.free) * products.segments;
        let mut information = DMatrix::<f64>::zeros(whole, whole);
        let mut gradient = DVector::<f64>::zeros(whole);
        let mut by_changes = vec![gradient.clone(); products.changes];
        for (cell, key) in products.fitted() {
            let weight = sizes[key.channel].1 / sizes[key.channel].0.max(f64::MIN_POSITIVE);
            for i in 0..products.lanes {
                gradient[products.index(i, key.segment)] += weight * cell.g[i];
                for (gradient, of_change) in by_changes.iter_mut().zip(&cell.by_changes) {
                    gradient[products.index(i, key.segment)] += weight * of_change[i];
                }
                for j in 0..products.lanes {
                    information[(products.index(i, key.segment), products.index(j, key.segment))] += weight * cell.product(i, j);
                }
            }
        }
        (information, gradient, by_changes)
    }
}

/// Relative increase of the diagonal of the normal equations, so that their factorisation exists.
const RIDGE: f64 = 1e-9;

/// What is summed of a simulation. With a gradient for each of the `changes` of the readings (by channel and row, filtered by the whitener): the
/// information times the unknowns that imitate the change best.
#[derive(Clone, Copy)]
pub struct View<'w> {
    /// The filter. Each channel is weighted by its whitened variance.
    pub whitener: &'w Whitener,
    /// Changes of the readings.
    pub changes: &'w [Vec<Vec<f64>>],
}

/// The last rows of a channel, which its filter needs: residual and derivatives.
type Past<const N: usize> = VecDeque<(f64, [f64; N])>;

impl View<'_> {
    /// Adds a row of a channel to its sums.
    fn add<const N: usize>(
        &self,
        (channel, row): (usize, usize),
        residual: f64,
        slopes: [f64; N],
        past: &mut Past<N>,
        sums: &mut SumsOfProducts<N>,
    ) {
        let coefficients = &self.whitener.filters[channel].coefficients;
        let p = coefficients.len();
        if past.len() >= p {
            let (mut e, mut d) = (residual, slopes);
            for (a, (r, s)) in coefficients.iter().zip(past.iter().rev()) {
                e -= a * r;
                for n in 0..N {
                    d[n] -= a * s[n];
                }
            }
            sums.add(e, &d, self.changes.iter().map(|change| change[channel][row]));
        }
        if p > 0 {
            if past.len() == p {
                past.pop_front();
            }
            past.push_back((residual, slopes));
        }
    }
}

/// Sums of products of the whitened residuals of a model and their derivatives, and of filtered changes of the readings and the derivatives, by
/// each of the `views`.
fn products<const N: usize>(
    system: &System,
    parameters: &Parameters,
    starts: &InitialStates,
    data: &PreparedLog,
    log_rows: &[Range<usize>],
    views: &[View],
) -> Vec<Products<N>>
where
    Dual<N>: FitScalar,
{
    let rig = system.rig::<Dual<N>>(parameters, data.driven);
    let free = parameters.free().len();
    let (lanes, segments, channels) = (free + starts.kinds.len(), data.segments.len(), data.channels.len());
    let empty = |view: &View| Products { cells: Vec::new(), keys: Vec::new(), free, lanes, segments, changes: view.changes.len() };
    let mut products: Vec<Products<N>> = views.iter().map(empty).collect();
    for (segment, rows) in data.segments.iter().enumerate() {
        let Some(log) = log_rows.iter().position(|l| l.contains(&rows.start)) else { continue };
        let first = products.first().map_or(0, |products| products.cells.len());
        for products in &mut products {
            for (channel, held_out) in (0..channels).flat_map(|channel| [(channel, false), (channel, true)]) {
                products.cells.push(SumsOfProducts::new(products.changes));
                products.keys.push(Key { channel, log, held_out, segment });
            }
        }
        let mut past: Vec<Vec<Past<N>>> = vec![vec![VecDeque::new(); channels]; views.len()];
        run(&rig, data, segment, (&starts.kinds, &starts.values[segment]), free, &mut |c, row, value: &Dual<N>| {
            let Some(target) = data.target(c, row, rows.start).filter(|_| value.re.is_finite()) else { return true };
            let cell = first + 2 * c + usize::from(data.held_out(row));
            for ((view, products), past) in views.iter().zip(&mut products).zip(&mut past) {
                if (row - rows.start).is_multiple_of(view.whitener.filters[c].stride) {
                    view.add((c, row), target - value.re, value.slopes, &mut past[c], &mut products.cells[cell]);
                }
            }
            true
        });
    }
    products
}

/// Rows to which sums of products belong.
struct Key {
    channel: usize,
    log: usize,
    held_out: bool,
    segment: usize,
}

/// Sums of products of all rows, by channel, log, held-out rows and segment.
struct Products<const N: usize> {
    cells: Vec<SumsOfProducts<N>>,
    keys: Vec<Key>,
    /// Number of free parameters.
    free: usize,
    /// Number of unknowns of a segment: free parameters and its initial states.
    lanes: usize,
    /// Number of segments.
    segments: usize,
    /// Number of changes of the readings.
    changes: usize,
}

impl<const N: usize> Products<N> {
    /// The sums of the fitted rows.
    fn fitted(&self) -> impl Iterator<Item = (&SumsOfProducts<N>, &Key)> {
        self.cells.iter().zip(&self.keys).filter(|(_, key)| !key.held_out)
    }

    /// Index of an unknown of a segment among those of all segments.
    fn index(&self, lane: usize, segment: usize) -> usize {
        if lane < self.free { lane } else { self.free + segment * (self.lanes - self.free) + lane - self.free }
    }
}

/// Sums of products of whitened residuals and their derivatives by the unknowns.
struct SumsOfProducts<const N: usize> {
    square: f64,
    rows: f64,
    /// Derivatives times residual.
    g: [f64; N],
    /// Derivatives times derivatives: the lower triangle.
    h: [[f64; N]; N],
    /// Derivatives times each change of the readings.
    by_changes: Vec<[f64; N]>,
}

impl<const N: usize> SumsOfProducts<N> {
    fn new(changes: usize) -> Self {
        SumsOfProducts { square: 0.0, rows: 0.0, g: [0.0; N], h: [[0.0; N]; N], by_changes: vec![[0.0; N]; changes] }
    }

    fn add(&mut self, e: f64, d: &[f64; N], changes: impl Iterator<Item = f64>) {
        self.square += e * e;
        self.rows += 1.0;
        for i in 0..N {
            self.g[i] += d[i] * e;
            // The lower triangle in groups of four columns, which the compiler vectorises.
            for j in 0..((i | 3) + 1).min(N) {
                self.h[i][j] += d[i] * d[j];
            }
        }
        for (sums, change) in self.by_changes.iter_mut().zip(changes) {
            for (sum, d) in sums.iter_mut().zip(d) {
                *sum += d * change;
            }
        }
    }

    /// Sum of the products of two derivatives.
    fn product(&self, i: usize, j: usize) -> f64 {
        self.h[i.max(j)][i.min(j)]
    }

    /// Sum of squares after a step of the unknowns, by the linear model.
    fn after(&self, step: &[f64], lanes: usize) -> f64 {
        let mut square = self.square;
        for i in 0..lanes {
            square -= 2.0 * self.g[i] * step[i];
            for j in 0..lanes {
                square += step[i] * self.product(i, j) * step[j];
            }
        }
        square
    }
}

/// A series minus its prediction by the past; NaN where the past is not known.
fn filtered(series: &[f64], coefficients: &[f64]) -> Vec<f64> {
    (0..series.len())
        .map(|k| {
            let past = coefficients.iter().enumerate().map(|(j, a)| k.checked_sub(j + 1).map_or(f64::NAN, |at| a * series[at]));
            series[k] - past.sum::<f64>()
        })
        .collect()
}

/// Runs of finite values, every `stride`-th row of a segment.
fn finite_runs(data: &PreparedLog, residual: &[f64], stride: usize) -> Vec<Vec<f64>> {
    let mut list = Vec::new();
    for rows in &data.segments {
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

/// Coefficients by the Levinson–Durbin recursion on sums of products, of the order with the smallest BIC.
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

impl WhitenedSums {
    /// Σ n ln(RSS before / RSS after) over the channels, of one log or of all.
    fn likelihood_ratio(&self, before: &[Vec<(f64, f64)>], after: &[Vec<(f64, f64)>], log: Option<usize>) -> f64 {
        let total = |list: &[(f64, f64)]| {
            list.iter().enumerate().filter(|(k, _)| log.is_none_or(|l| l == *k)).fold((0.0, 0.0), |(s, n), (_, (q, m))| (s + q, n + m))
        };
        before
            .iter()
            .zip(after)
            .map(|(b, a)| {
                let ((b, n), (a, _)) = (total(b), total(a));
                let floor = self.min_square_ratio * b.max(a);
                if n > 0.0 && floor > 0.0 { n * (b.max(floor) / a.max(floor)).ln() } else { 0.0 }
            })
            .sum()
    }

    /// 2 ln of the likelihood ratio of the model `after` to this one, over the fitted rows.
    pub fn gain(&self, after: &WhitenedSums) -> f64 {
        self.likelihood_ratio(&self.fitted, &after.fitted, None)
    }

    /// 2 ln of the likelihood ratio over the held-out rows; 0 where there are none.
    pub fn held_out_gain(&self, after: &WhitenedSums) -> f64 {
        self.likelihood_ratio(&self.held_out, &after.held_out, None)
    }

    /// 2 ln of the likelihood ratio on one log alone, fitted and held-out rows together.
    pub fn gain_on(&self, after: &WhitenedSums, log: usize) -> f64 {
        self.likelihood_ratio(&self.fitted, &after.fitted, Some(log)) + self.likelihood_ratio(&self.held_out, &after.held_out, Some(log))
    }

    /// There are held-out rows.
    pub fn holds_rows_out(&self) -> bool {
        self.held_out.iter().flatten().any(|(_, n)| *n > 0.0)
    }

    /// Number of independent samples among the fitted rows.
    pub fn effective_samples(&self) -> f64 {
        self.fitted.iter().flatten().map(|(_, n)| n).sum()
    }
}

/// BIC of a model with so many more parameters (fewer: negative) minus that of the model without them: k ln n − gain.
pub fn delta_bic(gain: f64, parameters: f64, effective_samples: f64) -> f64 {
    parameters * effective_samples.max(2.0).ln() - gain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn autoregression_is_recovered_from_its_covariances() {
        // x_k = 0.6 x_{k−1} − 0.2 x_{k−2} + e: the Yule–Walker equations give the covariances.
        let rho1 = 0.6 / 1.2;
        let rho2 = 0.6 * rho1 - 0.2;
        let rho3 = 0.6 * rho2 - 0.2 * rho1;
        let found = autoregression(&[1.0, rho1, rho2, rho3], 100_000);
        assert_eq!(found.len(), 2);
        assert!((found[0] - 0.6).abs() < 1e-12 && (found[1] + 0.2).abs() < 1e-12, "{found:?}");
    }
}
