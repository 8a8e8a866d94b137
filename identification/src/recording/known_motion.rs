//! The known motion with which a rate sensor is compared: the slope of the measured angle.

use std::ops::Range;

use crate::statistics::distributions::chi_squared_tail;
use crate::statistics::robust::median_in_place;

/// Halves of the windows of the local fits, s, widest first. The noise of a slope falls with the power 1.5 of the window; in the narrowest
/// one a sine of 5 Hz loses 1e-3 of its amplitude.
const HALF_WINDOWS_S: [f64; 3] = [0.08, 0.04, 0.02];
/// Rows on each side at least.
const MIN_ROWS: usize = 3;
/// Coefficients of a cubic, which describes most windows, and of a quintic.
const CUBIC: usize = 4;
const QUINTIC: usize = 6;
/// Probability below which a cubic is refuted: by what the two more coefficients of a quintic explain, or by its scatter.
const REFUTED_P: f64 = 1e-3;

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

/// The motion at each row of the segments, from a least-squares polynomial through the angle around it.
///
/// Each row has the widest window in which a cubic describes the angle (Goldenshluger and Nemirovski, Math. Methods Stat. 6 (1997) 135),
/// because a noisy slope favours a model that smooths it, such as a lag. A cubic smooths the corners of the motion, always to their inner
/// side, and this error adds up to a dependence on the rate. It is therefore used only where no row of the window refutes it; in the
/// narrowest window a quintic takes its place.
pub fn along(angle: &MeasuredAngle, segments: &[Range<usize>]) -> Vec<KnownMotion> {
    let mut list = vec![KnownMotion { theta_rad: 0.0, omega_rad_s: 0.0, aged_rad_s: 0.0, is_resolved: false }; angle.t_s.len()];
    for (width, half_s) in HALF_WINDOWS_S.into_iter().enumerate().rev() {
        let is_narrowest = width + 1 == HALF_WINDOWS_S.len();
        let fits: Vec<Vec<Option<LocalFits>>> = segments.iter().map(|rows| local_fits(angle, rows, half_s)).collect();
        let mut variances: Vec<f64> = fits.iter().flatten().flatten().filter_map(|fits| fits.cubic.variance()).collect();
        let usual = median_in_place(&mut variances).unwrap_or(0.0).max(angle.quantum_rad * angle.quantum_rad / 12.0);
        for (rows, fits) in segments.iter().zip(&fits) {
            let bent_before = bent_before(fits, usual);
            for (row, fits) in rows.clone().zip(fits).filter_map(|(row, fits)| Some((row, fits.as_ref()?))) {
                let has_bend = bent_before[fits.window.end] > bent_before[fits.window.start];
                let motion = fits.motion(has_bend, usual, angle.age_s.map_or(0.0, |age| age[row]));
                if is_narrowest || (motion.is_resolved && !has_bend) {
                    list[row] = motion;
                }
            }
        }
    }
    list
}

/// Number of rows before each row, and before the end, whose window refutes a cubic.
fn bent_before(fits: &[Option<LocalFits>], usual: f64) -> Vec<usize> {
    let bent = fits.iter().map(|fits| usize::from(fits.as_ref().is_some_and(|f| f.is_bent(usual))));
    let sums = bent.scan(0, |sum, bent| {
        *sum += bent;
        Some(*sum)
    });
    std::iter::once(0).chain(sums).collect()
}

/// The polynomials through the window of a row.
struct LocalFits {
    /// Its rows, counted from the begin of the segment.
    window: Range<usize>,
    /// It reaches as far before the row as behind it.
    is_symmetric: bool,
    cubic: Polynomial,
    /// `None` where it is not determined.
    quintic: Option<Polynomial>,
}

impl LocalFits {
    /// The motion at the row, of a reading that is `age_s` older: of the quintic if the window has a bend. A quintic follows a corner that
    /// a cubic hardly shows, not one that a cubic does not describe.
    fn motion(&self, has_bend: bool, usual: f64, age_s: f64) -> KnownMotion {
        let fit = self.quintic.as_ref().filter(|_| has_bend).unwrap_or(&self.cubic);
        KnownMotion {
            theta_rad: fit.value(),
            omega_rad_s: fit.slope_at(0.0),
            aged_rad_s: fit.slope_at(-age_s) - fit.slope_at(0.0),
            is_resolved: self.is_symmetric && self.cubic.describes(usual),
        }
    }

