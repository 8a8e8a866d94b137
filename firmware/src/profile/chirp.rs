//! Logarithmic and linear chirps, repeated.

use super::{ProfileConfig, milliseconds, sine};

/// Phase per millisecond at one hertz, 2⁻³² turn.
const STEP_PER_HZ: f64 = 1e-3 * 4_294_967_296.0;

#[derive(Clone, Debug)]
pub(super) struct Chirp {
    amplitude: f64,
    /// Phase, in units of 2⁻³² turn.
    phase: f64,
    step: f64,
    first_step: f64,
    /// Factor and increment of the step per millisecond.
    growth: f64,
    rise: f64,
    sweep_ms: u32,
    left_ms: u32,
}

impl Chirp {
    /// The frequency rises by the same factor in each second.
    pub(super) fn logarithmic(amplitude: f64, c: &ProfileConfig) -> Self {
        let chirp = Self::constant(amplitude, c);
        let growth = libm::pow(c.to_Hz / c.from_Hz, 1.0 / f64::from(chirp.sweep_ms));
        Self { growth, ..chirp }
    }

    /// The frequency rises by the same number of hertz in each second.
    pub(super) fn linear(amplitude: f64, c: &ProfileConfig) -> Self {
        let chirp = Self::constant(amplitude, c);
        let rise = (c.to_Hz - c.from_Hz) * STEP_PER_HZ / f64::from(chirp.sweep_ms);
        Self { rise, ..chirp }
    }

    /// A constant sine at the lowest frequency.
    fn constant(amplitude: f64, c: &ProfileConfig) -> Self {
        let sweep_ms = milliseconds(c.sweep_s);
        let first_step = c.from_Hz * STEP_PER_HZ;
        Self { amplitude, phase: 0.0, step: first_step, first_step, growth: 1.0, rise: 0.0, sweep_ms, left_ms: sweep_ms }
    }

    pub(super) fn next_value(&mut self) -> f64 {
        let value = self.amplitude * sine(self.phase as u64 as u32);
        if self.left_ms == 0 {
            self.left_ms = self.sweep_ms;
            self.step = self.first_step;
        }
        self.left_ms -= 1;
        self.phase += self.step;
        if self.phase >= 4_294_967_296.0 {
            self.phase -= 4_294_967_296.0;
        }
        self.step = self.step * self.growth + self.rise;
        value
    }
}
