//! Hands a profile to the speed loop, millisecond by millisecond, always one ahead.
//!
//! At t_k it posts the segment of [t_{k+1}, t_{k+2}). In voltage mode a value holds for its millisecond; in rate mode the
//! command goes straight from one value to the next.

use super::Profile;
use crate::board::{CONTROL_PER_ROW, Clock, Hardware, TICKS_PER_CONTROL, TICKS_PER_ROW, Ticks};
use crate::speed_loop::{Mode, Order, OrderWriter, Segment, Zero};
use crate::status::Fault;

/// A profile on its way to the speed loop. Made by [`ProfileRunner::new`]; run wherever the caller likes.
pub struct ProfileRunner<'a> {
    profile: Profile,
    mode: Mode,
    hardware: Hardware,
    orders: OrderWriter<'a>,
    clear: u16,
}

impl<'a> ProfileRunner<'a> {
    /// A runner that regulates as `mode` says.
    pub fn new(profile: Profile, mode: Mode, hardware: Hardware, orders: OrderWriter<'a>) -> Self {
        Self { profile, mode, hardware, orders, clear: 0 }
    }

    /// Another profile for the next run.
    pub fn set(&mut self, profile: Profile, mode: Mode) {
        self.profile = profile;
        self.mode = mode;
    }

    /// Switches off now, whatever was under way.
    pub fn stop<C: Clock>(&mut self, clock: &C) {
        let tick = clock.now().0.checked_div(TICKS_PER_CONTROL).unwrap_or(0);
        self.orders.post(&Order { segment: Segment::off(tick), clear: self.clear, trip: Fault::None });
    }

    /// The next order clears a latched fault.
    pub fn clear_faults(&mut self) {
        self.clear = self.clear.wrapping_add(1);
    }

    /// Runs for `rows` milliseconds from `start` on (a whole millisecond, at least one ahead), then switches off.
    pub async fn run<C: Clock>(&mut self, clock: &C, start: Ticks, rows: u64) {
        let ticks = CONTROL_PER_ROW as u16;
        let mut tick = start.0.checked_div(TICKS_PER_CONTROL).unwrap_or(0);
        let mut at = Ticks(start.0.saturating_sub(TICKS_PER_ROW));
        let mut value = self.profile.next_value();
        for _ in 0..rows {
            clock.until(at).await;
            let following = self.profile.next_value();
            let segment = match self.mode {
                Mode::Off => Segment::off(tick),
                Mode::Voltage => Segment::voltage(&self.hardware, tick, ticks, value),
                Mode::Rate => Segment::rate(&self.hardware, tick, ticks, value, following),
                // From the zero of power-on: the index may not have been seen.
                Mode::Position => Segment::position(&self.hardware, tick, Zero::PowerOn, value, None),
            };
            self.orders.post(&Order { segment, clear: self.clear, trip: Fault::None });
            value = following;
            tick = tick.saturating_add(CONTROL_PER_ROW);
            at = at + TICKS_PER_ROW;
        }
        clock.until(at).await;
        self.orders.post(&Order { segment: Segment::off(tick), clear: self.clear, trip: Fault::None });
    }
}
