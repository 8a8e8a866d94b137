//! The sensors of the simulated board: quantised, noisy, filtered, each with its own sampling times.
//!
//! Input: the readings of the sensor elements. Output: codes, as the board traits of the firmware define them. Every number has a source.
//! Each sensor has a random stream of its own, so that another sensor does not change the others; a seed gives the same numbers on every
//! machine (xoshiro256++ and its `jump`).

mod clock_reference;
mod current;
mod edges;
mod encoder;
pub mod flash;
pub mod imu;
mod index;
mod noise;
mod normal;
mod rate_sensor;
pub mod serial;
mod slow;
mod slow_noise;
mod stalling_flash;
mod task_edge;

pub use clock_reference::{ClockSetup, Crystal, ReferencePulses, ReferenceSetup};
pub use current::CurrentAdc;
pub use edges::Edges;
pub use encoder::Encoder;
pub use flash::SimFlash;
pub use index::Index;
pub use noise::Noise;
pub(crate) use normal::standard_normal;
pub use rate_sensor::RateSensor;
pub use serial::SerialLine;
pub use slow::SlowChannel;
pub use slow_noise::SlowNoise;
pub use stalling_flash::StallingFlash;
pub use task_edge::TaskEdge;

use stand_firmware::config::{ConfigError, within};
use std::f64::consts::PI;

/// Noise and filters of the sensors. The sources of the defaults are given there; [`SensorSetup::ideal`] has no noise and no filter.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorSetup {
    /// Noise of one conversion of the current, A rms.
    pub current_noise_A: f64,
    /// Conversions of the current per control tick.
    pub current_per_tick: u32,
    /// Cutoff of the first-order filter of the rate sensor, Hz; infinite: no filter.
    pub rate_cutoff_Hz: f64,
    /// Noise of one sample of the rate sensor, rad/s rms.
    pub rate_noise_rad_s: f64,
    /// Full scale of the rate sensor, rad/s.
    pub rate_full_scale_rad_s: f64,
    /// Noise of one conversion of the supply, V rms.
    pub supply_noise_V: f64,
    /// Noise of one reading of the winding's temperature, K rms.
    pub temp_noise_K: f64,
}

impl Default for SensorSetup {
    fn default() -> Self {
        // Bosch BMG160 (BST-BMG160-DS000): noise 0.014 °/s/√Hz, bandwidth 523 Hz unfiltered; a first-order low pass
        // passes the noise of π/2 times its cutoff.
        let rate_noise_deg_s = 0.014 * (PI / 2.0 * 523.0_f64).sqrt();
        Self {
            // INA240A2 (SBOS662) at 20 mΩ: input noise 40 nV/√Hz is 1.3 mA in 400 kHz; the rest is the bridge's
            // ripple into the sampling instant, as usual on such boards: 12 mA in all.
            current_noise_A: 12e-3,
            current_per_tick: 2, // one for each period of the 20 kHz bridge
            rate_cutoff_Hz: 523.0,
            rate_noise_rad_s: rate_noise_deg_s.to_radians(),
            rate_full_scale_rad_s: 2000_f64.to_radians(),
            supply_noise_V: 5e-3, // one LSB of the divided supply
            temp_noise_K: 0.05,   // 10 kΩ NTC over a 12-bit converter, mean of 16
        }
    }
}

impl SensorSetup {
    /// Sensors without noise and filter; the converters still quantise.
    pub fn ideal() -> Self {
        Self {
            current_noise_A: 0.0,
            current_per_tick: 1,
            rate_cutoff_Hz: f64::INFINITY,
            rate_noise_rad_s: 0.0,
            rate_full_scale_rad_s: f64::INFINITY,
            supply_noise_V: 0.0,
            temp_noise_K: 0.0,
        }
    }
}

impl SensorSetup {
    /// Checks the values of a file.
    ///
    /// # Errors
    /// The name of the first invalid parameter.
    pub fn check(&self) -> Result<(), ConfigError> {
        within("current_noise_A", self.current_noise_A, 0.0, 1e3)?;
        within("current_per_tick", f64::from(self.current_per_tick), 1.0, 100.0)?;
        within("rate_noise_rad_s", self.rate_noise_rad_s, 0.0, 1e3)?;
        within("supply_noise_V", self.supply_noise_V, 0.0, 1e3)?;
        within("temp_noise_K", self.temp_noise_K, 0.0, 1e3)?;
        for (name, value) in [("rate_cutoff_Hz", self.rate_cutoff_Hz), ("rate_full_scale_rad_s", self.rate_full_scale_rad_s)] {
            if value != f64::INFINITY {
                within(name, value, 1e-3, 1e9)?;
            }
        }
        Ok(())
    }
}

/// Rounds to the nearest code. (`round` is a library call on the oldest x86-64.)
#[inline]
fn nearest(value: f64) -> i64 {
    (value + 0.5_f64.copysign(value)) as i64
}
