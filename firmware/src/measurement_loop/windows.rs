//! Rows weighed over short windows, so that nothing has to be differentiated.
//!
//! The laws of drive and sensor are differential equations; they hold as well for integrals over a window with any weight φ(t). With a weight
//! that vanishes at both ends with its slope, φ = 16 s²(1 − s)² for s = 0 … 1, integration by parts moves the derivatives from the noisy
//! angle to the weight (modulating functions, Shinbrot 1957; the integrated form of theory.md §4): no initial state, no rate made by
//! differences. Windows of 0.2 s begin each 0.1 s; the weight is constant within a row, so that voltage and current, which are means over
//! rows, and the angle's increments enter exactly.

use super::Row;
use crate::board::{ROW_HZ, TICKS_PER_ROW, TICKS_PER_S};

/// Rows in a window.
pub const ROWS: u32 = 200;
/// 32 over the square of a window's length, 1/s².
const PER_LENGTH2: f64 = 32.0 * (ROW_HZ as f64 / ROWS as f64) * (ROW_HZ as f64 / ROWS as f64);
/// Windows that run at the same time, evenly one after the other.
const AT_ONCE: usize = 2;
/// Rows without a count after which the platform is taken to stand: at less than 0.016 rad/s the sign of the friction is not known.
const STANDS_ROWS: u32 = 20;

/// The weighted sums of one window: ∫ φ x dt of what the names say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Window {
    /// ∫ φ dt, s.
    pub weight_s: f64,
    /// Of the voltage, V s.
    pub volt_s: f64,
    /// Of the current, A s; `None` where a row had none.
    pub ampere_s: Option<f64>,
    /// Of the current's slope, by parts, A; `None` where a row had no current.
    pub slope_A: Option<f64>,
    /// Of the rate, by the angle's increments, rad.
    pub angle_rad: f64,
    /// Of the acceleration, by parts, rad/s.
    pub rate_rad_s: f64,
    /// Of the acceleration's slope, by parts twice, rad/s².
    pub slope_rad_s2: f64,
    /// Of the rate sensor, rad; `None` where a row had none.
    pub sensor_rad: Option<f64>,
    /// +1 or −1 if the platform turned that way all the time without standing.
    pub way: Option<i8>,
}

/// A window under way.
#[derive(Clone, Copy, Debug, Default)]
struct Open {
    /// Rows taken; the window is still to begin where it is negative.
    taken: i32,
    before: f64,
    sums: Window,
    way: Option<i8>,
    broken_way: bool,
}

/// Cuts rows into windows.
#[derive(Clone, Copy, Debug)]
pub struct Windows {
    /// The last row, and its time and angle as well as those of the one before it.
    last: Option<Row>,
    earlier: Option<(f64, f64)>,
    open: [Open; AT_ONCE],
    way: i8,
    still: u32,
}

impl Default for Windows {
    fn default() -> Self {
        Self { last: None, earlier: None, open: Self::fresh(), way: 0, still: STANDS_ROWS }
    }
}

impl Windows {
    fn fresh() -> [Open; AT_ONCE] {
        let apart = (ROWS >> 1) as i32;
        core::array::from_fn(|k| Open { taken: -(k as i32) * apart, ..Open::new() })
    }

    /// Takes a row; returns a window if one is complete.
    pub fn take(&mut self, row: &Row) -> Option<Window> {
        let complete = match self.last {
            Some(last) => {
                let steps = row.at - last.at;
                let follows = last.sequence.wrapping_add(1) == row.sequence && steps.saturating_mul(2) < 3 * TICKS_PER_ROW && steps > 0;
                if follows {
                    self.weigh(&last, row, steps as f64 / TICKS_PER_S as f64)
                } else {
                    // A row is missing: what spans the gap belongs to no window.
                    *self = Self::default();
                    None
                }
            }
            None => None,
        };
        self.earlier = self.last.map(|last| (last.at.seconds(), last.theta_rad));
        self.last = Some(*row);
        complete
    }

    /// Weighs row `k`, now that the angle at its end is known.
    fn weigh(&mut self, k: &Row, next: &Row, dt_s: f64) -> Option<Window> {
        let step_rad = next.theta_rad - k.theta_rad;
        // The rate at t_k, by the rows on both sides.
        let rate_rad_s = match self.earlier {
            Some((at_s, theta_rad)) => (next.theta_rad - theta_rad) / (next.at.seconds() - at_s),
            None => step_rad / dt_s,
        };
        if step_rad == 0.0 {
            self.still = self.still.saturating_add(1);
        } else {
            self.way = if step_rad > 0.0 { 1 } else { -1 };
            self.still = 0;
        }
        let way = (self.still < STANDS_ROWS).then_some(self.way);
        let mut complete = None;
        for open in &mut self.open {
            if open.taken >= 0 {
                open.add(k, step_rad, rate_rad_s, dt_s, way);
            }
            open.taken += 1;
            if open.taken >= ROWS as i32 {
                // By parts, the last weight meets the rate at the end; it is 10⁻⁴ of the greatest.
                open.sums.rate_rad_s += open.before * step_rad / dt_s;
                complete = Some(Window { way: open.way.filter(|_| !open.broken_way), ..open.sums });
                *open = Open::new();
            }
        }
        complete
    }
}

