//! What the commands are and do: one table that dispatches, and that `HELP?` lists.
//!
//! An entry is a header and an [`Act`]. Most are a number with its range, a choice of words, a question or an event, and say in a line how to read
//! or set it; the rest read their parameters themselves. Parameters of the profiles and kept settings come from their own tables, so that one
//! that is new there is new here. What needs the flash or time is a [`Job`] that the console does.

mod calibration;
mod common;
mod compensation;
mod drift;
mod drive;
mod fault;
mod help;
mod imu;
mod measure;
mod observer;
mod profile;
mod settings;
mod status;
mod stream;
mod system;

pub(super) use help::help_line;
pub(super) use settings::at_rest;

use super::state::State;
use crate::config::ConfigError;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Command, Parameters, Range};
use crate::console::text::Writer;
use crate::words::{Words, words};

/// What comes of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Nothing to say.
    Done,
    /// The reply is written.
    Said,
    /// Lines of a list follow.
    List(List),
    /// The console does it.
    Job(Job),
}

/// A reply of many lines.
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
    /// All errors.
    Errors,
    /// The learnt compensation.
    Compensation,
    /// The observer's numbers.
    Observer,
    /// What was recorded around a fault.
    Capture,
}

/// What takes time or the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Job {
    /// Wait for the end of what runs.
    Wait,
    /// The same, then say 1.
    WaitAndSay,
    /// Write the settings to flash.
    Save,
    /// Read them.
    Load,
}

/// What is written or taken: the state, and what went wrong.
type Done = Result<(), ErrorEntry>;

