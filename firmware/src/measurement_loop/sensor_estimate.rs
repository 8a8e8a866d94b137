//! Online estimate of scale, bias and delay of the sensor under test against the encoder: `MEASure:SENSor?`.
//!
//! In: the weighted sums of [`Window`]s. Out: s, b and τ of y(t) = s ω(t − τ) + b, each with its standard error, by
//! ∫φy = s ∫φω + b ∫φ − s τ ∫φω' + m ∫φω''. The sensor's output is the dependent variable; the encoder's angle is almost exact. The delay
//! contains the sensor's filter, the transport and the age of the samples. Without the delay and its next order (m), a changing rate would
//! bias the scale by some 1e-6 for 1 ms. All windows since the last restart count ([`LeastSquares`]).

use super::drive_estimate::{ELEMENTS, Estimate};
use super::least_squares::{LeastSquares, Regressor};
use super::windows::Window;
use crate::board::ROW_HZ;

/// Elements of z after the sensor's output.
const RATE: usize = 1;
const ACCELERATION: usize = 2;
const BIAS: usize = 3;
const CURVATURE: usize = 4;
/// Lags of the residuals' autocovariance: one second.
const LAGS: usize = 10;
/// Fewest windows for an estimate.
const MIN_WINDOWS: u32 = 20;
/// Prior of the delay, 1 σ, s: the delay is not observable at a constant rate.
const DELAY_S: f64 = 0.02;

/// The sensor is read at the beginning of a row, the rate is the mean of the row: half a row to be subtracted from the delay.
const HALF_ROW_S: f64 = 0.5 / ROW_HZ as f64;

/// Estimates of the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorReading {
    /// Scale factor, measured / true; not significant at a constant rate.
    pub scale: Estimate,
    /// Bias, rad/s.
    pub bias_rad_s: Estimate,
    /// Delay, s.
    pub delay_s: Estimate,
    /// Number of windows used.
    pub windows: u32,
}

/// Estimator of the sensor.
#[derive(Clone, Copy, Debug, Default)]
pub struct SensorEstimator {
    sums: LeastSquares<ELEMENTS, LAGS>,
}

impl SensorEstimator {
    /// Adds a window.
    pub fn add(&mut self, window: &Window) {
        let z = |reading| [reading, window.angle_rad, window.rate_rad_s, window.weight_s, window.slope_rad_s2, 0.0, 0.0];
        self.sums.add(window.sensor_rad.map(z));
    }

    /// Forgets all windows.
    pub fn restart(&mut self) {
        *self = Self::default();
    }

    /// The estimates so far; `None` with too few windows.
    pub fn reading(&self) -> Option<SensorReading> {
        if self.sums.count() < MIN_WINDOWS {
            return None;
        }
        let delay = Regressor { prior_sigma: DELAY_S, ..Regressor::minus(ACCELERATION) };
        let curvature = Regressor { prior_sigma: DELAY_S * DELAY_S, ..Regressor::plus(CURVATURE) };
        let answer = self.sums.solve([Regressor::plus(RATE), delay, Regressor::plus(BIAS), curvature])?;
        let covariance = self.sums.covariance(&answer, &answer, true);
        let [scale, late, bias, _] = answer.coefficients;
        let sigma = |by: [f64; 4]| libm::sqrt(f64::max(covariance.form(&by, &by), 0.0));
        let delay_sigma = sigma([-late / (scale * scale), 1.0 / scale, 0.0, 0.0]);
        Some(SensorReading {
            scale: Estimate { value: scale, sigma: sigma([1.0, 0.0, 0.0, 0.0]) },
            bias_rad_s: Estimate { value: bias, sigma: sigma([0.0, 0.0, 1.0, 0.0]) },
            delay_s: Estimate { value: late / scale - HALF_ROW_S, sigma: delay_sigma },
            windows: self.sums.count(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bias_and_delay_are_found_with_varying_and_with_constant_rate() {
        let mut sensor = SensorEstimator::default();
        let mut steady = SensorEstimator::default();
        for k in 0..200 {
            let t = f64::from(k) * 0.1;
            let (rate, acceleration) = (10.0 * t.sin(), 10.0 * t.cos());
            let noise = 1e-3 * (f64::from(k) * 12.9898).sin();
            let shown = 1.01 * (rate - 2e-3 * acceleration) + 0.02 + noise;
            sensor.add(&Window { weight_s: 1.0, angle_rad: rate, rate_rad_s: acceleration, sensor_rad: Some(shown), ..Window::default() });
            let rate = if k < 100 { 3.0 } else { -3.0 };
            steady.add(&Window { weight_s: 1.0, angle_rad: rate, sensor_rad: Some(1.01 * rate + 0.02 + noise), ..Window::default() });
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
