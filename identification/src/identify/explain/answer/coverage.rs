//! The range of operation that a log covers: rates, turns, currents, warming. Effects outside this range are not visible.

use std::f64::consts::TAU;

use crate::identify::explain::criteria::CoverageCriteria;
use crate::log::Log;

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
    /// The log has rates in both directions; `true` where the rate is not known.
    pub both_ways: bool,
    /// The log has enough slow turns to show a ripple over the angle; `true` where rate and angle are not known.
    pub slow_turns: bool,
    /// The winding warms enough to show effects of its temperature; `false` where its temperature is not known.
    pub warms: bool,
}

impl Coverage {
    /// Computes the coverage of a log.
    pub fn of(log: &Log, criteria: &CoverageCriteria) -> Coverage {
        let rates = rates(log, criteria);
        let rates_rad_s = rates.as_deref().and_then(range);
        let largest = rates_rad_s.map_or(0.0, |(low, high)| high.max(-low));
        let slow = rates.as_deref().map(|rates| {
            let turning = rates.iter().filter(|w| w.abs() > criteria.min_turning_fraction * largest).count();
            let slow = rates
                .iter()
                .filter(|w| w.abs() > criteria.min_turning_fraction * largest && w.abs() < criteria.max_slow_fraction * largest)
                .count();
            slow as f64 / turning.max(1) as f64
        });
        let span = |name: &str| log.column(name).and_then(range).map(|(low, high)| high - low);
        // Averaged over 1 s, so that noise of the sensor does not count as warming.
        let second = ((1.0 / log.median_dt_s()).round() as usize).max(1);
        let smooth = |values: &[f64]| values.chunks(second).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect::<Vec<f64>>();
        let turns = span("theta_rad").map(|s| s / TAU);
        let warming_K = log.column("temp_C").and_then(|t| range(&smooth(t))).map(|(low, high)| high - low);
        Coverage {
            both_ways: rates_rad_s.is_none_or(|(low, high)| high.min(-low) > criteria.min_reverse_fraction * high.max(-low)),
            slow_turns: slow.is_none_or(|s| s >= criteria.min_slow_rows_fraction) && turns.is_none_or(|t| t >= criteria.min_turns),
            warms: warming_K.is_some_and(|k| k >= criteria.min_warming_K),
            rates_rad_s,
            slow,
            turns,
            current_A: log.column("i_A").and_then(range).map(|(low, high)| high.max(-low)),
            warming_K,
            duration_s: log.segments().iter().map(|rows| rows.len() as f64 * log.median_dt_s()).sum(),
        }
    }
}

/// The rate, measured or from the angle.
fn rates(log: &Log, criteria: &CoverageCriteria) -> Option<Vec<f64>> {
    if let Some(rates) = log.column("omega_rad_s") {
        return Some(rates.to_vec());
    }
    let theta = log.column("theta_rad")?;
    let lag = ((criteria.angle_interval_s / log.median_dt_s()).round() as usize).max(1);
    let later = theta.get(lag..)?.iter().zip(log.t_s().get(lag..)?);
    Some(theta.iter().zip(log.t_s()).zip(later).map(|((a, t), (b, u))| (b - a) / (u - t)).collect())
}

fn range(values: &[f64]) -> Option<(f64, f64)> {
    values.iter().filter(|v| v.is_finite()).fold(None, |range, &v| {
        let (low, high) = range.unwrap_or((v, v));
        Some((v.min(low), v.max(high)))
    })
}
