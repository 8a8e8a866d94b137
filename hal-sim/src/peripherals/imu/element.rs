//! Errors of the gyroscope element, before the filter of the chip: the quantities of a calibration.

use super::ramp::{Ends, Ramp};
use serde::{Deserialize, Serialize};
use stand_firmware::board::CONTROL_HZ;
use stand_firmware::config::{ConfigError, within};
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Reference temperature of scale and bias, °C.
const REFERENCE_C: f64 = 25.0;

/// Deviations from an ideal gyroscope. The default is none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GyroElement {
    /// Quadratic term: reading = … + c₂ ω².
    pub quadratic_s: f64,
    /// Cubic term: reading = … + c₃ ω³.
    pub cubic_s2: f64,
    /// Dead band: rates within ± this read 0, larger ones are reduced by it, rad/s.
    pub dead_band_rad_s: f64,
    /// Rate reading per specific force along the sensor's x, rad/s per m/s².
    pub g_sensitivity_s_m: f64,
    /// Rate reading per rate about the sensor's y.
    pub cross_axis: f64,
    /// Change of the bias per kelvin above 25 °C, rad/s/K.
    pub bias_rad_s_per_K: f64,
    /// Change of the scale per kelvin above 25 °C, 1/K.
    pub scale_per_K: f64,
    /// Natural frequency of the element, Hz; infinite: no lag.
    pub natural_Hz: f64,
    /// Its damping ratio.
    pub damping: f64,
    /// Transport delay before the filter of the chip, s; rounded down to whole ticks.
    pub delay_s: f64,
}

impl Default for GyroElement {
    fn default() -> Self {
        Self {
            quadratic_s: 0.0,
            cubic_s2: 0.0,
            dead_band_rad_s: 0.0,
            g_sensitivity_s_m: 0.0,
            cross_axis: 0.0,
            bias_rad_s_per_K: 0.0,
            scale_per_K: 0.0,
            natural_Hz: f64::INFINITY,
            damping: 0.7,
            delay_s: 0.0,
        }
    }
}

impl GyroElement {
    /// Checks the values of a file.
    ///
    /// # Errors
    /// The name of the first invalid parameter.
    pub fn check(&self) -> Result<(), ConfigError> {
        within("imu.gyro.quadratic_s", self.quadratic_s, -1.0, 1.0)?;
        within("imu.gyro.cubic_s2", self.cubic_s2, -1.0, 1.0)?;
        within("imu.gyro.dead_band_rad_s", self.dead_band_rad_s, 0.0, 10.0)?;
        within("imu.gyro.g_sensitivity_s_m", self.g_sensitivity_s_m, -1.0, 1.0)?;
        within("imu.gyro.cross_axis", self.cross_axis, -1.0, 1.0)?;
        within("imu.gyro.bias_rad_s_per_K", self.bias_rad_s_per_K, -1.0, 1.0)?;
        within("imu.gyro.scale_per_K", self.scale_per_K, -0.1, 0.1)?;
        within("imu.gyro.damping", self.damping, 0.05, 10.0)?;
        within("imu.gyro.delay_s", self.delay_s, 0.0, 0.1)?;
        if self.natural_Hz != f64::INFINITY {
            within("imu.gyro.natural_Hz", self.natural_Hz, 1.0, 2000.0)?;
        }
        Ok(())
    }
}

/// State of the element.
#[derive(Clone, Debug)]
pub(super) struct Element {
    setup: GyroElement,
    /// Second order, by the exact step for a linear input: two states.
    step: Option<[[f64; 2]; 2]>,
    state: [f64; 2],
    input: Ends,
    late: VecDeque<f64>,
    late_ticks: usize,
}

impl Element {
    pub(super) fn new(setup: GyroElement) -> Self {
        let dt_s = 1.0 / CONTROL_HZ as f64;
        let step = setup.natural_Hz.is_finite().then(|| exact_step(TAU * setup.natural_Hz, setup.damping, dt_s));
        Self {
            setup,
            step,
            state: [0.0; 2],
            input: Ends::default(),
            late: VecDeque::new(),
            late_ticks: (setup.delay_s / dt_s).round() as usize,
        }
    }

