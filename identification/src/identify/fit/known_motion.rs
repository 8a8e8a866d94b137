//! The known motion with which a rate sensor is compared: the slope of the measured angle.

use std::ops::Range;

use crate::statistics::distributions::chi_squared_tail;
use crate::statistics::robust::median_in_place;

/// Half of the window of the local fit, s: a sine of 5 Hz loses 1e-3 of its amplitude.
const HALF_WINDOW_S: f64 = 0.02;
/// Rows on each side at least.
const MIN_ROWS: usize = 3;
/// Coefficients of the local fit, a cubic.
const COEFFICIENTS: usize = 4;
/// Probability below which the scatter about the cubic is not that of the other rows: the acceleration jumps within the window.
const UNRESOLVED_P: f64 = 1e-3;

/// The motion at a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownMotion {
    /// Angle, rad.
    pub theta_rad: f64,
    /// Rate, rad/s.
    pub omega_rad_s: f64,
    /// Rate at the time of the reading, which is older than the row, minus that at the row, rad/s.
    pub aged_rad_s: f64,
    /// The angle resolves the motion here: its window lies within the segment, and a cubic describes the angle.
    pub is_resolved: bool,
}

/// The measured angle as a known motion.
pub struct MeasuredAngle<'a> {
    /// Time of each row, s.
    pub t_s: &'a [f64],
    /// Angle, rad.
    pub theta_rad: &'a [f64],
    /// Count of the encoder, rad; 0 if the angle is continuous.
    pub quantum_rad: f64,
    /// Age at t_s of the reading that is compared, s; `None`: zero.
    pub age_s: Option<&'a [f64]>,
}

/// The motion at each row of the segments, by least-squares cubics through the angle within ± 20 ms.
pub fn along(angle: &MeasuredAngle, segments: &[Range<usize>]) -> Vec<KnownMotion> {
    let MeasuredAngle { t_s, theta_rad, quantum_rad, age_s } = *angle;
    let mut list = vec![KnownMotion { theta_rad: 0.0, omega_rad_s: 0.0, aged_rad_s: 0.0, is_resolved: false }; t_s.len()];
    let mut scatters = vec![(0.0, 0.0); t_s.len()];
    for rows in segments {
        let (t, y) = (&t_s[rows.clone()], &theta_rad[rows.clone()]);
        let (mut from, mut to) = (0, 0);
        for k in 0..t.len() {
            while t[k] - t[from] > HALF_WINDOW_S {
                from += 1;
            }
            while to + 1 < t.len() && t[to + 1] - t[k] <= HALF_WINDOW_S {
                to += 1;
            }
            let (a, b) = (from.min(k.saturating_sub(MIN_ROWS)), to.max((k + MIN_ROWS).min(t.len() - 1)));
            let Some(cubic) = Cubic::fit(&t[a..=b], &y[a..=b], t[k]) else { continue };
            let row = rows.start + k;
            list[row] = KnownMotion {
                theta_rad: cubic.value(),
                omega_rad_s: cubic.slope_at(0.0),
                aged_rad_s: age_s.map_or(0.0, |age| cubic.slope_at(-age[row]) - cubic.slope_at(0.0)),
                is_resolved: symmetric(t, a, k, b),
            };
            scatters[row] = (cubic.squares, (b + 1 - a) as f64 - COEFFICIENTS as f64);
        }
    }
    let mut variances: Vec<f64> =
        scatters.iter().filter(|(_, freedom)| *freedom > 0.0).map(|(squares, freedom)| squares / freedom).collect();
    let usual = median_in_place(&mut variances).unwrap_or(0.0).max(quantum_rad * quantum_rad / 12.0);
    for (motion, (squares, freedom)) in list.iter_mut().zip(scatters) {
        motion.is_resolved &= freedom <= 0.0 || usual <= 0.0 || chi_squared_tail(squares / usual, freedom) >= UNRESOLVED_P;
    }
    list
}

/// The window reaches as far before the row as behind it, but for a row.
fn symmetric(t: &[f64], from: usize, at: usize, to: usize) -> bool {
    let (before, after) = (t[at] - t[from], t[to] - t[at]);
    (before - after).abs() <= (t[from + 1] - t[from]).max(t[to] - t[to - 1])
}

