//! The input within the rows: its mean, and the course of a voltage about the mean.
//!
//! A column of values at t is interpolated by a monotone cubic. Means over the row of a voltage that moves within it are those of a
//! quadratic spline, and of a jump between two steady voltages. The stand records mean and first moment of each row. Its speed loop follows
//! an estimate of the rate, which is an integral of the encoder's innovations: within a row the voltage is a random walk. Its expected
//! course, given the means and moments of all rows, is a cubic in each row without jumps at the edges (smoothing spline: G. Wahba, Spline
//! Models for Observational Data, 1990, section 1.3).

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use rand_xoshiro::rand_core::Rng;

use crate::log::Log;
use crate::model::Input;

/// Column of the first moment of the voltage within a row.
const VOLTAGE_SLOPE: &str = "u_slope_V";
/// Standard deviations of the random walk beyond which the voltage jumps at the edge of a row: a step of the setpoint.
const MIN_JUMP_SIGMAS: f64 = 5.0;
/// Largest difference between the rows before a jump, and between those after it, part of the jump, at which they are steady: the mean of
/// the row tells the time of the jump to this part of the row.
const MAX_STEADY_STEP: f64 = 0.02;
/// Rows on each side of a row whose moments tell the variance there. A drive with a shaft oscillates in bursts. The moment of one row alone
/// is no estimate: where a ramp ends at a limit, the quiet rows beyond it would have none, and the edge to them no slope.
const ROWS_BESIDE: usize = 3;
/// Variance of the first moment of a random walk over a row, in the variance that the walk gains in the row; and that of its end, given
/// mean and moment of the row.
const MOMENT_VARIANCE: f64 = 0.3;
const EDGE_VARIANCE: f64 = 0.125;
/// Steps of a drawn random walk per row.
const WALK_STEPS: u32 = 16;

/// Slope at a row of the monotone cubic through evenly spaced values, per row: the central difference, limited so that the cubic does not
/// overshoot (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238).
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

/// When the input had the values of its column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputTiming {
    /// Each is the mean over its row, from t to the next one.
    OverRow,
    /// Each is the value at the time t of its row.
    AtT,
    /// Each is the mean over the row before: a program that logs its last output with the readings that this output has led to.
    OverRowBefore,
}

/// The mean of the input over each row: the column itself, the mean of the monotone cubic through its values at t, or the values of the
/// next rows.
pub fn input<'a>(column: &'a [f64], timing: InputTiming, segments: &[Range<usize>]) -> Cow<'a, [f64]> {
    if timing == InputTiming::OverRow {
        return Cow::Borrowed(column);
    }
    let mut means = column.to_vec();
    for rows in segments {
        let u = &column[rows.clone()];
        for k in 0..u.len().saturating_sub(1) {
            means[rows.start + k] = match timing {
                InputTiming::AtT => 0.5 * (u[k] + u[k + 1]) + (monotone_slope(u, k) - monotone_slope(u, k + 1)) / 12.0,
                _ => u[k + 1],
            };
        }
    }
    Cow::Owned(means)
}

/// What a log has of the voltage within its rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Known {
    /// Mean and first moment of each row.
    Moments,
    /// The mean over each row, within which the voltage moves.
    Means,
    /// The value at the time of each row.
    Values,
}

/// Course of the voltage within each row.
#[derive(Debug, Clone, PartialEq)]
pub struct VoltageCourse {
    /// Course about the mean of each row, V ([`drive_rig::RowInput::voltage_course_V`]).
    pub rows_V: Arc<[[f64; 3]]>,
    /// What it is made of.
    pub known: Known,
}

impl VoltageCourse {
    /// The expected course of a voltage: `voltage` has its means over the rows, or its values at t. `None` where the log lacks what it is
    /// to be made of, or the input is no voltage.
    pub fn expected(log: &Log, voltage: &[f64], driven: Input, known: Known, segments: &[Range<usize>]) -> Option<Self> {
        if driven != Input::Voltage {
            return None;
        }
        let moments = if known == Known::Moments { Some(log.column(VOLTAGE_SLOPE)?) } else { None };
        let mut course = vec![[0.0; 3]; voltage.len()];
        for rows in segments {
            let (u, course) = (&voltage[rows.clone()], &mut course[rows.clone()]);
            match (known, moments) {
                (Known::Values, _) => by_values(u, course),
                (_, Some(moments)) => {
                    let moments = &moments[rows.clone()];
                    by_moments(u, moments, &walk_variance(moments, MOMENT_VARIANCE), course);
                }
                (_, None) => by_means_and_jumps(u, course),
            }
        }
        Some(VoltageCourse { rows_V: course.into(), known })
    }

