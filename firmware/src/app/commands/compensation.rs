//! `COMPensation`: the feed-forward of friction and cogging. Friction is also among the settings; harmonics are set here only.

use super::{Action, Done, Entry, List, entry};
use crate::app::state::State;
use crate::compensation::{Compensation, Harmonic, Harmonics};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range};
use crate::console::quantity::Quantity;
use crate::speed_loop::Compensating;
use crate::text::write_list;
use core::fmt::{self, Write};

pub(super) const ENTRIES: &[Entry] = &[
    entry("COMPensation:LIST", Action::ListQuery(List::Compensation), "friction and harmonics in force"),
    entry(
        "COMPensation:HARMonic",
        Action::Command("<order>,<N.M>,<RAD>", harmonic),
        "set a harmonic: torque sin(order angle + phase); 0 N.M removes it",
    ),
    entry(
        "COMPensation:CLEar",
        Action::Event(|state| change(state, |c| *c = Compensation { winding_lag_s: c.winding_lag_s, ..Compensation::default() })),
        "compensate nothing",
    ),
    entry(
        "COMPensation:COULomb",
        Action::Number {
            range: const { &Range::new(Quantity::TORQUE, 0.0, 1e3, 0.0) },
            read: |state| state.settings.kept.get().settings.compensation.coulomb_N_m,
            write: |state, torque_N_m| change(state, |c| c.coulomb_N_m = torque_N_m),
        },
        "Coulomb friction; possible while the drive is on",
    ),
    entry(
        "COMPensation:VISCous",
        Action::Number {
            range: const { &Range::new(Quantity::only("N.M.S"), 0.0, 1e3, 0.0) },
            read: |state| state.settings.kept.get().settings.compensation.viscous_N_m_s,
            write: |state, viscous_N_m_s| change(state, |c| c.viscous_N_m_s = viscous_N_m_s),
        },
        "viscous friction; possible while the drive is on",
    ),
    entry("COMPensation:STATe", Action::TextQuery("names", active_parts), "the parts that act now"),
];

fn active_parts(state: &State<'_>, out: &mut dyn Write) -> Done {
    let active = state.measured.row.get().compensating;
    let parts = [
        (Compensating::INDEX, "index seen"),
        (Compensating::FRICTION, "friction"),
        (Compensating::HARMONICS, "harmonics"),
        (Compensating::WAITS_FOR_INDEX, "harmonics wait for the index"),
    ];
    Ok(write_list(out, parts.into_iter().filter(|(flag, _)| active.contains(*flag)).map(|(_, name)| name))?)
}

/// Changes the compensation if the settings stay valid; the speed loop has it two milliseconds later.
fn change(state: &State<'_>, change: impl FnOnce(&mut Compensation)) -> Done {
    let mut kept = state.settings.kept.get();
    change(&mut kept.settings.compensation);
    kept.config().map_err(|error| ErrorEntry::with(Code::SETTING, error))?;
    state.settings.kept.set(kept);
    state.source.compensation_changed.set(true);
    Ok(())
}

fn harmonic(state: &State<'_>, parameters: &mut Parameters<'_>) -> Done {
    let order = parameters.number(const { &Range::new(Quantity::PLAIN, 1.0, crate::compensation::MAX_HARMONIC_ORDER as f64, 1.0) })?;
    let torque_N_m = parameters.number(const { &Range::new(Quantity::TORQUE, 0.0, 1e3, 0.0) })?;
    let phase_rad = parameters.number(const { &Range::new(Quantity::ANGLE, -1e3, 1e3, 0.0) })?;
    let order = libm::round(order) as u32 as u16;
    let new = Harmonic { order, torque_N_m, phase_rad };
    let old = state.settings.kept.get().settings.compensation.harmonics;
    let others = old.as_slice().iter().copied().filter(|harmonic| harmonic.order != order);
    let all = Harmonics::of(others.chain((torque_N_m > 0.0).then_some(new)));
    let all = all.ok_or_else(|| ErrorEntry::with(Code::SETTINGS_CONFLICT, "the list of harmonics is full; 0 N.M removes one"))?;
    change(state, |compensation| compensation.harmonics = all)
}

/// Friction, then one harmonic per line.
pub(super) fn line(state: &State<'_>, line: usize, out: &mut dyn Write) -> Result<bool, fmt::Error> {
    let compensation = state.settings.kept.get().settings.compensation;
    let friction = [("coulomb", compensation.coulomb_N_m, "N.M"), ("viscous", compensation.viscous_N_m_s, "N.M.S")];
    if let Some((name, value, unit)) = friction.get(line) {
        write!(out, "{name} {}", state.with_unit(*value, unit))?;
        return Ok(true);
    }
    let Some(harmonic) = compensation.harmonics.as_slice().get(line - friction.len()) else { return Ok(false) };
    let (torque, phase) = (state.with_unit(harmonic.torque_N_m, "N.M"), state.with_unit(harmonic.phase_rad, "RAD"));
    write!(out, "order {}: {torque}, {phase}", harmonic.order)?;
    Ok(true)
}
