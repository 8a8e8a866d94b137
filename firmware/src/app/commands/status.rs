//! `STATus`: SCPI's two groups of conditions and events.

use super::{Act, Entry, entry};
use crate::console::parse::Range;
use crate::console::quantity::Quantity;
use crate::words::words;

const WORD: &Range = &Range::new(Quantity::PLAIN, 0.0, 65_535.0, 0.0);

pub(super) const ENTRIES: &[Entry] = &[
    entry!(
        "STATus:OPERation:CONDition",
        Act::Ask("", |state| Ok(f64::from(state.status.operation.condition()))),
        "1 calibrates, 256 drives, 512 a profile, 1024 streams, 2048 compensates",
    ),
    entry!("STATus:OPERation:EVENt", Act::Ask("", |state| Ok(f64::from(state.status.operation.take_event()))), "what has become so, taken"),
    entry!("STATus:OPERation", Act::Ask("", |state| Ok(f64::from(state.status.operation.take_event()))), "the same"),
    entry!(
        "STATus:OPERation:ENABle",
        Act::Number {
            range: WORD,
            read: |state| f64::from(state.status.operation.enable()),
            write: |state, bits| (state.status.operation.set_enable(bits as u16), Ok(())).1,
        },
        "events that the status byte shows",
    ),
    entry!(
        "STATus:QUEStionable:CONDition",
        Act::Ask("", |state| Ok(f64::from(state.status.questionable.condition()))),
        "1 to 128 limits in force, 256 a fault, 512 frames were lost",
    ),
    entry!(
        "STATus:QUEStionable:EVENt",
        Act::Ask("", |state| Ok(f64::from(state.status.questionable.take_event()))),
        "what has become so, taken",
    ),
    entry!("STATus:QUEStionable", Act::Ask("", |state| Ok(f64::from(state.status.questionable.take_event()))), "the same"),
    entry!(
        "STATus:QUEStionable:ENABle",
        Act::Number {
            range: WORD,
            read: |state| f64::from(state.status.questionable.enable()),
            write: |state, bits| (state.status.questionable.set_enable(bits as u16), Ok(())).1,
        },
        "events that the status byte shows",
    ),
    entry!("STATus:PRESet", Act::Do(|state| (state.status.preset(), Ok(())).1), "the status byte shows none of them"),
];
