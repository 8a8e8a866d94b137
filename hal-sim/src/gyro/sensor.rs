//! The angle sensor: gain, noise, resolution, range.

use crate::peripherals::Noise;

/// Parameters.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AngleSensor {
    /// K_k, V/rad.
    pub gain_V_rad: f64,
    /// U0: output voltage at zero angle, V.
    pub offset_V: f64,
    /// Noise of one sample, rad rms.
    pub noise_rad: f64,
    /// Resolution, rad; 0: unlimited, apart from the converter.
    pub step_rad: f64,
    /// Range on either side, V.
    pub range_V: f64,
}

impl Default for AngleSensor {
    fn default() -> Self {
        Self { gain_V_rad: 150.0, offset_V: 0.02, noise_rad: 0.5 * super::ARCSEC, step_rad: 0.0, range_V: 1.65 }
    }
}

impl AngleSensor {
    /// No noise, unlimited resolution and range.
    pub fn ideal() -> Self {
        Self { noise_rad: 0.0, range_V: f64::INFINITY, ..Self::default() }
    }

    /// Angle reading, rad; `noise` is a stream of unit deviates.
    pub fn reading_rad(&self, theta_rad: f64, noise: &mut Noise) -> f64 {
        let noisy = if self.noise_rad > 0.0 { theta_rad + self.noise_rad * noise.draw() } else { theta_rad };
        if self.step_rad > 0.0 { (noisy / self.step_rad).round() * self.step_rad } else { noisy }
    }

    /// Output, V.
    pub fn output_V(&self, theta_rad: f64, noise: &mut Noise) -> f64 {
        (self.offset_V + self.gain_V_rad * self.reading_rad(theta_rad, noise)).clamp(-self.range_V, self.range_V)
    }
}
