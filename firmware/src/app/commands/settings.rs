//! `SETTings`: all kept numbers by name; save, load, reset.

use super::{Act, Answer, Entry, Job, List, entry, refused, with_unit};
use crate::app::state::State;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range};
use crate::console::text::Writer;
use crate::settings::{FIELDS, Field};
use crate::words::words;

pub(super) const ENTRIES: &[Entry] = &[
    entry!("SETTings:LIST", Act::List(List::Settings), "all settings with their values"),
    entry!("SETTings:SAVE", Act::Job(Job::Save), "write them to flash; the drive must be off"),
    entry!("SETTings:LOAD", Act::Job(Job::Load), "take what is in flash; the drive must be off"),
    entry!(
        "SETTings:RESet",
        Act::Do(|state| {
            at_rest(state)?;
            state.tune(state.defaults).map_err(|wrong| refused(&wrong))
        }),
        "take the stand's own; SAVE keeps them",
    ),
];

/// Settings change and flash is written only with the drive off.
pub(crate) fn at_rest(state: &State<'_>) -> Result<(), ErrorEntry> {
    if state.is_driving() {
        return Err(ErrorEntry::saying(Code::SETTINGS_CONFLICT, words!("the drive is on: OUTPut OFF first")));
    }
    if state.pulse.is_running() {
        return Err(ErrorEntry::saying(Code::SETTINGS_CONFLICT, words!("the drift is measured: DRIFt:ABORt first")));
    }
    Ok(())
}

fn range(field: &Field, state: &State<'_>) -> Range {
    Range::new(field.quantity(), field.least, field.greatest, (field.read)(&state.defaults))
}

/// Sets or tells a setting; `None` where none is called so.
pub(super) fn field(
    state: &State<'_>,
    name: &[u8],
    asks: bool,
    parameters: &mut Parameters<'_>,
    out: &mut Writer<'_>,
) -> Option<Result<Answer, ErrorEntry>> {
    let field = Field::named(name)?;
    Some(if asks { ask(state, field, parameters, out) } else { set(state, field, parameters) })
}

fn ask(state: &State<'_>, field: &Field, parameters: &mut Parameters<'_>, out: &mut Writer<'_>) -> Result<Answer, ErrorEntry> {
    let value = match parameters.next_text() {
        Some(word) => range(field, state).keyword(word).ok_or_else(|| ErrorEntry::about(Code::ILLEGAL_VALUE, word))?,
        None => (field.read)(&state.kept.get()),
    };
    parameters.end()?;
    with_unit(out, value, field.quantity().unit);
    Ok(Answer::Said)
}

fn set(state: &State<'_>, field: &Field, parameters: &mut Parameters<'_>) -> Result<Answer, ErrorEntry> {
    let value = parameters.number(&range(field, state))?;
    parameters.end()?;
    at_rest(state)?;
    let mut kept = state.kept.get();
    (field.write)(&mut kept, value);
    state.tune(kept).map_err(|wrong| refused(&wrong))?;
    Ok(Answer::Done)
}

/// Lines of `HELP?`: set and ask, for each field.
pub(super) fn help(line: usize, out: &mut Writer<'_>) -> Option<()> {
    let field = FIELDS.get(line >> 1)?;
    out.text("SETTings:").text(field.name);
    if line & 1 == 1 {
        out.words(words!("?  the setting"));
    } else {
        out.text(" <");
        Range::new(field.quantity(), field.least, field.greatest, 0.0).write(out);
        out.text(if field.is_scale { ">  scale; acts from the next power-on on, when it is saved" } else { ">  the drive must be off" });
    }
    Some(())
}

/// A setting and its value.
pub(super) fn line(state: &State<'_>, line: usize, out: &mut Writer<'_>) -> Option<()> {
    let field = FIELDS.get(line)?;
    out.text(field.name).text(" ");
    with_unit(out, (field.read)(&state.kept.get()), field.quantity().unit);
    Some(())
}
