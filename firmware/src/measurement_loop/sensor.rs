//! Scale, bias and delay of the rate sensor under test against the encoder, while it runs: `MEASure:SENSor?`.
//!
//! In: the weighted sums of [`Window`]s. Out: s, b and τ of y(t) = s ω(t − τ) + b, each with its standard error, by
//! ∫φy = s ∫φω + b ∫φ − s τ ∫φω' + m ∫φω''. The sensor's noise is what is explained; the encoder's angle is all but exact. The delay is that of the
//! sensor's filter, of the transport and of the age of its samples together; without it, and the next order of it (m), a rate that changes would bias the
//! scale, by some millionths for 1 ms. Memory
//! grows until a restart ([`Moments`]).

use super::drive::{ELEMENTS, Estimate};
use super::moments::{Moments, Regressor};
use super::windows::Window;
use crate::board::ROW_HZ;

/// Elements of z after the sensor itself.
const RATE: usize = 1;
const ACCELERATION: usize = 2;
const BIAS: usize = 3;
const BEND: usize = 4;
/// Lags of the errors' colour: one second.
const LAGS: usize = 10;
/// Windows before anything is said.
const FEWEST: u32 = 20;
/// A delay that nobody has, 1 σ, in s times the scale: at a constant rate nothing is known of it, and nothing has to be.
const DELAY_S: f64 = 0.02;

/// A row's sensor is that of its beginning, its rate the mean of the row: half a row of the delay is none.
const HALF_ROW_S: f64 = 0.5 / ROW_HZ as f64;

/// What is said of the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorReading {
    /// Shown over true; not seen where the platform kept one rate.
    pub scale: Estimate,
    /// Shown at rest, rad/s.
    pub bias_rad_s: Estimate,
    /// How late it shows, s.
    pub delay_s: Estimate,
    /// Windows that counted.
    pub windows: u32,
}

/// The sums.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sensor {
    moments: Moments<ELEMENTS, LAGS>,
}

impl Sensor {
    /// Takes a window.
    pub fn take(&mut self, window: &Window) {
        let z = |shown| [shown, window.angle_rad, window.rate_rad_s, window.weight_s, window.slope_rad_s2, 0.0, 0.0];
        self.moments.take(window.sensor_rad.map(z));
    }

    /// Forgets what was.
    pub fn restart(&mut self) {
        *self = Self::default();
    }

    /// What is said so far; `None` before there is enough to say anything.
    pub fn reading(&self) -> Option<SensorReading> {
        if self.moments.count() < FEWEST {
            return None;
        }
        let delay = Regressor { prior_sigma: DELAY_S, ..Regressor::new(ACCELERATION, -1.0) };
        let bend = Regressor { prior_sigma: DELAY_S * DELAY_S, ..Regressor::new(BEND, 1.0) };
        let answer = self.moments.solve([Regressor::new(RATE, 1.0), delay, Regressor::new(BIAS, 1.0), bend])?;
        let covariance = self.moments.covariance(&answer, &answer, true);
        let [scale, late, bias, _] = answer.coefficients;
        let sigma = |by: [f64; 4]| libm::sqrt(f64::max(covariance.form(&by, &by), 0.0));
        let delay_sigma = sigma([-late / (scale * scale), 1.0 / scale, 0.0, 0.0]);
        Some(SensorReading {
            scale: Estimate { value: scale, sigma: sigma([1.0, 0.0, 0.0, 0.0]) },
            bias_rad_s: Estimate { value: bias, sigma: sigma([0.0, 0.0, 1.0, 0.0]) },
            delay_s: Estimate { value: late / scale - HALF_ROW_S, sigma: delay_sigma },
            windows: self.moments.count(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bias_and_delay_are_found_and_a_steady_rate_does_not_hide_scale_behind_delay() {
        let mut sensor = Sensor::default();
        let mut steady = Sensor::default();
        for k in 0..200 {
            let t = f64::from(k) * 0.1;
            let (rate, acceleration) = (10.0 * t.sin(), 10.0 * t.cos());
            let noise = 1e-3 * (f64::from(k) * 12.9898).sin();
            let shown = 1.01 * (rate - 2e-3 * acceleration) + 0.02 + noise;
            sensor.take(&Window { weight_s: 1.0, angle_rad: rate, rate_rad_s: acceleration, sensor_rad: Some(shown), ..Window::default() });
            let rate = if k < 100 { 3.0 } else { -3.0 };
            steady.take(&Window { weight_s: 1.0, angle_rad: rate, sensor_rad: Some(1.01 * rate + 0.02 + noise), ..Window::default() });
        }
        let reading = sensor.reading().unwrap();
        let steady = steady.reading();
        for r in [Some(reading), steady].into_iter().flatten() {
            assert!((r.scale.value - 1.01).abs() < 4.0 * r.scale.sigma.max(1e-5) && r.scale.sigma < 1e-3, "{r:?}");
            assert!((r.bias_rad_s.value - 0.02).abs() < 4.0 * r.bias_rad_s.sigma.max(1e-5), "{r:?}");
        }
        assert!((reading.delay_s.value - 1.5e-3).abs() < 4.0 * reading.delay_s.sigma && reading.delay_s.sigma < 1e-4, "{reading:?}");
    }
}
