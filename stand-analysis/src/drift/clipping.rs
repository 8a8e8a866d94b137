//! Clipped cycles: the angle does not follow the current of the torquer.
//!
//! Input: the angles of a cycle and the currents between them. Output: a [`Clipping`], or `None`. Between the pulses' edges the angle is
//! a + b t + g ∫i dt with the torquer's gain g = K_m/H. Two tests: g over the whole cycle against the known K_m/H (the reference against the
//! unswitched integral), and the slope of the angle over ∫i dt in a window at an end of its range against the windows of the other half of
//! the swing, whose scatter gives the noise of a slope (Student's t, both flanks together). A sensor at the end of its range shows a flat
//! top: a top of the height f of the swing changes the drift by f² of itself, and f from 2 % on is found where the noise permits.
//!
//! Limits: an error of the gains below 10 % is not clipping; a range that ends below half of the swing is found by the first test only.

use identification::statistics::distributions::student_tail;
use identification::statistics::least_squares::least_squares;

/// Points of one pulse: samples are averaged to this number.
const POINTS: usize = 100;
/// Widths of the windows, relative to the swing.
const WINDOWS: [f64; 2] = [0.05, 0.1];
/// Range of the swing that gives the slope of an unclipped angle.
const REFERENCE: (f64, f64) = (0.05, 0.5);
/// Range of the swing that gives it for the test of the lower end.
const UPPER_REFERENCE: (f64, f64) = (0.5, 0.95);
/// Slope of a window, relative to the reference, below which it counts as flat: a flat top of 2 % leaves 0.8 in the narrow window.
const MAX_FLAT_SLOPE: f64 = 0.85;
/// Probability with which noise is called a flat top, in one cycle.
const FLAT_PROBABILITY: f64 = 1e-4;
/// Rounding error: largest difference of a window's border from that of a range.
const BORDER: f64 = 1e-9;
/// Largest relative deviation of the torquer's gain by the angle from the known one.
const MAX_GAIN_DEVIATION: f64 = 0.1;

/// Why a cycle counts as clipped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Clipping {
    /// The angle is flat near an end of its range.
    FlatTop,
    /// The swing of the angle differs from that by the current.
    Reference {
        /// Measured over expected swing.
        ratio: f64,
    },
}

/// Mean angle and integral of the current at the points of a cycle.
struct Points {
    angle: Vec<f64>,
    swing: Vec<f64>,
}

/// Tests a cycle of 2 N + 1 angles, rad, and the 2 N mean currents between them, A; `pulse_s` is the duration of N samples,
/// `torquer_rad_s_A` is K_m/H.
pub fn clipping(angles_rad: &[f64], currents_A: &[f64], pulse_s: f64, torquer_rad_s_A: Option<f64>) -> Option<Clipping> {
    let n = currents_A.len() / 2;
    if n < 8 || angles_rad.len() != 2 * n + 1 || currents_A.len() != 2 * n {
        return None;
    }
    let points = points(angles_rad, currents_A, pulse_s / n as f64);
    let rows: Vec<Vec<f64>> = points.swing.iter().enumerate().map(|(k, swing)| vec![1.0, k as f64, *swing]).collect();
    let gain = least_squares(&rows, &points.angle)?.coefficients[2];
    if let Some(known) = torquer_rad_s_A {
        let ratio = gain / known;
        if (ratio - 1.0).abs() > MAX_GAIN_DEVIATION {
            return Some(Clipping::Reference { ratio });
        }
    }
    let tests = WINDOWS.map(|width| [true, false].map(|top| (width, top))).concat();
    let probability = FLAT_PROBABILITY / tests.len() as f64;
    tests.into_iter().any(|(width, top)| is_flat(&points.flanks(width), top, probability)).then_some(Clipping::FlatTop)
}

fn points(angles_rad: &[f64], currents_A: &[f64], dt_s: f64) -> Points {
    let group = (currents_A.len() / 2).div_ceil(POINTS);
    let mut integral = 0.0;
    let integrals: Vec<f64> = std::iter::once(0.0)
        .chain(currents_A.iter().map(|current| {
            integral += current * dt_s;
            integral
        }))
        .collect();
    let mean = |values: &[f64]| values.chunks(group).map(|chunk| chunk.iter().sum::<f64>() / chunk.len() as f64).collect();
    Points { angle: mean(angles_rad), swing: mean(&integrals) }
}

