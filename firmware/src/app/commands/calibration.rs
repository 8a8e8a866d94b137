//! `CALibration:COGGing`: the stand measures its own cogging and friction.

use super::{Action, Done, Entry, entry};
use crate::app::state::{Activity, CalibrationPhase, State};
use crate::console::errors::{Code, ErrorEntry};
use core::fmt::Write;

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "CALibration:COGGing:STARt",
        Action::Event(start),
        "turn, measure and compensate; *OPC? waits for the end; SETTings:SAVE keeps the result",
    ),
    entry(
        "CALibration:COGGing:ABORt",
        Action::Event(|state| (state.calibration.watch.abort(), Ok(())).1),
        "end the calibration; the compensation stays unchanged",
    ),
    entry(
        "CALibration:COGGing:PROGress",
        Action::NumberQuery("PCT", |state| Ok(libm::round(f64::from(state.calibration.watch.percent()) * 10.0) * 0.1)),
        "progress",
    ),
    entry(
        "CALibration:COGGing",
        Action::TextQuery("NONE, RUNNING, FAILED and the reason, or DONE,coulomb N.M,viscous N.M.S{,order,N.M}", result),
        "result",
    ),
];

fn start(state: &State<'_>) -> Done {
    state.require_no_fault()?;
    if state.is_busy() {
        return Err(ErrorEntry::with(Code::SETTINGS_CONFLICT, "an activity runs: wait for its end, or STOP"));
    }
    state.calibration.watch.restart();
    state.drive.activity.set(Activity::Calibration);
    state.calibration.phase.set(CalibrationPhase::Requested);
    Ok(())
}

fn result(state: &State<'_>, out: &mut dyn Write) -> Done {
    match state.calibration.phase.get() {
        CalibrationPhase::Idle => out.write_str("NONE")?,
        CalibrationPhase::Finished(Err(refused)) => write!(out, "FAILED,{refused}")?,
        CalibrationPhase::Finished(Ok(found)) => {
            let compensation = found.compensation;
            let (coulomb, viscous) =
                (state.with_unit(compensation.coulomb_N_m, "N.M"), state.with_unit(compensation.viscous_N_m_s, "N.M.S"));
            write!(out, "DONE,{coulomb},{viscous}")?;
            for harmonic in found.harmonics.iter().flatten() {
                let h = harmonic.harmonic;
                write!(out, ",{},{}", h.order, state.with_unit(h.torque_N_m, "N.M"))?;
            }
        }
        _ => out.write_str("RUNNING")?,
    }
    Ok(())
}
