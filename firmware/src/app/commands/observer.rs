//! `OBServer`: a state observer of the gyroscope from its angle sensor: its numbers, estimates and feedback.

use super::{Action, Done, Entry, List, entry};
use crate::app::state::State;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range};
use crate::console::quantity::Quantity;
use crate::gyro_loop::observer::parameters::{Field, GAIN, GAMMA, MOMENT, REGULATOR, RESPONSE, SETTLE, STATES, TORQUER, VIBRATION, phi};
use crate::gyro_loop::observer::{MAX_STATES, Phase};
use crate::text::Significant;
use core::fmt::{self, Write};

const ANY: Range = Range::new(Quantity::PLAIN, -1e18, 1e18, 0.0);

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "OBServer:NEW",
        Action::Command("<states>,<ON|OFF: the last state is a moment>", |state, parameters| {
            let states = parameters.number(&Range::new(Quantity::PLAIN, 2.0, MAX_STATES as f64, 6.0))?;
            let has_moment = parameters.on_off()?;
            state.gyro.observer.change(|numbers| {
                *numbers = Default::default();
                numbers.get_mut(STATES).fill(libm::round(states));
                numbers.get_mut(MOMENT).fill(f64::from(u8::from(has_moment)));
            });
            Ok(())
        }),
        "delete all numbers and switch the observer off",
    ),
    entry(
        "OBServer:PHI",
        Action::Command("<row>,<a number for each state>", |state, parameters| {
            let row = parameters.number(&Range::new(Quantity::PLAIN, 1.0, MAX_STATES as f64, 1.0))?;
            set_states(state, parameters, phi((row as u32 as usize).saturating_sub(1)))
        }),
        "a row of PHI in x[n+1] = PHI x[n] + GAMMA u[n] + GAIN (y[n] - x1[n])",
    ),
    entry(
        "OBServer:GAMMa",
        Action::Command("<a number for each state>", |state, parameters| set_states(state, parameters, GAMMA)),
        "GAMMA, per N.M",
    ),
    entry(
        "OBServer:GAIN",
        Action::Command("<a number for each state>", |state, parameters| set_states(state, parameters, GAIN)),
        "GAIN, per RAD of the angle",
    ),
    entry(
        "OBServer:REGulator",
        Action::Command("<a number for each state>", |state, parameters| set_states(state, parameters, REGULATOR)),
        "N.M for each estimate; 1 feeds a moment forward",
    ),
    entry(
        "OBServer:TORQuer",
        Action::Number {
            range: const { &Range::new(Quantity::only("N.M/A"), 1e-12, 1e6, 1.0) },
            read: |state| state.gyro.observer.parameters().value(TORQUER),
            write: |state, value| (state.gyro.observer.change(|numbers| numbers.get_mut(TORQUER).fill(value)), Ok(())).1,
        },
        "torque constant of the torquer; switches the observer off",
    ),
    entry(
        "OBServer:SETTle",
        Action::Number {
            range: const { &Range::new(Quantity::TIME, 0.0, 1e5, 0.5) },
            read: |state| state.gyro.observer.parameters().value(SETTLE),
            write: |state, value| (state.gyro.observer.change(|numbers| numbers.get_mut(SETTLE).fill(value)), Ok(())).1,
        },
        "settling time before feedback; switches the observer off",
    ),
    entry("OBServer:LIST", Action::ListQuery(List::Observer), "all numbers"),
    entry(
        "OBServer:STATe",
        Action::Switch {
            read: |state| state.gyro.observer.phase() != Phase::Off,
            write: |state, on| {
                if on {
                    return state.gyro.observer.start().map_err(|error| ErrorEntry::with(Code::SETTING, error));
                }
                state.gyro.observer.stop();
                Ok(())
            },
        },
        "observer on or off; its poles are checked first",
    ),
    entry(
        "OBServer:PHASe",
        Action::TextQuery("OFF, CHECKING, NO ANGLE, SETTLING or SETTLED", |state, out| {
            Ok(out.write_str(state.gyro.observer.phase().name())?)
        }),
        "phase of the observer",
    ),
    entry("OBServer:ESTimate", Action::TextQuery("all states; innovation of the angle RAD", estimates), "estimates for the next row"),
    entry(
        "OBServer:FEEDback",
        Action::Switch {
            read: |state| state.gyro.observer.feedback_switches().0,
            write: |state, on| {
                if on {
                    state.require_no_fault()?;
                }
                state.gyro.observer.set_feedback(on).map_err(|error| ErrorEntry::with(Code::SETTING, error))
            },
        },
        "feedback by the regulator once the observer has settled; refused if the closed loop is unstable; a fault ends it",
    ),
    entry(
        "OBServer:FORWard",
        Action::Switch {
            read: |state| state.gyro.observer.feedback_switches().1,
            write: |state, on| (state.gyro.observer.set_feed_forward(on), Ok(())).1,
        },
        "feed-forward of the estimated moment",
    ),
    entry(
        "OBServer:VIBRation",
        Action::CommandAndQuery(
            "<seconds of whole periods>,<H/k s>,<(Jx-Jz)/k s2>",
            |state, parameters| set_numbers(state, parameters, VIBRATION, 3),
            vibration,
        ),
        "mean angle RAD, its part by vibration RAD, number of means",
    ),
    entry(
        "OBServer:RESPonse",
        Action::Command("<Re 1/R,Im 1/R over omega S of the rate,the same of the tilt rate>", |state, parameters| {
            set_numbers(state, parameters, RESPONSE, 4)
        }),
        "observer response at the vibration frequency, which VIBRation corrects",
    ),
    entry(
        "OBServer:CLEar",
        Action::Event(|state| (state.gyro.observer.set_parameters(&Default::default()), Ok(())).1),
        "delete the observer and switch it off; SETTings:SAVE keeps that",
    ),
];

