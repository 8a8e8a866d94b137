//! Detection of the cycles in a log: by the mark of the firmware, or by the current of the torquer.

use identification::statistics::Extremes;
use identification::statistics::robust::median_abs;
use std::ops::Range;

/// A cycle in a log: 2 N + 1 rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DetectedCycle {
    /// Rows.
    pub rows: Range<usize>,
    /// Sign of the first pulse.
    pub sign: i8,
    /// The cycle ended early.
    pub is_cut: bool,
}

/// Cycles by the column `drift_mark`: four times the number of the cycle, plus 1 in the first and 2 in the second pulse (firmware,
/// `Commutator::mark`). The sign follows from `current`.
pub fn cycles_by_mark(mark: &[f64], current: &[f64], samples: usize) -> Vec<DetectedCycle> {
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
        found.push(DetectedCycle { rows: from..whole.min(mark.len()), sign, is_cut: to < whole });
    }
    found
}

/// Smallest contrast of a cycle relative to the greatest: amplitudes may differ by a factor of 5.
const MIN_CONTRAST_RATIO: f64 = 0.15;
/// Fraction of the current magnitude that must contribute to the contrast: each pulse has one sign.
const MIN_CONTRAST_FRACTION: f64 = 0.9;
/// Largest sum of the two pulses relative to their difference.
const MAX_IMBALANCE: f64 = 0.2;
/// Current limit in the refinement, in medians of the magnitude.
const CLIP_MEDIANS: f64 = 1.5;

/// Cycles by the current: the pulses begin where the sum over N rows minus that over the next N is greatest, at least 2 N rows apart.
pub fn cycles_by_current(current: &[f64], samples: usize) -> Vec<DetectedCycle> {
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
        first * second < 0.0 && (first + second).abs() < MAX_IMBALANCE * (first - second).abs()
    };
    let mut candidates: Vec<usize> =
        (0..scores.len()).filter(|k| scores[*k].abs() > MIN_CONTRAST_RATIO * greatest && are_opposite(*k)).collect();
    candidates.sort_by(|a, b| scores[*b].abs().total_cmp(&scores[*a].abs()).then(a.cmp(b)));
    let mut begins: Vec<usize> = Vec::new();
    for k in candidates {
        if begins.iter().all(|other| other.abs_diff(k) >= 2 * samples) {
            begins.push(k);
        }
    }
    begins.sort_unstable();
    begins
        .into_iter()
        .filter_map(|k| refined(current, k, samples))
        .map(|k| DetectedCycle {
            rows: k..(k + 2 * samples + 1).min(rows),
            sign: if contrast(current, k, samples) < 0.0 { -1 } else { 1 },
            is_cut: k + 2 * samples + 1 > rows,
        })
        .collect()
}

/// Start of the pulses near `k`, with the current clipped: a closing loop produces short peaks. `None` where the peaks were all.
fn refined(current: &[f64], k: usize, samples: usize) -> Option<usize> {
    let level = CLIP_MEDIANS * median_abs(&current[k..k + 2 * samples])?;
    let (from, to) = (k.saturating_sub(samples / 2), (k + 2 * samples + samples / 2).min(current.len()));
    let clipped = || current[from..to].iter().map(|i| i.clamp(-level, level));
    let (sums, sizes) = (sums_of(clipped()), sums_of(clipped().map(f64::abs)));
    let score = |k: usize| (2.0 * sums[k + samples] - sums[k] - sums[k + 2 * samples]).abs();
    let best = (0..=to - from - 2 * samples).fold(0, |best, k| if score(k) > score(best) { k } else { best });
    let size = sizes[best + 2 * samples] - sizes[best];
    (score(best) > MIN_CONTRAST_FRACTION * size && size > 0.0).then_some(from + best)
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

/// Mean current of the first minus that of the second pulse, for a cycle that begins at a row.
pub fn contrast(current: &[f64], row: usize, samples: usize) -> f64 {
    let half = |from: usize| {
        let rows = &current[from.min(current.len())..(from + samples).min(current.len())];
        rows.iter().sum::<f64>() / rows.len().max(1) as f64
    };
    half(row) - half(row + samples)
}
