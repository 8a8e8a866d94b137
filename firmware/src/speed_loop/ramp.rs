//! The rate command as an integrated position, in integers: the mean rate is as good as the crystal.
//!
//! In: a target rate for the next tick. Out: position and rate command now, both fixed point (2⁻³² counts, 2⁻³² counts
//! per tick). The rate follows its target under the acceleration limit; the position is the rate's exact trapezoid.
//! When the measured position falls behind by more than the slip, the ramp is pulled along and says so.

/// Where the ramp is at the present tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ramp {
    /// Position command, 2⁻³² counts.
    pub position: i64,
    /// Rate command, 2⁻³² counts per tick.
    pub rate: i64,
}

impl Ramp {
    /// Starts at where the stand is, with the rate that it has.
    pub fn anchor(position_counts: i64, rate_counts_tick: f32) -> Self {
        Self { position: position_counts << 32, rate: (rate_counts_tick * 4_294_967_296.0) as i64 }
    }

    /// The ramp's step to the next tick: its new rate, and whether the acceleration limit held it back.
    #[inline]
    pub fn advance(&mut self, target: i64, acceleration: i64) -> bool {
        let wanted = target.saturating_sub(self.rate);
        let step = within(wanted, acceleration);
        let mean = self.rate.saturating_add(step >> 1);
        self.position = self.position.wrapping_add(mean);
        self.rate = self.rate.saturating_add(step);
        step != wanted
    }

    /// Position command minus measured position, 2⁻³² counts; slips if that is more than `slip`, and says so.
    #[inline]
    pub fn error(&mut self, measured_counts: i64, slip: i64) -> (i64, bool) {
        let error = self.position.wrapping_sub(measured_counts << 32);
        let held = within(error, slip);
        let slipped = held != error;
        if slipped {
            self.position = (measured_counts << 32).wrapping_add(held);
        }
        (held, slipped)
    }
}

/// `value` held within ± `limit`. (`clamp` panics where its bounds are swapped, and so has no place in the tick.)
#[inline]
fn within(value: i64, limit: i64) -> i64 {
    value.min(limit).max(limit.wrapping_neg())
}