    /// Reading one tick later, from the rates about its own axis and its y, the force along its x, and the temperature.
    pub(super) fn reading(&mut self, rate_rad_s: f64, across_rad_s: f64, force_m_s2: f64, temp_C: f64) -> f64 {
        let s = &self.setup;
        let beyond = (rate_rad_s.abs() - s.dead_band_rad_s).max(0.0).copysign(rate_rad_s);
        let warm_K = temp_C - REFERENCE_C;
        let readings = beyond * (1.0 + s.scale_per_K * warm_K + beyond * (s.quadratic_s + beyond * s.cubic_s2))
            + s.cross_axis * across_rad_s
            + s.g_sensitivity_s_m * force_m_s2
            + s.bias_rad_s_per_K * warm_K;
        let followed = match &self.step {
            None => readings,
            Some([to_value, to_slope]) => {
                // Steady-state response to a ramp: the ramp with a delay of 2ζ/ω.
                let Ramp { begin, end } = self.input.to(readings);
                let steep = (end - begin) * CONTROL_HZ as f64;
                let late = steep * 2.0 * s.damping / (TAU * s.natural_Hz);
                let [off, slope] = [self.state[0] - (begin - late), self.state[1] - steep];
                self.state = [end - late + to_value[0] * off + to_value[1] * slope, steep + to_slope[0] * off + to_slope[1] * slope];
                self.state[0]
            }
        };
        if self.late_ticks == 0 {
            return followed;
        }
        self.late.push_back(followed);
        if self.late.len() > self.late_ticks {
            self.late.pop_front().unwrap_or(followed)
        } else {
            self.late.front().copied().unwrap_or(followed)
        }
    }
}

/// exp(A h) of x″ + 2ζω x′ + ω² x = 0.
fn exact_step(omega: f64, zeta: f64, h: f64) -> [[f64; 2]; 2] {
    let decay = libm::exp(-zeta * omega * h);
    let beyond = zeta * zeta - 1.0;
    // cos, and sin over its frequency; hyperbolic above critical damping.
    let (c, s) = if beyond < -1e-9 {
        let own = omega * (-beyond).sqrt();
        (libm::cos(own * h), libm::sin(own * h) / own)
    } else if beyond > 1e-9 {
        let own = omega * beyond.sqrt();
        (libm::cosh(own * h), libm::sinh(own * h) / own)
    } else {
        (1.0, h)
    };
    let d = zeta * omega;
    [[decay * (c + d * s), decay * s], [-decay * omega * omega * s, decay * (c - d * s)]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Second order, 80 Hz, ζ 0.7: at 20 Hz 0.999297616, −20.472280°.
    #[test]
    fn the_element_is_of_second_order() {
        for (frequency_Hz, gain, phase_deg) in
            [(10.0, 1.000190484, -10.080598), (20.0, 0.999297616, -20.472280), (50.0, 0.937835904, -55.145544)]
        {
            let mut element = Element::new(GyroElement { natural_Hz: 80.0, damping: 0.7, ..GyroElement::default() });
            let (mut re, mut im) = (0.0, 0.0);
            let h = 1.0 / CONTROL_HZ as f64;
            let n = CONTROL_HZ as usize;
            for k in 0..3 * n {
                let to = TAU * frequency_Hz * (k + 1) as f64 * h;
                let readings = element.reading(to.sin(), 0.0, 0.0, 25.0);
                if k >= 2 * n {
                    re += 2.0 / n as f64 * readings * to.sin();
                    im += 2.0 / n as f64 * readings * to.cos();
                }
            }
            let (found, found_deg) = (re.hypot(im), im.atan2(re).to_degrees());
            assert!((found / gain - 1.0).abs() < 1e-6 && (found_deg - phase_deg).abs() < 1e-3, "{frequency_Hz}: {found} {found_deg}");
        }
    }

    #[test]
    fn each_error_follows_its_equation() {
        let reading = |setup, [rate, across, force, temp]: [f64; 4]| Element::new(setup).reading(rate, across, force, temp);
        let is = |setup, at, value: f64| assert!((reading(setup, at) - value).abs() < 1e-15);
        let none = GyroElement::default();
        is(none, [3.0, 1.0, 9.8, 60.0], 3.0);
        is(GyroElement { quadratic_s: 1e-3, ..none }, [-2.0, 0.0, 0.0, 25.0], -2.0 + 4e-3);
        is(GyroElement { cubic_s2: 1e-3, ..none }, [-2.0, 0.0, 0.0, 25.0], -2.008);
        is(GyroElement { dead_band_rad_s: 0.1, ..none }, [-0.3, 0.0, 0.0, 25.0], -0.3 + 0.1);
        is(GyroElement { dead_band_rad_s: 0.1, ..none }, [0.05, 0.0, 0.0, 25.0], 0.0);
        is(GyroElement { g_sensitivity_s_m: 1e-3, ..none }, [0.0, 0.0, 5.0, 25.0], 5e-3);
        is(GyroElement { cross_axis: 0.02, ..none }, [0.0, 5.0, 0.0, 25.0], 0.1);
        is(GyroElement { bias_rad_s_per_K: 1e-3, scale_per_K: 1e-2, ..none }, [2.0, 0.0, 0.0, 35.0], 2.2 + 1e-2);
        let mut late = Element::new(GyroElement { delay_s: 2e-4, ..none });
        let readings: Vec<f64> = (0..5).map(|k| late.reading(f64::from(k), 0.0, 0.0, 25.0)).collect();
        assert_eq!(readings[2..], [0.0, 1.0, 2.0]);
    }
}
