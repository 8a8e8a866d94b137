//! `PROFile`: kind, parameters from their table, start and stop.

use super::{Action, Done, Entry, List, drive, entry, value_or_keyword};
use crate::app::state::{Activity, Run, Setpoint, State};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range, is_name};
use crate::console::quantity::Quantity;
use crate::profile::{PARAMETERS, Parameter, Profile, ProfileConfig, ProfileKind};
use crate::session::rows_in;
use crate::speed_loop::Mode;
use crate::text::Ascii;
use core::fmt::{self, Write};

const MODES: [Mode; 3] = [Mode::Voltage, Mode::Rate, Mode::Position];

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "PROFile:TYPE",
        Action::CommandAndQuery("<name>", set_kind, |state, out| Ok(out.write_str(state.profile.config.get().kind.name())?)),
        "kind of the profile",
    ),
    entry("PROFile:TYPE:LIST", Action::ListQuery(List::Profiles), "all profiles with their parameters"),
    entry(
        "PROFile:MODE",
        Action::Choice {
            words: &["VOLTage", "RATE", "POSition"],
            read: |state| MODES.iter().position(|mode| *mode == state.profile.mode.get()).unwrap_or(1),
            write: |state, index| (state.profile.mode.set(MODES.get(index).copied().unwrap_or(Mode::Rate)), Ok(())).1,
        },
        "the quantity that the profile sets",
    ),
    entry(
        "PROFile:DURation",
        Action::Number {
            range: const { &Range::new(Quantity::TIME, 1e-3, 1e6, 30.0) },
            read: |state| state.profile.duration_s.get(),
            write: |state, seconds| (state.profile.duration_s.set(seconds), Ok(())).1,
        },
        "duration of the profile",
    ),
    entry("PROFile:STARt", Action::Event(start), "start the profile; *OPC? waits for its end"),
    entry("PROFile:STOP", Action::Event(|state| state.hold(Setpoint::Off)), "end the profile, drive off"),
    entry(
        "PROFile:STATe",
        Action::TextQuery("RUNNING or STOPPED", |state, out| {
            let is_running = state.drive.activity.get() == Activity::Profile;
            Ok(out.write_str(if is_running { "RUNNING" } else { "STOPPED" })?)
        }),
        "state of the profile",
    ),
];

fn set_kind(state: &State<'_>, parameters: &mut Parameters<'_>) -> Done {
    let name = parameters.text()?;
    let is_named = |kind: &&ProfileKind| {
        name.eq_ignore_ascii_case(kind.name().as_bytes()) || kind.alias().is_some_and(|alias| name.eq_ignore_ascii_case(alias.as_bytes()))
    };
    let kind = ProfileKind::ALL.iter().find(is_named).ok_or_else(|| {
        ErrorEntry::with(Code::ILLEGAL_VALUE, format_args!("there is no profile {}: PROFile:TYPE:LIST? lists all", Ascii(name)))
    })?;
    state.profile.config.set(ProfileConfig { kind: *kind, ..state.profile.config.get() });
    Ok(())
}

fn start(state: &State<'_>) -> Done {
    state.require_no_fault()?;
    if state.drive.activity.get() == Activity::Calibration {
        return Err(ErrorEntry::with(Code::SETTINGS_CONFLICT, "a calibration runs: wait for its end, or STOP"));
    }
    let (config, mode) = (state.profile.config.get(), state.profile.mode.get());
    let profile = Profile::for_mode(&config, mode).map_err(setting_error)?;
    state.drive.activity.set(Activity::Profile);
    let rows_left = rows_in(state.profile.duration_s.get()).max(1);
    state.drive.start(Run { profile, mode, rows_left, activity: Activity::Profile });
    Ok(())
}

fn setting_error(error: crate::config::ConfigError) -> ErrorEntry {
    ErrorEntry::with(Code::SETTING, error)
}

fn named(name: &[u8]) -> Option<&'static Parameter> {
    PARAMETERS.iter().find(|parameter| is_name(name, parameter.name))
}

/// The range of a parameter; that of amplitude and offset is the setpoint's, and the unit of their derivatives depends on the mode, too.
fn range(parameter: &Parameter, mode: Mode) -> Range {
    let (per_s, per_s2) = match mode {
        Mode::Voltage => (Quantity::only("V/S"), Quantity::only("V/S2")),
        Mode::Position => (Quantity::RATE, Quantity::ACCELERATION),
        _ => (Quantity::ACCELERATION, Quantity::only("RAD/S3")),
    };
    let (least, greatest) = parameter.range;
    let default = (parameter.read)(&ProfileConfig::DEFAULT);
    match parameter.unit {
        "x" => Range { default, ..*drive::range(mode) },
        "x/s" => Range::new(per_s, least, greatest, default),
        "x/s2" => Range::new(per_s2, least, greatest, default),
        _ => Range::new(Quantity::of_name(parameter.name), least, greatest, default),
    }
}

/// Sets or queries a parameter; `None` if there is none of this name.
pub(super) fn parameter(
    state: &State<'_>,
    name: &[u8],
    is_query: bool,
    parameters: &mut Parameters<'_>,
    reply: &mut dyn Write,
) -> Option<Done> {
    let parameter = named(name)?;
    let range = range(parameter, state.profile.mode.get());
    Some(if is_query { query(state, parameter, &range, parameters, reply) } else { set_parameter(state, parameter, &range, parameters) })
}

fn query(state: &State<'_>, parameter: &Parameter, range: &Range, parameters: &mut Parameters<'_>, reply: &mut dyn Write) -> Done {
    let value = value_or_keyword(parameters, range, || (parameter.read)(&state.profile.config.get()))?;
    Ok(write!(reply, "{}", state.with_unit(value, range.quantity.unit))?)
}

fn set_parameter(state: &State<'_>, parameter: &Parameter, range: &Range, parameters: &mut Parameters<'_>) -> Done {
    let value = parameters.number(range)?;
    parameters.end()?;
    let mut config = state.profile.config.get();
    parameter.set(&mut config, value).map_err(setting_error)?;
    state.profile.config.set(config);
    Ok(())
}

/// Lines of `HELP?`: command and query of each parameter.
pub(super) fn help(line: usize, out: &mut dyn Write) -> Result<bool, fmt::Error> {
    let Some(parameter) = PARAMETERS.get(line >> 1) else { return Ok(false) };
    write!(out, "PROFile:{}", parameter.name)?;
    if line & 1 == 1 {
        out.write_char('?')?;
    } else {
        write!(out, " <{}>", range(parameter, Mode::Rate))?;
    }
    write!(out, "  {}", parameter.help)?;
    Ok(true)
}

/// A profile with its parameters.
pub(super) fn line(line: usize, out: &mut dyn Write) -> Result<bool, fmt::Error> {
    let Some(kind) = ProfileKind::ALL.get(line) else { return Ok(false) };
    write!(out, "{}: {}; parameters", kind.name(), kind.description())?;
    for name in kind.parameters() {
        write!(out, " {name}")?;
    }
    Ok(true)
}
