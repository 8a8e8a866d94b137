//! Levels with a dwell on each and slopes between them: trapezoid, S-curve, alternating, ABBA.
//!
//! Starts at zero. The dwell does not include the slopes. After the last cycle the value goes to zero and stays there. Slopes start at
//! whole milliseconds.

use super::slope::{Slope, SlopeLimits};
use super::{ProfileConfig, milliseconds};

#[derive(Clone, Debug)]
pub(super) struct Plateaus {
    amplitude: f64,
    /// Signs of the levels of one cycle.
    pattern: &'static [i8],
    nth: usize,
    /// Remaining cycles with the present one; `None`: without end.
    left: Option<u32>,
    limits: SlopeLimits,
    slope: Slope,
    slope_ms: u64,
    dwell_ms: u64,
    done_ms: u64,
}

/// Up and down.
pub(super) const ONE_SIDE: &[i8] = &[1, 0];
/// Both signs in turn.
pub(super) const BOTH_SIDES: &[i8] = &[1, -1];
/// A linear drift has the same mean over A and B in A B B A.
pub(super) const ABBA: &[i8] = &[1, -1, -1, 1];

impl Plateaus {
    pub(super) fn new(amplitude: f64, pattern: &'static [i8], limits: SlopeLimits, c: &ProfileConfig) -> Self {
        let dwell_ms = u64::from(milliseconds(c.dwell_s));
        let left = (c.cycles > 0).then_some(c.cycles);
        let still = Slope::new(0.0, 0.0, &limits);
        let mut plateaus = Self { amplitude, pattern, nth: 0, left, limits, slope: still, slope_ms: 0, dwell_ms, done_ms: 0 };
        plateaus.start_slope(0.0);
        plateaus
    }

    pub(super) fn next_value(&mut self) -> f64 {
        while self.done_ms >= self.slope_ms.saturating_add(self.dwell_ms) && self.left != Some(0) {
            let from = self.level();
            self.nth += 1;
            if self.nth >= self.pattern.len() {
                self.nth = 0;
                self.left = self.left.map(|left| left.saturating_sub(1));
            }
            self.start_slope(from);
        }
        let value = if self.done_ms < self.slope_ms { self.slope.level(self.done_ms as f64 * 1e-3) } else { self.slope.to };
        self.done_ms = self.done_ms.saturating_add(1);
        value
    }

    fn level(&self) -> f64 {
        let sign = if self.left == Some(0) { 0 } else { self.pattern.get(self.nth).copied().unwrap_or(0) };
        f64::from(sign) * self.amplitude
    }

    fn start_slope(&mut self, from: f64) {
        self.slope = Slope::new(from, self.level(), &self.limits);
        // Rounding must not add a millisecond to a slope of whole milliseconds.
        self.slope_ms = libm::ceil(self.slope.length_s * 1e3 - 1e-9) as u64;
        self.done_ms = 0;
    }
}
