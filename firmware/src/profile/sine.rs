//! Sine profile: for the response at one frequency.
//!
//! The sine is computed in double precision, so that rounding adds no harmonics. The phase is an integer in units of 2⁻⁶⁴ turn: it
//! accumulates no rounding error.

use super::ProfileConfig;

#[derive(Clone, Debug)]
pub(super) struct Sine {
    amplitude: f64,
    /// Units of 2⁻⁶⁴ turn.
    phase: u64,
    /// Phase change in 1 ms, same unit.
    step: u64,
}

impl Sine {
    pub(super) fn new(amplitude: f64, c: &ProfileConfig) -> Self {
        Self { amplitude, phase: 0, step: (c.frequency_Hz * 1e-3 * 18_446_744_073_709_551_616.0) as u64 }
    }

    pub(super) fn next_value(&mut self) -> f64 {
        // The upper half of the phase, as −½ … ½ turn.
        let turn = ((self.phase >> 32) as u32 as i32) as f64 * (1.0 / 4_294_967_296.0);
        self.phase = self.phase.wrapping_add(self.step);
        self.amplitude * libm::sin(core::f64::consts::TAU * turn)
    }
}
