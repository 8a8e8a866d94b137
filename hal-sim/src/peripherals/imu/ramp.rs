//! Quantities that are known at the ends of the ticks, as a straight line over each tick.

/// A quantity at the last two ends.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ends {
    last: f64,
    before: f64,
}

/// A straight line over a tick.
pub(super) struct Ramp {
    pub begin: f64,
    pub end: f64,
}

impl Ends {
    /// The tick that ends with `now`: the slope between the ends, with the mean of the parabola through three of them (Adams-Moulton). The
    /// ends alone would attenuate a motion of 100 Hz by a few parts in ten thousand.
    pub(super) fn to(&mut self, now: f64) -> Ramp {
        let above = (now - 2.0 * self.last + self.before) / 12.0;
        let ramp = Ramp { begin: self.last - above, end: now - above };
        *self = Self { last: now, before: self.last };
        ramp
    }

    /// The value at the previous end.
    pub(super) fn last(&self) -> f64 {
        self.last
    }
}