/// What an entry does.
pub enum Act {
    /// A number that is set and asked for.
    Number {
        /// What it may be.
        range: &'static Range,
        /// Its value.
        read: fn(&State<'_>) -> f64,
        /// Sets it.
        write: fn(&State<'_>, f64) -> Done,
    },
    /// One of some words.
    Words {
        /// The words.
        words: &'static [&'static str],
        /// Which it is.
        read: fn(&State<'_>) -> usize,
        /// Chooses.
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
    Do(fn(&State<'_>) -> Done),
    /// A number that is asked for, with its unit.
    Ask(&'static str, fn(&State<'_>) -> Result<f64, ErrorEntry>),
    /// Words that are asked for; and what they are.
    Say(Words, fn(&State<'_>, &mut Writer<'_>) -> Done),
    /// Many lines.
    List(List),
    /// Many lines, some of them; and what says which.
    AskList(Words, fn(&State<'_>, &mut Parameters<'_>) -> Result<List, ErrorEntry>),
    /// An event that the console does.
    Job(Job),
    /// A question that the console answers.
    AskJob(Job),
    /// An event with parameters of its own; and what they are.
    Take(Words, fn(&State<'_>, &mut Parameters<'_>) -> Done),
    /// The same, also asked for.
    TakeAndSay(Words, fn(&State<'_>, &mut Parameters<'_>) -> Done, fn(&State<'_>, &mut Writer<'_>) -> Done),
}

impl Act {
    /// Whether it can be said, or asked.
    fn is_possible(&self, asks: bool) -> bool {
        match self {
            Act::Number { .. } | Act::Words { .. } | Act::Switch { .. } | Act::TakeAndSay(..) => true,
            Act::Do(_) | Act::Job(_) | Act::Take(..) => !asks,
            Act::Ask(..) | Act::Say(..) | Act::List(_) | Act::AskList(..) | Act::AskJob(_) => asks,
        }
    }
}

/// A command.
pub struct Entry {
    /// Its words, the short form in capitals.
    pub header: &'static str,
    /// What it does.
    pub act: Act,
    /// That in a few words.
    pub says: Words,
}

/// Header, what it does, and that in words.
macro_rules! entry {
    ($header:expr, $act:expr, $says:expr $(,)?) => {
        Entry { header: $header, act: $act, says: words!($says) }
    };
}
use entry;

/// All commands, by group, in the order of `HELP?`.
pub const GROUPS: [&[Entry]; 15] = [
    common::ENTRIES,
    system::ENTRIES,
    drive::ENTRIES,
    profile::ENTRIES,
    measure::ENTRIES,
    imu::ENTRIES,
    observer::ENTRIES,
    fault::ENTRIES,
    stream::ENTRIES,
    settings::ENTRIES,
    compensation::ENTRIES,
    calibration::ENTRIES,
    drift::ENTRIES,
    status::ENTRIES,
    help::ENTRIES,
];

/// Does what one command says; a reply goes into `out`.
///
/// # Errors
/// What is wrong with it, or why it cannot be done.
pub fn execute(state: &State<'_>, command: &Command<'_>, out: &mut Writer<'_>) -> Result<Answer, ErrorEntry> {
    let mut parameters = command.parameters();
    let entries = || GROUPS.iter().flat_map(|group| group.iter()).filter(|entry| command.is(entry.header));
    if let Some(entry) = entries().find(|entry| entry.act.is_possible(command.is_query)).or_else(|| entries().next()) {
        let answer = act(state, &entry.act, command.is_query, &mut parameters, out);
        // The parameters of a command that was refused are not looked at further.
        return answer.and_then(|answer| parameters.end().map(|()| answer)).map_err(|mut wrong| {
            if wrong.detail.is_empty() {
                wrong.detail.writer().bytes(command.header());
            }
            wrong
        });
    }
    let listed = match (command.last_below("PROFile"), command.last_below("SETTings")) {
        (Some(name), _) => profile::parameter(state, name, command.is_query, &mut parameters, out),
        (_, Some(name)) => settings::field(state, name, command.is_query, &mut parameters, out),
        _ => None,
    };
    listed.unwrap_or_else(|| {
        let mut wrong = ErrorEntry::about(Code::UNDEFINED_HEADER, command.header());
        wrong.detail.writer().text(if command.is_query { "?" } else { "" }).words(words!(": HELP? lists all"));
        Err(wrong)
    })
}

fn act(state: &State<'_>, act: &Act, asks: bool, parameters: &mut Parameters<'_>, out: &mut Writer<'_>) -> Result<Answer, ErrorEntry> {
    match (act, asks) {
        (Act::Number { range, read, .. }, true) => {
            let value = match parameters.next_text() {
                Some(word) => range.keyword(word).ok_or_else(|| ErrorEntry::about(Code::ILLEGAL_VALUE, word))?,
                None => read(state),
            };
            with_unit(out, value, range.quantity.unit);
            Ok(Answer::Said)
        }
        (Act::Number { range, write, .. }, false) => write(state, parameters.number(range)?).map(|()| Answer::Done),
        (Act::Words { words, read, .. }, true) => {
            for byte in words.get(read(state)).copied().unwrap_or("NONE").bytes() {
                out.byte(byte.to_ascii_uppercase());
            }
            Ok(Answer::Said)
        }
        (Act::Words { words, write, .. }, false) => {
            let chosen = parameters.choice(words).map_err(|wrong| among(wrong, words))?;
            write(state, chosen).map(|()| Answer::Done)
        }
        (Act::Switch { read, .. }, true) => {
            out.text(if read(state) { "1" } else { "0" });
            Ok(Answer::Said)
        }
        (Act::Switch { write, .. }, false) => write(state, parameters.on_off()?).map(|()| Answer::Done),
        (Act::Do(event), false) => event(state).map(|()| Answer::Done),
        (Act::Ask(unit, read), true) => {
            with_unit(out, read(state)?, unit);
            Ok(Answer::Said)
        }
        (Act::Say(_, say) | Act::TakeAndSay(_, _, say), true) => say(state, out).map(|()| Answer::Said),
        (Act::List(list), true) => Ok(Answer::List(*list)),
        (Act::AskList(_, which), true) => which(state, parameters).map(Answer::List),
        (Act::Job(job), false) | (Act::AskJob(job), true) => Ok(Answer::Job(*job)),
        (Act::Take(_, take) | Act::TakeAndSay(_, take, _), false) => take(state, parameters).map(|()| Answer::Done),
        _ => {
            let why = if asks { words!("nothing to ask for here") } else { words!("this can only be asked for: put ? behind it") };
            Err(ErrorEntry::saying(Code::UNDEFINED_HEADER, why))
        }
    }
}

/// A number and its unit, as far as a person would ask for it.
fn with_unit(out: &mut Writer<'_>, value: f64, unit: &str) {
    out.number(value, 9);
    if !unit.is_empty() {
        out.byte(b' ').text(unit);
    }
}

/// The error with the words that there are.
fn among(mut wrong: ErrorEntry, words: &[&str]) -> ErrorEntry {
    let mut out = wrong.detail.writer();
    out.text(": one of");
    for word in words {
        out.byte(b' ').text(word);
    }
    wrong
}

/// What is wrong with a setting, in words.
pub fn say_wrong(wrong: &ConfigError, out: &mut Writer<'_>) {
    out.text(wrong.parameter());
    match wrong {
        ConfigError::NonFinite(_) => drop(out.words(words!(" is not a finite number"))),
        ConfigError::OutOfRange(_, value, least, greatest) => {
            out.text(" = ").number(*value, 6).text(" is outside ").number(*least, 6).text(" to ").number(*greatest, 6);
        }
        ConfigError::Unfit(_, why) => drop(out.byte(b' ').text(why)),
    }
}

pub(super) fn refused(wrong: &ConfigError) -> ErrorEntry {
    let mut entry = ErrorEntry::new(Code::SETTING);
    say_wrong(wrong, &mut entry.detail.writer());
    entry
}

/// One line of a list; `None` after the last.
pub fn list_line(state: &State<'_>, list: List, line: usize, out: &mut Writer<'_>) -> Option<()> {
    match list {
        List::Help => help_line(line, out),
        List::Channels => stream::channel_line(line, out),
        List::Settings => settings::line(state, line, out),
        List::Profiles => profile::line(line, out),
        List::Errors => system::error_line(state, out),
        List::Capture => fault::capture_line(state, line, out),
        List::Observer => observer::line(state, line, out),
        List::Compensation => compensation::line(state, line, out),
    }
}
