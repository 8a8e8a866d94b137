//! A sine whose frequency rises by the same factor in each second, and begins anew at the end.

use super::{ProfileConfig, milliseconds, sine};
use crate::config::{ConfigError, within};

#[derive(Clone, Debug)]
pub(super) struct Sweep {
    amplitude: f64,
    /// 2⁻³² turn.
    phase: f64,
    step: f64,
    first_step: f64,
    growth: f64,
    sweep_ms: u32,
    left_ms: u32,
}

impl Sweep {
    pub(super) fn new(amplitude: f64, c: &ProfileConfig) -> Result<Self, ConfigError> {
        let lowest = within("from_Hz", c.from_Hz, 1e-3, 250.0)?;
        let highest = within("to_Hz", c.to_Hz, lowest, 250.0)?;
        let sweep_ms = milliseconds("sweep_s", c.sweep_s)?;
        let first_step = lowest * 1e-3 * 4_294_967_296.0;
        let growth = libm::pow(highest / lowest, 1.0 / f64::from(sweep_ms));
        Ok(Self { amplitude, phase: 0.0, step: first_step, first_step, growth, sweep_ms, left_ms: sweep_ms })
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
        self.step *= self.growth;
        value
    }
}
