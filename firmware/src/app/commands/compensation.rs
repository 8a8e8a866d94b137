//! `COMPensation`: what was learnt of the drive and is fed forward; friction is among the settings, harmonics are set here.

use super::{Act, Done, Entry, List, entry, refused, with_unit};
use crate::app::state::State;
use crate::compensation::{Compensation, Harmonic, Harmonics};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range};
use crate::console::quantity::Quantity;
use crate::console::text::Writer;
use crate::maths;
use crate::speed_loop::Compensating;
use crate::words::words;

pub(super) const ENTRIES: &[Entry] = &[
    entry!("COMPensation:LIST", Act::List(List::Compensation), "friction and harmonics in force"),
    entry!(
        "COMPensation:HARMonic",
        Act::Take(words!("<order>,<N.M>,<RAD>"), harmonic),
        "set one order: torque sin(order angle + phase); 0 N.M takes it away",
    ),
    entry!(
        "COMPensation:CLEar",
        Act::Do(|state| learn(state, |c| *c = Compensation { winding_lag_s: c.winding_lag_s, ..Compensation::default() })),
        "compensate nothing",
    ),
    entry!(
        "COMPensation:COULomb",
        Act::Number {
            range: const { &Range::new(Quantity::TORQUE, 0.0, 1e3, 0.0) },
            read: |state| state.kept.get().settings.compensation.coulomb_N_m,
            write: |state, torque_N_m| learn(state, |c| c.coulomb_N_m = torque_N_m),
        },
        "dry friction; also while the drive is on",
    ),
    entry!(
        "COMPensation:VISCous",
        Act::Number {
            range: const { &Range::new(Quantity::only("N.M.S"), 0.0, 1e3, 0.0) },
            read: |state| state.kept.get().settings.compensation.viscous_N_m_s,
            write: |state, viscous_N_m_s| learn(state, |c| c.viscous_N_m_s = viscous_N_m_s),
        },
        "viscous friction; also while the drive is on",
    ),
    entry!(
        "COMPensation:STATe",
        Act::Say(words!("what is at work"), |state, out| {
            let at_work = state.row.get().compensating;
            let mut any = false;
            for (flag, name) in [
                (Compensating::INDEX, "index seen"),
                (Compensating::FRICTION, "friction"),
                (Compensating::HARMONICS, "harmonics"),
                (Compensating::WAITS_FOR_INDEX, "harmonics wait for the index"),
            ] {
                if at_work.contains(flag) {
                    out.text(if any { "," } else { "" }).text(name);
                    any = true;
                }
            }
            out.text(if any { "" } else { "none" });
            Ok(())
        }),
        "what of it is at work now",
    ),
];

/// Changes the compensation, if it still makes sense then; the speed loop has it two milliseconds later.
fn learn(state: &State<'_>, change: impl FnOnce(&mut Compensation)) -> Done {
    let mut kept = state.kept.get();
    change(&mut kept.settings.compensation);
    kept.config().map_err(|wrong| refused(&wrong))?;
    state.kept.set(kept);
    state.learn.set(true);
    Ok(())
}

fn harmonic(state: &State<'_>, parameters: &mut Parameters<'_>) -> Done {
    let order = parameters.number(const { &Range::new(Quantity::PLAIN, 1.0, crate::compensation::HIGHEST_ORDER as f64, 1.0) })?;
    let torque_N_m = parameters.number(const { &Range::new(Quantity::TORQUE, 0.0, 1e3, 0.0) })?;
    let phase_rad = parameters.number(const { &Range::new(Quantity::ANGLE, -1e3, 1e3, 0.0) })?;
    let order = maths::to_u32(maths::round(order)) as u16;
    let new = Harmonic { order, torque_N_m, phase_rad };
    let old = state.kept.get().settings.compensation.harmonics;
    let others = old.as_slice().iter().copied().filter(|harmonic| harmonic.order != order);
    let all = Harmonics::of(others.chain((torque_N_m > 0.0).then_some(new)));
    let all = all.ok_or_else(|| ErrorEntry::saying(Code::SETTINGS_CONFLICT, words!("no room for another order; 0 N.M takes one away")))?;
    learn(state, |compensation| compensation.harmonics = all)
}

/// Friction, then one harmonic a line.
pub(super) fn line(state: &State<'_>, line: usize, out: &mut Writer<'_>) -> Option<()> {
    let compensation = state.kept.get().settings.compensation;
    let friction = [("coulomb", compensation.coulomb_N_m, "N.M"), ("viscous", compensation.viscous_N_m_s, "N.M.S")];
    if let Some((name, value, unit)) = friction.get(line) {
        out.text(name).text(" ");
        with_unit(out, *value, unit);
        return Some(());
    }
    let harmonic = compensation.harmonics.as_slice().get(line.checked_sub(friction.len())?)?;
    out.text("order ").whole(u64::from(harmonic.order), 1).text(": ");
    with_unit(out, harmonic.torque_N_m, "N.M, ");
    with_unit(out, harmonic.phase_rad, "RAD");
    Some(())
}
