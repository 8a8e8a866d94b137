//! What the tick tells the tasks, each tick, newest wins.
//!
//! Whatever must not be lost between two looks is a sum that only grows: duty over the ticks that have ended, and for
//! each limit the number of ticks in which it was in force. "Limited" is not "failed": [`Limits`] say why the output is
//! less than asked, [`Fault`] says that the drive was switched off and stays so until it is cleared.

use super::feed_forward::Compensating;
use super::segment::Mode;
use crate::mailbox::{Words, join_u64, split_u64};
use crate::safety::Fault;

/// Why the output is not what was asked for; a set of flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits(pub u8);

impl Limits {
    /// How many there are.
    pub const COUNT: usize = 5;
    /// The current limit holds the voltage back.
    pub const CURRENT: Self = Self(1);
    /// The bridge has no more voltage.
    pub const VOLTAGE: Self = Self(2);
    /// The rate command follows its target at the acceleration limit.
    pub const ACCELERATION: Self = Self(4);
    /// The position ramp was left behind and has been anchored anew: the mean rate is not the crystal's here.
    pub const SLIPPED: Self = Self(8);
    /// A segment came late, or none came and the last value is held.
    pub const STARVED: Self = Self(16);

    /// Their names, in the order of the bits.
    pub const NAMES: [&'static str; Self::COUNT] = ["current", "voltage", "acceleration", "slipped", "starved"];

    /// Whether all of `other` are set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    #[inline]
    pub(crate) fn set(&mut self, other: Self, when: bool) {
        if when {
            self.0 |= other.0;
        }
    }
}

/// What is so at the beginning of tick `tick`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Number of the tick.
    pub tick: u64,
    /// Sum of the compare counts over all ticks that have ended before this one began.
    pub duty_sum: i64,
    /// Position command at this tick, 2⁻³² counts from the counter's zero; means something in rate mode.
    pub position_command: i64,
    /// Rate command at this tick, 2⁻³² counts per tick; means something in rate mode.
    pub rate_command: i64,
    /// What is regulated during this tick.
    pub mode: Mode,
    /// What of the learnt compensation is at work during this tick.
    pub compensating: Compensating,
    /// The latched fault.
    pub fault: Fault,
    /// The limits in force in the output computed at this tick.
    pub limits: Limits,
    /// In how many ticks each limit has been in force since power-on, wrapping.
    pub limited_ticks: [u32; Limits::COUNT],
}

impl Report {
    /// The limits that were in force at some time after `earlier`.
    pub fn limits_since(&self, earlier: &Report) -> Limits {
        let pairs = self.limited_ticks.iter().zip(&earlier.limited_ticks).enumerate();
        Limits(pairs.fold(0, |flags, (bit, (now, then))| if now == then { flags } else { flags | 1 << bit }))
    }
}

impl Words<14> for Report {
    fn to_words(&self) -> [u32; 14] {
        let [t0, t1] = split_u64(self.tick);
        let [u0, u1] = split_u64(self.duty_sum as u64);
        let [p0, p1] = split_u64(self.position_command as u64);
        let [r0, r1] = split_u64(self.rate_command as u64);
        let state = self.mode.code() | self.fault.code() << 8 | u32::from(self.limits.0) << 16 | u32::from(self.compensating.0) << 24;
        let [a, b, c, d, e] = self.limited_ticks;
        [t0, t1, u0, u1, p0, p1, r0, r1, state, a, b, c, d, e]
    }

    fn from_words(&[t0, t1, u0, u1, p0, p1, r0, r1, state, a, b, c, d, e]: &[u32; 14]) -> Self {
        Self {
            tick: join_u64(t0, t1),
            duty_sum: join_u64(u0, u1) as i64,
            position_command: join_u64(p0, p1) as i64,
            rate_command: join_u64(r0, r1) as i64,
            mode: Mode::of_code(state & 0xff),
            compensating: Compensating((state >> 24) as u8),
            fault: Fault::of_code(state >> 8 & 0xff),
            limits: Limits((state >> 16) as u8),
            limited_ticks: [a, b, c, d, e],
        }
    }
}
