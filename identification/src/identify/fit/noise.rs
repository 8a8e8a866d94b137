//! Estimates of the noise of a channel and of its colour.

use crate::statistics::distributions::chi_squared_tail;
use crate::statistics::robust::median_abs;
use crate::statistics::series::products_by_shift;

/// Differences above this multiple of their median magnitude are due to the motion.
const MAX_MEDIAN_RATIO: f64 = 6.0;
/// Mean square, over σ², of a normal deviate cut off at [`MAX_MEDIAN_RATIO`] × its median magnitude (0.6745 σ), that is at 4.05 σ: 0.9991.
/// Its root is used, so that the estimate is 0.02 % too large: far less than its own scatter.
const CUT_OFF_LOSS: f64 = 0.999_5;

/// Standard deviation of white noise on a smooth series, from its third differences, which are zero for a parabola. 0 for too few values.
pub fn of_series(series: impl Iterator<Item = f64>) -> f64 {
    let y: Vec<f64> = series.collect();
    let differences: Vec<f64> = y.windows(4).map(|w| w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).collect();
    trimmed_rms(&differences) / 20f64.sqrt()
}

/// Standard deviation of the noise of residuals, from their differences: the misfit of a wrong model changes slowly by comparison.
///
/// First differences give σ of white noise. For noise that passed the filter of the logger, with a correlation ρ of at most
/// `max_correlation` between rows and ρ² at two rows (a first-order filter), the ratio of second to first differences gives ρ: var Δ²/var Δ = 3 − ρ.
pub fn of_residuals(residuals: &[f64], max_correlation: f64) -> f64 {
    let finite = |d: &f64| d.is_finite();
    let first: Vec<f64> = residuals.windows(2).map(|w| w[1] - w[0]).filter(finite).collect();
    let first = trimmed_rms(&first);
    if max_correlation < 1e-3 || first <= 0.0 {
        return first / 2f64.sqrt();
    }
    let second: Vec<f64> = residuals.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]).filter(finite).collect();
    let correlation = (3.0 - (trimmed_rms(&second) / first).powi(2)).clamp(0.0, max_correlation);
    first / (2.0 * (1.0 - correlation)).sqrt()
}

/// Root mean square without outliers.
fn trimmed_rms(values: &[f64]) -> f64 {
    let Some(median) = median_abs(values) else { return 0.0 };
    // A quantised channel at rest has a median of zero: no limit.
    let limit = if median > 0.0 { MAX_MEDIAN_RATIO * median } else { f64::INFINITY };
    let (sum, n) = values.iter().filter(|v| v.abs() <= limit).fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    let loss = if median > 0.0 { CUT_OFF_LOSS } else { 1.0 };
    (sum / (n * loss)).sqrt()
}

/// Lags of the correlations end below this, rows.
const MAX_LAG: usize = 2000;
/// Lags up to which each correlation is computed by itself: those of white residuals are insignificant there.
const DIRECT_LAGS: usize = 8;
/// Least number of residuals for a correlation.
const MIN_ROWS: usize = 8;

/// Variance inflation of a mean of residuals, 1 + 2 Σ ρ, up to the first correlation below three standard errors 1/√n of white residuals, and
/// over a quarter of the rows at most; 1 for fewer than [`MIN_ROWS`], or where the residuals are not finite.
pub fn inflation(residuals: &[f64]) -> f64 {
    let n = residuals.len();
    if n < MIN_ROWS {
        return 1.0;
    }
    let mean = residuals.iter().sum::<f64>() / n as f64;
    let centred: Vec<f64> = residuals.iter().map(|r| r - mean).collect();
    let power = centred.iter().map(|r| r * r).sum::<f64>();
    if power <= 0.0 {
        return 1.0;
    }
    let min_significant = 3.0 / (n as f64).sqrt();
    let lags = 1..(n / 4).min(MAX_LAG);
    let direct = |lag: usize| centred.iter().zip(&centred[lag..]).map(|(a, b)| a * b).sum::<f64>() / power;
    let correlations: Vec<f64> = lags.clone().take(DIRECT_LAGS).map(direct).take_while(|rho| *rho >= min_significant).collect();
    if correlations.len() < DIRECT_LAGS {
        return 1.0 + 2.0 * correlations.iter().sum::<f64>();
    }
    let products = products_by_shift(&centred, lags.end).unwrap_or_default();
    1.0 + 2.0 * products.iter().take(lags.end).skip(1).map(|p| p / power).take_while(|rho| *rho >= min_significant).sum::<f64>()
}

/// Lengths of the blocks for slow misfits, rows.
const BLOCK_ROWS: [usize; 3] = [100, 300, 1000];
/// Least significance of a slow misfit, in standard errors.
const MIN_SIGMAS: f64 = 2.5;
/// Least number of blocks.
const MIN_BLOCKS: usize = 20;

/// Variance of block sums over that of white noise; 1 unless it is significantly larger.
///
/// A misfit of a tenth of the noise over a thousand rows is not visible in the rows but biases a fit of thousands of rows. The mean of the
/// residuals is such a misfit, too, and is not subtracted. `noise` is the standard deviation of the channel. Not applicable to differenced counts, which are deterministic at low rates.
pub fn slow_inflation(residuals: &[f64], noise: f64) -> f64 {
    let mut worst = 1.0_f64;
    for rows in BLOCK_ROWS {
        let count = residuals.len() / rows;
        if count < MIN_BLOCKS {
            continue;
        }
        let sums = residuals.chunks_exact(rows).map(|block| block.iter().sum::<f64>());
        let square = sums.map(|s| s * s).sum::<f64>() / count as f64;
        let white = noise * noise * rows as f64;
        let ratio = square / white;
        if ratio > 1.0 + MIN_SIGMAS * (2.0 / count as f64).sqrt() {
            worst = worst.max(ratio);
        }
    }
    worst
}

/// Ljung–Box statistic of every `stride`-th residual over `lags` lags, and its p-value; (0, 1) for fewer than four values per lag.
pub fn ljung_box(residuals: &[f64], stride: usize, lags: usize) -> (f64, f64) {
    let y: Vec<f64> = residuals.iter().step_by(stride.max(1)).copied().collect();
    let n = y.len() as f64;
    let mean = y.iter().sum::<f64>() / n;
    let variance = y.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / n;
    if y.len() < 4 * lags || variance <= 0.0 {
        return (0.0, 1.0);
    }
    let mut q = 0.0;
    for lag in 1..=lags {
        let rho = y.windows(lag + 1).map(|w| (w[0] - mean) * (w[lag] - mean)).sum::<f64>() / (n * variance);
        q += rho * rho / (n - lag as f64);
    }
    q *= n * (n + 2.0);
    (q, chi_squared_tail(q, lags as f64))
}

#[cfg(test)]
mod tests {
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};

    use super::*;

    /// 1 + 2 Σ ρᵏ = (1 + ρ)/(1 − ρ) for a first-order autoregression.
    #[test]
    fn inflation_is_that_of_an_autoregression() {
        for (rho, expected) in [(0.0, 1.0), (0.5, 3.0), (0.9, 19.0), (0.99, 199.0)] {
            let mut draw = Xoshiro256PlusPlus::seed_from_u64(1);
            let mut last = 0.0;
            let mut next = || {
                last = rho * last + (draw.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
                last
            };
            let residuals: Vec<f64> = (0..200_000).map(|_| next()).collect();
            let found = inflation(&residuals);
            assert!((found / expected - 1.0).abs() < 0.1, "{rho}: {found}");
        }
    }
}
