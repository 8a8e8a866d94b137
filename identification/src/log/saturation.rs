//! Readings at the end of a sensor's or converter's range: they say that the quantity is at least this large, not how large it is.
//!
//! A limited reading has flat tops at its largest or smallest value, reached by a sharp edge, while its noise makes successive readings
//! differ elsewhere. Flat stretches of a setpoint, of a quantity without noise and of coarse counts are none, and zero is rest.

use super::quantization;
use crate::statistics::Extremes;

/// Rows in a row at the largest or smallest value that make a flat top.
const FLAT_TOP_ROWS: usize = 3;
/// Flat tops from which on a column is believed to be limited.
const MIN_FLAT_TOPS: usize = 2;
/// Quantisation steps from a flat top to its neighbour beyond which the top is a limit: the peak of a slow, quantised motion is flat too,
/// but its neighbours are one step away.
const MIN_EDGE_STEPS: f64 = 2.5;
/// Distinct values from which on a column is a measurement: a setpoint rests at its ends.
const MIN_LEVELS: usize = 16;
/// Part of the rows outside the tops in which the second difference has another sign than in the row before, at least. Of white noise it is
/// two thirds, of a motion without noise next to none.
const MIN_ALTERNATING: f64 = 0.25;

/// The rows at the ends of the range, in order; none where the readings are not limited.
pub fn rows_at_limits(values: &[f64]) -> Vec<usize> {
    let (low, high) = values.iter().copied().min_max();
    if low == high || !has_levels(values) {
        return Vec::new();
    }
    let edge = MIN_EDGE_STEPS * quantization::step(values).unwrap_or(0.0);
    let mut rows: Vec<usize> = [low, high].into_iter().filter(|end| *end != 0.0).flat_map(|end| rows_at(values, end, edge)).collect();
    rows.sort_unstable();
    if rows.is_empty() || is_noisy_outside(values, &rows) { rows } else { Vec::new() }
}

/// Rows in flat tops at `end`, which the values reach in a step of more than `edge`; none for fewer than [`MIN_FLAT_TOPS`].
fn rows_at(values: &[f64], end: f64, edge: f64) -> Vec<usize> {
    let (mut tops, mut rows, mut k) = (0, Vec::new(), 0);
    while k < values.len() {
        let begin = k;
        while k < values.len() && (values[k] == end) == (values[begin] == end) {
            k += 1;
        }
        let is_sharp = |neighbour: Option<&f64>| neighbour.is_some_and(|v| (v - end).abs() > edge);
        let sharp = is_sharp(begin.checked_sub(1).and_then(|b| values.get(b))) || is_sharp(values.get(k));
        if values[begin] == end && k - begin >= FLAT_TOP_ROWS && sharp {
            tops += 1;
            rows.extend(begin..k);
        }
    }
    if tops >= MIN_FLAT_TOPS { rows } else { Vec::new() }
}

fn is_noisy_outside(values: &[f64], rows: &[usize]) -> bool {
    let mut is_top = vec![false; values.len()];
    rows.iter().for_each(|row| is_top[*row] = true);
    let bend = |k: usize| values[k + 1] - 2.0 * values[k] + values[k - 1];
    let outside = (2..values.len().saturating_sub(1)).filter(|k| !is_top[k - 2..=k + 1].contains(&true));
    let (mut all, mut alternating) = (0usize, 0usize);
    for k in outside {
        all += 1;
        alternating += usize::from(bend(k) * bend(k - 1) < 0.0);
    }
    alternating as f64 >= MIN_ALTERNATING * all as f64
}

fn has_levels(values: &[f64]) -> bool {
    let mut levels: Vec<f64> = Vec::new();
    for value in values {
        if !levels.contains(value) {
            levels.push(*value);
            if levels.len() >= MIN_LEVELS {
                return true;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::rows_at_limits;

    fn noise(k: i32) -> f64 {
        (f64::from(k) * 12.9898).sin() * 43_758.545_3 % 1.0
    }

    #[test]
    fn clipped_readings_are_found() {
        let rate: Vec<f64> = (0..4000).map(|k| 6.0 * (f64::from(k) * 0.01).sin() + 0.02 * noise(k)).collect();
        let clipped: Vec<f64> = rate.iter().map(|v| v.clamp(-4.363, 4.363)).collect();
        let beyond = rate.iter().filter(|v| v.abs() >= 4.363).count();
        let found = rows_at_limits(&clipped).len();
        assert!(found <= beyond && found > beyond * 9 / 10, "{found} of {beyond}: single rows at the edges of a top are left");
        assert!(rows_at_limits(&rate).is_empty());
    }

    #[test]
    fn flat_stretches_without_noise_are_no_limits() {
        // A trapezoid without noise, a setpoint, counts at a steady rate, and rest.
        let trapezoid: Vec<f64> = (0..4000).map(|k| (30.0 * (f64::from(k) * 0.01).sin()).clamp(-20.0, 20.0)).collect();
        let setpoint: Vec<f64> = (0..4000).map(|k| f64::from((k / 400) % 3)).collect();
        let counts: Vec<f64> = (0..4000).map(|k| (10.0 * (f64::from(k) * 0.003).sin() + 0.3 * noise(k)).round()).collect();
        let rest: Vec<f64> = (0..4000).map(|k| ((f64::from(k) * 0.01).sin() + 0.02 * noise(k)).max(0.0)).collect();
        for values in [trapezoid, setpoint, counts, rest] {
            assert!(rows_at_limits(&values).is_empty());
        }
    }
}