    /// Another course that the log does not exclude: of a random walk with the means, or means and moments, of the log, `means_V` over the
    /// rows. The difference of a walk from its own expected course is added to the expected course of the log (conditioning by kriging:
    /// Chilès and Delfiner, Geostatistics, 2012, section 7.3). `None` where the log has values at t, between which a voltage is smooth.
    pub fn drawn(&self, means_V: &[f64], segments: &[Range<usize>], random: &mut impl Rng) -> Option<Self> {
        if self.known == Known::Values {
            return None;
        }
        let mut drawn = self.rows_V.to_vec();
        for rows in segments {
            let course = &self.rows_V[rows.clone()];
            let means = &means_V[rows.clone()];
            let variance = match self.known {
                Known::Moments => walk_variance(&differences_at_edges(means, course), 2.0 * EDGE_VARIANCE),
                _ => walk_variance(&second_differences(means), 1.0),
            };
            let walk = random_walk(&variance, random);
            let means: Vec<f64> = walk.iter().map(|w| w[0]).collect();
            let mut expected = vec![[0.0; 3]; walk.len()];
            if self.known == Known::Moments {
                let moments: Vec<f64> = walk.iter().map(|w| w[1]).collect();
                by_moments(&means, &moments, &variance, &mut expected);
            } else {
                by_means(&means, &mut expected);
            }
            for ((drawn, walk), expected) in drawn[rows.clone()].iter_mut().zip(&walk).zip(&expected) {
                for k in 0..3 {
                    drawn[k] += walk[k + 1] - expected[k];
                }
            }
        }
        Some(VoltageCourse { rows_V: drawn.into(), known: self.known })
    }
}

/// Coefficients of the cubic with this first moment and these slopes at its ends, per row.
fn cubic(moment: f64, [begin, end]: [f64; 2]) -> [f64; 3] {
    [moment, (end - begin) / 12.0, (begin + end - 4.0 * moment) / 24.0]
}

/// The monotone cubic through values at t.
fn by_values(u: &[f64], course: &mut [[f64; 3]]) {
    for k in 0..u.len().saturating_sub(1) {
        let slopes = [monotone_slope(u, k), monotone_slope(u, k + 1)];
        // Three times the mean of u (2 x − 1) over the cubic with these values and slopes at its ends.
        course[k] = cubic(0.6 * (u[k + 1] - u[k]) - 0.05 * (slopes[0] + slopes[1]), slopes);
    }
}

/// Difference at the begin of each row between the values that the row and the row before it tell; 0 at the first row and at jumps. For a
/// random walk its variance is `EDGE_VARIANCE` times that which the walk gains in both rows; a smooth voltage has none, whatever its slope.
fn differences_at_edges(means: &[f64], course: &[[f64; 3]]) -> Vec<f64> {
    let moments: Vec<f64> = course.iter().map(|c| c[0]).collect();
    let variance = walk_variance(&moments, MOMENT_VARIANCE);
    let difference = |k: usize| edge_difference(means, &moments, &variance, k).unwrap_or(0.0);
    (0..means.len()).map(|k| if k == 0 { 0.0 } else { difference(k) }).collect()
}

/// Second difference of the means, centred at each row; 0 at the ends and beside a jump. For a random walk its variance is that which the
/// walk gains in a row.
fn second_differences(means: &[f64]) -> Vec<f64> {
    let n = means.len();
    let mut second: Vec<f64> =
        (0..n).map(|k| if k == 0 || k + 1 >= n { 0.0 } else { means[k + 1] - 2.0 * means[k] + means[k - 1] }).collect();
    for k in (0..n).filter(|&k| jump(means, k).is_some()) {
        second[k.saturating_sub(1)..n.min(k + 2)].fill(0.0);
    }
    second
}

