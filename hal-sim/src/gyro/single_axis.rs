//! A single-axis stabiliser: θ′ = w + ω_d + ω_a, with the precession w of the torquer, the drift ω_d of the gyroscope and the Earth rate
//! ω_a.
//!
//! The caller closes the correction loop by the torquer current. A vibration of the base appears in the angle; the stabiliser follows with
//! a lag, which is that of the torquer here: both act alike.

use super::{AngleSensor, GyroPort, Site, Torquer};
use crate::peripherals::{Noise, SlowNoise};
use std::f64::consts::TAU;

/// Drift of the gyroscope, rad/s, and rad/s per g along its axes. Flicker noise, random walk and ramp begin with the simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OwnDrift {
    /// Independent of gravity.
    pub constant_rad_s: f64,
    /// Per g along the sensitive (input) axis.
    pub input_rad_s_g: f64,
    /// Per g along the output axis.
    pub output_rad_s_g: f64,
    /// Per g along the spin axis.
    pub spin_rad_s_g: f64,
    /// Flicker noise: bias instability B (IEEE Std 952, annex C).
    pub flicker_rad_s: f64,
    /// Random walk K, rad/s/√s.
    pub random_walk_rad_s_sqrt_s: f64,
    /// Ramp, rad/s².
    pub ramp_rad_s2: f64,
}

/// Random stream of the errors of the level.
const LEVEL_STREAM: u32 = 21;
/// Random stream of the slow noise.
const SLOW_STREAM: u32 = 20;

impl OwnDrift {
    /// Flicker noise and random walk of the gyroscope with this seed, rad/s, for the comparison of a measurement with the truth.
    pub fn slow_noise(&self, seed: u64) -> SlowNoise {
        SlowNoise::new(seed, SLOW_STREAM, self.flicker_rad_s, self.random_walk_rad_s_sqrt_s)
    }
}

/// Orientation: rotation about the vertical, elevation of the sensitive axis, roll about that axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Orientation {
    /// ψ, clockwise from above, rad.
    pub turned_rad: f64,
    /// ε, rad.
    pub raised_rad: f64,
    /// ρ: at 0 the spin axis points up, at 90° the output axis, rad.
    pub rolled_rad: f64,
}

impl Orientation {
    /// The upward direction in the gyroscope's axes: input, output, spin.
    pub fn up(&self) -> [f64; 3] {
        let (sin_raised, cos_raised) = libm::sincos(self.raised_rad);
        let (sin_rolled, cos_rolled) = libm::sincos(self.rolled_rad);
        [sin_raised, cos_raised * sin_rolled, cos_raised * cos_rolled]
    }
}

/// Oscillation of the base about the sensitive axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Vibration {
    /// Its amplitude, rad.
    pub amplitude_rad: f64,
    /// Its frequency, Hz.
    pub frequency_Hz: f64,
}

/// Parameters and state.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SingleAxis {
    /// Site.
    pub site: Site,
    /// Its drift.
    pub own: OwnDrift,
    /// The torquer.
    pub torquer: Torquer,
    /// The angle sensor.
    pub sensor: AngleSensor,
    /// Vibration of the base.
    pub vibration: Vibration,
    /// Error of the first rotation to another orientation, about the vertical, rad.
    pub turn_error_rad: f64,
    /// Standard deviation of the elevation of the sensitive axis, at the start and after each rotation to another orientation, rad: the
    /// offsets of the visits.
    pub level_error_rad: f64,
    /// Orientation.
    #[serde(rename = "place")]
    pub orientation: Orientation,
    /// Angle between gyro and base, rad.
    pub theta_rad: f64,
    #[serde(skip)]
    t_s: f64,
    #[serde(skip, default = "noise")]
    noise: Noise,
    #[serde(skip, default = "noise")]
    level_noise: Noise,
    #[serde(skip)]
    slow_noise: Option<SlowNoise>,
}

fn noise() -> Noise {
    Noise::new(0, 0, 1.0)
}

impl Default for SingleAxis {
    /// 1.5 °/h of drift at 70° north, azimuth 80°.
    fn default() -> Self {
        Self {
            site: Site::default(),
            own: OwnDrift { constant_rad_s: 1.5 * super::DEG_H, ..OwnDrift::default() },
            torquer: Torquer::default(),
            sensor: AngleSensor::default(),
            vibration: Vibration::default(),
            turn_error_rad: 0.0,
            level_error_rad: 0.0,
            orientation: Orientation::default(),
            theta_rad: 0.0,
            t_s: 0.0,
            noise: noise(),
            level_noise: noise(),
            slow_noise: None,
        }
    }
}

impl SingleAxis {
    /// The same gyroscope with this seed of its noise.
    pub fn seeded(self, seed: u64) -> Self {
        let mut seeded = Self {
            noise: Noise::new(seed, 6, 1.0),
            level_noise: Noise::new(seed, LEVEL_STREAM, 1.0),
            slow_noise: Some(self.own.slow_noise(seed)),
            ..self
        };
        seeded.orientation.raised_rad += seeded.level_error();
        seeded
    }

    /// The next error of the level, rad.
    fn level_error(&mut self) -> f64 {
        if self.level_error_rad > 0.0 { self.level_error_rad * self.level_noise.draw() } else { 0.0 }
    }

    /// ω_d in its orientation without slow noise and ramp, rad/s.
    pub fn own_rad_s(&self) -> f64 {
        let [input, output, spin] = self.orientation.up();
        let own = &self.own;
        own.constant_rad_s + own.input_rad_s_g * input + own.output_rad_s_g * output + own.spin_rad_s_g * spin
    }

    /// ω_a in its orientation on a platform at `platform_rad`: minus the component of the Earth rate along the sensitive axis, rad/s.
    pub fn apparent_rad_s(&self, platform_rad: f64) -> f64 {
        // The platform angle counts to the left seen from above, as the encoder.
        let [ahead, up, _] = self.site.rate_rad_s(self.orientation.turned_rad - platform_rad);
        let (sin, cos) = libm::sincos(self.orientation.raised_rad);
        -(ahead * cos + up * sin)
    }
}

impl GyroPort for SingleAxis {
    fn advance(&mut self, command_A: f64, platform_rad: f64, dt_s: f64) {
        let reference = self.torquer.advance(command_A, dt_s);
        let slow_rad_s = self.slow_noise.as_mut().map_or(0.0, |noise| noise.at(self.t_s)) + self.own.ramp_rad_s2 * self.t_s;
        self.theta_rad += (reference + self.own_rad_s() + slow_rad_s + self.apparent_rad_s(platform_rad)) * dt_s;
        self.t_s += dt_s;
    }

    fn sensor_V(&mut self) -> f64 {
        let vibration_rad = self.vibration.amplitude_rad * libm::sin(TAU * self.vibration.frequency_Hz * self.t_s);
        self.sensor.output_V(self.theta_rad + vibration_rad, &mut self.noise)
    }

    fn torquer_A(&self) -> f64 {
        self.torquer.mean_A()
    }

    fn set_orientation(&mut self, orientation: Orientation) {
        let raised_rad = orientation.raised_rad + self.level_error();
        self.orientation =
            Orientation { turned_rad: orientation.turned_rad + std::mem::take(&mut self.turn_error_rad), raised_rad, ..orientation };
    }

    fn limit(&mut self, limit_A: Option<f64>) {
        self.torquer.limit(limit_A);
    }
}
