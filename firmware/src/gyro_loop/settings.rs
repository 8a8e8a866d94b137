//! Settings of the gyroscope loop: gains, limits and correction loop, and the same in the converters' units.

use crate::board::{GyroSample, Hardware, TorquerStep};
use crate::config::{ConfigError, all_within};

/// Deviation of the torquer's current from its command, as a fraction of its limit, that is still accepted.
const CURRENT_TOLERANCE: f32 = 0.06;

/// Gains and limits in SI units.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// K_k: voltage of the angle sensor per angle, V/rad.
    pub angle_gain_V_rad: f64,
    /// K_m/H: rate of precession per current of the torquer, rad/s/A.
    pub torquer_gain_rad_s_A: f64,
    /// Gain of the correction loop: rate per angle, 1/s; 0 if another loop corrects.
    pub correction_1_s: f64,
    /// Current limit of the torquer, A.
    pub torquer_limit_A: f64,
    /// Valid range of the angle sensor, ± V: beyond it the sensor is saturated or its wire is broken.
    pub angle_limit_V: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            angle_gain_V_rad: 150.0,    // 1.1″ for each code of the usual converter, ± 0.63°
            torquer_gain_rad_s_A: 0.02, // 0.115 °/s at the amplifier's 0.1 A
            correction_1_s: 2.0,        // an angle of 0.25° is below 1″ after 4 s
            torquer_limit_A: 0.09,
            angle_limit_V: 1.6, // of ± 1.65
        }
    }
}

impl Settings {
    /// Checks all settings.
    ///
    /// # Errors
    /// The name of the first that is not finite or out of its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        all_within! { of self, "gyro.";
            angle_gain_V_rad: 1e-3, 1e6;
            torquer_gain_rad_s_A: 1e-9, 1e3;
            correction_1_s: 0.0, 100.0;
            torquer_limit_A: 1e-6, 1e3;
            angle_limit_V: 1e-3, 1e3;
        }
    }
}

/// Settings in codes and steps. Single precision: the sums are exact, and their conversion is accurate to 1e-7.
#[derive(Clone, Copy, Debug)]
pub struct Scales {
    /// Angle per code, rad.
    pub rad_per_code: f32,
    /// Reference rate per step, rad/s.
    pub rad_s_per_step: f32,
    /// Reference rate per code of the measured current, rad/s.
    pub rad_s_per_code: f32,
    /// Largest step of the torquer.
    pub max_steps: f32,
    angle_zero: f32,
    angle_range: f32,
    /// Steps per code of the angle.
    correction: f32,
    current_zero: f32,
    /// Codes of the current per step.
    codes_per_step: f32,
    tolerance_codes: f32,
}

impl Scales {
    /// Checked settings for this hardware.
    pub fn new(s: &Settings, hardware: &Hardware) -> Self {
        let A_per_step = hardware.torquer_A_per_step as f32;
        let A_per_code = hardware.torquer_A_per_code as f32;
        let V_per_code = hardware.angle_V_per_code as f32;
        let gain_rad_s_A = s.torquer_gain_rad_s_A as f32;
        let limit_A = s.torquer_limit_A as f32;
        let rad_per_code = V_per_code / s.angle_gain_V_rad as f32;
        let rad_s_per_step = A_per_step * gain_rad_s_A;
        Self {
            rad_per_code,
            rad_s_per_step,
            rad_s_per_code: A_per_code * gain_rad_s_A,
            max_steps: (limit_A / A_per_step).min(2047.0),
            angle_zero: hardware.angle_zero_code as f32,
            angle_range: s.angle_limit_V as f32 / V_per_code,
            correction: s.correction_1_s as f32 * rad_per_code / rad_s_per_step,
            current_zero: hardware.torquer_zero_code as f32,
            codes_per_step: A_per_step / A_per_code,
            tolerance_codes: limit_A * CURRENT_TOLERANCE / A_per_code,
        }
    }

    /// The torquer's step by the closed correction loop.
    pub fn correction(&self, angle: i32) -> TorquerStep {
        let steps = (self.angle_zero - angle as f32) * self.correction;
        TorquerStep(steps.clamp(-self.max_steps, self.max_steps) as i16)
    }

    /// Whether the angle sensor is outside of its valid range.
    pub fn is_saturated(&self, angle: i32) -> bool {
        (angle as f32 - self.angle_zero).abs() > self.angle_range
    }

    /// Whether the current over the last millisecond differs from its command.
    pub fn is_limited(&self, sample: &GyroSample, step: TorquerStep) -> bool {
        let expected = self.current_zero + f32::from(step.0) * self.codes_per_step;
        (sample.torquer as f32 - expected * sample.conversions as f32).abs() > self.tolerance_codes * sample.conversions as f32
    }
}
