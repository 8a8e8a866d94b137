//! The range of operation that a log covers: rates, turns, currents, warming. Effects outside this range are not visible.

use std::f64::consts::TAU;

use crate::log::Log;

/// Length over which a rate is made from the angle, s.
const ANGLE_S: f64 = 0.02;
/// Rates between these fractions of the largest rate count as slow.
const MIN_TURNING_FRACTION: f64 = 0.01;
const MAX_SLOW_FRACTION: f64 = 0.1;
/// Fraction of the largest rate that the rates in the other direction must reach.
const MIN_REVERSE_FRACTION: f64 = 0.05;
/// Fraction of slow rows, and number of turns, below which a ripple over the angle is not visible.
const MIN_SLOW_ROWS_FRACTION: f64 = 0.05;
const MIN_TURNS: f64 = 2.0;
/// Warming of the winding below which effects of its temperature are not visible, K.
const MIN_WARMING_K: f64 = 3.0;

/// The range of operation that a log covers; `None` where the log has no column for the quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    /// Lowest and highest rate, rad/s.
    pub rates_rad_s: Option<(f64, f64)>,
    /// Fraction of the turning rows at less than a tenth of the largest rate.
    pub slow: Option<f64>,
    /// Number of turns between the smallest and the largest angle.
    pub turns: Option<f64>,
    /// Largest current, A.
    pub current_A: Option<f64>,
    /// Span of the winding's temperature, K.
    pub warming_K: Option<f64>,
    /// Duration without gaps, s.
    pub duration_s: f64,
}

impl Coverage {
    /// Computes the coverage of a log.
    pub fn of(log: &Log) -> Coverage {
        let rates = rates(log);
        let rates_rad_s = rates.as_deref().and_then(range);
        let largest = rates_rad_s.map_or(0.0, |(low, high)| high.max(-low));
        let slow = rates.as_deref().map(|rates| {
            let turning = rates.iter().filter(|w| w.abs() > MIN_TURNING_FRACTION * largest).count();
            let slow = rates.iter().filter(|w| w.abs() > MIN_TURNING_FRACTION * largest && w.abs() < MAX_SLOW_FRACTION * largest).count();
            slow as f64 / turning.max(1) as f64
        });
        let span = |name: &str| log.column(name).and_then(range).map(|(low, high)| high - low);
        // Averaged over 1 s, so that noise of the sensor does not count as warming.
        let second = ((1.0 / log.median_dt_s()).round() as usize).max(1);
        let smooth = |values: &[f64]| values.chunks(second).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect::<Vec<f64>>();
        Coverage {
            rates_rad_s,
            slow,
            turns: span("theta_rad").map(|s| s / TAU),
            current_A: log.column("i_A").and_then(range).map(|(low, high)| high.max(-low)),
            warming_K: log.column("temp_C").and_then(|t| range(&smooth(t))).map(|(low, high)| high - low),
            duration_s: log.segments().iter().map(|rows| rows.len() as f64 * log.median_dt_s()).sum(),
        }
    }

    /// The log has rates in both directions; `true` where the rate is not known.
    pub fn both_ways(&self) -> bool {
        self.rates_rad_s.is_none_or(|(low, high)| high.min(-low) > MIN_REVERSE_FRACTION * high.max(-low))
    }

    /// The log has enough slow turns to show a ripple over the angle; `true` where rate and angle are not known.
    pub fn slow_turns(&self) -> bool {
        self.slow.is_none_or(|s| s >= MIN_SLOW_ROWS_FRACTION) && self.turns.is_none_or(|t| t >= MIN_TURNS)
    }

    /// The winding warms enough to show effects of its temperature; `false` where its temperature is not known.
    pub fn warms(&self) -> bool {
        self.warming_K.is_some_and(|k| k >= MIN_WARMING_K)
    }
}

/// The rate, measured or from the angle.
fn rates(log: &Log) -> Option<Vec<f64>> {
    if let Some(rates) = log.column("omega_rad_s") {
        return Some(rates.to_vec());
    }
    let theta = log.column("theta_rad")?;
    let lag = ((ANGLE_S / log.median_dt_s()).round() as usize).max(1);
    let later = theta.get(lag..)?.iter().zip(log.t_s().get(lag..)?);
    Some(theta.iter().zip(log.t_s()).zip(later).map(|((a, t), (b, u))| (b - a) / (u - t)).collect())
}

fn range(values: &[f64]) -> Option<(f64, f64)> {
    values.iter().filter(|v| v.is_finite()).fold(None, |range, &v| {
        let (low, high) = range.unwrap_or((v, v));
        Some((v.min(low), v.max(high)))
    })
}
