//! What is known at the ticks' ends, as a straight line over each tick.

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
    /// The tick to this end, where it is `now`: as steep as the ends say, with the mean of the parabola through three of them (Adams and Moulton). The ends
    /// alone would take a few parts in ten thousand of a motion of 100 Hz.
    pub(super) fn to(&mut self, now: f64) -> Ramp {
        let above = (now - 2.0 * self.last + self.before) / 12.0;
        let ramp = Ramp { begin: self.last - above, end: now - above };
        *self = Self { last: now, before: self.last };
        ramp
    }

    /// What it was at the last end.
    pub(super) fn last(&self) -> f64 {
        self.last
    }
}
