//! Rate from encoder counts: a tracking filter of third order with three equal poles.
//!
//! In: the step of the counter in each tick. Out: rate in counts per tick and acceleration in counts per tick², smooth
//! from tick to tick (at 1 rad/s an edge comes only every third tick). No lag at constant rate or acceleration. The
//! filter runs on the *difference* between counted and estimated position, so single precision is enough for ever.
//! Source of the gains: the critically damped g-h-k filter, E. Brookner, Tracking and Kalman Filtering Made Easy, §1.4.

/// The estimate's state, in counts and ticks.
#[derive(Clone, Copy, Debug, Default)]
pub struct RateEstimate {
    /// Counted minus estimated position, counts.
    behind: f32,
    /// Rate, counts per tick.
    pub rate: f32,
    /// Acceleration, counts per tick².
    pub acceleration: f32,
}

impl RateEstimate {
    /// One tick further; `step` counts have come.
    #[inline]
    pub fn update(&mut self, gains: &[f32; 3], step: f32) {
        let [position, rate, acceleration] = *gains;
        let innovation = self.behind + step - (self.rate + 0.5 * self.acceleration);
        self.behind = innovation - position * innovation;
        self.rate += self.acceleration + rate * innovation;
        self.acceleration += acceleration * innovation;
    }
}
