//! What the tick tells the tasks, each millisecond, newest wins.
//!
//! Whatever must not be lost between two looks only grows: the sum of the duty over the ticks that have ended, and for
//! each limit the number of milliseconds in which it was in force. "Limited" is not "failed": [`Limits`] say why the output is
//! less than asked, [`Fault`] says that the drive was switched off and stays so until it is cleared.

use super::feed_forward::Compensating;
use super::segment::Mode;
use crate::mailbox::{Words, join_u64, split_u64};
use crate::status::{Fault, Limits};

/// What is so at the beginning of tick `tick`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Number of the tick.
    pub tick: u64,
    /// Sum of the compare counts over all ticks that have ended before this one began, wrapping: see [`Report::duty_since`].
    pub duty_sum: i32,
    /// Position command at this tick, 2⁻³² counts from the counter's zero, whole counts wrapping; means something in rate and position mode.
    pub position_command: i64,
    /// Rate command at this tick, 2⁻³² counts per tick; means something in rate and position mode.
    pub rate_command: i64,
    /// Rate by the encoder's edges, counts per tick; between edges no more than a count in the age.
    pub rate: f32,
    /// Steps of the edge timer since the last edge: the age of `rate`. Ends at 2³⁰.
    pub edge_age: u32,
    /// What is regulated during this tick.
    pub mode: Mode,
    /// What of the learnt compensation is at work during this tick.
    pub compensating: Compensating,
    /// The latched fault.
    pub fault: Fault,
    /// The limits that were in force at some time within the millisecond before.
    pub limits: Limits,
    /// In how many milliseconds each limit has been in force since power-on, wrapping.
    pub limited_ms: [u32; Limits::COUNT],
}

/// Words of a [`Report`].
pub const REPORT_WORDS: usize = 16;

impl Report {
    /// The limits that were in force at some time after `earlier`.
    pub fn limits_since(&self, earlier: &Report) -> Limits {
        let pairs = self.limited_ms.iter().zip(&earlier.limited_ms).enumerate();
        Limits(pairs.fold(0, |flags, (bit, (now, then))| if now == then { flags } else { flags | 1 << bit }))
    }

    /// Sum of the compare counts over the ticks from `earlier` to this one; right up to 47 s.
    pub fn duty_since(&self, earlier: &Report) -> i32 {
        self.duty_sum.wrapping_sub(earlier.duty_sum)
    }

    /// The position command in counts from the counter's zero, unwrapped: the one that is nearest to `near_counts`.
    pub fn position_command_counts(&self, near_counts: i64) -> f64 {
        let whole = (self.position_command >> 32) as i32;
        let ahead = whole.wrapping_sub(near_counts as i32);
        near_counts.wrapping_add(i64::from(ahead)) as f64 + f64::from(self.position_command as u32) / super::ONE
    }
}

/// What is so, in one word.
#[inline(always)]
pub(super) fn state_word(mode: Mode, fault: Fault, limits: Limits, compensating: Compensating) -> u32 {
    mode.code() | fault.code() << 8 | u32::from(limits.0) << 16 | u32::from(compensating.0) << 24
}

impl Words<REPORT_WORDS> for Report {
    #[inline]
    fn to_words(&self) -> [u32; REPORT_WORDS] {
        let [t0, t1] = split_u64(self.tick);
        let [p0, p1] = split_u64(self.position_command as u64);
        let [r0, r1] = split_u64(self.rate_command as u64);
        let state = state_word(self.mode, self.fault, self.limits, self.compensating);
        let [a, b, c, d, e, f] = self.limited_ms;
        [t0, t1, self.duty_sum as u32, p0, p1, r0, r1, self.rate.to_bits(), self.edge_age, state, a, b, c, d, e, f]
    }

    fn from_words(&[t0, t1, duty, p0, p1, r0, r1, rate, edge_age, state, a, b, c, d, e, f]: &[u32; REPORT_WORDS]) -> Self {
        Self {
            tick: join_u64(t0, t1),
            duty_sum: duty as i32,
            position_command: join_u64(p0, p1) as i64,
            rate_command: join_u64(r0, r1) as i64,
            rate: f32::from_bits(rate),
            edge_age,
            mode: Mode::of_code(state & 0xff),
            compensating: Compensating((state >> 24) as u8),
            fault: Fault::of_code(state >> 8 & 0xff),
            limits: Limits((state >> 16) as u8),
            limited_ms: [a, b, c, d, e, f],
        }
    }
}
