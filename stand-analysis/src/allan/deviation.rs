//! Overlapping and non-overlapping Allan deviation (NIST SP 1065, formulas 10, 11 and 7) from rates or from angles.
//!
//! Input: one number per row, evenly spaced within each segment. Output: for each averaging factor the variance in the squared unit of the
//! column and the number of terms. No term crosses a gap. The cumulative sums replace the column in memory.
//!
//! A straight line is subtracted from the rates before summation and added to each term in closed form. The sums stay small, and 10⁷ rows
//! keep nine digits.

use std::ops::Range;

use rayon::prelude::*;

/// Rows per task; fixed, so that the sum does not depend on the number of cores.
const TASK: usize = 1 << 17;
/// Rows for which all small averaging factors are processed while they are in the cache.
const BLOCK: usize = 1 << 13;
/// Rows summed without compensation between two compensated additions.
const UNCOMPENSATED_ROWS: usize = 512;
/// Parallel accumulators, for vector instructions.
const LANES: usize = 8;

/// Cumulative sums of a segment. For rates an initial zero is implied and not stored.
#[derive(Debug, Clone)]
struct Segment {
    rows: Range<usize>,
    from_zero: bool,
}

/// A column prepared for any averaging factor.
#[derive(Debug, Clone)]
pub struct Series {
    sums: Vec<f64>,
    segments: Vec<Segment>,
    /// Slope of the subtracted straight line, per row.
    slope: f64,
    /// Divisor of differences besides m: 1 for rates, the interval for angles.
    step: f64,
}

/// The variance at one averaging factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variance {
    /// Averaging factor m, rows.
    pub factor: usize,
    /// Allan variance, squared unit of the rate; NaN without a term.
    pub variance: f64,
    /// Number of terms.
    pub terms: usize,
}

impl Series {
    /// From rates; `segments` lie within `rates` and do not overlap.
    pub fn of_rates(mut rates: Vec<f64>, segments: &[Range<usize>]) -> Self {
        let (middle, slope) = line(&rates, segments);
        let mut row = 0;
        for segment in segments {
            // Running sum with its rounding error (compensated summation).
            let (mut sum, mut rest) = (0.0, 0.0);
            for chunk in rates[segment.clone()].chunks_mut(UNCOMPENSATED_ROWS) {
                let mut local = 0.0;
                for value in chunk {
                    local += *value - middle - slope * row as f64;
                    *value = sum + (rest + local);
                    row += 1;
                }
                let total = sum + local;
                let of_local = total - sum;
                rest += (sum - (total - of_local)) + (local - of_local);
                sum = total;
            }
        }
        let segments = segments.iter().map(|rows| Segment { rows: rows.clone(), from_zero: true }).collect();
        Self { sums: rates, segments, slope, step: 1.0 }
    }

    /// From angles, which are cumulative sums already; the rate is their change per `interval_s`.
    pub fn of_angles(mut angles: Vec<f64>, segments: &[Range<usize>], interval_s: f64) -> Self {
        for segment in segments {
            // A straight line has no Allan deviation; subtracting it reduces rounding errors.
            let rows = &mut angles[segment.clone()];
            let (first, last) = (rows.first().copied().unwrap_or(0.0), rows.last().copied().unwrap_or(0.0));
            let slope = (last - first) / (rows.len().max(2) - 1) as f64;
            rows.iter_mut().enumerate().for_each(|(k, angle)| *angle = *angle - first - slope * k as f64);
        }
        let segments = segments.iter().map(|rows| Segment { rows: rows.clone(), from_zero: false }).collect();
        Self { sums: angles, segments, slope: 0.0, step: interval_s }
    }