    /// The quintic explains more than the cubic does, against the `usual` variance.
    fn is_bent(&self, usual: f64) -> bool {
        let added = (QUINTIC - CUBIC) as f64;
        self.quintic.as_ref().is_some_and(|q| usual > 0.0 && chi_squared_tail((self.cubic.squares - q.squares) / usual, added) < REFUTED_P)
    }
}

/// The polynomials of each row of a segment; `None` where the cubic is not determined.
fn local_fits(angle: &MeasuredAngle, rows: &Range<usize>, half_s: f64) -> Vec<Option<LocalFits>> {
    let (t, y) = (&angle.t_s[rows.clone()], &angle.theta_rad[rows.clone()]);
    let (mut from, mut to) = (0, 0);
    let mut of_row = |k: usize| {
        while t[k] - t[from] > half_s {
            from += 1;
        }
        while to + 1 < t.len() && t[to + 1] - t[k] <= half_s {
            to += 1;
        }
        let (a, b) = (from.min(k.saturating_sub(MIN_ROWS)), to.max((k + MIN_ROWS).min(t.len() - 1)));
        let (window_t, window_y) = (&t[a..=b], &y[a..=b]);
        Some(LocalFits {
            window: a..b + 1,
            is_symmetric: symmetric(t, a, k, b),
            cubic: Polynomial::fit::<CUBIC>(window_t, window_y, t[k])?,
            quintic: Polynomial::fit::<QUINTIC>(window_t, window_y, t[k]).filter(|q| q.freedom > 0),
        })
    };
    (0..t.len()).map(&mut of_row).collect()
}

/// The window reaches as far before the row as behind it, but for a row.
fn symmetric(t: &[f64], from: usize, at: usize, to: usize) -> bool {
    let (before, after) = (t[at] - t[from], t[to] - t[at]);
    (before - after).abs() <= (t[from + 1] - t[from]).max(t[to] - t[to - 1])
}

/// A least-squares polynomial about a time.
struct Polynomial {
    /// Value at the first point, to which the coefficients add.
    offset: f64,
    /// Coefficients over (t − at)/`scale_s`; zeros beyond those of a cubic.
    coefficients: [f64; QUINTIC],
    scale_s: f64,
    /// Sum of the squared residuals, and its degrees of freedom.
    squares: f64,
    freedom: usize,
}

impl Polynomial {
    /// The polynomial of `N` coefficients through the points, about the time `at`; `None` where it is not determined.
    fn fit<const N: usize>(t: &[f64], y: &[f64], at: f64) -> Option<Polynomial> {
        let (mut s, mut b) = (vec![0.0; 2 * N - 1], [0.0; N]);
        let offset = *y.first()?;
        let scale_s = (t[t.len() - 1] - t[0]).max(f64::MIN_POSITIVE);
        for (&t, &y) in t.iter().zip(y) {
            let x = (t - at) / scale_s;
            let mut power = 1.0;
            for (k, s) in s.iter_mut().enumerate() {
                *s += power;
                if k < N {
                    b[k] += power * (y - offset);
                }
                power *= x;
            }
        }
        let m = nalgebra::SMatrix::<f64, N, N>::from_fn(|i, j| s[i + j]);
        let mut coefficients = [0.0; QUINTIC];
        coefficients[..N].copy_from_slice(m.cholesky()?.solve(&nalgebra::SVector::from(b)).as_slice());
        let freedom = t.len().checked_sub(N)?;
        let residual = |(&t, &y): (&f64, &f64)| y - offset - horner(&coefficients, (t - at) / scale_s);
        let squares = t.iter().zip(y).map(|point| residual(point).powi(2)).sum();
        Some(Polynomial { offset, coefficients, scale_s, squares, freedom })
    }

    /// Value at its time.
    fn value(&self) -> f64 {
        self.offset + self.coefficients[0]
    }

    /// Slope `later_s` after its time.
    fn slope_at(&self, later_s: f64) -> f64 {
        let slope: [f64; QUINTIC - 1] = std::array::from_fn(|k| (k + 1) as f64 * self.coefficients[k + 1]);
        horner(&slope, later_s / self.scale_s) / self.scale_s
    }

    /// Variance of the points about it; `None` where it passes through all of them.
    fn variance(&self) -> Option<f64> {
        (self.freedom > 0).then(|| self.squares / self.freedom as f64)
    }

    /// Its scatter is that of the other rows.
    fn describes(&self, usual: f64) -> bool {
        self.freedom == 0 || usual <= 0.0 || chi_squared_tail(self.squares / usual, self.freedom as f64) >= REFUTED_P
    }
}

/// The polynomial with these coefficients, lowest power first, at x.
fn horner(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
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