/// Slopes of the angle over the swing in windows of one pulse: middle of the window, relative to the swing, and slope.
struct Flank {
    slopes: Vec<(f64, f64)>,
    width: f64,
}

impl Points {
    fn flanks(&self, width: f64) -> [Flank; 2] {
        let peak = (0..self.swing.len()).max_by(|a, b| self.swing[*a].abs().total_cmp(&self.swing[*b].abs())).unwrap_or(0);
        [0..peak + 1, peak..self.swing.len()].map(|rows| {
            let relative = |k: usize| self.swing[k] / self.swing[peak];
            let slopes = (0..(1.0 / width).round() as usize).filter_map(|window| {
                let (from, to) = (window as f64 * width, (window + 1) as f64 * width);
                let inside: Vec<usize> = rows.clone().filter(|k| (from - 1e-9..to + 1e-9).contains(&relative(*k))).collect();
                let count = inside.len() as f64;
                let mean = |of: &dyn Fn(usize) -> f64| inside.iter().map(|k| of(*k)).sum::<f64>() / count;
                let (x, y) = (mean(&relative), mean(&|k| self.angle[k]));
                let square: f64 = inside.iter().map(|k| (relative(*k) - x).powi(2)).sum();
                let product: f64 = inside.iter().map(|k| (relative(*k) - x) * (self.angle[*k] - y)).sum();
                (inside.len() >= 3 && square > 0.0).then(|| (0.5 * (from + to), product / square))
            });
            Flank { slopes: slopes.collect(), width }
        })
    }
}

/// Slope at an end of a flank, and those of its reference windows.
struct EndSlope {
    end: f64,
    mean: f64,
    /// Sum of the squared deviations of the reference windows from their mean, and their number.
    squares: f64,
    count: f64,
}

impl Flank {
    fn end_slope(&self, top: bool) -> Option<EndSlope> {
        let (from, to) = if top { REFERENCE } else { UPPER_REFERENCE };
        let half = 0.5 * self.width;
        let inside = |middle: &f64| middle - half >= from - BORDER && middle + half <= to + BORDER;
        let reference: Vec<f64> = self.slopes.iter().filter(|(middle, _)| inside(middle)).map(|(_, slope)| *slope).collect();
        let at_end = |middle: &f64| if top { middle + half > 1.0 - BORDER } else { middle - half < BORDER };
        let (_, end) = *self.slopes.iter().find(|(middle, _)| at_end(middle))?;
        let count = reference.len() as f64;
        let mean = reference.iter().sum::<f64>() / count;
        let squares = reference.iter().map(|slope| (slope - mean).powi(2)).sum();
        (reference.len() >= 2 && mean != 0.0).then_some(EndSlope { end, mean, squares, count })
    }
}