    /// Number of overlapping terms of each segment at factor m.
    pub fn terms(&self, factor: usize) -> impl Iterator<Item = usize> + '_ {
        self.segments.iter().map(move |s| (s.rows.len() + usize::from(s.from_zero)).saturating_sub(factor.saturating_mul(2)))
    }

    /// Largest averaging factor with a term.
    pub fn largest_factor(&self) -> usize {
        self.segments.iter().map(|s| (s.rows.len() + usize::from(s.from_zero)).saturating_sub(1) / 2).max().unwrap_or(0)
    }

    /// Overlapping Allan variance: all pairs of adjacent averages, starting at every row.
    pub fn overlapping(&self, factors: &[usize]) -> Vec<Variance> {
        let tasks: Vec<(usize, usize)> =
            (0..self.segments.len()).flat_map(|s| (0..self.segments[s].rows.len()).step_by(TASK).map(move |from| (s, from))).collect();
        let sums: Vec<Vec<f64>> = tasks.par_iter().map(|&(segment, from)| self.task(segment, from, factors)).collect();
        let total = |k: usize| sums.iter().map(|s| s[k]).sum::<f64>();
        factors.iter().enumerate().map(|(k, &m)| self.variance(m, total(k), self.terms(m).sum())).collect()
    }

    /// Non-overlapping Allan variance: averages from the start of each segment.
    pub fn plain(&self, factors: &[usize]) -> Vec<Variance> {
        let one = |&m: &usize| {
            let (mut sum, mut terms) = (0.0, 0);
            for (segment, all) in self.segments.iter().zip(self.terms(m)) {
                let x = &self.sums[segment.rows.clone()];
                let at = |k: usize| if segment.from_zero { k.checked_sub(1).map_or(0.0, |k| x[k]) } else { x[k] };
                let ramp = self.ramp(m);
                for i in (0..all).step_by(m.max(1)) {
                    let z = at(i + 2 * m) - 2.0 * at(i + m) + at(i) + ramp;
                    sum += z * z;
                    terms += 1;
                }
            }
            self.variance(m, sum, terms)
        };
        factors.par_iter().map(one).collect()
    }

    fn variance(&self, factor: usize, sum: f64, terms: usize) -> Variance {
        let divisor = factor as f64 * self.step;
        Variance { factor, variance: sum / (2.0 * divisor * divisor * terms as f64), terms }
    }

    /// Contribution of the straight line to every term.
    fn ramp(&self, factor: usize) -> f64 {
        self.slope * factor as f64 * factor as f64
    }

    /// Sums of the squared terms that begin at rows `from` to `from + TASK` of a segment.
    fn task(&self, segment: usize, from: usize, factors: &[usize]) -> Vec<f64> {
        let Segment { rows, from_zero } = &self.segments[segment];
        let x = &self.sums[rows.clone()];
        let mut sums = vec![0.0; factors.len()];
        let mut add = |k: usize, begin: usize, end: usize| {
            // With the implied zero, x[i] has phase i + 1; the term that starts at the zero is added separately.
            let m = factors[k];
            let end = end.min(x.len().saturating_sub(2 * m));
            let ramp = self.ramp(m);
            if *from_zero && begin == 0 && x.len() >= 2 * m {
                sums[k] += (x[2 * m - 1] - 2.0 * x[m - 1] + ramp).powi(2);
            }
            if begin < end {
                sums[k] += squares(&x[begin..end], &x[begin + m..end + m], &x[begin + 2 * m..end + 2 * m], ramp);
            }
        };
        let to = from.saturating_add(TASK);
        let small: Vec<usize> = (0..factors.len()).filter(|k| factors[*k] <= BLOCK).collect();
        for begin in (from..to.min(x.len())).step_by(BLOCK) {
            small.iter().for_each(|k| add(*k, begin, begin + BLOCK));
        }
        (0..factors.len()).filter(|k| factors[*k] > BLOCK).for_each(|k| add(k, from, to));
        sums
    }
}

/// Σ (x₂ − 2 x₁ + x₀ + ramp)².
fn squares(first: &[f64], middle: &[f64], last: &[f64], ramp: f64) -> f64 {
    let mut lanes = [0.0; LANES];
    let (a, b, c) = (first.chunks_exact(LANES), middle.chunks_exact(LANES), last.chunks_exact(LANES));
    let rest: f64 = (a.remainder().iter().zip(b.remainder()).zip(c.remainder())).map(|((a, b), c)| (c - 2.0 * b + a + ramp).powi(2)).sum();
    for ((a, b), c) in a.zip(b).zip(c) {
        for k in 0..LANES {
            let z = c[k] - 2.0 * b[k] + a[k] + ramp;
            lanes[k] += z * z;
        }
    }
    lanes.iter().sum::<f64>() + rest
}

/// Least-squares line through all rows of the segments: value at row 0 and slope per row.
fn line(values: &[f64], segments: &[Range<usize>]) -> (f64, f64) {
    let n: usize = segments.iter().map(ExactSizeIterator::len).sum();
    let reference = segments.first().and_then(|s| values.get(s.start)).copied().unwrap_or(0.0);
    let centre = (n as f64 - 1.0) / 2.0;
    let (mut sum, mut moment, mut row) = (0.0, 0.0, 0);
    for chunk in segments.iter().flat_map(|s| values[s.clone()].chunks(UNCOMPENSATED_ROWS)) {
        let (mut local, mut local_moment) = (0.0, 0.0);
        for (k, value) in chunk.iter().enumerate() {
            local += value - reference;
            local_moment += k as f64 * (value - reference);
        }
        sum += local;
        moment += local_moment + (row as f64 - centre) * local;
        row += chunk.len();
    }
    let n = n as f64;
    let slope = if n > 1.0 { moment * 12.0 / (n * (n * n - 1.0)) } else { 0.0 };
    (reference + sum / n.max(1.0) - slope * centre, slope)
}
