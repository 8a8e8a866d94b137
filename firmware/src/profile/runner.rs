//! Passes a profile to the speed loop, one millisecond ahead.
//!
//! At t_k it posts the segment of [t_{k+1}, t_{k+2}). In voltage mode a value is held for its millisecond; in rate mode the command is
//! linear between the values.

use super::Profile;
use crate::board::{CONTROL_PER_ROW, Clock, Hardware, TICKS_PER_CONTROL, TICKS_PER_ROW, Ticks};
use crate::mailbox::Mailbox;
use crate::speed_loop::{Command, Mode, Segment, Zero};
use crate::status::Fault;

/// Passes a profile to the speed loop.
pub struct ProfileRunner<'a> {
    profile: Profile,
    mode: Mode,
    hardware: Hardware,
    commands: &'a Mailbox<Command>,
    clear: u16,
}

impl<'a> ProfileRunner<'a> {
    /// A runner in this mode of the drive.
    pub fn new(profile: Profile, mode: Mode, hardware: Hardware, commands: &'a Mailbox<Command>) -> Self {
        Self { profile, mode, hardware, commands, clear: 0 }
    }

    /// Sets the profile and mode of the next run.
    pub fn set(&mut self, profile: Profile, mode: Mode) {
        self.profile = profile;
        self.mode = mode;
    }

    /// Switches the drive off now.
    pub fn stop<C: Clock>(&mut self, clock: &C) {
        let tick = clock.now().0.checked_div(TICKS_PER_CONTROL).unwrap_or(0);
        self.commands.post(Command { segment: Segment::off(tick), clear: self.clear, trip: Fault::None });
    }

    /// Clears a latched fault with the next segment.
    pub fn clear_faults(&mut self) {
        self.clear = self.clear.wrapping_add(1);
    }

    /// Runs for `rows` milliseconds from `start` on, a whole millisecond at least one millisecond ahead; then switches the drive off.
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
                // Angles from power-on: the index may not have been seen.
                Mode::Position => Segment::position(&self.hardware, tick, Zero::PowerOn, value, None),
            };
            self.commands.post(Command { segment, clear: self.clear, trip: Fault::None });
            value = following;
            tick = tick.saturating_add(CONTROL_PER_ROW);
            at = at + TICKS_PER_ROW;
        }
        clock.until(at).await;
        self.commands.post(Command { segment: Segment::off(tick), clear: self.clear, trip: Fault::None });
    }
}