/// Variance that the random walk gains in each row, by the mean square of `values` in the rows around it. `of_one`: the variance of one
/// value, in that of the walk.
fn walk_variance(values: &[f64], of_one: f64) -> Vec<f64> {
    let n = values.len();
    let around = |k: usize| &values[k.saturating_sub(ROWS_BESIDE)..n.min(k + ROWS_BESIDE + 1)];
    (0..n).map(|k| around(k).iter().map(|v| v * v).sum::<f64>() / (around(k).len() as f64 * of_one)).collect()
}

/// A random walk that gains this variance in each row: its mean and the coefficients of its course, per row.
fn random_walk(variance: &[f64], random: &mut impl Rng) -> Vec<[f64; 4]> {
    let steps = f64::from(WALK_STEPS);
    let mut begin = 0.0;
    let row = |variance: &f64| {
        let step = (variance / steps).sqrt();
        let signs = random.next_u32();
        let (mut at, mut sums) = (0.0, [0.0; 4]);
        for k in 0..WALK_STEPS {
            at += if signs >> k & 1 == 1 { step } else { -step };
            let x = (f64::from(k) + 0.5) / steps;
            let polynomials = [1.0, 2.0 * x - 1.0, (6.0 * x - 6.0) * x + 1.0, ((20.0 * x - 30.0) * x + 12.0) * x - 1.0];
            sums.iter_mut().zip(polynomials).for_each(|(sum, p)| *sum += at * p / steps);
        }
        // The mean of the second polynomial over n steps is −1/(2 n²), not 0.
        let [mean, p1, p2, p3] = sums;
        let row = [begin + mean, 3.0 * p1, 5.0 * (p2 + mean / (2.0 * steps * steps)), 7.0 * p3];
        begin += at;
        row
    };
    variance.iter().map(row).collect()
}

/// Difference between the values at the begin of row `k` that this row and the row before it tell, each by its mean and moment; `None`: the
/// voltage jumps there.
fn edge_difference(means: &[f64], moments: &[f64], variance: &[f64], k: usize) -> Option<f64> {
    let difference = (means[k] - 5.0 / 6.0 * moments[k]) - (means[k - 1] + 5.0 / 6.0 * moments[k - 1]);
    let both = variance[k - 1] + variance[k];
    (difference * difference < MIN_JUMP_SIGMAS.powi(2) * EDGE_VARIANCE * both).then_some(difference)
}

/// Expected course of a random walk with these means and first moments, which gains this variance in each row. The slopes at the edges,
/// each over the variance of its row the same on both sides, are such that no value jumps there; at a jump they are zero.
fn by_moments(means: &[f64], moments: &[f64], variance: &[f64], course: &mut [[f64; 3]]) {
    let n = means.len();
    // With the slope m = f s² at an edge, s² the variance of the row: −s²(k−1) f(k−1) + 3 (s²(k−1) + s²(k)) f(k) − s²(k) f(k+1) = 24 × the
    // difference at edge k; solved by elimination from the first edge.
    let (mut factor, mut slopes) = (vec![0.0; n + 1], vec![0.0; n + 1]);
    for k in 1..n {
        let Some(difference) = edge_difference(means, moments, variance, k) else { continue };
        let pivot = 3.0 * (variance[k - 1] + variance[k]) - variance[k - 1] * factor[k - 1];
        factor[k] = variance[k] / pivot;
        slopes[k] = (24.0 * difference + variance[k - 1] * slopes[k - 1]) / pivot;
    }
    for k in (1..n).rev() {
        slopes[k] += factor[k] * slopes[k + 1];
    }
    for k in 0..n {
        course[k] = cubic(moments[k], [slopes[k] * variance[k], slopes[k + 1] * variance[k]]);
    }
}

