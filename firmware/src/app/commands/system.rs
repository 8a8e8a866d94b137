//! `SYSTem`: errors, version, time, the line, the host's watch.

use super::{Act, Entry, List, entry};
use crate::app::state::State;
use crate::console::parse::Range;
use crate::console::quantity::Quantity;
use crate::console::text::Writer;
use crate::words::words;

pub(super) const ENTRIES: &[Entry] = &[
    entry!("SYSTem:ERRor", Act::Say(words!("number,words"), next), "oldest error, taken; 0 if there is none"),
    entry!("SYSTem:ERRor:NEXT", Act::Say(words!("number,words"), next), "the same"),
    entry!("SYSTem:ERRor:COUNt", Act::Ask("", |state| Ok(state.error_count() as f64)), "errors that nobody has asked for"),
    entry!("SYSTem:ERRor:ALL", Act::List(List::Errors), "all of them, taken"),
    entry!("SYSTem:VERSion", Act::Say(words!("year"), |_, out| (out.text("1999.0"), Ok(())).1), "the SCPI that is spoken"),
    entry!("SYSTem:UPTime", Act::Ask("S", |state| Ok(state.row.get().at.seconds())), "since power-on"),
    entry!("SYSTem:LINE:RATE", Act::Ask("BAUD", |state| Ok(f64::from(state.identity.baud))), "the serial line's rate"),
    entry!("SYSTem:LINE:LOST", Act::Ask("", |state| Ok(f64::from(state.out.lost()))), "frames that found no room since STReam ON"),
    entry!(
        "HOST:ARM",
        Act::Number {
            range: const { &Range::new(Quantity::TIME, 0.0, 3600.0, 2.0) },
            read: |state| state.host_silence_s.get().unwrap_or(0.0),
            write: |state, seconds| {
                state.host_silence_s.set((seconds > 0.0).then_some(seconds));
                state.watch_anew.set(true);
                Ok(())
            },
        },
        "switch the drive off when no line comes for this long; 0: never",
    ),
];

fn next(state: &State<'_>, out: &mut Writer<'_>) -> Result<(), crate::console::errors::ErrorEntry> {
    state.next_error().write(out);
    Ok(())
}

/// The next error, until there is none.
pub(super) fn error_line(state: &State<'_>, out: &mut Writer<'_>) -> Option<()> {
    (state.error_count() > 0).then(|| state.next_error().write(out))
}
