//! Staircase: from 0 up to +amplitude, down to −amplitude, up to 0, repeated; a dwell on each level.
//!
//! Shows friction as a function of rate, with every level approached from both sides.

use super::{ProfileConfig, milliseconds};

#[derive(Clone, Debug)]
pub(super) struct Staircase {
    step: f64,
    levels: i32,
    dwell_ms: u32,
    left_ms: u32,
    level: i32,
    up: bool,
}

impl Staircase {
    pub(super) fn new(amplitude: f64, c: &ProfileConfig) -> Self {
        let dwell_ms = milliseconds(c.dwell_s);
        Self { step: amplitude / f64::from(c.levels), levels: c.levels as i32, dwell_ms, left_ms: dwell_ms, level: 0, up: true }
    }

    pub(super) fn next_value(&mut self) -> f64 {
        if self.left_ms == 0 {
            self.left_ms = self.dwell_ms;
            if self.level.abs() >= self.levels {
                self.up = self.level < 0;
            }
            self.level += if self.up { 1 } else { -1 };
        }
        self.left_ms -= 1;
        f64::from(self.level) * self.step
    }
}
