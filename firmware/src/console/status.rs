//! The status registers of IEEE 488.2 and SCPI: what happened (events, kept until they are asked for) and what is so (conditions).
//!
//! Standard events: 0 operation complete, 2 query, 3 device, 4 execution, 5 command error, 7 power on. Status byte: 2 errors in the queue,
//! 3 questionable, 5 standard event, 6 any of them that is enabled, 7 operation.

use core::cell::Cell;

/// A condition with its events: a bit that rises is an event.
#[derive(Debug, Default)]
pub struct Group {
    condition: Cell<u16>,
    event: Cell<u16>,
    enable: Cell<u16>,
}

impl Group {
    /// What is so now.
    pub fn set_condition(&self, now: u16) {
        let risen = now & !self.condition.replace(now);
        self.event.set(self.event.get() | risen);
    }

    /// What is so.
    pub fn condition(&self) -> u16 {
        self.condition.get()
    }

    /// What has become so since the last call.
    pub fn take_event(&self) -> u16 {
        self.event.take()
    }

    /// Which events are shown in the status byte.
    pub fn enable(&self) -> u16 {
        self.enable.get()
    }

    /// Chooses them.
    pub fn set_enable(&self, bits: u16) {
        self.enable.set(bits);
    }

    fn summary(&self) -> bool {
        self.event.get() & self.enable.get() != 0
    }
}

/// Operation is complete.
pub const OPERATION_COMPLETE: u8 = 1;
const POWER_ON: u8 = 1 << 7;

/// All registers.
#[derive(Debug)]
pub struct Status {
    event: Cell<u8>,
    event_enable: Cell<u8>,
    request_enable: Cell<u8>,
    /// What the stand does: bit 0 calibrates, 8 drives, 9 runs a profile, 10 streams, 11 compensates.
    pub operation: Group,
    /// What is doubtful: bits 0 … 7 the limits in force, 8 a fault is latched, 9 frames were lost.
    pub questionable: Group,
}

impl Default for Status {
    fn default() -> Self {
        Self {
            event: Cell::new(POWER_ON),
            event_enable: Cell::new(0),
            request_enable: Cell::new(0),
            operation: Group::default(),
            questionable: Group::default(),
        }
    }
}

impl Status {
    /// A standard event has happened.
    pub fn happened(&self, bits: u8) {
        self.event.set(self.event.get() | bits);
    }

    /// What happened since the last call.
    pub fn take_event(&self) -> u8 {
        self.event.take()
    }

    /// Which standard events are shown in the status byte.
    pub fn event_enable(&self) -> u8 {
        self.event_enable.get()
    }

    /// Chooses them.
    pub fn set_event_enable(&self, bits: u8) {
        self.event_enable.set(bits);
    }

    /// Which bits of the status byte are shown in its bit 6.
    pub fn request_enable(&self) -> u8 {
        self.request_enable.get()
    }

    /// Chooses them; bit 6 itself cannot be.
    pub fn set_request_enable(&self, bits: u8) {
        self.request_enable.set(bits & !(1 << 6));
    }

    /// `*CLS`: forgets the events.
    pub fn clear(&self) {
        self.event.set(0);
        self.operation.take_event();
        self.questionable.take_event();
    }

    /// `STATus:PRESet`: nothing of the two groups is shown.
    pub fn preset(&self) {
        self.operation.set_enable(0);
        self.questionable.set_enable(0);
    }

    /// The status byte.
    pub fn byte(&self, has_errors: bool) -> u8 {
        let standard = self.event.get() & self.event_enable.get() != 0;
        let bits = u8::from(has_errors) << 2
            | u8::from(self.questionable.summary()) << 3
            | u8::from(standard) << 5
            | u8::from(self.operation.summary()) << 7;
        bits | u8::from(bits & self.request_enable.get() != 0) << 6
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_kept_until_asked_for_and_shown_where_enabled() {
        let status = Status::default();
        assert_eq!((status.take_event(), status.take_event()), (POWER_ON, 0));
        status.happened(1 << 5);
        assert_eq!(status.byte(true), 1 << 2);
        status.set_event_enable(1 << 5);
        status.set_request_enable(0xff);
        assert_eq!(status.byte(false), 1 << 5 | 1 << 6);
        status.clear();
        assert_eq!(status.byte(false), 0);
    }

    #[test]
    fn a_condition_that_comes_and_goes_leaves_its_event() {
        let group = Group::default();
        group.set_condition(0b10);
        group.set_condition(0);
        assert_eq!((group.condition(), group.take_event(), group.take_event()), (0, 0b10, 0));
    }
}
