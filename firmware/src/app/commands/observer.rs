//! `OBServer`: a state observer of the gyro on the angle sensor: its numbers, what it estimates, its feedback.

use super::{Act, Done, Entry, List, entry, refused, with_unit};
use crate::app::state::{State, no_fault};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range};
use crate::console::quantity::Quantity;
use crate::console::text::Writer;
use crate::gyro_loop::observer::MOST_STATES;
use crate::gyro_loop::observer::numbers::{GAIN, GAMMA, MOMENT, Place, REGULATOR, SETTLE, STATES, TORQUER, VIBRATION, phi};
use crate::words::words;

const ANY: Range = Range::new(Quantity::PLAIN, -1e18, 1e18, 0.0);

pub(super) const ENTRIES: &[Entry] = &[
    entry!(
        "OBServer:NEW",
        Act::Take(words!("<states>,<ON|OFF the last is a moment>"), |state, parameters| {
            let states = parameters.number(&Range::new(Quantity::PLAIN, 2.0, MOST_STATES as f64, 6.0))?;
            let moment = parameters.on_off()?;
            state.observer.change(|numbers| {
                *numbers = Default::default();
                numbers.of_mut(STATES).fill(crate::maths::round(states));
                numbers.of_mut(MOMENT).fill(f64::from(u8::from(moment)));
            });
            Ok(())
        }),
        "forget all numbers; off",
    ),
    entry!(
        "OBServer:PHI",
        Act::Take(words!("<row>,<a number for each state>"), |state, parameters| {
            let row = parameters.number(&Range::new(Quantity::PLAIN, 1.0, MOST_STATES as f64, 1.0))?;
            take(state, parameters, phi((crate::maths::to_u32(row) as usize).saturating_sub(1)))
        }),
        "x[n+1] = PHI x[n] + GAMMA u[n] + GAIN (y[n] - x1[n])",
    ),
    entry!("OBServer:GAMMa", Act::Take(words!("<a number for each state>"), |state, parameters| take(state, parameters, GAMMA)), "per N.M"),
    entry!(
        "OBServer:GAIN",
        Act::Take(words!("<a number for each state>"), |state, parameters| take(state, parameters, GAIN)),
        "of the angle"
    ),
    entry!(
        "OBServer:REGulator",
        Act::Take(words!("<a number for each state>"), |state, parameters| take(state, parameters, REGULATOR)),
        "N.M for each estimate; 1 feeds a moment forward",
    ),
    entry!(
        "OBServer:TORQuer",
        Act::Number {
            range: const { &Range::new(Quantity::only("N.M/A"), 1e-12, 1e6, 1.0) },
            read: |state| state.observer.numbers().one(TORQUER),
            write: |state, value| (state.observer.change(|numbers| numbers.of_mut(TORQUER).fill(value)), Ok(())).1,
        },
        "moment of the gyro's torquer; off",
    ),
    entry!(
        "OBServer:SETTle",
        Act::Number {
            range: const { &Range::new(Quantity::TIME, 0.0, 1e5, 0.5) },
            read: |state| state.observer.numbers().one(SETTLE),
            write: |state, value| (state.observer.change(|numbers| numbers.of_mut(SETTLE).fill(value)), Ok(())).1,
        },
        "no feedback before; off",
    ),
    entry!("OBServer:LIST", Act::List(List::Observer), "all its numbers"),
    entry!(
        "OBServer:STATe",
        Act::Switch {
            read: |state| state.observer.phase() != crate::gyro_loop::observer::Phase::Off,
            write: |state, on| {
                if on {
                    return state.observer.begin().map_err(|wrong| refused(&wrong));
                }
                state.observer.end();
                Ok(())
            },
        },
        "its poles are checked first",
    ),
    entry!(
        "OBServer:PHASe",
        Act::Say(words!("OFF, CHECKING, NO ANGLE, SETTLING or SETTLED"), |state, out| (out.text(state.observer.phase().name()), Ok(())).1),
        "where it is",
    ),
    entry!("OBServer:ESTimate", Act::Say(words!("all states; angle's innovation RAD"), estimates), "for the next row"),
    entry!(
        "OBServer:FEEDback",
        Act::Switch {
            read: |state| state.observer.feeds().0,
            write: |state, on| {
                if on {
                    no_fault(state)?;
                }
                state.observer.feed_back(on);
                Ok(())
            },
        },
        "regulate once it has settled; a fault ends it",
    ),
    entry!(
        "OBServer:FORWard",
        Act::Switch { read: |state| state.observer.feeds().1, write: |state, on| (state.observer.feed_forward(on), Ok(())).1 },
        "the estimated moment is fed forward",
    ),
    entry!(
        "OBServer:VIBRation",
        Act::TakeAndSay(
            words!("<seconds of whole periods>,<H/k s>,<(Jx-Jz)/k s2>"),
            |state, parameters| list(state, parameters, VIBRATION, 3),
            vibration
        ),
        "mean angle RAD, of it vibration's RAD, means",
    ),
];

/// A number for each state.
fn take(state: &State<'_>, parameters: &mut Parameters<'_>, place: Place) -> Done {
    match state.observer.numbers().states() {
        0 => Err(ErrorEntry::saying(Code::SETTINGS_CONFLICT, words!("how many states? OBServer:NEW first"))),
        states => list(state, parameters, place, states),
    }
}

fn list(state: &State<'_>, parameters: &mut Parameters<'_>, place: Place, count: usize) -> Done {
    let mut numbers = state.observer.numbers();
    for number in numbers.of_mut(place).iter_mut().take(count) {
        *number = parameters.number(&ANY)?;
    }
    state.observer.set(&numbers);
    Ok(())
}

fn estimates(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    let (estimates, innovation_rad, _) = state.observer.estimates();
    for estimate in estimates.iter().take(state.observer.numbers().states()) {
        with_unit(out, *estimate, "");
        out.byte(b',');
    }
    with_unit(out, innovation_rad, "RAD");
    Ok(())
}

fn vibration(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    let (_, _, corrected) = state.observer.estimates();
    if corrected.means == 0 {
        return Err(ErrorEntry::saying(Code::DATA_STALE, words!("no mean yet; it takes a sensor of the roll")));
    }
    with_unit(out, corrected.alpha_rad, "RAD,");
    with_unit(out, corrected.vibration_rad, "RAD,");
    out.whole(u64::from(corrected.means), 1);
    Ok(())
}

/// A line for each row of numbers; nothing after the last.
pub(super) fn line(state: &State<'_>, line: usize, out: &mut Writer<'_>) -> Option<()> {
    let numbers = state.observer.numbers();
    let states = numbers.states();
    let rest = [GAMMA, GAIN, REGULATOR, STATES, MOMENT, TORQUER, SETTLE, VIBRATION];
    let place = if line < states { phi(line) } else { *rest.get(line - states)? };
    out.text(place.name);
    let shown = if place.count == MOST_STATES { states } else { place.count };
    for number in numbers.of(place).iter().take(shown) {
        with_unit(out.byte(b' '), *number, "");
    }
    Some(())
}
