//! The rate that is regulated: a tracking filter of third order with three equal poles.
//!
//! In: how far the platform went in each tick, to parts of a count ([`super::edges`]). Out: rate in counts per tick and acceleration in
//! counts per tick². Its delay is the same at all rates, which a rate taken over edges cannot promise: at 1 °/s they are 18 ms apart,
//! and the loop's poles lie at 40 rad/s. No lag at constant rate or acceleration. The
//! filter runs on the *difference* between measured and estimated position, so single precision is enough for ever.
//! Source of the gains: the critically damped g-h-k filter, E. Brookner, Tracking and Kalman Filtering Made Easy, §1.4.

/// The estimate's state, in counts and ticks.
#[derive(Clone, Copy, Debug, Default)]
pub struct RateEstimate {
    /// Measured minus estimated position, counts.
    behind: f32,
    /// Rate, counts per tick.
    pub rate: f32,
    /// Acceleration, counts per tick².
    pub acceleration: f32,
}

impl RateEstimate {
    /// One tick further; it went `step` counts.
    #[inline]
    pub fn update(&mut self, gains: &[f32; 3], step: f32) {
        let [position, rate, acceleration] = *gains;
        let innovation = self.behind + step - (self.rate + 0.5 * self.acceleration);
        self.behind = innovation - position * innovation;
        self.rate += self.acceleration + rate * innovation;
        self.acceleration += acceleration * innovation;
    }
}
