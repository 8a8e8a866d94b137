//! Rate estimate: a tracking filter of third order with three equal poles (critically damped g-h-k filter: E. Brookner, Tracking and Kalman
//! Filtering Made Easy, 1998, §1.4).
//!
//! In, each tick: the last boundary between encoder counts and the fraction of a count since then ([`super::encoder`]). Out: rate in counts
//! per tick and acceleration in counts per tick². The filter has no lag at constant rate or acceleration, and its delay is the same at all
//! rates; the rate over encoder edges lacks that property: at 1 °/s the edges are 18 ms apart, and the loop's poles lie at 80 rad/s.
//! The position is counted from the last boundary, so that single precision never runs out.

use core::f64::consts::TAU;

/// Gains per tick for position, rate and acceleration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Config {
    position: f32,
    rate: f32,
    acceleration: f32,
}

impl Config {
    /// The rate estimate is 3 dB down at `bandwidth_Hz`.
    pub fn new(bandwidth_Hz: f64, tick_Hz: f64) -> Self {
        // Triple pole at w: the rate's transfer function (3 w² s + w³)/(s + w)³ is 3 dB down at 1.65 w.
        let pole = libm::exp(-TAU * bandwidth_Hz / 1.65 / tick_Hz);
        let gap = 1.0 - pole;
        Self {
            position: (1.0 - pole * pole * pole) as f32,
            rate: (1.5 * gap * gap * (1.0 + pole)) as f32,
            acceleration: (gap * gap * gap) as f32,
        }
    }
}

/// State of the filter, in counts and ticks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Estimator {
    /// Boundary from which the position is counted.
    boundary: i32,
    /// Position, counts from the boundary.
    position: f32,
    /// Rate, counts per tick.
    pub rate: f32,
    /// Acceleration, counts per tick².
    pub acceleration: f32,
}

impl Estimator {
    /// Starts at rest at this boundary.
    pub fn start(&mut self, boundary: i32) {
        *self = Self { boundary, ..Self::default() };
    }

    /// One tick further: the platform is `fraction` of a count past `boundary`.
    #[inline]
    pub fn update(&mut self, config: &Config, boundary: i32, fraction: f32) {
        let moved = boundary.wrapping_sub(self.boundary);
        self.boundary = boundary;
        let predicted = self.position + self.rate + 0.5 * self.acceleration - moved as f32;
        let innovation = fraction - predicted;
        self.position = predicted + config.position * innovation;
        self.rate += self.acceleration + config.rate * innovation;
        self.acceleration += config.acceleration * innovation;
    }
}
