//! The commands: one table that dispatches them and that `HELP?` lists.
//!
//! An entry is a header and an [`Action`]. Most actions are a number with its range, a choice of words, a query or an event; the rest read
//! their parameters themselves. Parameters of profiles and kept settings come from their own tables, so that a new one needs no
//! entry here. The console executes a [`Job`], which needs the flash or takes time.

mod calibration;
mod common;
mod compensation;
mod drift;
mod drive;
mod dut;
pub(super) mod fault;
mod help;
mod learn;
mod measure;
mod observer;
mod profile;
mod self_test;
mod settings;
mod status;
mod stream;
mod system;

pub use system::SIGN_OF_LIFE;

use super::state::State;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Command, Parameters, Range};
use crate::text::Ascii;
use core::fmt::Write;

/// Outcome of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Executed; a query has written its reply.
    Done,
    /// The console sends a list.
    List(List),
    /// The console executes a job.
    Job(Job),
}

/// A reply of several lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum List {
    /// The commands.
    Help,
    /// The channels.
    Channels,
    /// The kept settings.
    Settings,
    /// The profiles.
    Profiles,
    /// The error queue.
    Errors,
    /// The compensation.
    Compensation,
    /// The commands that restore all settings.
    Learn,
    /// The numbers of the observer.
    Observer,
    /// The recording around a fault.
    Capture,
}

/// Work of the console that needs the flash or takes time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Job {
    /// Wait for the end of the activity.
    Wait,
    /// Wait for the end of the activity, then reply 1.
    WaitAndReply,
    /// Write the settings to flash.
    Save,
    /// Read the settings from flash.
    Load,
    /// Clear the latched fault.
    ClearFault,
}

