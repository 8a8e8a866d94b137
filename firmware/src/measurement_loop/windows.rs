//! Modulating functions: weighted integrals of the rows over short windows, so that no signal is differentiated.
//!
//! The equations of drive and sensor are differential equations; they hold for integrals over a window with any weight φ(t). With a weight
//! that vanishes at both ends together with its slope, φ = 16 s²(1 − s)² for s = 0 … 1, integration by parts moves the derivatives from the
//! noisy angle to the weight (Shinbrot 1957; docs/theory.md §4): no initial state and no rate by differences is needed. Windows of 0.2 s
//! begin each 0.1 s. The weight is constant within a row, so that voltage and current, which are means over rows, and the angle's
//! increments enter exactly.

use super::Row;
use crate::board::{ROW_HZ, TICKS_PER_ROW, TICKS_PER_S};

/// Rows in a window.
pub const ROWS: u32 = 200;
/// 32 / (length of a window)², 1/s².
const PER_LENGTH2: f64 = 32.0 * (ROW_HZ as f64 / ROWS as f64) * (ROW_HZ as f64 / ROWS as f64);
/// Number of overlapping windows.
const OVERLAP: usize = 2;
/// Rows without a count after which the platform is at rest: below 0.016 rad/s the sign of the friction is unknown.
const REST_ROWS: u32 = 20;

/// Weighted integrals ∫ φ x dt of one window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Window {
    /// ∫ φ dt, s.
    pub weight_s: f64,
    /// Voltage, V s.
    pub volt_s: f64,
    /// Current, A s; `None` if a row had none.
    pub ampere_s: Option<f64>,
    /// Slope of the current, by parts, A; `None` if a row had no current.
    pub slope_A: Option<f64>,
    /// Rate, by the angle's increments, rad.
    pub angle_rad: f64,
    /// Acceleration, by parts, rad/s.
    pub rate_rad_s: f64,
    /// Slope of the acceleration, by parts twice, rad/s².
    pub slope_rad_s2: f64,
    /// Rate sensor, rad; `None` if a row had none.
    pub sensor_rad: Option<f64>,
    /// Direction, ±1, if the platform moved in it throughout.
    pub direction: Option<i8>,
}

/// An open window.
#[derive(Clone, Copy, Debug, Default)]
struct Open {
    /// Rows so far; negative before the window begins.
    rows: i32,
    last_weight: f64,
    sums: Window,
    direction: Option<i8>,
    direction_changed: bool,
}

/// Divides rows into windows.
#[derive(Clone, Copy, Debug)]
pub struct Windows {
    /// The last row, and time and angle of the one before it.
    last: Option<Row>,
    earlier: Option<(f64, f64)>,
    open: [Open; OVERLAP],
    direction: i8,
    rows_at_rest: u32,
}

impl Default for Windows {
    fn default() -> Self {
        Self { last: None, earlier: None, open: Self::fresh(), direction: 0, rows_at_rest: REST_ROWS }
    }
}

impl Windows {
    fn fresh() -> [Open; OVERLAP] {
        let spacing = (ROWS >> 1) as i32;
        core::array::from_fn(|k| Open { rows: -(k as i32) * spacing, ..Open::new() })
    }

