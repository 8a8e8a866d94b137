//! `OUTPut` and `SOURce`: the setpoints of the drive.

use super::{Action, Done, Entry, entry};
use crate::app::state::{Setpoint, State, Targets};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::Range;
use crate::console::quantity::Quantity;
use crate::speed_loop::{Mode, Zero};

/// Rate range of the stand: 2000 °/s.
const MAX_RATE_RAD_S: f64 = 2000.0 * core::f64::consts::PI / 180.0;

const RATE: &Range = &Range::new(Quantity::RATE, -MAX_RATE_RAD_S, MAX_RATE_RAD_S, 0.0);
const VOLTAGE: &Range = &Range::new(Quantity::VOLTAGE, -48.0, 48.0, 0.0);
const ANGLE: &Range = &Range::new(Quantity::ANGLE, -1e4, 1e4, 0.0);

/// Range of a setpoint.
pub(super) fn range(mode: Mode) -> &'static Range {
    match mode {
        Mode::Voltage => VOLTAGE,
        Mode::Position => ANGLE,
        _ => RATE,
    }
}

const MODES: [Mode; 4] = [Mode::Off, Mode::Voltage, Mode::Rate, Mode::Position];

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "OUTPut",
        Action::Switch {
            read: |state| state.is_driving(),
            write: |state, on| if on { drive(state, state.source.mode.get()) } else { state.hold(Setpoint::Off) },
        },
        "drive on in the last mode, or off",
    ),
    entry(
        "SOURce:MODE",
        Action::Choice {
            words: &["OFF", "VOLTage", "RATE", "POSition"],
            read: |state| match state.drive.setpoint.get() {
                Setpoint::Off => 0,
                Setpoint::Hold(mode, _) => MODES.iter().position(|m| *m == mode).unwrap_or(0),
            },
            write: |state, index| {
                let mode = MODES.get(index).copied().unwrap_or_default();
                if mode == Mode::Off {
                    return state.hold(Setpoint::Off);
                }
                drive(state, mode)?;
                state.source.mode.set(mode);
                Ok(())
            },
        },
        "mode of the setpoint; switches the drive on with the value of this mode",
    ),
    entry(
        "SOURce:RATE",
        Action::Number {
            range: RATE,
            read: |state| state.source.targets.get().rate_rad_s,
            write: |state, rate_rad_s| set_target(state, Mode::Rate, Targets { rate_rad_s, ..state.source.targets.get() }),
        },
        "setpoint of mode RATE",
    ),
    entry(
        "SOURce:VOLTage",
        Action::Number {
            range: VOLTAGE,
            read: |state| state.source.targets.get().voltage_V,
            write: |state, voltage_V| set_target(state, Mode::Voltage, Targets { voltage_V, ..state.source.targets.get() }),
        },
        "setpoint of mode VOLTAGE; the limits apply",
    ),
    entry(
        "SOURce:POSition",
        Action::Number {
            range: ANGLE,
            read: |state| state.source.targets.get().position_rad,
            write: |state, position_rad| set_target(state, Mode::Position, Targets { position_rad, ..state.source.targets.get() }),
        },
        "setpoint of mode POSITION; may be several turns away",
    ),
    entry(
        "SOURce:POSition:ZERO",
        Action::Choice {
            words: &["POWeron", "INDex"],
            read: |state| usize::from(state.drive.zero.get() == Zero::Index),
            write: |state, index| {
                if index == 1 && state.measured.row.get().from_index_rad.is_none() {
                    let detail = "the index was not seen since power-on: turn the platform first";
                    return Err(ErrorEntry::with(Code::SETTINGS_CONFLICT, detail));
                }
                if matches!(state.drive.setpoint.get(), Setpoint::Hold(Mode::Position, _)) {
                    return Err(ErrorEntry::with(Code::SETTINGS_CONFLICT, "an angle is held: OUTPut OFF first"));
                }
                state.drive.zero.set(if index == 1 { Zero::Index } else { Zero::PowerOn });
                Ok(())
            },
        },
        "zero of the angles of SOURce",
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
    state.hold(Setpoint::Hold(mode, value(state.source.targets.get(), mode)))
}

/// Sets a target; where its mode is held, it acts at once.
fn set_target(state: &State<'_>, mode: Mode, targets: Targets) -> Done {
    let is_held = matches!(state.drive.setpoint.get(), Setpoint::Hold(held, _) if held == mode);
    if is_held {
        state.require_no_fault()?;
        state.drive.setpoint.set(Setpoint::Hold(mode, value(targets, mode)));
    }
    state.source.targets.set(targets);
    Ok(())
}
