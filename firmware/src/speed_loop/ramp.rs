//! The rate command as an integrated position, in integers: the mean rate is as good as the crystal.
//!
//! In: a target rate for the next tick. Out: position and rate command now, both fixed point (2⁻³² counts, 2⁻³² counts
//! per tick). The rate follows its target under the acceleration limit and is then averaged over the last [`SMOOTHED`] ticks, so that
//! acceleration, and with it the voltage, never jumps: a voltage that jumps within a millisecond would leave the winding's current where
//! a log of millisecond means cannot follow it. The position is the smoothed rate's exact trapezoid.
//! When the measured position falls behind by more than the slip, the ramp is pulled along and says so.

/// Ticks over which the rate command is averaged: 25.6 ms, within which the acceleration rises to its limit.
pub const SMOOTHED: usize = 1 << SMOOTHED_SHIFT;
const SMOOTHED_SHIFT: u32 = 8;

/// Where the ramp is at the present tick.
#[derive(Clone, Copy, Debug)]
pub struct Ramp {
    /// Position command, 2⁻³² counts.
    pub position: i64,
    /// Rate command, smoothed, 2⁻³² counts per tick.
    pub rate: i64,
    /// Rate before it is smoothed.
    straight: i64,
    past: [i64; SMOOTHED],
    oldest: usize,
    sum: i64,
}

impl Default for Ramp {
    fn default() -> Self {
        Self { position: 0, rate: 0, straight: 0, past: [0; SMOOTHED], oldest: 0, sum: 0 }
    }
}

impl Ramp {
    /// Starts at where the stand is, with the rate that it has.
    pub fn anchor(position_counts: i64, rate_counts_tick: f32) -> Self {
        let rate = (rate_counts_tick * 4_294_967_296.0) as i64;
        Self {
            position: position_counts << 32,
            rate,
            straight: rate,
            past: [rate; SMOOTHED],
            oldest: 0,
            sum: rate.wrapping_mul(SMOOTHED as i64),
        }
    }

    /// The ramp's step to the next tick: its new rate, and whether the acceleration limit held it back.
    #[inline]
    pub fn advance(&mut self, target: i64, acceleration: i64) -> bool {
        let wanted = target.saturating_sub(self.straight);
        let step = within(wanted, acceleration);
        self.straight = self.straight.saturating_add(step);
        if let Some(oldest) = self.past.get_mut(self.oldest & (SMOOTHED - 1)) {
            self.sum = self.sum.wrapping_sub(*oldest).wrapping_add(self.straight);
            *oldest = self.straight;
        }
        self.oldest = self.oldest.wrapping_add(1);
        let before = self.rate;
        self.rate = self.sum >> SMOOTHED_SHIFT;
        self.position = self.position.wrapping_add(before.saturating_add((self.rate.saturating_sub(before)) >> 1));
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
