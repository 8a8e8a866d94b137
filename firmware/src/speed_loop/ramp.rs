//! The command as an integrated position, in integers: the mean rate is as good as the crystal.
//!
//! In, once in a millisecond: the rate to be reached at the end of it, which it reaches a millisecond later. That millisecond is laid out
//! ahead of its beginning, and taken over in a few instructions when it begins. Out, at each decision: position and rate command, both fixed point
//! (2⁻³² counts, 2⁻³² counts per tick; the position's whole counts wrap with the counter's). The rate follows its target under the
//! acceleration limit and is then averaged over the last [`SMOOTHED`] milliseconds, so that acceleration, and with it the voltage, rises
//! in small steps, at the beginnings of the log's rows and nowhere else. Within a millisecond the rate goes straight and the position is
//! its exact trapezoid. When the measured position is behind by more than the slip at a millisecond's beginning, the ramp is pulled along and says so.

use super::{BEAT, BEATS, SLOTS};

/// Milliseconds over which the rate command is averaged: the time in which the acceleration rises to its limit.
pub const SMOOTHED: usize = 1 << SMOOTHED_SHIFT;
const SMOOTHED_SHIFT: u32 = 5;
/// What the position gains between two decisions: twice the rate and, of the rate's gain in a tick, twice; four times that more with each.
const _: () = assert!(BEAT == 2);

/// A millisecond of the ramp, from its beginning on.
#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    /// What the position gains from this decision's tick to the next one's, 2⁻³² counts.
    advance: i64,
    /// What that gains with each decision of this millisecond.
    slope: i64,
    /// What of the answer does not depend on what is measured, compare counts, and what that gains with each decision.
    feed: f32,
    feed_step: f32,
}

impl Piece {
    /// One field after the other: all at once it is a call that copies byte by byte.
    #[inline(always)]
    fn become_like(&mut self, other: &Self) {
        self.advance = other.advance;
        self.slope = other.slope;
        self.feed = other.feed;
        self.feed_step = other.feed_step;
    }
}

/// Where the ramp is in the tick from which on the last decision acts.
#[derive(Clone, Copy, Debug)]
pub struct Ramp {
    /// Position command, 2⁻³² counts.
    pub position: i64,
    /// This millisecond, and the next.
    now: Piece,
    next: Piece,
    /// Rate at the end of the millisecond that is laid out, 2⁻³² counts per tick.
    end: i64,
    end_f32: f32,
    /// Rate before it is smoothed, and its integral.
    straight: i64,
    straight_position: i64,
    sum: i64,
    /// The rate before the ramp began, which stands for all milliseconds that are not filled yet.
    anchored: i64,
    filled: usize,
    past: [i64; SMOOTHED],
}

impl Default for Ramp {
    fn default() -> Self {
        Self {
            position: 0,
            now: Piece::default(),
            next: Piece::default(),
            end: 0,
            end_f32: 0.0,
            straight: 0,
            straight_position: 0,
            sum: 0,
            anchored: 0,
            filled: 0,
            past: [0; SMOOTHED],
        }
    }
}

impl Ramp {
    /// Starts at where the stand is, with the rate that it has and what holds that, compare counts.
    #[inline]
    pub fn anchor(&mut self, position: i64, rate_counts_tick: f32, feed: f32) {
        // Two integer halves: a 64-bit conversion is a library call on the chip.
        let rate = i64::from((rate_counts_tick * 16_777_216.0) as i32) << 8;
        // In the tick after the decision.
        self.position = position.wrapping_add(rate);
        let steady = Piece { advance: rate << 1, slope: 0, feed, feed_step: 0.0 };
        self.now.become_like(&steady);
        // Where it starts between the laying out of a millisecond and its beginning.
        self.next.become_like(&steady);
        self.end = rate;
        self.end_f32 = rate_counts_tick;
        self.straight = rate;
        self.straight_position = position;
        self.sum = rate << SMOOTHED_SHIFT;
        self.anchored = rate;
        self.filled = 0;
    }

    /// Rate command, 2⁻³² counts per tick.
    #[inline]
    pub fn rate(&self) -> i64 {
        self.now.advance.wrapping_sub(self.now.slope >> 1) >> 1
    }

    /// Its mean from this decision's tick to the next one's, 2⁻¹⁶ counts per tick.
    #[inline]
    pub fn mean_rate_16(&self) -> i32 {
        (self.now.advance >> 17) as i32
    }

    /// What of the answer does not depend on what is measured, compare counts.
    #[inline]
    pub fn feed(&self) -> f32 {
        self.now.feed
    }

    /// Rate and position to which the ramp has come before they are smoothed.
    #[inline]
    pub fn straight(&self) -> (i64, i64) {
        (self.straight, self.straight_position)
    }

    /// A decision further; where a millisecond `begins` with it, that is taken over.
    #[inline]
    pub fn step(&mut self, begins: bool) {
        self.position = self.position.wrapping_add(self.now.advance);
        if begins {
            self.now.become_like(&self.next);
        } else {
            self.now.advance = self.now.advance.wrapping_add(self.now.slope);
            self.now.feed += self.now.feed_step;
        }
    }