/// A least-squares cubic about a time.
struct Cubic {
    /// Value at the first point, to which the coefficients add.
    offset: f64,
    /// Coefficients over (t − at)/`scale_s`.
    c: nalgebra::Vector4<f64>,
    scale_s: f64,
    /// Sum of the squared residuals.
    squares: f64,
}

impl Cubic {
    /// The cubic through the points, about the time `at`; `None` where it is not determined.
    fn fit(t: &[f64], y: &[f64], at: f64) -> Option<Cubic> {
        let (mut s, mut b) = ([0.0; 2 * COEFFICIENTS - 1], [0.0; COEFFICIENTS]);
        let offset = *y.first()?;
        let scale_s = (t[t.len() - 1] - t[0]).max(f64::MIN_POSITIVE);
        for (&t, &y) in t.iter().zip(y) {
            let x = (t - at) / scale_s;
            let mut power = 1.0;
            for (k, s) in s.iter_mut().enumerate() {
                *s += power;
                if k < COEFFICIENTS {
                    b[k] += power * (y - offset);
                }
                power *= x;
            }
        }
        let m = nalgebra::Matrix4::from_fn(|i, j| s[i + j]);
        let c = m.lu().solve(&nalgebra::Vector4::from(b))?;
        let residual = |(&t, &y): (&f64, &f64)| {
            let x = (t - at) / scale_s;
            y - offset - (c[0] + x * (c[1] + x * (c[2] + x * c[3])))
        };
        let squares = t.iter().zip(y).map(|point| residual(point).powi(2)).sum();
        Some(Cubic { offset, c, scale_s, squares })
    }

    /// Value at its time.
    fn value(&self) -> f64 {
        self.offset + self.c[0]
    }

    /// Slope `later_s` after its time.
    fn slope_at(&self, later_s: f64) -> f64 {
        let x = later_s / self.scale_s;
        (self.c[1] + x * (2.0 * self.c[2] + x * 3.0 * self.c[3])) / self.scale_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT_RAD: f64 = 3e-4;

    #[test]
    fn slope_is_that_of_a_smooth_motion_and_a_jump_of_the_acceleration_is_not_resolved() {
        let t_s: Vec<f64> = (0..4000).map(|k| f64::from(k) * 1e-3).collect();
        // The acceleration jumps by 100 rad/s² at 2 s.
        let angle = |t: f64| 3.0 * t + (2.0 * t).sin() + 50.0 * (t - 2.0).max(0.0).powi(2);
        let rate = |t: f64| 3.0 + 2.0 * (2.0 * t).cos() + 100.0 * (t - 2.0).max(0.0);
        let theta: Vec<f64> = t_s.iter().map(|t| (angle(*t) / COUNT_RAD).floor() * COUNT_RAD).collect();
        let angle = MeasuredAngle { t_s: &t_s, theta_rad: &theta, quantum_rad: COUNT_RAD, age_s: None };
        let motion = along(&angle, std::slice::from_ref(&(0..4000)));
        for (k, m) in motion.iter().enumerate().filter(|(_, m)| m.is_resolved) {
            // A count over the window, and its fit: 3 mrad/s rms.
            assert!((m.omega_rad_s - rate(t_s[k])).abs() < 0.03, "row {k}: {} {}", m.omega_rad_s, rate(t_s[k]));
        }
        let ages = vec![4e-3; 4000];
        let older = along(&MeasuredAngle { age_s: Some(&ages), ..angle }, std::slice::from_ref(&(0..4000)));
        for k in (100..3900).filter(|k| older[*k].is_resolved) {
            assert!((older[k].omega_rad_s + older[k].aged_rad_s - rate(t_s[k] - 4e-3)).abs() < 0.03, "row {k}");
        }
        let unresolved: Vec<usize> = (100..3900).filter(|k| !motion[*k].is_resolved).collect();
        assert!(unresolved.contains(&2000) && unresolved.len() < 80, "{unresolved:?}");
        assert!(!motion[0].is_resolved && !motion[3999].is_resolved && motion[1000].is_resolved);
    }
}
