//! The rate sensor: Bosch BMG160 (BST-BMG160-DS000), range ±2000 °/s, 16.4 LSB/(°/s), 2 kHz, 523 Hz bandwidth.
//!
//! A first-order low-pass of the rate reading, then a sample each 500 µs with white noise, rounded to
//! the code and saturated at full scale. The low-pass is exact for a rate that is linear within each step.

use super::{Noise, SensorSetup, nearest};
use stand_firmware::board::{Hardware, RateCode};
use std::f64::consts::TAU;

/// State of the sensor.
#[derive(Clone, Debug)]
pub struct RateSensor {
    tau_s: f64,
    /// Step length of the two weights.
    step_s: f64,
    decay: f64,
    /// (1 − decay) τ/h: the weight of the slope.
    slope: f64,
    filtered: f64,
    last_input: f64,
    codes_per_rad_s: f64,
    full_scale: f64,
    noise: Noise,
    code: RateCode,
}

impl RateSensor {
    /// The sensor of this hardware at rest at `rate_rad_s`, with noise from `seed`.
    pub fn new(hardware: &Hardware, setup: &SensorSetup, seed: u64, rate_rad_s: f64) -> Self {
        let codes_per_rad_s = 1.0 / hardware.rate_rad_s_per_code;
        Self {
            tau_s: 1.0 / (TAU * setup.rate_cutoff_Hz),
            step_s: f64::NAN,
            decay: 0.0,
            slope: 0.0,
            filtered: rate_rad_s,
            last_input: rate_rad_s,
            codes_per_rad_s,
            full_scale: setup.rate_full_scale_rad_s,
            noise: Noise::new(seed, 1, setup.rate_noise_rad_s),
            code: RateCode::default(),
        }
    }

    /// Advances the filter by `step_s`, at whose end the rate is `rate_rad_s`.
    #[inline]
    pub fn advance(&mut self, rate_rad_s: f64, step_s: f64) {
        if step_s != self.step_s {
            self.step_s = step_s;
            (self.decay, self.slope) = if self.tau_s > 0.0 {
                let decay = libm::exp(-step_s / self.tau_s);
                (decay, (1.0 - decay) * self.tau_s / step_s)
            } else {
                (0.0, 0.0)
            };
        }
        // y' = (x − y)/τ with linear x: y₁ = x₁ + (y₀ − x₀) d − (x₁ − x₀)(1 − d) τ/h.
        let rise = rate_rad_s - self.last_input;
        self.filtered = rate_rad_s + (self.filtered - self.last_input) * self.decay - rise * self.slope;
        self.last_input = rate_rad_s;
    }

    /// Takes a sample.
    pub fn sample(&mut self) {
        let seen = (self.filtered + self.noise.draw()).clamp(-self.full_scale, self.full_scale);
        self.code = RateCode(nearest(seen * self.codes_per_rad_s) as i32);
    }

    /// Replaces the newest sample by a random code of full scale.
    #[cold]
    pub fn random_full_scale(&mut self) {
        let full_scale = self.full_scale.min(1e3) * self.codes_per_rad_s;
        self.code = RateCode(self.noise.uniform(full_scale) as i32);
    }

    /// The newest sample.
    pub fn code(&self) -> RateCode {
        self.code
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_filter_is_first_order_with_the_cutoff_of_the_data_sheet() {
        let setup = SensorSetup::default();
        let mut sensor = RateSensor::new(&Hardware::default(), &setup, 1, 0.0);
        let (cutoff, h) = (523.0, 1e-4);
        let mut greatest = 0.0_f64;
        for n in 0..20_000 {
            sensor.advance((TAU * cutoff * h * f64::from(n)).sin(), h);
            if n > 10_000 {
                greatest = greatest.max(sensor.filtered);
            }
        }
        // Linear interpolation of a sine with 19 samples per period loses sinc² ≈ 0.9 %.
        assert!((greatest - 0.5_f64.sqrt()).abs() < 0.012, "{greatest}");
    }
}