impl Open {
    fn new() -> Self {
        let sums = Window { ampere_s: Some(0.0), slope_A: Some(0.0), sensor_rad: Some(0.0), ..Window::default() };
        Self { sums, ..Self::default() }
    }

    fn add(&mut self, row: &Row, step_rad: f64, rate_rad_s: f64, dt_s: f64, way: Option<i8>) {
        let s = (f64::from(self.taken) + 0.5) * (1.0 / ROWS as f64);
        let root = 4.0 * s * (1.0 - s);
        let weight = root * root;
        let sums = &mut self.sums;
        sums.weight_s += weight * dt_s;
        sums.volt_s += weight * row.u_V * dt_s;
        sums.ampere_s = sums.ampere_s.zip(row.i_A).map(|(sum, i_A)| sum + weight * i_A * dt_s);
        sums.slope_A = sums.slope_A.zip(row.i_A).map(|(sum, i_A)| sum + (self.before - weight) * i_A);
        sums.sensor_rad = sums.sensor_rad.zip(row.gyro_rad_s.or(row.omega_rad_s)).map(|(sum, rate)| sum + weight * rate * dt_s);
        sums.angle_rad += weight * step_rad;
        // φ'' = 32 (1 − 6 s + 6 s²)/T².
        sums.slope_rad_s2 += PER_LENGTH2 * (1.0 - 6.0 * s * (1.0 - s)) * step_rad;
        sums.rate_rad_s += (self.before - weight) * rate_rad_s;
        self.before = weight;
        if self.taken == 0 {
            self.way = way;
        }
        self.broken_way |= way.is_none() || way != self.way;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Ticks;

    /// A platform with ω = 3 + 0.5 sin 9t; the current is 2 ω' + 0.1 ω + 0.3, the sensor shows 1.02 ω + 0.01.
    fn row(k: u32) -> Row {
        let t = f64::from(k) * 1e-3;
        let theta = |t: f64| 3.0 * t - 0.5 / 9.0 * (9.0 * t).cos();
        let omega = |t: f64| 3.0 + 0.5 * (9.0 * t).sin();
        let mean = (theta(t + 1e-3) - theta(t)) / 1e-3;
        let i_A = 2.0 * (omega(t + 1e-3) - omega(t)) / 1e-3 + 0.1 * mean + 0.3;
        Row {
            sequence: k,
            at: Ticks(u64::from(k) * TICKS_PER_ROW),
            theta_rad: theta(t),
            i_A: Some(i_A),
            u_V: 2.0 * i_A,
            gyro_rad_s: Some(1.02 * mean + 0.01),
            ..Row::default()
        }
    }

    #[test]
    fn the_laws_hold_for_the_weighted_sums_without_an_initial_state() {
        let mut windows = Windows::default();
        let complete: Vec<Window> = (0..2000).filter_map(|k| windows.take(&row(k))).collect();
        assert_eq!(complete.len(), 18, "two hundred rows each, a hundred apart");
        for w in &complete {
            let current = 2.0 * w.rate_rad_s + 0.1 * w.angle_rad + 0.3 * w.weight_s;
            // The rate from neighbours 2 ms apart is smooth over 10⁻⁵ of the acceleration.
            assert!((w.ampere_s.unwrap() - current).abs() < 2e-5, "{w:?}");
            assert!((w.volt_s - 2.0 * w.ampere_s.unwrap()).abs() < 1e-12);
            assert!((w.sensor_rad.unwrap() - 1.02 * w.angle_rad - 0.01 * w.weight_s).abs() < 1e-12);
            assert!(w.way == Some(1) && (w.weight_s - 0.2 * 16.0 / 30.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_gap_begins_anew_and_a_stand_or_a_turning_back_has_no_way() {
        let mut windows = Windows::default();
        let mut complete = 0;
        for k in (0..150).chain(151..400) {
            complete += u32::from(windows.take(&row(k)).is_some());
        }
        assert_eq!(complete, 1, "the window before the gap is not made up");
        let still = |k: u32| Row { theta_rad: if k < 250 { f64::from(k) * 1e-3 } else { 0.25 }, i_A: None, ..row(k) };
        let mut windows = Windows::default();
        let all: Vec<Window> = (0..700).filter_map(|k| windows.take(&still(k))).collect();
        assert_eq!(all.iter().map(|w| w.way.is_some()).collect::<Vec<_>>(), [true, false, false, false, false]);
        assert!(all.iter().all(|w| w.ampere_s.is_none()));
        let back = |k: u32| Row { theta_rad: (f64::from(k) - 300.0).abs() * 1e-3, ..row(k) };
        let mut windows = Windows::default();
        let ways: Vec<Option<i8>> = (0..620).filter_map(|k| windows.take(&back(k)).map(|w| w.way)).collect();
        assert_eq!(ways, [Some(-1), Some(-1), None, Some(1), Some(1)]);
    }
}
