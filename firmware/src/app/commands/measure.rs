//! `MEASure`: the newest row, with units.

use super::{Act, Entry, entry, with_unit};
use crate::app::state::State;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::text::Writer;

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "MEASure:RATE",
        Act::Ask("RAD/S", |state| state.rate_rad_s.get().ok_or_else(|| missing(b"no rows yet"))),
        "rate by the encoder, mean over 32 ms",
    ),
    entry("MEASure:ANGLe", Act::Ask("RAD", |state| Ok(state.row.get().theta_rad)), "angle by the encoder, unwrapped"),
    entry(
        "MEASure:CURRent",
        Act::Ask("A", |state| state.row.get().i_A.ok_or_else(|| missing(b"no conversion of the current"))),
        "motor current, mean over 1 ms",
    ),
    entry(
        "MEASure:SUPPly",
        Act::Ask("V", |state| state.row.get().supply_V.ok_or_else(|| missing(b"no reading of the supply"))),
        "the bridge's supply",
    ),
    entry("MEASure:VOLTage", Act::Ask("V", |state| Ok(state.row.get().u_V)), "voltage that was asked for, mean over 1 ms"),
    entry(
        "MEASure:TEMPerature",
        Act::Ask("CEL", |state| state.row.get().temp_C.ok_or_else(|| missing(b"no reading of the temperature"))),
        "the winding",
    ),
    entry("MEASure:TIMing", Act::Say("rows, least and greatest S, age S", timing), "how evenly the rows come"),
];

fn missing(what: &[u8]) -> ErrorEntry {
    ErrorEntry::about(Code::DATA_STALE, what)
}

fn timing(state: &State<'_>, out: &mut Writer<'_>) -> Result<(), ErrorEntry> {
    let (row, pace) = (state.row.get(), state.pace.get());
    out.whole(u64::from(row.sequence) + 1, 1).text(",");
    if pace.greatest == 0 {
        return Err(missing(b"no rows yet"));
    }
    with_unit(out, pace.least as f64 * 1e-7, "S,");
    with_unit(out, pace.greatest as f64 * 1e-7, "S,");
    with_unit(out, row.age as f64 * 1e-7, "S");
    Ok(())
}
