//! The input within the rows: its mean, and the course of a voltage about the mean.
//!
//! A column of values at t is interpolated by a monotone cubic. The stand records mean and first moment of each row. Its speed loop follows an estimate of the rate, which is an integral of
//! the encoder's innovations: within a row the voltage is a random walk. Its expected course, given the means and moments of all rows, is a cubic in each row without
//! jumps at the edges (smoothing spline: G. Wahba, Spline Models for Observational Data, 1990, section 1.3).

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use crate::log::Log;
use crate::model::Input;
use crate::statistics::robust::{MEDIAN_ABS_PER_SIGMA, median_abs};

/// Column of the first moment of the voltage within a row.
const VOLTAGE_SLOPE: &str = "u_slope_V";
/// Standard deviations of the random walk beyond which the voltage jumps at the edge of a row: a step of the setpoint.
const MIN_JUMP_SIGMAS: f64 = 5.0;
/// Variance of the first moment of a random walk over a row, in the variance that the walk gains in the row; and that of its end, given mean and moment of the row.
const MOMENT_VARIANCE: f64 = 0.3;
const EDGE_VARIANCE: f64 = 0.125;

/// Slope at a row of the monotone cubic through evenly spaced values, per row: the central difference, limited so that the cubic does not overshoot
/// (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238).
fn monotone_slope(u: &[f64], k: usize) -> f64 {
    if k == 0 || k + 1 >= u.len() {
        return 0.0;
    }
    let (before, after) = (u[k] - u[k - 1], u[k + 1] - u[k]);
    if before * after <= 0.0 {
        return 0.0;
    }
    let most = 3.0 * before.abs().min(after.abs());
    (0.5 * (before + after)).clamp(-most, most)
}

/// The input over each row: the column itself, or the mean of the monotone cubic through its values where it holds values at t.
pub fn input<'a>(column: &'a [f64], at_t: bool, segments: &[Range<usize>]) -> Cow<'a, [f64]> {
    if !at_t {
        return Cow::Borrowed(column);
    }
    let mut means = column.to_vec();
    for rows in segments {
        let u = &column[rows.clone()];
        for k in 0..u.len().saturating_sub(1) {
            means[rows.start + k] = 0.5 * (u[k] + u[k + 1]) + (monotone_slope(u, k) - monotone_slope(u, k + 1)) / 12.0;
        }
    }
    Cow::Owned(means)
}

/// Course of the voltage within each row ([`drive_rig::RowInput::voltage_course_V`]): by the column of the stand, or by the cubic through values at t. `None` where it is not
/// known, or the input is no voltage.
pub fn voltage_course_V(log: &Log, driven: Input, at_t: bool, segments: &[Range<usize>]) -> Option<Arc<[[f64; 3]]>> {
    if driven != Input::Voltage {
        return None;
    }
    let voltage = log.column(driven.column())?;
    let moments = if at_t { None } else { Some(log.column(VOLTAGE_SLOPE)?) };
    let mut course = vec![[0.0; 3]; voltage.len()];
    for rows in segments {
        let (u, course) = (&voltage[rows.clone()], &mut course[rows.clone()]);
        match moments {
            Some(moments) => expected_course(u, &moments[rows.clone()], course),
            None => {
                for k in 0..u.len().saturating_sub(1) {
                    let slopes = [monotone_slope(u, k), monotone_slope(u, k + 1)];
                    // Three times the mean of u (2 x − 1) over the cubic with these values and slopes at its ends.
                    course[k] = cubic(0.6 * (u[k + 1] - u[k]) - 0.05 * (slopes[0] + slopes[1]), slopes);
                }
            }
        }
    }
    Some(course.into())
}

/// Coefficients of the cubic with this first moment and these slopes at its ends, per row.
fn cubic(moment: f64, [begin, end]: [f64; 2]) -> [f64; 3] {
    [moment, (end - begin) / 12.0, (begin + end - 4.0 * moment) / 24.0]
}

