//! The measured motion for the inverse model: evenly sampled, low-passed without delay, differentiated.

use super::Settings;
use super::zero_phase::LowPass;
use crate::recording::PreparedLog;

/// A segment on an even time grid.
pub(super) struct Motion {
    /// Last row of the log up to each point.
    pub row: Vec<usize>,
    /// Time, s.
    pub t_s: Vec<f64>,
    /// Filtered angle, rad.
    pub theta: Vec<f64>,
    /// Rate, rad/s.
    pub omega: Vec<f64>,
    /// Acceleration, rad/s².
    pub alpha: Vec<f64>,
    /// Measured input at the points, in its unit.
    pub given: Vec<f64>,
}

/// Relative deviation of a row interval above which the rows are resampled.
const MAX_INTERVAL_DEVIATION: f64 = 1e-3;
/// Pairs of poles of the low-pass before differentiation: order four (Janot, Gautier and Brunot 2019).
const POLE_PAIRS: u32 = 2;

/// The motion along one segment. `given` is the measured input: means over the rows if `mean_over_row`, otherwise samples.
pub(super) fn along(data: &PreparedLog, segment: usize, angle: &[f64], given: &[f64], mean_over_row: bool, settings: Settings) -> Motion {
    let rows = data.segments[segment].clone();
    let (t, h) = (&data.t_s[rows.clone()], data.dt_s);
    let even = t.windows(2).all(|w| ((w[1] - w[0]) / h - 1.0).abs() < MAX_INTERVAL_DEVIATION);
    let half_count = 0.5 * data.theta_quantum;
    let raw: Vec<f64> = angle[rows.clone()].iter().map(|a| a + half_count).collect();
    let given = &given[rows.clone()];
    let (t_s, raw) = if even {
        (t.to_vec(), raw)
    } else {
        let (from, to) = (t.first().copied().unwrap_or(0.0), t.last().copied().unwrap_or(0.0));
        let grid: Vec<f64> = (0..=((to - from) / h).floor() as usize).map(|k| from + k as f64 * h).collect();
        let raw = interpolated(t, &raw, &grid);
        (grid, raw)
    };
    let given = match (mean_over_row, even) {
        (false, true) => given.to_vec(),
        (false, false) => interpolated(t, given, &t_s),
        (true, _) => {
            // A mean over [t_k, t_k+1) is assigned to the middle of the row.
            let middles: Vec<f64> = (0..t.len()).map(|k| t[k] + 0.5 * t.get(k + 1).map_or(h, |next| next - t[k])).collect();
            interpolated(&middles, given, &t_s)
        }
    };
    let theta = LowPass::butterworth(POLE_PAIRS, settings.cutoff_hz * 2.0 * h).filter_both_ways(&raw);
    let omega = central_differences(&theta, h);
    let alpha = central_differences(&omega, h);
    let row = t_s.iter().map(|&at| rows.start + t.partition_point(|&t| t <= at).saturating_sub(1)).collect();
    Motion { row, t_s, theta, omega, alpha, given }
}

/// Linear interpolation at `grid`, constant beyond the ends. Both times increase.
fn interpolated(t: &[f64], y: &[f64], grid: &[f64]) -> Vec<f64> {
    let mut after = 0;
    let at = |at: &f64| {
        while after < t.len() && t[after] <= *at {
            after += 1;
        }
        match (after.checked_sub(1), after < t.len()) {
            (Some(k), true) => y[k] + (y[after] - y[k]) * ((at - t[k]) / (t[after] - t[k])),
            (Some(k), false) => y[k],
            (None, _) => y[0],
        }
    };
    grid.iter().map(at).collect()
}

/// Central differences, one-sided at the ends.
fn central_differences(y: &[f64], h: f64) -> Vec<f64> {
    let last = y.len().saturating_sub(1);
    let slope = |k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
        if b > a { (y[b] - y[a]) / ((b - a) as f64 * h) } else { 0.0 }
    };
    (0..y.len()).map(slope).collect()
}