    /// Works out the end of the millisecond after this: towards `target` by no more than `acceleration` (per millisecond). Returns whether
    /// the limit held it back.
    #[inline]
    pub fn ahead(&mut self, target: i64, acceleration: i64) -> bool {
        let wanted = target.wrapping_sub(self.straight);
        // One comparison for both sides.
        let held_back = wanted.wrapping_add(acceleration) as u64 > (acceleration as u64) << 1;
        let step = if held_back { along(wanted, acceleration) } else { wanted };
        let before = self.straight;
        self.straight = before.wrapping_add(step);
        // Ten ticks at the mean of both ends, in 2⁻³² counts.
        let mean = before.wrapping_add(step >> 1);
        self.straight_position = self.straight_position.wrapping_add(mean.wrapping_mul(i64::from(SLOTS)));
        if let Some(oldest) = self.past.get_mut(self.filled & (SMOOTHED - 1)) {
            let leaves = if self.filled < SMOOTHED { self.anchored } else { *oldest };
            self.sum = self.sum.wrapping_sub(leaves).wrapping_add(self.straight);
            *oldest = self.straight;
        }
        // From here on round and round, and never through zero.
        self.filled = if self.filled >= 2 * SMOOTHED - 1 { SMOOTHED } else { self.filled.wrapping_add(1) };
        held_back
    }

    /// Lays out the next millisecond. Returns the rates at its ends; [`Ramp::feed_forward`] follows.
    #[inline]
    pub fn plan(&mut self) -> (f32, f32) {
        let start = self.end;
        self.end = self.sum >> SMOOTHED_SHIFT;
        let gain = tenth(self.end.wrapping_sub(start));
        self.next.slope = gain << 2;
        self.next.advance = start.wrapping_add(gain) << 1;
        let (from, to) = (self.end_f32, fixed_to_f32(self.end));
        self.end_f32 = to;
        (from, to)
    }

    /// What is fed forward in the next millisecond, from its beginning to its end, compare counts.
    #[inline]
    pub fn feed_forward(&mut self, from: f32, to: f32) {
        self.next.feed_step = (to - from) * (1.0 / BEATS as f32);
        self.next.feed = from;
    }

    /// Position command minus measured position, 2⁻¹⁶ counts.
    #[inline]
    pub fn error(&self, counts: i32) -> i32 {
        ((self.position >> 16) as i32).wrapping_sub(counts << 16)
    }

    /// Slips if the position command is `slip` whole counts or more off the measured position, and says so.
    #[inline]
    pub fn slips(&mut self, counts: i32, slip: i32) -> bool {
        let whole = ((self.position >> 32) as i32).wrapping_sub(counts);
        // One comparison for both sides.
        let slips = whole.wrapping_add(slip) as u32 >= (slip as u32) << 1;
        if slips {
            self.slip(whole, slip);
        }
        slips
    }

    /// Pulls the ramp along, to `slip` counts before or behind.
    #[cold]
    #[inline(never)]
    fn slip(&mut self, whole: i32, slip: i32) {
        let held = if whole > 0 { slip.wrapping_sub(1) } else { slip.wrapping_neg() };
        let pulled = i64::from(whole.wrapping_sub(held)) << 32;
        self.position = self.position.wrapping_sub(pulled);
        self.straight_position = self.straight_position.wrapping_sub(pulled);
    }
}

/// `limit` in the direction of `value`.
#[inline]
fn along(value: i64, limit: i64) -> i64 {
    if value < 0 { limit.wrapping_neg() } else { limit }
}

/// A tenth, to 2⁻³¹ of it, without a 64-bit division.
#[inline]
fn tenth(value: i64) -> i64 {
    // 2³² / 10, rounded.
    const TENTH: u64 = 429_496_730;
    let low = (u64::from(value as u32) * TENTH) >> 32;
    (value >> 32).wrapping_mul(TENTH as i64).wrapping_add(low as i64)
}

/// A fixed-point number as single precision, in units; ± 2³¹.
#[inline]
pub fn fixed_to_f32(value: i64) -> f32 {
    // Two integer halves: a 64-bit conversion is a library call on the chip.
    let whole = (value >> 32) as i32;
    let part = (value as u32 >> 8) as i32;
    whole as f32 + part as f32 * (1.0 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_is_a_tenth_to_a_unit_in_ten_digits() {
        for value in [0, 1, 9, 10, -1, -10, 123_456_789_012, -123_456_789_012, 1 << 46, -(1 << 46)] {
            let error = tenth(value) as f64 - value as f64 / 10.0;
            assert!(error.abs() <= 1.0 + value.unsigned_abs() as f64 * 1e-10, "{value}: {}", tenth(value));
        }
    }

    #[test]
    fn fixed_point_becomes_single_precision_without_a_64_bit_conversion() {
        for value in [0.0, 0.5, -0.5, 11.103_5, -11.103_5, 4500.0, -4500.25, 1e-6] {
            let converted = f64::from(fixed_to_f32((value * 4_294_967_296.0) as i64));
            assert!((converted - value).abs() <= 1.2e-7 * value.abs().max(0.5), "{value} {converted}");
        }
    }
}
