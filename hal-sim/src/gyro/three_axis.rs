//! A platform in three gimbals: exact attitude kinematics, including the coupling of the axes.
//!
//! The platform rotates relative to the base at w + ω_d − Rᵀ ω_e: its reference, its drift, and minus the Earth rate in its axes. The
//! gimbal angles are measured.

use super::attitude::{Rotation, Vector, each};
use super::{AngleSensor, GyroPort, Torquer};
use crate::peripherals::Noise;

/// Attitude and rates, rad/s.
#[derive(Clone, Copy, Debug)]
pub struct ThreeAxis {
    /// ω_d, about the platform's axes.
    pub own_rad_s: Vector,
    /// ω_e, in the base's axes.
    pub earth_rad_s: Vector,
    attitude: Rotation,
}

impl ThreeAxis {
    /// A platform at these gimbal angles, rad.
    pub fn new(own_rad_s: Vector, earth_rad_s: Vector, gimbals_rad: Vector) -> Self {
        Self { own_rad_s, earth_rad_s, attitude: Rotation::of_gimbals(gimbals_rad) }
    }

    /// Advances by `dt_s` with these reference rates about the platform axes, constant over the step; second order in the step.
    pub fn advance(&mut self, reference_rad_s: Vector, dt_s: f64) {
        let rate = |attitude: &Rotation| {
            let earth = attitude.into_platform(self.earth_rad_s);
            each(each(reference_rad_s, self.own_rad_s, |w, own| w + own), earth, |rate, earth| rate - earth)
        };
        let by = |rate: Vector, dt_s: f64| Rotation::of_vector(rate.map(|r| r * dt_s));
        let half = self.attitude.then(&by(rate(&self.attitude), 0.5 * dt_s));
        self.attitude = self.attitude.then(&by(rate(&half), dt_s));
    }

    /// The gimbals' angles about x, y, z, rad.
    pub fn gimbals_rad(&self) -> Vector {
        self.attitude.gimbals()
    }
}

/// One axis of a platform on the board; loops of their own control the other two.
#[derive(Clone, Debug)]
pub struct OneAxis {
    /// The platform.
    pub platform: ThreeAxis,
    /// Which axis: 0 to 2.
    pub axis: usize,
    /// Its torquer.
    pub torquer: Torquer,
    /// Its angle sensor.
    pub sensor: AngleSensor,
    /// Gain of the loops of the other axes, 1/s.
    pub correction_1_s: f64,
    noise: Noise,
}

impl OneAxis {
    /// An axis of a platform, with this seed of the noise.
    pub fn new(platform: ThreeAxis, axis: usize, seed: u64) -> Self {
        let (torquer, sensor) = Default::default();
        Self { platform, axis: axis.min(2), torquer, sensor, correction_1_s: 2.0, noise: Noise::new(seed, 6, 1.0) }
    }
}

impl GyroPort for OneAxis {
    fn advance(&mut self, command_A: f64, _platform_rad: f64, dt_s: f64) {
        let mut reference = self.platform.gimbals_rad().map(|angle| -self.correction_1_s * angle);
        reference[self.axis] = self.torquer.advance(command_A, dt_s);
        self.platform.advance(reference, dt_s);
    }

    fn sensor_V(&mut self) -> f64 {
        self.sensor.output_V(self.platform.gimbals_rad()[self.axis], &mut self.noise)
    }

    fn torquer_A(&self) -> f64 {
        self.torquer.mean_A()
    }

    fn limit(&mut self, limit_A: Option<f64>) {
        self.torquer.limit(limit_A);
    }
}
