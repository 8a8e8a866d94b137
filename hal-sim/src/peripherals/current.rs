//! The ADC of the current: sampled in the middle of each bridge period, summed by DMA.
//!
//! A sample in the middle of a centre-aligned period equals the mean of the period; the model uses the mean over the control
//! tick for each of its samples. INA240A2, 50 V/V at 20 mΩ, 12 bits of 3.3 V about the middle: 0.8 mA per code, dithered
//! by noise of 15 codes, so that sums are much finer than a code.

use super::{Noise, SensorSetup, nearest};
use stand_firmware::board::{CurrentCode, CurrentSum, Hardware};

/// The converter and the sum since the last read.
#[derive(Clone, Debug)]
pub struct CurrentAdc {
    codes_per_A: f64,
    zero: f64,
    per_tick: u32,
    greatest: i64,
    noise: Noise,
    newest: i64,
    sum: CurrentSum,
}

impl CurrentAdc {
    /// The converter of this hardware, with noise from `seed`.
    pub fn new(hardware: &Hardware, setup: &SensorSetup, seed: u64) -> Self {
        let codes_per_A = 1.0 / hardware.current_A_per_code;
        Self {
            codes_per_A,
            zero: hardware.current_zero_code,
            per_tick: setup.current_per_tick,
            // The range of the converter is symmetric about its zero.
            greatest: (2.0 * hardware.current_zero_code) as i64 - 1,
            noise: Noise::new(seed, 0, setup.current_noise_A * codes_per_A),
            // Before the first conversion no current flows.
            newest: hardware.current_zero_code as i64,
            sum: CurrentSum::default(),
        }
    }

    /// The conversions of a tick in which the current was `mean_A`.
    #[inline]
    pub fn tick(&mut self, mean_A: f64) {
        let exact = mean_A * self.codes_per_A + self.zero;
        for _ in 0..self.per_tick {
            self.newest = nearest(exact + self.noise.draw()).clamp(0, self.greatest);
            self.sum.codes += self.newest;
            self.sum.count += 1;
        }
    }

    /// The newest conversion.
    #[inline]
    pub fn newest(&self) -> CurrentCode {
        CurrentCode(self.newest as i32)
    }

    /// The sum since the last call.
    pub fn take(&mut self) -> CurrentSum {
        std::mem::take(&mut self.sum)
    }
}
