//! What is drawn of a residual: its size over time, its distribution, its memory.
//!
//! Each is one pass over the rows (the memory: one per lag) into a few dozen numbers, so that an hour's log costs no second copy.

use crate::identify::fit::Record;

/// Root mean square of the residual in equal stretches of time; `None` where none was compared.
pub fn rms_over_time(record: &Record, residual: &[f64], columns: usize) -> Vec<Option<f64>> {
    let mut sums = vec![(0.0, 0usize); columns];
    let Some((&first, &last)) = record.t_s.first().zip(record.t_s.last()) else { return Vec::new() };
    let scale = columns as f64 / (last - first).max(f64::MIN_POSITIVE);
    for (t, r) in record.t_s.iter().zip(residual).filter(|(_, r)| r.is_finite()) {
        let column = (((t - first) * scale) as usize).min(columns.saturating_sub(1));
        if let Some((sum, n)) = sums.get_mut(column) {
            *sum += r * r;
            *n += 1;
        }
    }
    sums.into_iter().map(|(sum, n)| (n > 0).then(|| (sum / n as f64).sqrt())).collect()
}

/// How the residual is distributed.
pub struct Histogram {
    /// Left edge of the first bin.
    pub from: f64,
    /// Width of a bin.
    pub width: f64,
    /// Density in each bin, 1/unit.
    pub density: Vec<f64>,
}

/// Distribution of the finite values between ± `reach`; what lies beyond is in the last bins.
pub fn histogram(values: &[f64], reach: f64, bins: usize) -> Histogram {
    let width = 2.0 * reach / bins.max(1) as f64;
    let mut counts = vec![0usize; bins];
    let mut n = 0usize;
    for v in values.iter().filter(|v| v.is_finite()) {
        let bin = (((v + reach) / width).max(0.0) as usize).min(bins.saturating_sub(1));
        if let Some(count) = counts.get_mut(bin) {
            *count += 1;
            n += 1;
        }
    }
    let unit = (n.max(1) as f64 * width).max(f64::MIN_POSITIVE);
    Histogram { from: -reach, width, density: counts.into_iter().map(|c| c as f64 / unit).collect() }
}

/// Correlation of the residual with itself, lag by lag from 1 on, and the half-width of the band that holds 95 % of white noise's.
pub struct Memory {
    /// Correlations at lags 1, 2, …
    pub correlation: Vec<f64>,
    /// 1.96/√n.
    pub band: f64,
}

/// The memory of a series up to `lags`; values that are not finite take no part.
pub fn memory(values: &[f64], lags: usize) -> Memory {
    let (sum, n) = values.iter().filter(|v| v.is_finite()).fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
    let mean = sum / n.max(1) as f64;
    let power: f64 = values.iter().filter(|v| v.is_finite()).map(|v| (v - mean).powi(2)).sum();
    let lags = lags.min(n / 4);
    let correlation = (1..=lags)
        .map(|lag| {
            let later = values.get(lag..).unwrap_or(&[]);
            let products = values.iter().zip(later).map(|(a, b)| (a - mean) * (b - mean));
            products.filter(|p| p.is_finite()).sum::<f64>() / power.max(f64::MIN_POSITIVE)
        })
        .collect();
    Memory { correlation, band: 1.96 / (n.max(1) as f64).sqrt() }
}

/// Sum and number of a stretch of rows that follow each other within a bin: neighbours are no independent witnesses, stretches are.
#[derive(Clone, Copy, Default)]
struct Cell {
    sum: f64,
    squares: f64,
    n: f64,
    /// Σ S², Σ S n, Σ n² and number of the stretches S.
    visits: (f64, f64, f64, f64),
}

/// Mean of the residual within one bin of a coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Middle of the bin.
    pub at: f64,
    /// Mean residual.
    pub mean: f64,
    /// Half-width of its 95 % confidence interval.
    pub confidence: f64,
}

/// Longest stretch that counts as one witness, rows.
const VISIT_ROWS: usize = 200;
/// A bin with fewer rows or visits says nothing.
const FEWEST_ROWS: f64 = 10.0;
const FEWEST_VISITS: f64 = 4.0;

/// Means of `values` in equal bins of a coordinate over `range`; bins that hardly any row visits are left out.
///
/// The confidence interval takes every stretch of successive rows within a bin as one witness (a cluster-robust standard error), so that
/// a residual that remembers does not look sure of itself.
pub fn binned(coordinate: impl Iterator<Item = f64>, values: impl Iterator<Item = f64>, range: (f64, f64), bins: usize) -> Vec<Bin> {
    let (low, high) = range;
    let width = (high - low) / bins.max(1) as f64;
    if width.is_nan() || width <= 0.0 {
        return Vec::new();
    }
    let mut cells = vec![Cell::default(); bins];
    let mut visit = (usize::MAX, 0.0, 0usize);
    let close = |cells: &mut Vec<Cell>, (bin, sum, n): (usize, f64, usize)| {
        if let (Some(cell), true) = (cells.get_mut(bin), n > 0) {
            let n = n as f64;
            let (ss, sn, nn, k) = cell.visits;
            cell.visits = (ss + sum * sum, sn + sum * n, nn + n * n, k + 1.0);
        }
    };
    for (x, v) in coordinate.zip(values) {
        if !(x.is_finite() && v.is_finite() && x >= low && x <= high) {
            continue;
        }
        let bin = (((x - low) / width) as usize).min(bins - 1);
        if bin != visit.0 || visit.2 >= VISIT_ROWS {
            close(&mut cells, visit);
            visit = (bin, 0.0, 0);
        }
        visit = (bin, visit.1 + v, visit.2 + 1);
        if let Some(cell) = cells.get_mut(bin) {
            cell.sum += v;
            cell.squares += v * v;
            cell.n += 1.0;
        }
    }
    close(&mut cells, visit);
    let said = cells.iter().enumerate().filter(|(_, c)| c.n >= FEWEST_ROWS && c.visits.3 >= FEWEST_VISITS);
    said.map(|(k, c)| {
        let mean = c.sum / c.n;
        let (ss, sn, nn, visits) = c.visits;
        let between = ((ss - 2.0 * mean * sn + mean * mean * nn).max(0.0) * visits / (visits - 1.0)).sqrt() / c.n;
        let within = ((c.squares / c.n - mean * mean).max(0.0) / c.n).sqrt();
        Bin { at: low + (k as f64 + 0.5) * width, mean, confidence: student(visits) * between.max(within) }
    })
    .collect()
}

/// 97.5 % point of Student's distribution with one degree of freedom less than the witnesses.
fn student(witnesses: f64) -> f64 {
    use statrs::distribution::{ContinuousCDF, StudentsT};
    if witnesses > 200.0 {
        return 1.96;
    }
    StudentsT::new(0.0, 1.0, (witnesses - 1.0).max(1.0)).map_or(1.96, |d| d.inverse_cdf(0.975))
}
