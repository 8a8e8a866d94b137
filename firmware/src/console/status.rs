//! Status registers of IEEE 488.2 and SCPI: events, kept until they are read, and conditions.
//!
//! Standard events by bit: 0 operation complete, 2 query error, 3 device error, 4 execution error, 5 command error, 7 power on. Status
//! byte: 2 error queue not empty, 3 questionable, 5 standard event, 6 summary of the enabled bits, 7 operation.

use core::cell::Cell;

/// Bits of a register of SCPI; bit 15 is always 0.
pub const REGISTER_BITS: u16 = 0x7fff;

/// A condition register with its transition filters and its event register.
#[derive(Debug)]
pub struct Group {
    condition: Cell<u16>,
    /// Bits whose rise sets their event.
    pub positive: Cell<u16>,
    /// Bits whose fall sets their event.
    pub negative: Cell<u16>,
    event: Cell<u16>,
    /// Events that are enabled for the status byte.
    pub enable: Cell<u16>,
}

/// As after `STATus:PRESet`.
impl Default for Group {
    fn default() -> Self {
        let group =
            Self { condition: Cell::new(0), positive: Cell::new(0), negative: Cell::new(0), event: Cell::new(0), enable: Cell::new(0) };
        group.preset();
        group
    }
}

impl Group {
    /// Sets the condition bits.
    pub fn set_condition(&self, now: u16) {
        let before = self.condition.replace(now);
        let (risen, fallen) = (now & !before, before & !now);
        self.event.set(self.event.get() | risen & self.positive.get() | fallen & self.negative.get());
    }

    /// The condition bits.
    pub fn condition(&self) -> u16 {
        self.condition.get()
    }

    /// Reads and clears the event bits.
    pub fn take_event(&self) -> u16 {
        self.event.take()
    }

    /// Enables no event; each rise sets its event, no fall does.
    fn preset(&self) {
        self.positive.set(REGISTER_BITS);
        self.negative.set(0);
        self.enable.set(0);
    }

    fn summary(&self) -> bool {
        self.event.get() & self.enable.get() != 0
    }
}

/// Standard event: operation complete.
pub const OPERATION_COMPLETE: u8 = 1;
const POWER_ON: u8 = 1 << 7;

/// All registers.
#[derive(Debug)]
pub struct Status {
    event: Cell<u8>,
    event_enable: Cell<u8>,
    request_enable: Cell<u8>,
    /// Operation: bit 0 calibrating, 8 driving, 9 profile running, 10 streaming, 11 compensating.
    pub operation: Group,
    /// Questionable: bits 0 … 7 limits in force, 8 fault latched, 9 frames lost.
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
    /// Sets standard events.
    pub fn set_event(&self, bits: u8) {
        self.event.set(self.event.get() | bits);
    }

    /// Reads and clears the standard events.
    pub fn take_event(&self) -> u8 {
        self.event.take()
    }

    /// The standard events that are enabled for the status byte.
    pub fn event_enable(&self) -> u8 {
        self.event_enable.get()
    }

    /// Enables standard events for the status byte.
    pub fn set_event_enable(&self, bits: u8) {
        self.event_enable.set(bits);
    }

    /// The bits of the status byte that are enabled for its bit 6.
    pub fn request_enable(&self) -> u8 {
        self.request_enable.get()
    }

    /// Enables bits of the status byte for its bit 6; bit 6 itself cannot be enabled.
    pub fn set_request_enable(&self, bits: u8) {
        self.request_enable.set(bits & !(1 << 6));
    }

    /// `*CLS`: clears the events.
    pub fn clear(&self) {
        self.event.set(0);
        self.operation.take_event();
        self.questionable.take_event();
    }

    /// `STATus:PRESet`: presets both groups.
    pub fn preset(&self) {
        self.operation.preset();
        self.questionable.preset();
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
    fn events_are_kept_until_read_and_shown_where_enabled() {
        let status = Status::default();
        assert_eq!((status.take_event(), status.take_event()), (POWER_ON, 0));
        status.set_event(1 << 5);
        assert_eq!(status.byte(true), 1 << 2);
        status.set_event_enable(1 << 5);
        status.set_request_enable(0xff);
        assert_eq!(status.byte(false), 1 << 5 | 1 << 6);
        status.clear();
        assert_eq!(status.byte(false), 0);
    }

    #[test]
    fn a_short_condition_leaves_its_event() {
        let group = Group::default();
        group.set_condition(0b10);
        group.set_condition(0);
        assert_eq!((group.condition(), group.take_event(), group.take_event()), (0, 0b10, 0));
    }

    #[test]
    fn filters_select_the_changes_that_set_an_event() {
        let group = Group::default();
        group.positive.set(0b01);
        group.negative.set(0b10);
        group.set_condition(0b11);
        assert_eq!(group.take_event(), 0b01);
        group.set_condition(0);
        assert_eq!(group.take_event(), 0b10);
        group.preset();
        group.set_condition(0b11);
        group.set_condition(0);
        assert_eq!(group.take_event(), 0b11);
    }
}
