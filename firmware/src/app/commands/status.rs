//! `STATus`: SCPI's two groups of conditions and events.

use super::{Action, Entry, entry};
use crate::console::parse::Range;
use crate::console::quantity::Quantity;

const WORD: &Range = &Range::new(Quantity::PLAIN, 0.0, 65_535.0, 0.0);

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "STATus:OPERation:CONDition",
        Action::NumberQuery("", |state| Ok(f64::from(state.status.registers.operation.condition()))),
        "1 calibrating, 256 driving, 512 profile, 1024 streaming, 2048 compensating",
    ),
    entry(
        "STATus:OPERation:EVENt",
        Action::NumberQuery("", |state| Ok(f64::from(state.status.registers.operation.take_event()))),
        "read and clear the events of that group",
    ),
    entry(
        "STATus:OPERation",
        Action::NumberQuery("", |state| Ok(f64::from(state.status.registers.operation.take_event()))),
        "as STATus:OPERation:EVENt?",
    ),
    entry(
        "STATus:OPERation:ENABle",
        Action::Number {
            range: WORD,
            read: |state| f64::from(state.status.registers.operation.enable()),
            write: |state, bits| (state.status.registers.operation.set_enable(bits as u16), Ok(())).1,
        },
        "events that set bit 7 of the status byte",
    ),
    entry(
        "STATus:QUEStionable:CONDition",
        Action::NumberQuery("", |state| Ok(f64::from(state.status.registers.questionable.condition()))),
        "1 to 128 limits in force, 256 fault, 512 frames lost",
    ),
    entry(
        "STATus:QUEStionable:EVENt",
        Action::NumberQuery("", |state| Ok(f64::from(state.status.registers.questionable.take_event()))),
        "read and clear the events of that group",
    ),
    entry(
        "STATus:QUEStionable",
        Action::NumberQuery("", |state| Ok(f64::from(state.status.registers.questionable.take_event()))),
        "as STATus:QUEStionable:EVENt?",
    ),
    entry(
        "STATus:QUEStionable:ENABle",
        Action::Number {
            range: WORD,
            read: |state| f64::from(state.status.registers.questionable.enable()),
            write: |state, bits| (state.status.registers.questionable.set_enable(bits as u16), Ok(())).1,
        },
        "events that set bit 3 of the status byte",
    ),
    entry("STATus:PRESet", Action::Event(|state| (state.status.registers.preset(), Ok(())).1), "disable the events of both groups"),
];