/// Rise of a voltage that jumps once within row `k`, at its begin or at its end, between two steady voltages. `None`: it does not. A
/// voltage of a loop swings within a row as well.
fn jump(means: &[f64], k: usize) -> Option<f64> {
    if k < ROWS_BESIDE || k + ROWS_BESIDE >= means.len() {
        return None;
    }
    let largest_step = |rows: &[f64]| rows.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
    let (before, after) = (&means[k - ROWS_BESIDE..k], &means[k + 1..=k + ROWS_BESIDE]);
    let (begin, end) = (before[ROWS_BESIDE - 1], after[0]);
    let beside = largest_step(before).max(largest_step(after));
    let is_between = means[k] >= begin.min(end) - beside && means[k] <= begin.max(end) + beside;
    (is_between && beside < MAX_STEADY_STEP * (end - begin).abs()).then_some(end - begin)
}

/// Course within a row in which the voltage jumps by `rise`, at the fraction `at` of the row: its projection on the polynomials.
fn jump_course(rise: f64, at: f64) -> [f64; 3] {
    let x = at.clamp(0.0, 1.0);
    [3.0 * rise * (1.0 - x) * x, 5.0 * rise * ((3.0 - 2.0 * x) * x - 1.0) * x, 7.0 * rise * (((10.0 - 5.0 * x) * x - 6.0) * x + 1.0) * x]
}

/// Expected course with these means, of a voltage that may jump: the mean of a row with a jump between two steady voltages tells its time.
/// Between the jumps as [`by_means`].
fn by_means_and_jumps(means: &[f64], course: &mut [[f64; 3]]) {
    let mut begin = 0;
    for k in 0..means.len() {
        if let Some(rise) = jump(means, k) {
            by_means(&means[begin..k], &mut course[begin..k]);
            course[k] = jump_course(rise, (means[k + 1] - means[k]) / rise);
            begin = k + 1;
        }
    }
    by_means(&means[begin..], &mut course[begin..]);
}

