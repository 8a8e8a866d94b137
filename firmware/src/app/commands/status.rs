//! `STATus`: SCPI's two groups of conditions, transition filters and events.

use super::{Action, Entry, entry};
use crate::console::parse::Range;
use crate::console::quantity::Quantity;
use crate::console::status::REGISTER_BITS;

/// The mask is cut to the bits of a register.
const MASK: &Range = &Range::new(Quantity::PLAIN, 0.0, 65_535.0, 0.0);

/// A mask of a group.
macro_rules! mask {
    ($header:literal, $group:ident, $mask:ident, $help:literal) => {
        entry(
            $header,
            Action::Number {
                range: MASK,
                read: |state| f64::from(state.status.registers.$group.$mask.get()),
                write: |state, bits| (state.status.registers.$group.$mask.set(bits as u16 & REGISTER_BITS), Ok(())).1,
            },
            $help,
        )
    };
}

/// A query of a group.
macro_rules! query {
    ($header:literal, $group:ident, $read:ident, $help:literal) => {
        entry($header, Action::NumberQuery("", |state| Ok(f64::from(state.status.registers.$group.$read()))), $help)
    };
}

pub(super) const ENTRIES: &[Entry] = &[
    query!(
        "STATus:OPERation:CONDition",
        operation,
        condition,
        "1 calibrating, 256 driving, 512 profile, 1024 streaming, 2048 compensating"
    ),
    query!("STATus:OPERation:EVENt", operation, take_event, "read and clear the events of that group"),
    query!("STATus:OPERation", operation, take_event, "as STATus:OPERation:EVENt?"),
    mask!("STATus:OPERation:PTRansition", operation, positive, "conditions whose rise is an event"),
    mask!("STATus:OPERation:NTRansition", operation, negative, "conditions whose fall is an event"),
    mask!("STATus:OPERation:ENABle", operation, enable, "events that set bit 7 of the status byte"),
    query!("STATus:QUEStionable:CONDition", questionable, condition, "1 to 128 limits in force, 256 fault, 512 frames lost"),
    query!("STATus:QUEStionable:EVENt", questionable, take_event, "read and clear the events of that group"),
    query!("STATus:QUEStionable", questionable, take_event, "as STATus:QUEStionable:EVENt?"),
    mask!("STATus:QUEStionable:PTRansition", questionable, positive, "conditions whose rise is an event"),
    mask!("STATus:QUEStionable:NTRansition", questionable, negative, "conditions whose fall is an event"),
    mask!("STATus:QUEStionable:ENABle", questionable, enable, "events that set bit 3 of the status byte"),
    entry(
        "STATus:PRESet",
        Action::Event(|state| (state.status.registers.preset(), Ok(())).1),
        "in both groups: no event enabled, each rise an event, no fall",
    ),
];