/// Expected course of a random walk with these means and first moments. Its variance per row follows the row's own moment: where the voltage jumps within a row, the quiet rows beside it
/// tell where it goes. The slopes at the edges, each over the variance of its row the same on both sides, are such that no value jumps there; at a jump they are zero.
fn expected_course(means: &[f64], moments: &[f64], course: &mut [[f64; 3]]) {
    let usual = median_abs(moments).unwrap_or(0.0) / MEDIAN_ABS_PER_SIGMA;
    let variance: Vec<f64> = moments.iter().map(|m| (usual * usual + m * m) / MOMENT_VARIANCE).collect();
    let n = means.len();
    // With the slope m = f s² at an edge, s² the variance of the row: −s²(k−1) f(k−1) + 3 (s²(k−1) + s²(k)) f(k) − s²(k) f(k+1) = 24 × the difference at edge k;
    // solved by elimination from the first edge.
    let (mut factor, mut slopes) = (vec![0.0; n + 1], vec![0.0; n + 1]);
    for k in 1..n {
        let step = (means[k] - 5.0 / 6.0 * moments[k]) - (means[k - 1] + 5.0 / 6.0 * moments[k - 1]);
        let both = variance[k - 1] + variance[k];
        if step * step >= MIN_JUMP_SIGMAS.powi(2) * EDGE_VARIANCE * both {
            continue;
        }
        let pivot = 3.0 * both - variance[k - 1] * factor[k - 1];
        factor[k] = variance[k] / pivot;
        slopes[k] = (24.0 * step + variance[k - 1] * slopes[k - 1]) / pivot;
    }
    for k in (1..n).rev() {
        slopes[k] += factor[k] * slopes[k + 1];
    }
    for k in 0..n {
        course[k] = cubic(moments[k], [slopes[k] * variance[k], slopes[k + 1] * variance[k]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Value of the course about the mean at the fraction x of the row.
    fn value([p1, p2, p3]: [f64; 3], x: f64) -> f64 {
        p1 * (2.0 * x - 1.0) + p2 * (6.0 * x * x - 6.0 * x + 1.0) + p3 * (((20.0 * x - 30.0) * x + 12.0) * x - 1.0)
    }

    #[test]
    fn smooth_voltage_is_reproduced_and_continuous() {
        // Means and first moments of sin(t) over rows of 0.3.
        let h = 0.3;
        let (mut means, mut moments) = (Vec::new(), Vec::new());
        for k in 0..40 {
            let at = |j: usize| (f64::from(k) + (j as f64 + 0.5) / 1000.0) * h;
            means.push((0..1000).map(|j| at(j).sin()).sum::<f64>() / 1000.0);
            moments.push((0..1000).map(|j| at(j).sin() * (2.0 * (j as f64 + 0.5) / 1000.0 - 1.0)).sum::<f64>() * 3.0 / 1000.0);
        }
        let mut course = vec![[0.0; 3]; 40];
        expected_course(&means, &moments, &mut course);
        for k in 3..36 {
            for x in [0.0, 0.3, 0.5, 0.9, 1.0] {
                let (found, true_value) = (means[k] + value(course[k], x), ((k as f64 + x) * h).sin());
                assert!((found - true_value).abs() < 3e-3, "row {k}, {x}: {found} {true_value}");
            }
        }
    }

    #[test]
    fn jump_at_an_edge_stays_a_jump_and_a_lone_moment_is_that_of_a_random_walk() {
        let mut course = vec![[0.0; 3]; 4];
        expected_course(&[1.0, 1.0, 5.0, 5.0], &[0.0; 4], &mut course);
        assert_eq!(course, [[0.0; 3]; 4]);
        // From 0 to 1 at 0.6 of a row: the rows beside it tell the ends.
        expected_course(&[0.0, 0.4, 1.0, 1.0], &[1e-3, 0.72, 1e-3, -1e-3], &mut course);
        assert!((value(course[1], 0.0) + 0.4).abs() < 0.01 && (value(course[1], 1.0) - 0.6).abs() < 0.01, "{course:?}");
        // One row alone: slopes zero at the ends, 5/6 of the moment there.
        expected_course(&[0.0], &[0.6], &mut course[..1]);
        assert!((value(course[0], 1.0) - 0.5).abs() < 1e-12 && (value(course[0], 0.0) + 0.5).abs() < 1e-12);
    }

    #[test]
    fn course_is_nearer_to_a_random_walk_than_straight_lines() {
        let mut state = 1_u64;
        let mut step = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        const TICKS: usize = 100;
        let mut level = 0.0;
        let walk: Vec<f64> = (0..2000 * TICKS)
            .map(|_| {
                level += step();
                level
            })
            .collect();
        let rows: Vec<&[f64]> = walk.chunks(TICKS).collect();
        let x = |j: usize| 2.0 * (j as f64 + 0.5) / TICKS as f64 - 1.0;
        let means: Vec<f64> = rows.iter().map(|row| row.iter().sum::<f64>() / TICKS as f64).collect();
        let moments: Vec<f64> =
            rows.iter().map(|row| row.iter().enumerate().map(|(j, u)| u * x(j)).sum::<f64>() * 3.0 / TICKS as f64).collect();
        let mut course = vec![[0.0; 3]; rows.len()];
        expected_course(&means, &moments, &mut course);
        let (mut by_course, mut by_line) = (0.0, 0.0);
        for k in 10..rows.len() - 10 {
            let end = rows[k][TICKS - 1] - means[k];
            by_course += (value(course[k], 1.0) - end).powi(2);
            by_line += (moments[k] - end).powi(2);
        }
        assert!(by_course < 0.5 * by_line, "{by_course} {by_line}");
    }
}
