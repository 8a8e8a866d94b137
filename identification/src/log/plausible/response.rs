//! The response to a constant input: the rate goes to a final value, with an oscillation at most. A step and a coast-down determine
//! parameters, although their input never changes. A constant column beside a motion to and fro is not what drove it.

use super::windows::{mean, sd};
use crate::statistics::Extremes;

/// Blocks into which a rate is divided at most.
const BLOCKS: usize = 40;
/// Rows of a block at least, so that it has less noise than a row.
const MIN_BLOCK_ROWS: usize = 4;
/// Standard deviations of the noise of a block by which the rate changes at least.
const MIN_CHANGE_SIGMAS: f64 = 6.0;
/// Each swing of the rate, from one turning point to the next, over the one before it, at most: a free oscillation dies away.
const MAX_SWING: f64 = 0.9;
/// Part of its largest value that a coasting drive has at the beginning, at least.
const MIN_INITIAL_PART: f64 = 0.9;

/// A series of rates that responds to a constant input: one that drives (`is_driven`), or zero, under which it only becomes slower. Values
/// that are no numbers are left out.
pub fn is_one(rate: &[f64], is_driven: bool) -> bool {
    let rate: Vec<f64> = rate.iter().copied().filter(|v| v.is_finite()).collect();
    let rows = rate.len().div_ceil(BLOCKS).max(MIN_BLOCK_ROWS);
    let blocks: Vec<f64> = rate.chunks_exact(rows).map(mean).collect();
    let steps: Vec<f64> = rate.windows(2).map(|w| w[1] - w[0]).collect();
    let noise = sd(&steps) / (2.0 * rows as f64).sqrt();
    let (low, high) = blocks.iter().copied().min_max();
    let Some(first) = blocks.first() else { return false };
    let changes = high - low > MIN_CHANGE_SIGMAS * noise && high > low;
    let dies_away = swings(&blocks, MIN_CHANGE_SIGMAS * noise).windows(2).all(|w| w[1] <= MAX_SWING * w[0]);
    let slows_down = first.abs() >= MIN_INITIAL_PART * blocks.iter().copied().max_abs();
    changes && dies_away && (is_driven || slows_down)
}

/// Sizes of the swings between turning points; turns by no more than `least` are noise.
fn swings(values: &[f64], least: f64) -> Vec<f64> {
    let Some(first) = values.first() else { return Vec::new() };
    // Where the present swing began, and how far it has come.
    let (mut begin, mut end) = (*first, *first);
    let mut found = Vec::new();
    for value in values {
        if (value - end) * (end - begin) >= 0.0 {
            end = *value;
        } else if (value - end).abs() > least {
            found.push((end - begin).abs());
            (begin, end) = (end, *value);
        }
    }
    found.push((end - begin).abs());
    found
}

/// Mean rate over each of some even blocks of rows, from an angle.
pub fn rate_of(t_s: &[f64], theta: &[f64]) -> Vec<f64> {
    let rows = theta.len().div_ceil(MIN_BLOCK_ROWS * BLOCKS).max(1);
    let ends: Vec<usize> = (0..theta.len()).step_by(rows).collect();
    ends.windows(2).map(|w| (theta[w[1]] - theta[w[0]]) / (t_s[w[1]] - t_s[w[0]])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(rate: impl Fn(f64) -> f64) -> Vec<f64> {
        // Noise of 0.01 rad/s.
        (0..600).map(|k| rate(f64::from(k) / 600.0) + 0.01 * (f64::from(k) * 12.9898).sin()).collect()
    }

    #[test]
    fn step_and_coasting_respond_to_a_constant_input() {
        assert!(is_one(&series(|t| 20.0 * (1.0 - (-8.0 * t).exp())), true));
        assert!(is_one(&series(|t| 20.0 - 20.0 * (-4.0 * t).exp() * (30.0 * t).cos()), true), "a shaft that swings");
        assert!(is_one(&series(|t| 20.0 * (-8.0 * t).exp()), false));
        let t_s: Vec<f64> = (0..600).map(|k| f64::from(k) * 1e-3).collect();
        let theta: Vec<f64> = t_s.iter().map(|t| 20.0 * t * t).collect();
        assert!(is_one(&rate_of(&t_s, &theta), true));
    }

    #[test]
    fn constant_column_beside_another_motion_drove_nothing() {
        assert!(!is_one(&series(|t| 20.0 * (12.0 * t).sin()), true), "to and fro");
        assert!(
            !is_one(
                &series(|t| if t < 0.3 {
                    60.0 * t
                } else if t < 0.7 {
                    18.0 - 90.0 * (t - 0.3)
                } else {
                    -18.0
                }),
                true
            ),
            "steps"
        );
        assert!(!is_one(&series(|_| 20.0), true), "steady");
        assert!(!is_one(&series(|t| 20.0 * (1.0 - (-8.0 * t).exp())), false), "zero volts accelerate nothing");
        assert!(!is_one(&[], true));
    }
}