/// Both flanks are flat at an end of the range, beyond the scatter of their slopes.
fn is_flat(flanks: &[Flank; 2], top: bool, probability: f64) -> bool {
    let [Some(one), Some(other)] = [0, 1].map(|k: usize| flanks[k].end_slope(top)) else { return false };
    let ratios = [&one, &other].map(|slope| slope.end / slope.mean);
    let dof = one.count + other.count - 2.0;
    let variance = (one.squares + other.squares) / dof;
    let deficit = (one.mean - one.end) * one.mean.signum() + (other.mean - other.end) * other.mean.signum();
    // The windows of both flanks adjoin at the reversal: noise that is longer than a window changes both alike.
    let u = variance.sqrt() * ((1.0 + 1.0 / one.count).sqrt() + (1.0 + 1.0 / other.count).sqrt());
    ratios.iter().all(|ratio| *ratio < MAX_FLAT_SLOPE) && (u == 0.0 || student_tail(deficit / u, dof) < probability)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::gyro::{ARCSEC, DEG_H};
    use hal_sim::peripherals::Noise;

    const GAIN: f64 = 0.02;
    const W: f64 = 0.05 * std::f64::consts::PI / 180.0;

    /// A cycle of 5 s pulses at 1 kHz with a drift of 5 °/h and noise of 0.5″, clipped at this part of its swing.
    fn cycle(range: f64, triangular: bool, sign: f64, unequal: f64) -> (Vec<f64>, Vec<f64>) {
        let mut noise = Noise::new(1, 0, 0.5 * ARCSEC);
        let n = 5000;
        let shape = |k: usize| if triangular { 2.0 - (4.0 * (k % n) as f64 / n as f64 - 2.0).abs() } else { 1.0 };
        let currents: Vec<f64> = (0..2 * n).map(|k| sign * shape(k) * W / GAIN * if k < n { 1.0 } else { -(1.0 + unequal) }).collect();
        let mut angle = 0.0;
        let mut angles = vec![0.0];
        for current in &currents {
            angle += (GAIN * current + 5.0 * DEG_H) * 1e-3;
            angles.push(angle);
        }
        let limit = range * angles.iter().fold(0.0_f64, |most, angle| most.max(angle.abs()));
        (angles.iter().map(|a| a.clamp(-limit, limit) + noise.draw()).collect(), currents)
    }

    #[test]
    fn cycles_within_the_range_are_not_clipped() {
        for triangular in [false, true] {
            for sign in [1.0, -1.0] {
                let (angles, currents) = cycle(2.0, triangular, sign, 0.0);
                assert_eq!(clipping(&angles, &currents, 5.0, Some(GAIN)), None, "{triangular} {sign}");
                assert_eq!(clipping(&angles, &currents, 5.0, None), None, "{triangular} {sign}");
            }
        }
        // Unequal pulses are not clipping.
        let (angles, currents) = cycle(2.0, false, 1.0, 0.1);
        assert_eq!(clipping(&angles, &currents, 5.0, Some(GAIN)), None);
    }

    /// A top of 2 % of the swing changes the drift by 4e-4 of itself.
    #[test]
    fn a_flat_top_of_two_percent_is_found() {
        for range in [0.98, 0.9, 0.6] {
            for sign in [1.0, -1.0] {
                let (angles, currents) = cycle(range, false, sign, 0.0);
                assert_eq!(clipping(&angles, &currents, 5.0, None), Some(Clipping::FlatTop), "{range} {sign}");
            }
        }
        let (angles, currents) = cycle(0.9, true, 1.0, 0.0);
        assert_eq!(clipping(&angles, &currents, 5.0, Some(GAIN)), Some(Clipping::FlatTop));
    }

    #[test]
    fn a_swing_that_differs_from_the_current_is_found() {
        let (angles, currents) = cycle(0.25, false, 1.0, 0.0);
        assert!(matches!(clipping(&angles, &currents, 5.0, Some(GAIN)), Some(Clipping::Reference { ratio }) if ratio < 0.6));
        let (angles, currents) = cycle(2.0, false, 1.0, 0.0);
        assert!(
            matches!(clipping(&angles, &currents, 5.0, Some(2.0 * GAIN)), Some(Clipping::Reference { ratio }) if (ratio - 0.5).abs() < 0.01)
        );
    }

    #[test]
    fn noise_of_the_swing_is_no_flat_top() {
        let mut found = 0;
        for seed in 0..1000 {
            let mut noise = Noise::new(seed, 1, 20.0 * ARCSEC);
            let (mut angles, currents) = cycle(2.0, false, 1.0, 0.0);
            // Vibration of 0.5 to 8 Hz with any phase, and noise.
            let frequency = 2.0 * std::f64::consts::PI * 0.5 * 16_f64.powf(0.5 + noise.uniform(0.5));
            let phase = noise.uniform(std::f64::consts::PI);
            angles
                .iter_mut()
                .enumerate()
                .for_each(|(k, a)| *a += noise.draw() + 20.0 * ARCSEC * (frequency * 1e-3 * k as f64 + phase).sin());
            found += u32::from(clipping(&angles, &currents, 5.0, Some(GAIN)).is_some());
        }
        // 1000 cycles with a probability of 1e-4 each.
        assert!(found <= 1, "{found}");
    }
}
