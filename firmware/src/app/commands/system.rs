//! `SYSTem` and `HOST`: errors, version, time, the serial line, supervision of the host.

use super::{Action, Done, Entry, List, entry};
use crate::app::state::State;
use crate::console::errors::ErrorEntry;
use crate::console::parse::Range;
use crate::console::quantity::Quantity;
use core::fmt::Write;

pub(super) const ENTRIES: &[Entry] = &[
    entry("SYSTem:ERRor", Action::TextQuery("number,text", next_error), "take the oldest error; 0 if there is none"),
    entry("SYSTem:ERRor:NEXT", Action::TextQuery("number,text", next_error), "as SYSTem:ERRor?"),
    entry("SYSTem:ERRor:COUNt", Action::NumberQuery("", |state| Ok(state.status.error_count() as f64)), "number of errors in the queue"),
    entry("SYSTem:ERRor:ALL", Action::ListQuery(List::Errors), "take all errors"),
    entry("SYSTem:VERSion", Action::TextQuery("year", |_, out| Ok(out.write_str("1999.0")?)), "version of SCPI"),
    entry("SYSTem:UPTime", Action::NumberQuery("S", |state| Ok(state.measured.row.get().at.seconds())), "time since power-on"),
    entry(
        "SYSTem:RESet:CAUSe",
        Action::TextQuery("cause", |state, out| Ok(out.write_str(state.identity.reset_cause.name())?)),
        "why the controller has started: power-on, watchdog, ...",
    ),
    entry("SYSTem:LINE:RATE", Action::NumberQuery("BAUD", |state| Ok(f64::from(state.identity.baud))), "rate of the serial line"),
    entry("SYSTem:LINE:LOST", Action::NumberQuery("", |state| Ok(f64::from(state.out.lost()))), "frames lost since STReam ON"),
    entry(
        "HOST:ARM",
        Action::Number {
            range: const { &Range::new(Quantity::TIME, 0.0, 3600.0, 2.0) },
            read: |state| state.supervision.host_timeout_s.get().unwrap_or(0.0),
            write: |state, seconds| {
                state.supervision.host_timeout_s.set((seconds > 0.0).then_some(seconds));
                state.supervision.settings_changed.set(true);
                Ok(())
            },
        },
        "switch the drive off if no line comes for this time; 0: never",
    ),
];

fn next_error(state: &State<'_>, out: &mut dyn Write) -> Done {
    Ok(write!(out, "{}", state.status.next_error())?)
}

/// A line of the error queue; takes the error.
pub(super) fn error_line(state: &State<'_>, out: &mut dyn Write) -> Result<bool, ErrorEntry> {
    if state.status.error_count() == 0 {
        return Ok(false);
    }
    next_error(state, out)?;
    Ok(true)
}
