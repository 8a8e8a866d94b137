//! What the method must know of the gyro: gains, limits, the correction loop; and the same in the converters' units.

use crate::board::{GyroSample, Hardware, TorquerStep};
use crate::config::{ConfigError, all_within};

/// The torquer's current may be off by this share of its limit; beyond it something else limits it.
const OFF_SHARE: f32 = 0.06;

/// Gains and limits, in a person's units.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// K_k: voltage of the angle sensor per angle, V/rad.
    pub angle_gain_V_rad: f64,
    /// K_m/H: rate of precession per current of the torquer, rad/s/A.
    pub torquer_gain_rad_s_A: f64,
    /// Gain of the correction loop: rate per angle, 1/s; 0 where another loop corrects.
    pub correction_1_s: f64,
    /// Greatest current that the torquer is given, A.
    pub torquer_limit_A: f64,
    /// Greatest voltage of the angle sensor, either side, V: beyond it the sensor is saturated, or its wire is off.
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
    /// Checks all of them.
    ///
    /// # Errors
    /// The name of the first that is not a number or makes no sense.
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

/// The same in codes and steps. Single precision: the sums are exact, and what they are in rad/s is good to a part in 10⁷.
#[derive(Clone, Copy, Debug)]
pub struct Scales {
    /// Angle per code, rad.
    pub rad_per_code: f32,
    /// Reference rate per step, rad/s.
    pub rad_s_per_step: f32,
    /// Reference rate per code of the measured current, rad/s.
    pub rad_s_per_code: f32,
    /// Greatest step that the torquer is given.
    pub most_steps: f32,
    angle_zero: f32,
    angle_span: f32,
    /// Steps per code of the angle.
    correction: f32,
    current_zero: f32,
    /// Codes of the current per step.
    codes_per_step: f32,
    off_codes: f32,
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
            most_steps: (limit_A / A_per_step).min(2047.0),
            angle_zero: hardware.angle_zero_code as f32,
            angle_span: s.angle_limit_V as f32 / V_per_code,
            correction: s.correction_1_s as f32 * rad_per_code / rad_s_per_step,
            current_zero: hardware.torquer_zero_code as f32,
            codes_per_step: A_per_step / A_per_code,
            off_codes: limit_A * OFF_SHARE / A_per_code,
        }
    }

    /// What the closed correction loop gives the torquer.
    pub fn correction(&self, angle: i32) -> TorquerStep {
        let steps = (self.angle_zero - angle as f32) * self.correction;
        TorquerStep(steps.clamp(-self.most_steps, self.most_steps) as i16)
    }

    /// Whether the angle sensor shows what it cannot, or no more than its end.
    pub fn is_saturated(&self, angle: i32) -> bool {
        (angle as f32 - self.angle_zero).abs() > self.angle_span
    }

    /// Whether the current over the last millisecond is another than the torquer was given.
    pub fn is_limited(&self, sample: &GyroSample, given: TorquerStep) -> bool {
        let expected = self.current_zero + f32::from(given.0) * self.codes_per_step;
        (sample.torquer as f32 - expected * sample.conversions as f32).abs() > self.off_codes * sample.conversions as f32
    }
}
