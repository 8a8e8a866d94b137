//! Continues an angle that was wrapped to one turn.
//!
//! In: an angle, rad, one value for each row. Out: the angle over the turns, and the number of jumps. An angle is wrapped if it stays
//! within one turn and all its steps are either short or jumps of about one turn: then no jump can be a motion.

use std::f64::consts::{PI, TAU};

use crate::statistics::Extremes;

/// Longest step of the motion from one row to the next, rad. A longer step within one turn could be a wrap or a motion.
const MAX_STEP_RAD: f64 = 0.5 * PI;
/// Width of the range of a wrapped angle, turns; rounding may exceed one turn.
const MAX_TURNS: f64 = 1.001;

/// Unwraps the angle; the number of jumps, 0 if it was not wrapped.
pub(super) fn unwrap(theta_rad: &mut [f64]) -> usize {
    let (low, high) = theta_rad.iter().copied().min_max();
    if high - low > MAX_TURNS * TAU {
        return 0;
    }
    let step = |pair: &[f64]| pair[1] - pair[0];
    let turns = |step: f64| (step / TAU).round();
    if theta_rad.windows(2).map(step).any(|step| (step - TAU * turns(step)).abs() > MAX_STEP_RAD) {
        return 0;
    }
    let (mut jumps, mut offset, mut before) = (0, 0.0, theta_rad.first().copied().unwrap_or(0.0));
    for theta in theta_rad {
        let jump = turns(*theta - before);
        before = *theta;
        jumps += usize::from(jump != 0.0);
        offset -= jump;
        *theta += TAU * offset;
    }
    jumps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapped_angle_is_continued_in_both_directions() {
        let angle: Vec<f64> = (0..2000).map(|k| 30.0 * (k as f64 * 2e-3).sin()).collect();
        for low in [0.0, -PI] {
            let mut wrapped: Vec<f64> = angle.iter().map(|a| (a - low).rem_euclid(TAU) + low).collect();
            let offset = wrapped[0] - angle[0];
            assert!(unwrap(&mut wrapped) > 8);
            assert!(wrapped.iter().zip(&angle).all(|(w, a)| (w - a - offset).abs() < 1e-9));
        }
    }

    #[test]
    fn angle_over_turns_and_small_motions_are_unchanged() {
        for amplitude in [0.1, 3.0, 30.0] {
            let angle: Vec<f64> = (0..2000).map(|k| amplitude * (k as f64 * 2e-3).sin()).collect();
            let mut same = angle.clone();
            assert_eq!(unwrap(&mut same), 0);
            assert_eq!(same, angle);
        }
        // Steps between a quarter and three quarters of a turn: a fast motion at a low row rate.
        let mut coarse: Vec<f64> = (0..20).map(|k| (k as f64 * 2.5).rem_euclid(TAU)).collect();
        assert_eq!(unwrap(&mut coarse), 0);
    }
}
