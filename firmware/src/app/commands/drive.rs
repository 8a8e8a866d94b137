//! `OUTPut` and `SOURce`: what the drive holds.

use super::{Act, Done, Entry, entry};
use crate::app::state::{Demand, State, Targets, hold, no_fault};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::Range;
use crate::console::quantity::Quantity;
use crate::speed_loop::{Mode, Zero};
use crate::words::words;

/// 2000 °/s: the range of the stand.
const RATE_RAD_S: f64 = 2000.0 * core::f64::consts::PI / 180.0;

const MODES: [Mode; 4] = [Mode::Off, Mode::Voltage, Mode::Rate, Mode::Position];

pub(super) const ENTRIES: &[Entry] = &[
    entry!(
        "OUTPut",
        Act::Switch {
            read: |state| state.is_driving(),
            write: |state, on| if on { drive(state, state.mode.get()) } else { hold(state, Demand::Off) },
        },
        "drive on in the mode that was last chosen, or off",
    ),
    entry!(
        "SOURce:MODE",
        Act::Words {
            words: &["OFF", "VOLTage", "RATE", "POSition"],
            read: |state| match state.demand.get() {
                Demand::Off => 0,
                Demand::Hold(mode, _) => MODES.iter().position(|m| *m == mode).unwrap_or(0),
            },
            write: |state, chosen| {
                let mode = MODES.get(chosen).copied().unwrap_or_default();
                if mode == Mode::Off {
                    return hold(state, Demand::Off);
                }
                drive(state, mode)?;
                state.mode.set(mode);
                Ok(())
            },
        },
        "what is held; the drive goes on with the value that was asked for",
    ),
    entry!(
        "SOURce:RATE",
        Act::Number {
            range: const { &Range::new(Quantity::RATE, -RATE_RAD_S, RATE_RAD_S, 0.0) },
            read: |state| state.targets.get().rate_rad_s,
            write: |state, rate_rad_s| target(state, Mode::Rate, Targets { rate_rad_s, ..state.targets.get() }),
        },
        "rate to hold in mode RATE",
    ),
    entry!(
        "SOURce:VOLTage",
        Act::Number {
            range: const { &Range::new(Quantity::VOLTAGE, -48.0, 48.0, 0.0) },
            read: |state| state.targets.get().voltage_V,
            write: |state, voltage_V| target(state, Mode::Voltage, Targets { voltage_V, ..state.targets.get() }),
        },
        "voltage to hold in mode VOLTAGE; limits hold",
    ),
    entry!(
        "SOURce:POSition",
        Act::Number {
            range: const { &Range::new(Quantity::ANGLE, -1e4, 1e4, 0.0) },
            read: |state| state.targets.get().position_rad,
            write: |state, position_rad| target(state, Mode::Position, Targets { position_rad, ..state.targets.get() }),
        },
        "angle to go to and hold in mode POSITION; several turns if it is to be",
    ),
    entry!(
        "SOURce:POSition:ZERO",
        Act::Words {
            words: &["POWeron", "INDex"],
            read: |state| usize::from(state.zero.get() == Zero::Index),
            write: |state, chosen| {
                if chosen == 1 && state.row.get().from_index_rad.is_none() {
                    return Err(ErrorEntry::saying(Code::SETTINGS_CONFLICT, words!("the index was not seen yet: turn the platform first")));
                }
                if matches!(state.demand.get(), Demand::Hold(Mode::Position, _)) {
                    return Err(ErrorEntry::saying(Code::SETTINGS_CONFLICT, words!("an angle is held: OUTPut OFF first")));
                }
                state.zero.set(if chosen == 1 { Zero::Index } else { Zero::PowerOn });
                Ok(())
            },
        },
        "what angles of SOURce are counted from",
    ),
];

fn value(targets: Targets, mode: Mode) -> f64 {
    match mode {
        Mode::Off => 0.0,
        Mode::Voltage => targets.voltage_V,
        Mode::Rate => targets.rate_rad_s,
        Mode::Position => targets.position_rad,
    }
}

fn drive(state: &State<'_>, mode: Mode) -> Done {
    hold(state, Demand::Hold(mode, value(state.targets.get(), mode)))
}

/// Another target; where its mode is held, it is held at once.
fn target(state: &State<'_>, mode: Mode, targets: Targets) -> Done {
    let is_held = matches!(state.demand.get(), Demand::Hold(held, _) if held == mode);
    if is_held {
        no_fault(state)?;
        state.demand.set(Demand::Hold(mode, value(targets, mode)));
    }
    state.targets.set(targets);
    Ok(())
}