    /// The next row; returns a window if one is complete.
    pub fn update(&mut self, row: &Row) -> Option<Window> {
        let complete = match self.last {
            Some(last) => {
                let steps = row.at - last.at;
                let follows = last.sequence.wrapping_add(1) == row.sequence && steps.saturating_mul(2) < 3 * TICKS_PER_ROW && steps > 0;
                if follows {
                    self.add(&last, row, steps as f64 / TICKS_PER_S as f64)
                } else {
                    // A row is missing: open windows are dropped.
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

    /// Adds row `k`, once the angle at its end is known.
    fn add(&mut self, k: &Row, next: &Row, dt_s: f64) -> Option<Window> {
        let step_rad = next.theta_rad - k.theta_rad;
        // The rate at t_k by both neighbours.
        let rate_rad_s = match self.earlier {
            Some((at_s, theta_rad)) => (next.theta_rad - theta_rad) / (next.at.seconds() - at_s),
            None => step_rad / dt_s,
        };
        if step_rad == 0.0 {
            self.rows_at_rest = self.rows_at_rest.saturating_add(1);
        } else {
            self.direction = if step_rad > 0.0 { 1 } else { -1 };
            self.rows_at_rest = 0;
        }
        let direction = (self.rows_at_rest < REST_ROWS).then_some(self.direction);
        let mut complete = None;
        for open in &mut self.open {
            if open.rows >= 0 {
                open.add(k, step_rad, rate_rad_s, dt_s, direction);
            }
            open.rows += 1;
            if open.rows >= ROWS as i32 {
                // Boundary term of the integration by parts; this weight is 1e-4 of the largest.
                open.sums.rate_rad_s += open.last_weight * step_rad / dt_s;
                complete = Some(Window { direction: open.direction.filter(|_| !open.direction_changed), ..open.sums });
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

    fn add(&mut self, row: &Row, step_rad: f64, rate_rad_s: f64, dt_s: f64, direction: Option<i8>) {
        let s = (f64::from(self.rows) + 0.5) * (1.0 / ROWS as f64);
        let root = 4.0 * s * (1.0 - s);
        let weight = root * root;
        let sums = &mut self.sums;
        sums.weight_s += weight * dt_s;
        sums.volt_s += weight * row.u_V * dt_s;
        sums.ampere_s = sums.ampere_s.zip(row.i_A).map(|(sum, i_A)| sum + weight * i_A * dt_s);
        sums.slope_A = sums.slope_A.zip(row.i_A).map(|(sum, i_A)| sum + (self.last_weight - weight) * i_A);
        sums.sensor_rad = sums.sensor_rad.zip(row.gyro_rad_s.or(row.omega_rad_s)).map(|(sum, rate)| sum + weight * rate * dt_s);
        sums.angle_rad += weight * step_rad;
        // φ'' = 32 (1 − 6 s + 6 s²)/T².
        sums.slope_rad_s2 += PER_LENGTH2 * (1.0 - 6.0 * s * (1.0 - s)) * step_rad;
        sums.rate_rad_s += (self.last_weight - weight) * rate_rad_s;
        self.last_weight = weight;
        if self.rows == 0 {
            self.direction = direction;
        }
        self.direction_changed |= direction.is_none() || direction != self.direction;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Ticks;

    /// ω = 3 + 0.5 sin 9t, current 2 ω' + 0.1 ω + 0.3, sensor 1.02 ω + 0.01.
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
    fn equations_hold_for_the_weighted_integrals() {
        let mut windows = Windows::default();
        let complete: Vec<Window> = (0..2000).filter_map(|k| windows.update(&row(k))).collect();
        assert_eq!(complete.len(), 18, "two hundred rows each, a hundred apart");
        for w in &complete {
            let current = 2.0 * w.rate_rad_s + 0.1 * w.angle_rad + 0.3 * w.weight_s;
            // The rate from neighbours 2 ms apart is smooth over 10⁻⁵ of the acceleration.
            assert!((w.ampere_s.unwrap() - current).abs() < 2e-5, "{w:?}");
            assert!((w.volt_s - 2.0 * w.ampere_s.unwrap()).abs() < 1e-12);
            assert!((w.sensor_rad.unwrap() - 1.02 * w.angle_rad - 0.01 * w.weight_s).abs() < 1e-12);
            assert!(w.direction == Some(1) && (w.weight_s - 0.2 * 16.0 / 30.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_gap_restarts_and_rest_or_reversal_has_no_direction() {
        let mut windows = Windows::default();
        let mut complete = 0;
        for k in (0..150).chain(151..400) {
            complete += u32::from(windows.update(&row(k)).is_some());
        }
        assert_eq!(complete, 1, "the window before the gap is dropped");
        let still = |k: u32| Row { theta_rad: if k < 250 { f64::from(k) * 1e-3 } else { 0.25 }, i_A: None, ..row(k) };
        let mut windows = Windows::default();
        let all: Vec<Window> = (0..700).filter_map(|k| windows.update(&still(k))).collect();
        assert_eq!(all.iter().map(|w| w.direction.is_some()).collect::<Vec<_>>(), [true, false, false, false, false]);
        assert!(all.iter().all(|w| w.ampere_s.is_none()));
        let back = |k: u32| Row { theta_rad: (f64::from(k) - 300.0).abs() * 1e-3, ..row(k) };
        let mut windows = Windows::default();
        let ways: Vec<Option<i8>> = (0..620).filter_map(|k| windows.update(&back(k)).map(|w| w.direction)).collect();
        assert_eq!(ways, [Some(-1), Some(-1), None, Some(1), Some(1)]);
    }
}
