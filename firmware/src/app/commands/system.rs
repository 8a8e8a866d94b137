//! `SYSTem` and `HOST`: errors, version, time, the serial line, supervision of the host.

use super::{Action, Done, Entry, List, entry};
use crate::app::state::State;
use crate::board::TICKS_PER_S;
use crate::console::errors::ErrorEntry;
use crate::console::parse::Range;
use crate::console::quantity::Quantity;
use crate::supervision::HOST_TIMEOUT_S;
use core::fmt::Write;

/// Sign of life without another effect.
pub const SIGN_OF_LIFE: &str = "HOST:ALIVe";
/// Sent by a program that measures, too.
pub(super) const RELEASE: &str = "HOST:RELease";
/// Longest time without a host, s: 11 days.
const MAX_UNATTENDED_S: f64 = 1e6;

pub(super) const ENTRIES: &[Entry] = &[
    entry("SYSTem:ERRor", Action::TextQuery("number,text", next_error), "take the oldest error; 0 if there is none"),
    entry("SYSTem:ERRor:NEXT", Action::TextQuery("number,text", next_error), "as SYSTem:ERRor?"),
    entry("SYSTem:ERRor:COUNt", Action::NumberQuery("", |state| Ok(state.status.error_count() as f64)), "number of errors in the queue"),
    entry("SYSTem:ERRor:ALL", Action::ListQuery(List::Errors), "take all errors, with commas between them"),
    entry(
        "SYSTem:ERRor:CODE",
        Action::NumberQuery("", |state| Ok(f64::from(state.status.next_error().code.0))),
        "take the oldest error; its number",
    ),
    entry(
        "SYSTem:ERRor:CODE:NEXT",
        Action::NumberQuery("", |state| Ok(f64::from(state.status.next_error().code.0))),
        "as SYSTem:ERRor:CODE?",
    ),
    entry("SYSTem:ERRor:CODE:ALL", Action::TextQuery("numbers", all_codes), "take all errors; their numbers"),
    entry("SYSTem:VERSion", Action::TextQuery("year.revision", |_, out| Ok(out.write_str("1999.0")?)), "version of SCPI"),
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
            read: |state| state.supervision.host_timeout_s.get().unwrap_or(HOST_TIMEOUT_S),
            write: |state, seconds| {
                state.supervision.host_timeout_s.set((seconds > 0.0).then_some(seconds));
                state.supervision.settings_changed.set(true);
                Ok(())
            },
        },
        "switch the drive off if the program that drives is silent for this time, also while it is off; 0: after 2 s, while it is on",
    ),
    entry(
        RELEASE,
        Action::Event(|state| {
            state.supervision.checked_line_at.set(None);
            state.out.has_units.set(false);
            Ok(())
        }),
        "the program is done: lines without a check sum are accepted again, replies have no units",
    ),
    entry(SIGN_OF_LIFE, Action::Event(|_| Ok(())), "sign of life of the program that drives; queries are none"),
    entry(
        "HOST:UNATTended",
        Action::Number {
            range: const { &Range::new(Quantity::TIME, 0.0, MAX_UNATTENDED_S, 0.0) },
            read: |state| (state.supervision.unattended_until.get() - state.measured.row.get().at) as f64 / TICKS_PER_S as f64,
            write: |state, seconds| {
                let until = state.measured.row.get().at + (seconds * TICKS_PER_S as f64) as u64;
                state.supervision.unattended_until.set(until);
                Ok(())
            },
        },
        "let the drive run without a host for this time; query: the rest of it",
    ),
];

fn next_error(state: &State<'_>, out: &mut dyn Write) -> Done {
    Ok(write!(out, "{}", state.status.next_error())?)
}

/// Takes all errors and writes their numbers; 0 if there is none.
fn all_codes(state: &State<'_>, out: &mut dyn Write) -> Done {
    write!(out, "{}", state.status.next_error().code.0)?;
    while state.status.error_count() > 0 {
        write!(out, ",{}", state.status.next_error().code.0)?;
    }
    Ok(())
}

/// An error of the queue, which is taken; 0 as the only line of an empty queue.
pub(super) fn error_line(state: &State<'_>, line: usize, out: &mut dyn Write) -> Result<bool, ErrorEntry> {
    if line > 0 && state.status.error_count() == 0 {
        return Ok(false);
    }
    next_error(state, out)?;
    Ok(true)
}
