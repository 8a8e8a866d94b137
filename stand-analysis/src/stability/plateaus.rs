//! Stretches of constant rate in a log.
//!
//! Input: a log, its angle. Output: row ranges without a gap, with the setpoint if the log has it. With a column `rate_cmd_rad_s` a plateau
//! is a run of equal setpoints other than 0; without it, a run in one direction whose rate, smoothed over 0.2 s, stays within 20 % of its
//! median.

use identification::log::Log;
use identification::statistics::robust::median;
use std::ops::Range;

/// Time over which the rate is smoothed without a setpoint, s.
const SMOOTHING_S: f64 = 0.2;
/// Largest relative deviation of the smoothed rate from its median.
const MAX_DEVIATION: f64 = 0.2;
/// Largest relative change of a setpoint within a plateau.
const SAME_COMMAND: f64 = 1e-9;

/// A stretch of constant rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Plateau {
    /// Rows.
    pub rows: Range<usize>,
    /// Setpoint, rad/s.
    pub command_rad_s: Option<f64>,
}

/// The plateaus of a log, without the first `settle_s` of each.
pub fn of_log(log: &Log, theta_rad: &[f64], settle_s: f64) -> Vec<Plateau> {
    let dt_s = log.median_dt_s();
    let command = log.column("rate_cmd_rad_s");
    let mut plateaus = Vec::new();
    for segment in log.segments() {
        match command {
            Some(command) => plateaus.extend(by_command(command, segment)),
            None => plateaus.extend(by_rate(theta_rad, segment, dt_s)),
        }
    }
    let skipped = (settle_s / dt_s).round() as usize;
    plateaus
        .into_iter()
        .map(|plateau| Plateau { rows: (plateau.rows.start + skipped).min(plateau.rows.end)..plateau.rows.end, ..plateau })
        .filter(|plateau| plateau.rows.len() > 2)
        .collect()
}

fn by_command(command: &[f64], segment: Range<usize>) -> Vec<Plateau> {
    let mut found = Vec::new();
    let mut from = segment.start;
    while from < segment.end {
        let value = command[from];
        let same = |k: &usize| (command[*k] - value).abs() <= SAME_COMMAND * value.abs();
        let to = (from..segment.end).find(|k| !same(k)).unwrap_or(segment.end);
        if value != 0.0 && value.is_finite() {
            found.push(Plateau { rows: from..to, command_rad_s: Some(value) });
        }
        from = to.max(from + 1);
    }
    found
}

fn by_rate(theta_rad: &[f64], segment: Range<usize>, dt_s: f64) -> Option<Plateau> {
    let half = ((0.5 * SMOOTHING_S / dt_s).round() as usize).max(1);
    if segment.len() < 4 * half {
        return None;
    }
    let inner = segment.start + half..segment.end - half;
    let rate = |k: usize| (theta_rad[k + half] - theta_rad[k - half]) / (2.0 * half as f64 * dt_s);
    let usual = median(inner.clone().map(rate))?;
    let is_usual = |k: &usize| (rate(*k) / usual - 1.0).abs() < MAX_DEVIATION;
    // The longest run.
    let (mut best, mut from) = (0..0, inner.start);
    while from < inner.end {
        let to = (from..inner.end).find(|k| !is_usual(k)).unwrap_or(inner.end);
        if to - from > best.len() {
            best = from..to;
        }
        from = to + 1;
    }
    (usual != 0.0 && !best.is_empty()).then_some(Plateau { rows: best, command_rad_s: None })
}
