//! Time stamps that scatter although the readings are evenly spaced.
//!
//! A logger that stamps its rows when it gets round to it writes a jittered time for regular samples. A reading then lies where even times
//! put it, not where its stamp does. Both times are tried on the readings themselves: each is predicted from its two neighbours by linear
//! interpolation, and the time with the smaller error is the right one, by the test of Diebold and Mariano (J. Bus. Econ. Stat. 13 (1995)
//! 253). Stamps of samples that were really taken unevenly stay as they are.

use std::ops::Range;

use crate::statistics::robust::{median, median_abs, quantile};

/// Rms scatter of the steps, part of the interval, below which the time is even enough.
const MIN_JITTER: f64 = 0.01;
/// Distance of 99 % of the stamps from even times, intervals: beyond, the clock wanders or rows are missing.
const MAX_DISTANCE: f64 = 0.5;
/// Evidence of a channel for even times, standard deviations, at which they are right.
const MIN_EVIDENCE: f64 = 5.0;
/// Evidence of another channel for the stamps at which nothing is changed: significant at 0.1 %.
const MAX_CONTRARY_EVIDENCE: f64 = 3.0;
/// Readings that both times predict worse than by this many median errors are outliers.
const OUTLIER_ERRORS: f64 = 8.0;

/// Even times, and the rms scatter of the stamps about them, s, if the readings of `columns` are evenly spaced and the stamps are not.
pub(super) fn even_times(t_s: &[f64], segments: &[Range<usize>], columns: &[&[f64]]) -> Option<(Vec<f64>, f64)> {
    let interval = median(t_s.windows(2).map(|w| w[1] - w[0]))?;
    let inside = |rows: &Range<usize>| rows.len() > 10;
    let steps =
        segments.iter().filter(|r| inside(r)).flat_map(|r| t_s[r.clone()].windows(2).map(|w| w[1] / interval - w[0] / interval - 1.0));
    let (sum, n) = steps.fold((0.0, 0usize), |(sum, n), d| (sum + d * d, n + 1));
    if n == 0 || (sum / n as f64).sqrt() < MIN_JITTER {
        return None;
    }
    let mut even = t_s.to_vec();
    let mut squares = 0.0;
    for rows in segments.iter().filter(|r| inside(r)) {
        let (begin, step) = line(&t_s[rows.clone()]);
        for (k, t) in even[rows.clone()].iter_mut().enumerate() {
            *t = begin + step * k as f64;
        }
        let off: Vec<f64> = even[rows.clone()].iter().zip(&t_s[rows.clone()]).map(|(e, t)| (e - t).abs()).collect();
        squares += off.iter().map(|d| d * d).sum::<f64>();
        if quantile(off, 0.99)? > MAX_DISTANCE * interval {
            return None;
        }
    }
    if even.windows(2).any(|w| w[1] <= w[0]) {
        return None;
    }
    let evidence: Vec<f64> = columns.iter().filter_map(|y| evidence(&even, t_s, y, segments)).collect();
    let is_better = evidence.iter().any(|e| *e > MIN_EVIDENCE) && evidence.iter().all(|e| *e > -MAX_CONTRARY_EVIDENCE);
    is_better.then(|| (even, (squares / t_s.len() as f64).sqrt()))
}

/// Begin and step of the straight line through equally numbered times.
fn line(t: &[f64]) -> (f64, f64) {
    let n = t.len() as f64;
    let (middle, mean) = (0.5 * (n - 1.0), t.iter().sum::<f64>() / n);
    let (mut product, mut square) = (0.0, 0.0);
    for (k, t) in t.iter().enumerate() {
        let x = k as f64 - middle;
        product += x * (t - mean);
        square += x * x;
    }
    let step = product / square;
    (mean - step * middle, step)
}

/// How much better the even times predict the readings than the stamps do: the sum of the differences of the squared errors over its
/// standard deviation. Errors two rows apart share a reading.
fn evidence(even: &[f64], stamps: &[f64], y: &[f64], segments: &[Range<usize>]) -> Option<f64> {
    let (by_even, by_stamps) = (prediction_errors(even, y, segments), prediction_errors(stamps, y, segments));
    let median = median_abs(&by_even)?.max(median_abs(&by_stamps)?);
    // Where most readings are equal to their neighbours, as at rest, the median tells nothing.
    let limit = if median > 0.0 { OUTLIER_ERRORS * median } else { f64::INFINITY };
    let better: Vec<f64> =
        by_even.iter().zip(&by_stamps).map(|(e, s)| if e.abs().min(s.abs()) > limit { 0.0 } else { s * s - e * e }).collect();
    let products = |lag: usize| better.iter().zip(better.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
    let variance = products(0) + 2.0 * (products(1) + products(2));
    (variance > 0.0).then(|| better.iter().sum::<f64>() / variance.sqrt())
}

/// Error of the linear interpolation between the neighbours of each row.
fn prediction_errors(t: &[f64], y: &[f64], segments: &[Range<usize>]) -> Vec<f64> {
    let error = |k: usize| y[k] - y[k - 1] - (y[k + 1] - y[k - 1]) * (t[k] - t[k - 1]) / (t[k + 1] - t[k - 1]);
    segments.iter().flat_map(|rows| rows.start + 1..rows.end.saturating_sub(1)).map(error).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random numbers in ±1.
    fn scatter(k: usize) -> f64 {
        ((k as f64 * 12.989_8).sin() * 43_758.545_3).fract()
    }

    #[test]
    fn scattered_stamps_of_even_readings_are_replaced() {
        let t: Vec<f64> = (0..4000).map(|k| 1e-3 * (k as f64 + 0.2 * scatter(k))).collect();
        let theta: Vec<f64> = (0..4000).map(|k| 5.0 * (1e-3 * k as f64).sin() * 7.0).collect();
        let (even, rms) = even_times(&t, std::slice::from_ref(&(0..4000)), &[&theta]).expect("even times");
        assert!(even.iter().enumerate().all(|(k, t)| (t - 1e-3 * k as f64).abs() < 1e-5));
        assert!((rms / 1.15e-4 - 1.0).abs() < 0.1, "an even error of ±0.2 ms: {rms}");
    }

    /// A drive that is slow most of the time: most readings do not tell the times, by the encoder's counts.
    #[test]
    fn few_fast_rows_tell_the_times() {
        const COUNT_RAD: f64 = 3e-4;
        let angle = |t: f64| (t + 3.0 * (-(t - 2.0).powi(2) / 0.02).exp()).div_euclid(COUNT_RAD) * COUNT_RAD;
        let stamps: Vec<f64> = (0..4000).map(|k| 1e-3 * (k as f64 + 0.2 * scatter(k))).collect();
        let by_even: Vec<f64> = (0..4000).map(|k| angle(1e-3 * k as f64)).collect();
        let by_stamps: Vec<f64> = stamps.iter().map(|t| angle(*t)).collect();
        let segments = std::slice::from_ref(&(0..4000));
        assert!(even_times(&stamps, segments, &[&by_even]).is_some());
        assert!(even_times(&stamps, segments, &[&by_stamps]).is_none());
        assert!(even_times(&stamps, segments, &[&by_even, &by_stamps]).is_none(), "the channels contradict each other");
    }

    #[test]
    fn uneven_readings_keep_their_stamps() {
        let t: Vec<f64> = (0..4000).map(|k| 1e-3 * (k as f64 + 0.2 * scatter(k))).collect();
        let theta: Vec<f64> = t.iter().map(|t| 35.0 * t.sin()).collect();
        assert!(even_times(&t, std::slice::from_ref(&(0..4000)), &[&theta]).is_none());
    }
}
