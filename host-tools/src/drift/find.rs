//! Where the cycles are in a log: by the firmware's mark where the log has it, else by the torquer's current.

use crate::statistics::Extremes;
use crate::statistics::robust::median_abs;
use std::ops::Range;

/// A cycle in a log: its rows from the first sample to the last, 2 N + 1 of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Rows.
    pub rows: Range<usize>,
    /// Sign of its first pulse.
    pub sign: i8,
    /// The loop was closed before its end: it was cut short.
    pub is_cut: bool,
}

/// By the column `drift_mark`: four times the cycle's number, and 1 in the first pulse, 2 in the second (firmware, `Commutator::mark`). `current` tells
/// the sign.
pub fn by_mark(mark: &[f64], current: &[f64], samples: usize) -> Vec<Found> {
    let mut found = Vec::new();
    let mut k = 0;
    let half = |k: usize| mark[k] as u64 % 4;
    while k < mark.len() {
        if half(k) == 0 {
            k += 1;
            continue;
        }
        let number = mark[k] as u64 / 4;
        let from = k;
        while k < mark.len() && half(k) > 0 && mark[k] as u64 / 4 == number {
            k += 1;
        }
        // The last sample is that at which the loop closes.
        let to = (k + 1).min(mark.len());
        let first = &current[from..(from + samples).min(current.len())];
        let sign = if first.iter().sum::<f64>() < 0.0 { -1 } else { 1 };
        let whole = from + 2 * samples + 1;
        found.push(Found { rows: from..whole.min(mark.len()), sign, is_cut: to < whole });
    }
    found
}

/// Least contrast of a cycle beside the greatest one's: amplitudes may differ as 1 to 5.
const LEAST: f64 = 0.15;
/// Share of the current's size that must go into the contrast: all of a pulse is of one sign.
const PURE: f64 = 0.9;

/// By the current alone: where the sum over N rows less that over the next N is greatest, the pulses begin. Least distance: 2 N.
pub fn by_current(current: &[f64], samples: usize) -> Vec<Found> {
    let rows = current.len();
    if rows < 2 * samples {
        return Vec::new();
    }
    let sums = sums_of(current.iter().copied());
    let scores: Vec<f64> = (0..=rows - 2 * samples).map(|k| 2.0 * sums[k + samples] - sums[k] - sums[k + 2 * samples]).collect();
    let greatest = scores.iter().copied().max_abs();
    let halves = |k: usize| [sums[k + samples] - sums[k], sums[k + 2 * samples] - sums[k + samples]];
    let are_opposite = |k: usize| {
        let [first, second] = halves(k);
        first * second < 0.0 && (first + second).abs() < 0.2 * (first - second).abs()
    };
    let mut order: Vec<usize> = (0..scores.len()).filter(|k| scores[*k].abs() > LEAST * greatest && are_opposite(*k)).collect();
    order.sort_by(|a, b| scores[*b].abs().total_cmp(&scores[*a].abs()).then(a.cmp(b)));
    let mut begins: Vec<usize> = Vec::new();
    for k in order {
        if begins.iter().all(|other| other.abs_diff(k) >= 2 * samples) {
            begins.push(k);
        }
    }
    begins.sort_unstable();
    begins
        .into_iter()
        .filter_map(|k| refined(current, k, samples))
        .map(|k| Found {
            rows: k..(k + 2 * samples + 1).min(rows),
            sign: if contrast(current, k, samples) < 0.0 { -1 } else { 1 },
            is_cut: k + 2 * samples + 1 > rows,
        })
        .collect()
}

/// The beginning of the pulses near `k`, by currents no greater than a pulse's: a loop that closes swiftly gives much for a moment. `None` where these are
/// no pulses but such moments.
fn refined(current: &[f64], k: usize, samples: usize) -> Option<usize> {
    let level = 1.5 * median_abs(&current[k..k + 2 * samples])?;
    let (from, to) = (k.saturating_sub(samples / 2), (k + 2 * samples + samples / 2).min(current.len()));
    let clipped = || current[from..to].iter().map(|i| i.clamp(-level, level));
    let (sums, sizes) = (sums_of(clipped()), sums_of(clipped().map(f64::abs)));
    let score = |k: usize| (2.0 * sums[k + samples] - sums[k] - sums[k + 2 * samples]).abs();
    let best = (0..=to - from - 2 * samples).fold(0, |best, k| if score(k) > score(best) { k } else { best });
    let size = sizes[best + 2 * samples] - sizes[best];
    (score(best) > PURE * size && size > 0.0).then_some(from + best)
}

fn sums_of(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sum = 0.0;
    std::iter::once(0.0)
        .chain(values.map(|value| {
            sum += value;
            sum
        }))
        .collect()
}

/// Mean of the first half less that of the second, of a cycle that begins at a row; of the rows that are there.
pub fn contrast(current: &[f64], row: usize, samples: usize) -> f64 {
    let half = |from: usize| {
        let rows = &current[from.min(current.len())..(from + samples).min(current.len())];
        rows.iter().sum::<f64>() / rows.len().max(1) as f64
    };
    half(row) - half(row + samples)
}
