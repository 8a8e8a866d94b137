//! `CALibration:COGGing`: the stand measures its own cogging and friction.

use super::{Act, Entry, entry};
use crate::app::state::{Running, State, no_fault};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::text::Writer;
use crate::words::words;

pub(super) const ENTRIES: &[Entry] = &[
    entry!("CALibration:COGGing:STARt", Act::Do(start), "turn, measure and compensate; *OPC? waits for its end; SETTings:SAVE keeps it"),
    entry!("CALibration:COGGing:ABORt", Act::Do(|state| (state.calibration.abort(), Ok(())).1), "end it; the compensation stays as it was"),
    entry!(
        "CALibration:COGGing:PROGress",
        Act::Ask("PCT", |state| Ok(crate::maths::round(f64::from(state.calibration.percent()) * 10.0) * 0.1)),
        "how far it is",
    ),
    entry!("CALibration:COGGing", Act::Say(words!("RUNNING, DONE and what was found, or FAILED and why"), result), "how it ended"),
];

fn start(state: &State<'_>) -> Result<(), ErrorEntry> {
    no_fault(state)?;
    if state.is_busy() {
        return Err(ErrorEntry::saying(Code::SETTINGS_CONFLICT, words!("something runs: wait for its end, or STOP")));
    }
    state.calibration.restart();
    state.calibrated.set(None);
    state.running.set(Running::Calibration);
    state.calibrating.set(true);
    state.calibrate.set(true);
    Ok(())
}

fn result(state: &State<'_>, out: &mut Writer<'_>) -> Result<(), ErrorEntry> {
    match state.calibrated.get() {
        None if state.calibrating.get() => drop(out.text("RUNNING")),
        None => drop(out.text("NONE")),
        Some(Err(why)) => {
            out.text("FAILED,");
            crate::app::calibrate::say(&why, out);
        }
        Some(Ok(found)) => {
            let compensation = found.compensation;
            out.text("DONE,coulomb ")
                .number(compensation.coulomb_N_m, 4)
                .text(" N.M,viscous ")
                .number(compensation.viscous_N_m_s, 4)
                .text(" N.M.S");
            for harmonic in found.harmonics.iter().flatten() {
                let h = harmonic.harmonic;
                out.text(",order ").whole(u64::from(h.order), 1).byte(b' ').number(h.torque_N_m, 4).text(" N.M");
            }
        }
    }
    Ok(())
}
