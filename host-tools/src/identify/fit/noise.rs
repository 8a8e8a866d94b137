//! The tool's own estimate of a channel's noise, and of its colour.

use crate::statistics::distributions::chi_squared_tail;
use crate::statistics::robust::median_abs;

/// Differences beyond this many of their median size belong to the motion, not to the noise.
const OUTLIER: f64 = 6.0;
/// Mean square of a normal deviate cut off at [`OUTLIER`] × the median of its size (0.6745 σ), relative to the whole: 4.05 σ.
const CUT_LOSS: f64 = 0.999_5;

/// Standard deviation of white noise on a smooth series, by its third differences (which a parabola does not move).
///
/// For a series that has not been explained yet. 0 where there are too few points.
pub fn of_series(series: impl Iterator<Item = f64>) -> f64 {
    let y: Vec<f64> = series.collect();
    let differences: Vec<f64> = y.windows(4).map(|w| w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).collect();
    cut_rms(&differences) / 20f64.sqrt()
}

/// Standard deviation of the noise in residuals, by their fine structure: what a wrong model leaves is slow beside it.
///
/// First differences show σ of white noise. Where the noise went through the logger's own filter, with a correlation of at most `most`
/// from row to row, the ratio of second to first differences says how much of that there is: var Δ²/var Δ = 3 − ρ.
pub fn of_residuals(residuals: &[f64], most: f64) -> f64 {
    let finite = |d: &f64| d.is_finite();
    let first: Vec<f64> = residuals.windows(2).map(|w| w[1] - w[0]).filter(finite).collect();
    let first = cut_rms(&first);
    if most < 1e-3 || first <= 0.0 {
        return first / 2f64.sqrt();
    }
    let second: Vec<f64> = residuals.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]).filter(finite).collect();
    let correlation = (3.0 - (cut_rms(&second) / first).powi(2)).clamp(0.0, most);
    first / (2.0 * (1.0 - correlation)).sqrt()
}

/// Root mean square without outliers.
fn cut_rms(values: &[f64]) -> f64 {
    let Some(median) = median_abs(values) else { return 0.0 };
    // A quantised channel at rest has a median of zero: then nothing can be called an outlier.
    let limit = if median > 0.0 { OUTLIER * median } else { f64::INFINITY };
    let (sum, n) = values.iter().filter(|v| v.abs() <= limit).fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    let loss = if median > 0.0 { CUT_LOSS } else { 1.0 };
    (sum / (n * loss)).sqrt()
}

/// Variance inflation of a mean of residuals, 1 + 2 Σ ρ, up to the first correlation that is no longer seen (Geyer's initial sequence).
pub fn inflation(residuals: &[f64]) -> f64 {
    let n = residuals.len();
    if n < 8 {
        return 1.0;
    }
    let mean = residuals.iter().sum::<f64>() / n as f64;
    let variance = residuals.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / n as f64;
    if variance <= 0.0 {
        return 1.0;
    }
    let seen = 3.0 / (n as f64).sqrt();
    let mut factor = 1.0;
    // An hour's residual is looked at by as many products as half a minute's.
    for lag in 1..(n / 4).min(2000).min((60_000_000 / n).max(20)) {
        let rho = residuals.windows(lag + 1).map(|w| (w[0] - mean) * (w[lag] - mean)).sum::<f64>() / (n as f64 * variance);
        if rho < seen {
            break;
        }
        factor += 2.0 * rho;
    }
    factor
}

/// Rows of the blocks in which slow misfit is looked for, and by how many standard errors it must show.
const BLOCKS: [usize; 3] = [100, 300, 1000];
const SEEN: f64 = 2.5;
/// Fewest blocks that say anything.
const FEWEST_BLOCKS: usize = 20;

/// Variance of block sums over that of the noise alone, where it is seen to be more; else 1.
///
/// A model may be off by a tenth of the noise for a second and nobody sees it in the rows, but a fit of thousands of rows does. `noise` is
/// the channel's, white. (Of counts that were differenced it says nothing: at low rates they are no noise at all.)
pub fn slow_inflation(residuals: &[f64], noise: f64) -> f64 {
    let mut worst = 1.0_f64;
    for rows in BLOCKS {
        let count = residuals.len() / rows;
        if count < FEWEST_BLOCKS {
            continue;
        }
        let sums = residuals.chunks_exact(rows).map(|block| block.iter().sum::<f64>());
        let square = sums.map(|s| s * s).sum::<f64>() / count as f64;
        let alone = noise * noise * rows as f64;
        let ratio = square / alone;
        if ratio > 1.0 + SEEN * (2.0 / count as f64).sqrt() {
            worst = worst.max(ratio);
        }
    }
    worst
}

/// Ljung–Box statistic over `lags` lags of a stride, and its p-value: is the residual white?
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
