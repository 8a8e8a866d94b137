//! Adjoining windows of equal length; none contains a gap.

use std::ops::Range;

use crate::log::Log;

/// Windows over the rows of a log.
pub(super) struct Windows {
    /// Rows of each window. `end` is the first row of an adjoining next window.
    pub rows: Vec<Range<usize>>,
}

impl Windows {
    /// Windows of `count` rows.
    pub fn of_rows(log: &Log, count: usize) -> Self {
        let count = count.max(1);
        let mut rows = Vec::new();
        for segment in log.segments() {
            let mut from = segment.start;
            // One row more: the difference over the window needs it.
            while from + count < segment.end {
                rows.push(from..from + count);
                from += count;
            }
        }
        Windows { rows }
    }

    /// Windows of at least `length_s`.
    pub fn of_length(log: &Log, length_s: f64) -> Self {
        let dt_s = log.median_dt_s();
        Self::of_rows(log, if dt_s > 0.0 { (length_s / dt_s).round() as usize } else { 1 })
    }

    /// The windows with `beside` adjoining windows on each side.
    pub fn centres(&self, beside: usize) -> impl Iterator<Item = usize> {
        let adjoin = move |k: usize| self.rows[k - beside..=k + beside].windows(2).all(|w| w[0].end == w[1].start);
        (beside..self.rows.len().saturating_sub(beside)).filter(move |&k| adjoin(k))
    }

    /// Mean of the rows of each window.
    pub fn means(&self, values: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|r| mean(&values[r.clone()])).collect()
    }

    /// Difference over each window: value at `end` minus value at `start`.
    pub fn differences(&self, values: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|r| values[r.end] - values[r.start]).collect()
    }

    /// Integral over each window by the trapezoidal rule.
    pub fn integrals(&self, values: &[f64], t_s: &[f64]) -> Vec<f64> {
        let span = |r: &Range<usize>| r.clone().map(|k| 0.5 * (values[k] + values[k + 1]) * (t_s[k + 1] - t_s[k])).sum();
        self.rows.iter().map(span).collect()
    }
}

/// Mean; 0 for an empty slice.
pub(super) fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
}

/// Standard deviation about the mean.
pub(super) fn sd(values: &[f64]) -> f64 {
    let m = mean(values);
    (values.iter().map(|v| (v - m) * (v - m)).sum::<f64>() / values.len().max(1) as f64).sqrt()
}
