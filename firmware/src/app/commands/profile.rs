//! `PROFile`: which one, its parameters from their table, start and stop.

use super::{Act, Answer, Entry, List, entry, refused, with_unit};
use crate::app::state::{Demand, Request, Running, State, hold, no_fault};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range, is_name};
use crate::console::quantity::Quantity;
use crate::console::text::Writer;
use crate::profile::{PARAMETERS, Parameter, Profile, ProfileKind};
use crate::session::rows_in;
use crate::speed_loop::Mode;
use crate::words::words;

const MODES: [Mode; 3] = [Mode::Voltage, Mode::Rate, Mode::Position];

pub(super) const ENTRIES: &[Entry] = &[
    entry!(
        "PROFile:TYPE",
        Act::TakeAndSay(
            words!("<name>"),
            |state, parameters| {
                let name = parameters.text()?;
                let named = |kind: &&ProfileKind| {
                    name.eq_ignore_ascii_case(kind.name().as_bytes())
                        || kind.alias().is_some_and(|alias| name.eq_ignore_ascii_case(alias.as_bytes()))
                };
                let kind = ProfileKind::ALL.iter().find(named).ok_or_else(|| {
                    let mut wrong = ErrorEntry::about(Code::ILLEGAL_VALUE, name);
                    wrong.detail.writer().words(words!(": PROFile:TYPE:LIST? has the names"));
                    wrong
                })?;
                state.profile.set(crate::profile::ProfileConfig { kind: *kind, ..state.profile.get() });
                Ok(())
            },
            |state, out| (out.text(state.profile.get().kind.name()), Ok(())).1,
        ),
        "which profile",
    ),
    entry!("PROFile:TYPE:LIST", Act::List(List::Profiles), "all profiles with their parameters"),
    entry!(
        "PROFile:MODE",
        Act::Words {
            words: &["VOLTage", "RATE", "POSition"],
            read: |state| MODES.iter().position(|mode| *mode == state.profile_mode.get()).unwrap_or(1),
            write: |state, chosen| (state.profile_mode.set(MODES.get(chosen).copied().unwrap_or(Mode::Rate)), Ok(())).1,
        },
        "what the profile is of",
    ),
    entry!(
        "PROFile:DURation",
        Act::Number {
            range: const { &Range::new(Quantity::TIME, 1e-3, 1e6, 30.0) },
            read: |state| state.profile_s.get(),
            write: |state, seconds| (state.profile_s.set(seconds), Ok(())).1,
        },
        "how long it runs",
    ),
    entry!("PROFile:STARt", Act::Do(start), "begin; *OPC? waits for its end"),
    entry!("PROFile:STOP", Act::Do(|state| hold(state, Demand::Off)), "end it, drive off"),
    entry!(
        "PROFile:STATe",
        Act::Say(words!("RUNNING or STOPPED"), |state, out| {
            out.text(if state.running.get() == Running::Profile { "RUNNING" } else { "STOPPED" });
            Ok(())
        }),
        "whether it runs",
    ),
];

fn start(state: &State<'_>) -> Result<(), ErrorEntry> {
    no_fault(state)?;
    if state.running.get() == Running::Calibration {
        return Err(ErrorEntry::saying(Code::SETTINGS_CONFLICT, words!("something runs: wait for its end, or STOP")));
    }
    let (config, mode) = (state.profile.get(), state.profile_mode.get());
    Profile::for_mode(&config, mode).map_err(|wrong| refused(&wrong))?;
    state.running.set(Running::Profile);
    state.request.set(Some(Request::Profile(config, mode, rows_in(state.profile_s.get()).max(1))));
    Ok(())
}

fn named(name: &[u8]) -> Option<&'static Parameter> {
    PARAMETERS.iter().find(|parameter| is_name(name, parameter.name))
}

/// The unit of a parameter; those of the amplitude are as the mode has it.
fn quantity(parameter: &Parameter, mode: Mode) -> Quantity {
    let (value, per_s, per_s2) = match mode {
        Mode::Voltage => (Quantity::VOLTAGE, Quantity::only("V/S"), Quantity::only("V/S2")),
        Mode::Position => (Quantity::ANGLE, Quantity::RATE, Quantity::ACCELERATION),
        _ => (Quantity::RATE, Quantity::ACCELERATION, Quantity::only("RAD/S3")),
    };
    match parameter.unit {
        "x" => value,
        "x/s" => per_s,
        "x/s2" => per_s2,
        _ => Quantity::of_name(parameter.name),
    }
}

/// Sets or tells a parameter; `None` where none is called so.
pub(super) fn parameter(
    state: &State<'_>,
    name: &[u8],
    asks: bool,
    parameters: &mut Parameters<'_>,
    out: &mut Writer<'_>,
) -> Option<Result<Answer, ErrorEntry>> {
    let parameter = named(name)?;
    let quantity = quantity(parameter, state.profile_mode.get());
    let mut config = state.profile.get();
    if asks {
        with_unit(out, (parameter.read)(&config), quantity.unit);
        return Some(parameters.end().map(|()| Answer::Said));
    }
    let range = Range::new(quantity, -1e16, 1e16, 0.0);
    Some(parameters.number(&range).and_then(|value| parameters.end().map(|()| value)).and_then(|value| {
        parameter.set(&mut config, value).map_err(|wrong| refused(&wrong))?;
        state.profile.set(config);
        Ok(Answer::Done)
    }))
}

/// Lines of `HELP?`: set and ask, for each parameter.
pub(super) fn help(line: usize, out: &mut Writer<'_>) -> Option<()> {
    let parameter = PARAMETERS.get(line >> 1)?;
    out.text("PROFile:").text(parameter.name);
    if line & 1 == 1 {
        out.byte(b'?');
    } else {
        out.text(" <").text(match quantity(parameter, Mode::Rate).unit {
            "" => "number",
            unit => unit,
        });
        out.text(">");
    }
    out.text("  ").words(parameter.says);
    Some(())
}

/// A profile with the parameters that it takes.
pub(super) fn line(line: usize, out: &mut Writer<'_>) -> Option<()> {
    let kind = ProfileKind::ALL.get(line)?;
    out.text(kind.name()).text(": ").words(kind.says()).text("; takes");
    for name in kind.parameters() {
        out.byte(b' ').text(name);
    }
    Some(())
}
