//! Rows at which a measured angle jumps, from the angle alone: lost counts.
//!
//! The increment of such a row differs from those of the rows before and after it by far more than the noise and the counts of the angle
//! allow; no rotor accelerates and comes back within a row. Such rows are few, and a fit has to see them: they are never held out.

use std::ops::Range;

use crate::statistics::robust::{MEDIAN_ABS_PER_SIGMA, median};

/// Rows on either side with which an increment is compared.
const NEIGHBOURS: usize = 3;
/// Distance of a jump from its neighbours, standard deviations of such distances.
const MIN_SIGMAS: f64 = 10.0;
/// The same in counts: two at each end are rounding.
const MIN_COUNTS: f64 = 4.0;
/// Fraction of the rows above which jumps are a property of the angle.
const MAX_FRACTION: f64 = 1e-3;

/// First rows after each jump of `theta` within a segment. `quantum`: the least significant bit, 0 for a continuous angle.
pub fn angle_jumps(theta: &[f64], quantum: f64, segments: &[Range<usize>]) -> Vec<usize> {
    let mut distances: Vec<(usize, f64)> = Vec::new();
    for rows in segments {
        let increment = |row: usize| theta[row] - theta[row - 1];
        for row in rows.start + 1 + NEIGHBOURS..rows.end.saturating_sub(NEIGHBOURS) {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for other in (row - NEIGHBOURS..row).chain(row + 1..=row + NEIGHBOURS) {
                (low, high) = (low.min(increment(other)), high.max(increment(other)));
            }
            let own = increment(row);
            distances.push((row, (own - high).max(low - own)));
        }
    }
    let scale = median(distances.iter().map(|(_, d)| d.abs())).unwrap_or(0.0) / MEDIAN_ABS_PER_SIGMA;
    let limit = (MIN_SIGMAS * scale).max(MIN_COUNTS * quantum);
    let jumps: Vec<usize> = distances.iter().filter(|(_, d)| *d > limit && *d > 0.0).map(|(row, _)| *row).collect();
    if jumps.len() as f64 > MAX_FRACTION * theta.len() as f64 { Vec::new() } else { jumps }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counted(rows: usize, jump_counts: f64) -> Vec<f64> {
        let count = 3.14e-4;
        (0..rows)
            .map(|k| {
                let t = k as f64 * 1e-3;
                ((5.0 * t + 2.0 * (3.0 * t).sin()) / count).floor() * count + if k >= 777 { jump_counts * count } else { 0.0 }
            })
            .collect()
    }

    #[test]
    fn jump_of_counts_is_found_and_motion_is_not() {
        let whole = 0..2000;
        let segments = [whole];
        assert_eq!(angle_jumps(&counted(2000, -20.0), 3.14e-4, &segments), [777]);
        assert_eq!(angle_jumps(&counted(2000, 0.0), 3.14e-4, &segments), [0_usize; 0]);
        // Between two segments there is no increment.
        assert_eq!(angle_jumps(&counted(2000, 20.0), 3.14e-4, &[0..777, 777..2000]), [0_usize; 0]);
    }

    #[test]
    fn angle_that_jumps_all_the_time_has_no_single_jumps() {
        let whole = 0..2000;
        let segments = [whole];
        let coarse: Vec<f64> = (0..2000).map(|k| ((k * 7 % 11) as f64).powi(2)).collect();
        assert_eq!(angle_jumps(&coarse, 0.0, &segments), [0_usize; 0]);
    }
}
