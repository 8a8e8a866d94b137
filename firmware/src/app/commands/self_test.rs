//! `TEST:DRIVe`: the self-test with motion.

use super::{Action, Entry, entry};
use crate::app::self_test;

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "TEST:DRIVe:STARt",
        Action::Event(self_test::start),
        "0.5 V for 2.5 s: encoder, direction, current, back-EMF, index; *OPC? waits for the end",
    ),
    entry(
        "TEST:DRIVe",
        Action::TextQuery("NONE, RUNNING, PASSED and rate / rate by voltage, or FAILED and the findings", |state, out| {
            Ok(state.drive_test.write(out)?)
        }),
        "result of the self-test with motion",
    ),
];
