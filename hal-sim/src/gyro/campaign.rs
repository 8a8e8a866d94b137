//! A complete drift measurement on a three-axis platform without firmware: gimbal angles over all cycles in two positions 180° apart.
//!
//! Only the plant is simulated, fast enough for a thousand Monte Carlo runs; the evaluation is elsewhere.

use super::attitude::{Vector, cross, each};
use super::{AngleSensor, Site, ThreeAxis};
use crate::peripherals::Noise;
use std::f64::consts::PI;

/// The axes that get pulses, and their sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// All at once, + −.
    Together,
    /// All at once, + − and then − +.
    BothPolarities,
    /// One after the other, + −.
    OneAtATime,
}

impl Pattern {
    /// Sign of the first pulse on each axis, for each cycle; 0: no pulse.
    pub fn cycles(self) -> &'static [[f64; 3]] {
        match self {
            Self::Together => &[[1.0, 1.0, 1.0]],
            Self::BothPolarities => &[[1.0, 1.0, 1.0], [-1.0, -1.0, -1.0]],
            Self::OneAtATime => &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        }
    }
}

/// The measurement and its errors.
#[derive(Clone, Copy, Debug)]
pub struct Campaign {
    /// Site and azimuth.
    pub site: Site,
    /// ω_d about the platform's axes, rad/s.
    pub own_rad_s: Vector,
    /// w: rate of a rectangular pulse, rad/s.
    pub rate_rad_s: f64,
    /// T, s.
    pub pulse_s: f64,
    /// Samples in one pulse.
    pub samples: u32,
    /// Pulse pattern.
    pub pattern: Pattern,
    /// Gimbal angles at the beginning of each cycle, rad.
    pub start_rad: Vector,
    /// The angle sensors, in rad: gain and range do not matter here.
    pub sensor: AngleSensor,
    /// Level error about x and z that rotates with the platform, rad.
    pub level_platform_rad: f64,
    /// Level error about x and z fixed to the base, rad.
    pub level_base_rad: f64,
    /// Relative excess of the second pulse.
    pub inequality: f64,
    /// Error of the 180° rotation, rad.
    pub turn_error_rad: f64,
}

impl Default for Campaign {
    /// Exact sensors, drifts of 1, −0.5 and 2 °/h.
    fn default() -> Self {
        Self {
            site: Site::default(),
            own_rad_s: [1.0, -0.5, 2.0].map(|rate| rate * super::DEG_H),
            rate_rad_s: 0.05_f64.to_radians(),
            pulse_s: 5.0,
            samples: 1000,
            pattern: Pattern::BothPolarities,
            start_rad: [0.0; 3],
            sensor: AngleSensor::ideal(),
            level_platform_rad: 0.0,
            level_base_rad: 0.0,
            inequality: 0.0,
            turn_error_rad: 0.0,
        }
    }
}

impl Campaign {
    /// Duration of a cycle, s.
    pub fn cycle_s(&self) -> f64 {
        2.0 * self.pulse_s
    }

    /// Angle readings: for each position and each cycle of the pattern 2 N + 1 samples; `noise`: unit deviates.
    pub fn run(&self, noise: &mut Noise) -> [Vec<Vec<Vector>>; 2] {
        [0.0, 1.0].map(|turn| {
            let level = self.level_platform_rad + (1.0 - 2.0 * turn) * self.level_base_rad;
            let level_earth = self.site.rate_rad_s(turn * (PI + self.turn_error_rad));
            let earth = each(level_earth, cross(level_earth, [level, 0.0, level]), |a, b| a + b);
            self.pattern.cycles().iter().map(|signs| self.cycle(signs, earth, noise)).collect()
        })
    }

    fn cycle(&self, signs: &Vector, earth_rad_s: Vector, noise: &mut Noise) -> Vec<Vector> {
        let dt_s = self.pulse_s / f64::from(self.samples);
        let mut platform = ThreeAxis::new(self.own_rad_s, earth_rad_s, self.start_rad);
        let shown = |platform: &ThreeAxis, noise: &mut Noise| platform.gimbals_rad().map(|angle| self.sensor.reading_rad(angle, noise));
        let mut angles = vec![shown(&platform, noise)];
        for n in 0..2 * self.samples {
            let rate = if n < self.samples { self.rate_rad_s } else { -self.rate_rad_s * (1.0 + self.inequality) };
            platform.advance(signs.map(|sign| sign * rate), dt_s);
            angles.push(shown(&platform, noise));
        }
        angles
    }
}
