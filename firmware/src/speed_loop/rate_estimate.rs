//! The rate that is regulated: a tracking filter of third order with three equal poles.
//!
//! In, at each decision: the last boundary between counts and the part of a count since then ([`super::edges`]). Out: rate in counts per tick and acceleration in
//! counts per tick². Its delay is the same at all rates, which a rate taken over edges cannot promise: at 1 °/s they are 18 ms apart,
//! and the loop's poles lie at 40 rad/s. No lag at constant rate or acceleration. The filter's position counts from the boundary that the
//! platform has passed last, so single precision is enough for ever.
//! Source of the gains: the critically damped g-h-k filter, E. Brookner, Tracking and Kalman Filtering Made Easy, §1.4.

use super::BEAT;

/// The estimate's state, in counts and ticks.
#[derive(Clone, Copy, Debug, Default)]
pub struct RateEstimate {
    /// The boundary that was crossed last at the last decision, from which the position counts, and the estimated position, counts from there.
    pub boundary: i32,
    part: f32,
    /// Rate, counts per tick.
    pub rate: f32,
    /// What the rate gains from one decision to the next, counts per tick.
    gain: f32,
}

impl RateEstimate {
    /// Counts from this boundary on.
    pub fn begin(&mut self, boundary: i32) {
        self.boundary = boundary;
    }

    /// A decision further, [`BEAT`] ticks; the platform is `part` of a count past that boundary. The gains are those for position,
    /// rate, and what the rate gains.
    #[inline]
    pub fn update(&mut self, gains: &[f32; 3], boundary: i32, part: f32) {
        let [position, rate, gain] = *gains;
        let rate_now = self.rate + self.gain;
        let moved = boundary.wrapping_sub(self.boundary);
        self.boundary = boundary;
        // Two ticks at the mean of both ends.
        const { assert!(BEAT == 2) };
        let predicted = self.part + (self.rate + rate_now) - moved as f32;
        let innovation = part - predicted;
        self.part = predicted + position * innovation;
        self.rate = rate_now + rate * innovation;
        self.gain += gain * innovation;
    }
}
