//! Slow channels: supply voltage and winding temperature, sampled each millisecond.

use super::{Noise, nearest};

/// A converter with white noise.
#[derive(Clone, Debug)]
pub struct SlowChannel {
    codes_per_unit: f64,
    noise: Noise,
    code: i64,
}

impl SlowChannel {
    /// A channel with this scale per code.
    pub fn new(unit_per_code: f64, noise: Noise) -> Self {
        Self { codes_per_unit: 1.0 / unit_per_code, noise, code: 0 }
    }

    /// Takes a sample of `value`.
    pub fn sample(&mut self, value: f64) {
        self.code = nearest((value + self.noise.draw()) * self.codes_per_unit);
    }

    /// The newest sample.
    pub fn code(&self) -> i64 {
        self.code
    }
}
