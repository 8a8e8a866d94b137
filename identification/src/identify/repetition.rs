//! Noise of the channels from repetitions of the excitation.
//!
//! In: a prepared log. Out: where the input repeats itself, the part of each channel that does not repeat with it. Its standard deviation
//! comes from the differences of successive periods; the first period, in which the transient decays, is left out (Pintelon, Schoukens,
//! System Identification, 2012, section 2.5). A residual above it is an error of the model that returns with the input; a residual near it
//! is noise, or depends on something that does not repeat.

use crate::model::{Channel, Input};
use crate::recording::PreparedLog;
use crate::statistics::series::products_by_shift;

/// An excitation that repeats itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Repetition {
    /// Its period, s.
    pub period_s: f64,
    /// Number of whole periods in the log.
    pub periods: usize,
    /// Standard deviation of what does not repeat, by channel; that of an angle is of its increments over 20 ms.
    pub not_repeatable: Vec<(Channel, f64)>,
}

/// Fewest periods: a transient, and two to compare.
const MIN_PERIODS: usize = 3;
/// Rows of a period at least.
const MIN_ROWS: usize = 100;
/// Mean square of the change of the input from period to period, fraction of its variance, up to which it repeats. The quantization of a
/// bridge is far below.
const MAX_INPUT_CHANGE: f64 = 1e-4;
/// Rows at most: the transform of a longer log would need more memory than its columns.
const MAX_ROWS: usize = 1 << 22;
/// Rows between a peak of the autocorrelation and the period at most.
const MAX_SHIFT: usize = 50;
/// Differences of sampling intervals from their median, fraction, up to which rows of two periods belong together.
const MAX_JITTER: f64 = 1e-3;

/// The repetition of the input of a log of one segment with even rows; `None` where it does not repeat.
pub fn repetition(data: &PreparedLog) -> Option<Repetition> {
    let [rows] = data.segments.as_slice() else { return None };
    let even = |w: &[f64]| ((w[1] - w[0]) / data.dt_s - 1.0).abs() < MAX_JITTER;
    if data.driven == Input::Motion || data.len() > MAX_ROWS || *rows != (0..data.len()) || !data.t_s.windows(2).all(even) {
        return None;
    }
    let period = period_rows(&data.input)?;
    let periods = data.len() / period;
    let not_repeatable = data.channels.iter().map(|c| {
        let lag = if c.channel == Channel::Angle { data.angle_lag() } else { 0 };
        let value = |row: usize| if lag > 0 { c.measured[row] - c.measured[row - lag] } else { c.measured[row] };
        let differences = (period.max(lag)..data.len() - period).map(|row| value(row + period) - value(row));
        let (sum, n) = differences.fold((0.0, 0.0), |(s, n), d| (s + d * d, n + 1.0));
        (c.channel, (sum / (2.0 * f64::max(n, 1.0))).sqrt())
    });
    Some(Repetition { period_s: period as f64 * data.dt_s, periods, not_repeatable: not_repeatable.collect() })
}

/// Period of a series in rows: the shortest shift, of at most a third of its length, by which it is the same.
fn period_rows(series: &[f64]) -> Option<usize> {
    let n = series.len();
    let mean = series.iter().sum::<f64>() / n.max(1) as f64;
    let centred: Vec<f64> = series.iter().map(|v| v - mean).collect();
    let variance = centred.iter().map(|v| v * v).sum::<f64>() / n.max(1) as f64;
    if variance <= 0.0 || n < MIN_PERIODS * MIN_ROWS {
        return None;
    }
    let correlation = products_by_shift(&centred, n - 1)?;
    let change = |lag: usize| {
        let sum: f64 = series[lag..].iter().zip(series).map(|(a, b)| (a - b).powi(2)).sum();
        sum / (n - lag) as f64
    };
    // A shift by a period leaves the correlation of the rows that overlap; a slow input has high correlations beside it, so that only peaks
    // are tried.
    let relative = |lag: usize| correlation[lag] / (n - lag) as f64 / variance;
    let peaks =
        (MIN_ROWS..=n / MIN_PERIODS).filter(|&lag| correlation[lag] >= correlation[lag - 1] && correlation[lag] >= correlation[lag + 1]);
    // The sum over the rows that overlap shifts the peak of a slow input by some rows: the nearest shift with the least change is the
    // period.
    let nearest = |peak: usize| {
        let mut lag = peak;
        for _ in 0..MAX_SHIFT {
            let here = change(lag);
            if lag < n / MIN_PERIODS && change(lag + 1) < here {
                lag += 1;
            } else if lag > MIN_ROWS && change(lag - 1) < here {
                lag -= 1;
            } else {
                break;
            }
        }
        lag
    };
    let close = peaks.filter(|&lag| relative(lag) > 0.9).map(nearest).find(|&lag| change(lag) < MAX_INPUT_CHANGE * variance)?;
    // A constant stretch of the input also stays the same for a while: the input must change within a period.
    let changes = series[..close].windows(2).any(|w| (w[1] - w[0]).abs() > 0.0);
    changes.then_some(close)
}

#[cfg(test)]
mod tests {
    use super::period_rows;

    #[test]
    fn shortest_period_of_a_multisine_is_found() {
        let series: Vec<f64> =
            (0..6500).map(|k| f64::from(k) / 2000.0 * std::f64::consts::TAU).map(|x| x.sin() + (3.0 * x).cos()).collect();
        assert_eq!(period_rows(&series), Some(2000));
    }

    #[test]
    fn steps_of_random_height_do_not_repeat() {
        let series: Vec<f64> = (0..6000u32).map(|k| f64::from((k / 250).wrapping_mul(2_654_435_761) >> 20)).collect();
        assert_eq!(period_rows(&series), None);
    }

    #[test]
    fn two_periods_are_too_few() {
        let series: Vec<f64> = (0..4100).map(|k| (f64::from(k) / 2000.0 * std::f64::consts::TAU).sin()).collect();
        assert_eq!(period_rows(&series), None);
    }
}
