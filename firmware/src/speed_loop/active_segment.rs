//! The segment under way: its mode and value, tick by tick.

use super::segment::{Mode, Segment, Zero};

/// The segment at one tick.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ActiveSegment {
    pub mode: Mode,
    pub zero: Zero,
    /// Value at this tick, as in [`Segment`].
    pub value: i64,
    slope: i64,
    ticks_left: u32,
}

impl ActiveSegment {
    /// The segment, which should have begun `late` ticks ago.
    pub fn start(segment: &Segment, late: u64) -> Self {
        let mut active = Self {
            mode: segment.mode,
            zero: segment.zero,
            value: segment.value,
            slope: segment.slope,
            ticks_left: u32::from(segment.ticks),
        };
        active.advance(u32::try_from(late).unwrap_or(u32::MAX));
        active
    }

    /// So many ticks further; at the end of the segment the value is held.
    #[inline]
    pub fn advance(&mut self, ticks: u32) {
        if self.mode != Mode::Position {
            self.value = self.value_after(ticks);
            self.ticks_left = self.ticks_left.saturating_sub(ticks);
        }
    }

    /// The value `ticks` later.
    #[inline]
    pub fn value_after(&self, ticks: u32) -> i64 {
        self.value.wrapping_add(self.slope.wrapping_mul(i64::from(ticks.min(self.ticks_left))))
    }

    /// Whether the segment ends within the next `ticks`: its successor should have come.
    #[inline]
    pub fn ends_within(&self, ticks: u32) -> bool {
        matches!(self.mode, Mode::Voltage | Mode::Rate) && self.ticks_left < ticks
    }

    /// Greatest rate of the approach to an angle, 2⁻³² counts per tick; `None`: as in the settings.
    pub fn approach_rate(&self) -> Option<i64> {
        (self.slope != 0).then_some(self.slope)
    }
}