/// Sets a number for each state.
fn set_states(state: &State<'_>, parameters: &mut Parameters<'_>, place: Field) -> Done {
    match state.gyro.observer.parameters().states() {
        0 => Err(ErrorEntry::with(Code::SETTINGS_CONFLICT, "the number of states is not set: OBServer:NEW first")),
        states => set_numbers(state, parameters, place, states),
    }
}

fn set_numbers(state: &State<'_>, parameters: &mut Parameters<'_>, place: Field, count: usize) -> Done {
    let mut numbers = state.gyro.observer.parameters();
    for number in numbers.get_mut(place).iter_mut().take(count) {
        *number = parameters.number(&ANY)?;
    }
    state.gyro.observer.set_parameters(&numbers);
    Ok(())
}

fn estimates(state: &State<'_>, out: &mut dyn Write) -> Done {
    let (estimates, innovation_rad, _) = state.gyro.observer.estimates();
    for estimate in estimates.iter().take(state.gyro.observer.parameters().states()) {
        write!(out, "{},", Significant(*estimate, 9))?;
    }
    Ok(write!(out, "{}", state.with_unit(innovation_rad, "RAD"))?)
}

fn vibration(state: &State<'_>, out: &mut dyn Write) -> Done {
    let (_, _, corrected) = state.gyro.observer.estimates();
    if corrected.means == 0 {
        return Err(ErrorEntry::with(Code::DATA_STALE, "there is no mean yet; it needs a sensor of the roll"));
    }
    let (angle, part) = (state.with_unit(corrected.alpha_rad, "RAD"), state.with_unit(corrected.vibration_rad, "RAD"));
    Ok(write!(out, "{angle},{part},{}", corrected.means)?)
}

/// A line for each row of numbers; `false` after the last.
pub(super) fn line(state: &State<'_>, line: usize, out: &mut dyn Write) -> Result<bool, fmt::Error> {
    let numbers = state.gyro.observer.parameters();
    let states = numbers.states();
    let rest = [GAMMA, GAIN, REGULATOR, STATES, MOMENT, TORQUER, SETTLE, VIBRATION, RESPONSE];
    let place = if line < states { Some(phi(line)) } else { rest.get(line - states).copied() };
    let Some(place) = place else { return Ok(false) };
    out.write_str(place.name)?;
    let count = if place.count == MAX_STATES { states } else { place.count };
    for number in numbers.get(place).iter().take(count) {
        write!(out, " {}", Significant(*number, 9))?;
    }
    Ok(true)
}
