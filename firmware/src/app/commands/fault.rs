//! `FAULt`: why the drive was switched off, and the way back.

use super::{Act, Entry, entry};
use crate::app::state::State;
use crate::safety::Fault;
use crate::speed_loop::Limits;

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "FAULt",
        Act::Say("number,name,advice", |state, out| {
            let fault = state.row.get().fault;
            out.whole(u64::from(fault.code()), 1).byte(b',').text(fault.name()).byte(b',').text(fault.advice());
            Ok(())
        }),
        "the latched fault; 0,none",
    ),
    entry("FAULt:CLEar", Act::Do(|state| (clear(state), Ok(())).1), "clear it, where its cause is gone; the drive stays off"),
    entry(
        "FAULt:LIMits",
        Act::Say("names", |state, out| {
            let limits = state.row.get().limits;
            let mut any = false;
            for (bit, name) in Limits::NAMES.iter().enumerate() {
                if limits.contains(Limits(1 << bit)) {
                    out.text(if any { "," } else { "" }).text(name);
                    any = true;
                }
            }
            out.text(if any { "" } else { "none" });
            Ok(())
        }),
        "why the output is less than asked, now",
    ),
];

fn clear(state: &State<'_>) {
    state.all_off();
    state.stop_line.clear_stop();
    state.trip.set(Fault::None);
    state.clear.set(state.clear.get().wrapping_add(1));
}