/// Result of an event or a written value.
type Done = Result<(), ErrorEntry>;
/// Writes the reply of a query.
type Reply = fn(&State<'_>, &mut dyn Write) -> Done;
/// Reads the parameters of a command and executes it.
type Take = fn(&State<'_>, &mut Parameters<'_>) -> Done;

/// What a command does.
pub enum Action {
    /// A number that can be set and queried.
    Number {
        /// Its range, with unit and default.
        range: &'static Range,
        /// Reads it.
        read: fn(&State<'_>) -> f64,
        /// Sets it.
        write: fn(&State<'_>, f64) -> Done,
    },
    /// A choice of words that can be set and queried.
    Choice {
        /// The words.
        words: &'static [&'static str],
        /// Index of the present word.
        read: fn(&State<'_>) -> usize,
        /// Selects a word by its index.
        write: fn(&State<'_>, usize) -> Done,
    },
    /// ON or OFF.
    Switch {
        /// Whether it is on.
        read: fn(&State<'_>) -> bool,
        /// Switches.
        write: fn(&State<'_>, bool) -> Done,
    },
    /// An event without parameters.
    Event(fn(&State<'_>) -> Done),
    /// A query for a number, with its unit.
    NumberQuery(&'static str, fn(&State<'_>) -> Result<f64, ErrorEntry>),
    /// A query for text, with its description.
    TextQuery(&'static str, Reply),
    /// A query for a list.
    ListQuery(List),
    /// A query for a part of a list, with the description of its parameters.
    PartialListQuery(&'static str, fn(&State<'_>, &mut Parameters<'_>) -> Result<List, ErrorEntry>),
    /// A job.
    Job(Job),
    /// A job that replies.
    JobQuery(Job),
    /// An event with parameters, with their description.
    Command(&'static str, Take),
    /// An event with parameters, with their description, that can also be queried.
    CommandAndQuery(&'static str, Take, Reply),
}

impl Action {
    /// Whether the action exists as query, or as command.
    fn has(&self, is_query: bool) -> bool {
        match self {
            Action::Number { .. } | Action::Choice { .. } | Action::Switch { .. } | Action::CommandAndQuery(..) => true,
            Action::Event(_) | Action::Job(_) | Action::Command(..) => !is_query,
            Action::NumberQuery(..) | Action::TextQuery(..) | Action::ListQuery(_) | Action::PartialListQuery(..) | Action::JobQuery(_) => {
                is_query
            }
        }
    }
}

/// A command.
pub struct Entry {
    /// Its header, the short form in capitals.
    pub header: &'static str,
    /// What it does.
    pub action: Action,
    /// Its line in `HELP?`.
    pub help: &'static str,
}

const fn entry(header: &'static str, action: Action, help: &'static str) -> Entry {
    Entry { header, action, help }
}

/// Groups whose commands a client that only measures sends too.
const MEASURING_GROUPS: [&[Entry]; 5] = [common::ENTRIES, measure::ENTRIES, stream::ENTRIES, status::ENTRIES, help::ENTRIES];
/// Commands that stop the drive or an activity; with the switch OFF.
const STOPS: [&str; 7] = ["STOP", "*RST", "OUTPut", "SOURce:MODE", "PROFile:STOP", "CALibration:COGGing:ABORt", "DRIFt:ABORt"];

/// Whether a command shows that the program that drives is alive: no query, and no command of a client that only measures.
pub fn is_sign_of_life(command: &Command<'_>) -> bool {
    !command.is_query
        && !command.is(system::RELEASE)
        && !MEASURING_GROUPS.iter().flat_map(|group| group.iter()).any(|entry| command.is(entry.header))
}

/// Whether a command stops the drive or an activity.
pub fn is_stop(command: &Command<'_>) -> bool {
    let is_on = || !matches!(command.parameters().on_off(), Ok(false));
    !command.is_query && STOPS.iter().any(|header| command.is(header) && !(matches!(*header, "OUTPut" | "SOURce:MODE") && is_on()))
}

/// All commands by group, in the order of `HELP?`.
pub const GROUPS: [&[Entry]; 17] = [
    common::ENTRIES,
    system::ENTRIES,
    drive::ENTRIES,
    profile::ENTRIES,
    measure::ENTRIES,
    dut::ENTRIES,
    observer::ENTRIES,
    fault::ENTRIES,
    stream::ENTRIES,
    settings::ENTRIES,
    learn::ENTRIES,
    compensation::ENTRIES,
    calibration::ENTRIES,
    self_test::ENTRIES,
    drift::ENTRIES,
    status::ENTRIES,
    help::ENTRIES,
];

/// Executes a command; a query writes its reply to `reply`.
///
/// # Errors
/// The command or a parameter is wrong, or the command is not possible now.
#[inline(never)] // for the size of the image
pub fn execute(state: &State<'_>, command: &Command<'_>, reply: &mut dyn Write) -> Result<Outcome, ErrorEntry> {
    let mut parameters = command.parameters();
    let entries = || GROUPS.iter().flat_map(|group| group.iter()).filter(|entry| command.is(entry.header));
    if command.has_other_suffix() {
        return Err(ErrorEntry::with(Code::HEADER_SUFFIX, format_args!("{}: there is one of each", Ascii(command.header()))));
    }
    let result = if let Some(entry) = entries().find(|entry| entry.action.has(command.is_query)).or_else(|| entries().next()) {
        perform(state, &entry.action, command.is_query, &mut parameters, reply)
    } else if let Some(result) =
        command.last_below("PROFile").and_then(|name| profile::parameter(state, name, command.is_query, &mut parameters, reply))
    {
        result.map(|()| Outcome::Done)
    } else if let Some(result) =
        command.last_below("SETTings").and_then(|name| settings::field(state, name, command.is_query, &mut parameters, reply))
    {
        result.map(|()| Outcome::Done)
    } else {
        let mark = if command.is_query { "?" } else { "" };
        return Err(ErrorEntry::with(Code::UNDEFINED_HEADER, format_args!("{}{mark}: HELP? lists all", Ascii(command.header()))));
    };
    result.and_then(|outcome| parameters.end().map(|()| outcome)).map_err(|error| named(command, error))
}

/// A parameter error with the header of its command.
fn named(command: &Command<'_>, error: ErrorEntry) -> ErrorEntry {
    let header = Ascii(command.header());
    match error.code {
        _ if error.detail().is_empty() => ErrorEntry::with(error.code, header),
        Code::NUMERIC_DATA | Code::INVALID_SUFFIX | Code::OUT_OF_RANGE | Code::ILLEGAL_VALUE | Code::PARAMETER_NOT_ALLOWED => {
            ErrorEntry::with(error.code, format_args!("{header}: {}", error.detail()))
        }
        _ => error,
    }
}

fn perform(
    state: &State<'_>,
    action: &Action,
    is_query: bool,
    parameters: &mut Parameters<'_>,
    reply: &mut dyn Write,
) -> Result<Outcome, ErrorEntry> {
    match (action, is_query) {
        (Action::Number { range, read, .. }, true) => {
            let value = value_or_keyword(parameters, range, || read(state))?;
            write!(reply, "{}", state.with_unit(value, range.quantity.unit))?;
        }
        (Action::Number { range, write, .. }, false) => write(state, parameters.number(range)?)?,
        (Action::Choice { words, read, .. }, true) => {
            let word = words.get(read(state)).copied().unwrap_or("NONE");
            word.chars().try_for_each(|letter| reply.write_char(letter.to_ascii_uppercase()))?;
        }
        (Action::Choice { words, write, .. }, false) => write(state, parameters.choice(words)?)?,
        (Action::Switch { read, .. }, true) => reply.write_str(if read(state) { "1" } else { "0" })?,
        (Action::Switch { write, .. }, false) => write(state, parameters.on_off()?)?,
        (Action::Event(event), false) => event(state)?,
        (Action::NumberQuery(unit, read), true) => write!(reply, "{}", state.with_unit(read(state)?, unit))?,
        (Action::TextQuery(_, query) | Action::CommandAndQuery(_, _, query), true) => query(state, reply)?,
        (Action::ListQuery(list), true) => return Ok(Outcome::List(*list)),
        (Action::PartialListQuery(_, select), true) => return select(state, parameters).map(Outcome::List),
        (Action::Job(job), false) | (Action::JobQuery(job), true) => return Ok(Outcome::Job(*job)),
        (Action::Command(_, take) | Action::CommandAndQuery(_, take, _), false) => take(state, parameters)?,
        (_, true) => return Err(ErrorEntry::with(Code::UNDEFINED_HEADER, "this command has no query")),
        (_, false) => return Err(ErrorEntry::with(Code::UNDEFINED_HEADER, "this is a query only: put ? behind it")),
    }
    Ok(Outcome::Done)
}

/// The present value, or the value of the keyword MINimum, MAXimum or DEFault if it is given.
fn value_or_keyword(parameters: &mut Parameters<'_>, range: &Range, read: impl FnOnce() -> f64) -> Result<f64, ErrorEntry> {
    match parameters.next_text() {
        Some(word) => range
            .keyword(word)
            .ok_or_else(|| ErrorEntry::with(Code::ILLEGAL_VALUE, format_args!("{} is not one of MIN, MAX or DEF", Ascii(word)))),
        None => Ok(read()),
    }
}

/// Writes a line of a list; `false` after the last line.
///
/// # Errors
/// The line is too long.
pub fn list_line(state: &State<'_>, list: List, line: usize, out: &mut dyn Write) -> Result<bool, ErrorEntry> {
    Ok(match list {
        List::Help => help::line(line, out)?,
        List::Channels => stream::channel_line(line, out)?,
        List::Settings => settings::line(state, line, out)?,
        List::Profiles => profile::line(line, out)?,
        List::Errors => system::error_line(state, line, out)?,
        List::Capture => fault::capture_line(state, line, out)?,
        List::Observer => observer::line(state, line, out)?,
        List::Compensation => compensation::line(state, line, out)?,
        List::Learn => learn::line(state, line, out)?,
    })
}
