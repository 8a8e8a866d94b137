//! Where the cycles are in a log: by the firmware's mark where the log has it, else by the torquer's current.

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

/// By the current alone: where the sum over N rows less that over the next N is greatest, the pulses begin. Least distance: 2 N.
pub fn by_current(current: &[f64], samples: usize) -> Vec<Found> {
    let rows = current.len();
    if rows < 2 * samples {
        return Vec::new();
    }
    let mut sums = Vec::with_capacity(rows + 1);
    sums.push(0.0);
    for i in current {
        sums.push(sums.last().copied().unwrap_or(0.0) + i);
    }
    let contrast = |k: usize| 2.0 * sums[k + samples] - sums[k] - sums[k + 2 * samples];
    let scores: Vec<f64> = (0..=rows - 2 * samples).map(contrast).collect();
    let greatest = scores.iter().fold(0.0, |most: f64, score| most.max(score.abs()));
    let mut order: Vec<usize> = (0..scores.len()).filter(|k| scores[*k].abs() > 0.8 * greatest && is_pulse(current, *k, samples)).collect();
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
        .map(|k| Found {
            rows: k..(k + 2 * samples + 1).min(rows),
            sign: if scores[k] < 0.0 { -1 } else { 1 },
            is_cut: k + 2 * samples + 1 > rows,
        })
        .collect()
}

/// Whether the halves are pulses indeed: of one sign each, and opposite.
fn is_pulse(current: &[f64], k: usize, samples: usize) -> bool {
    let mean = |half: &[f64]| half.iter().sum::<f64>() / half.len() as f64;
    let (first, second) = (mean(&current[k..k + samples]), mean(&current[k + samples..k + 2 * samples]));
    let balance = (first + second).abs();
    first * second < 0.0 && balance < 0.2 * (first - second).abs()
}