/// Expected course of a random walk with these means: the quadratic in each row with which value and slope are continuous at the edges.
/// Values e at the edges: e(k) + 4 e(k+1) + e(k+2) = 3 (m(k) + m(k+1)), at both ends, where the slope is zero, 2 e + e' = 3 m; solved by
/// elimination from the first edge.
fn by_means(means: &[f64], course: &mut [[f64; 3]]) {
    let n = means.len();
    let (mut factor, mut edges) = (vec![0.0; n + 1], vec![0.0; n + 1]);
    (factor[0], edges[0]) = (0.5, 1.5 * means.first().copied().unwrap_or(0.0));
    for k in 1..=n {
        let (diagonal, right) = if k < n { (4.0, 3.0 * (means[k - 1] + means[k])) } else { (2.0, 3.0 * means[n - 1]) };
        let pivot = diagonal - factor[k - 1];
        factor[k] = 1.0 / pivot;
        edges[k] = (right - edges[k - 1]) / pivot;
    }
    for k in (0..n).rev() {
        edges[k] -= factor[k] * edges[k + 1];
    }
    for k in 0..n {
        course[k] = [0.5 * (edges[k + 1] - edges[k]), 0.5 * (edges[k] + edges[k + 1]) - means[k], 0.0];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    fn by_expected_moments(means: &[f64], moments: &[f64], course: &mut [[f64; 3]]) {
        by_moments(means, moments, &walk_variance(moments, MOMENT_VARIANCE), course);
    }

    #[test]
    fn value_of_a_row_acts_in_the_row_before_it_within_its_segment() {
        let column = [1.0, 2.0, 3.0, 4.0, 5.0];
        let before = input(&column, InputTiming::OverRowBefore, &[0..3, 3..5]);
        assert_eq!(*before, [2.0, 3.0, 3.0, 5.0, 5.0]);
        assert_eq!(*input(&column, InputTiming::OverRow, &[0..3, 3..5]), column);
    }

    /// Value of the course about the mean at the fraction x of the row.
    fn value([p1, p2, p3]: [f64; 3], x: f64) -> f64 {
        p1 * (2.0 * x - 1.0) + p2 * (6.0 * x * x - 6.0 * x + 1.0) + p3 * (((20.0 * x - 30.0) * x + 12.0) * x - 1.0)
    }

    #[test]
    fn smooth_voltage_is_reproduced_and_continuous() {
        // Means and first moments of sin(t) over rows of 0.3. Where the moments pass through zero, so does the assumed variance: 4e-3 of
        // the amplitude.
        let h = 0.3;
        let (mut means, mut moments) = (Vec::new(), Vec::new());
        for k in 0..40 {
            let at = |j: usize| (f64::from(k) + (j as f64 + 0.5) / 1000.0) * h;
            means.push((0..1000).map(|j| at(j).sin()).sum::<f64>() / 1000.0);
            moments.push((0..1000).map(|j| at(j).sin() * (2.0 * (j as f64 + 0.5) / 1000.0 - 1.0)).sum::<f64>() * 3.0 / 1000.0);
        }
        let mut course = vec![[0.0; 3]; 40];
        by_expected_moments(&means, &moments, &mut course);
        for k in 3..36 {
            for x in [0.0, 0.3, 0.5, 0.9, 1.0] {
                let (found, true_value) = (means[k] + value(course[k], x), ((k as f64 + x) * h).sin());
                assert!((found - true_value).abs() < 4e-3, "row {k}, {x}: {found} {true_value}");
            }
        }
    }

    /// Error of the course at the end of each row, for rows of 1 that start at 0.
    fn errors_at_ends(voltage: impl Fn(f64) -> f64, rows: usize) -> Vec<f64> {
        let part = |k: usize, j: usize| k as f64 + (j as f64 + 0.5) / 1000.0;
        let mean_of = |f: &dyn Fn(usize) -> f64| (0..1000).map(f).sum::<f64>() / 1000.0;
        let means: Vec<f64> = (0..rows).map(|k| mean_of(&|j| voltage(part(k, j)))).collect();
        let moments: Vec<f64> =
            (0..rows).map(|k| 3.0 * mean_of(&|j| voltage(part(k, j)) * (2.0 * (j as f64 + 0.5) / 1000.0 - 1.0))).collect();
        let mut course = vec![[0.0; 3]; rows];
        by_expected_moments(&means, &moments, &mut course);
        (0..rows).map(|k| means[k] + value(course[k], 1.0) - voltage((k + 1) as f64)).collect()
    }

    /// A shaft that oscillates for 20 rows, with seven rows per period, in a quiet log. With a variance by each row's own moment the error
    /// would be 0.07.
    #[test]
    fn oscillation_in_a_burst_is_reproduced() {
        let errors =
            errors_at_ends(|t| if (40.0..61.0).contains(&t) { (std::f64::consts::TAU * (t - 40.0) / 7.0).sin() } else { 0.0 }, 100);
        assert!(errors[46..55].iter().all(|e| e.abs() < 0.005), "{errors:?}");
    }

    /// The end of play: the voltage falls to a limit, 1 per row. With a variance by each row's own moment the edge before the end would be
    /// off by 0.13.
    #[test]
    fn ramp_that_ends_at_a_limit_is_reproduced() {
        let errors = errors_at_ends(|t| (10.0 - t).clamp(-5.2, 0.0), 30);
        assert!(errors.iter().all(|e| e.abs() < 0.05), "{errors:?}");
    }

    #[test]
    fn means_of_a_moving_voltage_tell_its_course() {
        let at = |t: f64| (0.3 * t).sin();
        let means: Vec<f64> =
            (0..40).map(|k| (0..1000).map(|j| at(f64::from(k) + (f64::from(j) + 0.5) / 1000.0)).sum::<f64>() / 1000.0).collect();
        let mut course = vec![[0.0; 3]; 40];
        by_means(&means, &mut course);
        for k in 4..36 {
            for x in [0.0, 0.3, 0.5, 0.9, 1.0] {
                let (found, true_value) = (means[k] + value(course[k], x), at(k as f64 + x));
                assert!((found - true_value).abs() < 1e-3, "row {k} at {x}: {found} {true_value}");
            }
        }
        let mut flat = vec![[1.0; 3]; 6];
        by_means(&[2.0; 6], &mut flat);
        assert!(flat.iter().flatten().all(|c| c.abs() < 1e-12), "{flat:?}");
        by_means(&[], &mut []);
    }

    /// A step of the setpoint does not wait for a row.
    #[test]
    fn jump_within_a_row_is_found_by_its_mean() {
        let (low, high, at) = (-0.3, 0.7, 0.37);
        let mut means = vec![low; 10];
        means[5..].fill(high);
        means[5] = low * at + high * (1.0 - at);
        let mut course = vec![[1.0; 3]; 10];
        by_means_and_jumps(&means, &mut course);
        assert!(course[..5].iter().chain(&course[6..]).flatten().all(|c| c.abs() < 1e-12), "{course:?}");
        for (k, order) in [(0, 1), (1, 2), (2, 3)] {
            // By its definition: (2 n + 1) times the mean of the voltage and the Legendre polynomial of order n.
            let unit = |k: usize| std::array::from_fn(|j| f64::from(u8::from(j == k)));
            let mean =
                (0..100_000).map(|j| (f64::from(j) + 0.5) / 1e5).map(|x| if x < at { low } else { high } * value(unit(k), x)).sum::<f64>()
                    / 1e5;
            assert!((course[5][k] - f64::from(2 * order + 1) * mean).abs() < 1e-4, "{k}: {course:?}");
        }
        // A jump at an edge leaves nothing within the rows, and a ramp over two rows is no jump.
        means[5] = high;
        by_means_and_jumps(&means, &mut course);
        assert!(course.iter().flatten().all(|c| c.abs() < 1e-12), "{course:?}");
        means[4..6].copy_from_slice(&[0.0, 0.3]);
        assert!((0..10).all(|k| jump(&means, k).is_none()));
    }

    /// A course of a true walk differs from the expected one as the drawn ones do, and these have what the log has.
    #[test]
    fn drawn_courses_scatter_as_the_true_one() {
        const ROWS: usize = 4000;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let walk = random_walk(&[0.01; ROWS], &mut random);
        let means: Vec<f64> = walk.iter().map(|w| w[0]).collect();
        let moments: Vec<f64> = walk.iter().map(|w| w[1]).collect();
        for known in [Known::Moments, Known::Means] {
            let mut rows = vec![[0.0; 3]; ROWS];
            match known {
                Known::Moments => by_expected_moments(&means, &moments, &mut rows),
                _ => by_means(&means, &mut rows),
            }
            let expected = VoltageCourse { rows_V: rows.into(), known };
            let drawn = expected.drawn(&means, &[0..ROWS / 2, ROWS / 2..ROWS], &mut random).unwrap();
            for k in 0..3 {
                let rms = |other: &dyn Fn(usize) -> f64| {
                    ((0..ROWS).map(|row| (other(row) - expected.rows_V[row][k]).powi(2)).sum::<f64>() / ROWS as f64).sqrt()
                };
                let (true_one, drawn_one) = (rms(&|row| walk[row][k + 1]), rms(&|row| drawn.rows_V[row][k]));
                if known == Known::Moments && k == 0 {
                    assert_eq!((true_one, drawn_one), (0.0, 0.0));
                } else {
                    assert!((drawn_one / true_one - 1.0).abs() < 0.1, "{known:?} {k}: {drawn_one} {true_one}");
                }
            }
        }
        let values = VoltageCourse { rows_V: vec![[0.1; 3]; 4].into(), known: Known::Values };
        assert_eq!(values.drawn(&[0.0; 4], &[0..2, 2..4], &mut random), None);
    }

    #[test]
    fn jump_at_an_edge_stays_a_jump_and_a_lone_moment_is_that_of_a_random_walk() {
        let mut course = vec![[0.0; 3]; 4];
        by_expected_moments(&[1.0, 1.0, 5.0, 5.0], &[0.0; 4], &mut course);
        assert_eq!(course, [[0.0; 3]; 4]);
        // One row alone: slopes zero at the ends, 5/6 of the moment there.
        by_expected_moments(&[0.0], &[0.6], &mut course[..1]);
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
        by_expected_moments(&means, &moments, &mut course);
        let (mut by_course, mut by_line) = (0.0, 0.0);
        for k in 10..rows.len() - 10 {
            let end = rows[k][TICKS - 1] - means[k];
            by_course += (value(course[k], 1.0) - end).powi(2);
            by_line += (moments[k] - end).powi(2);
        }
        assert!(by_course < 0.5 * by_line, "{by_course} {by_line}");
    }
}
