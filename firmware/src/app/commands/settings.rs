//! `SETTings`: all kept numbers by name; save, load, reset.

use super::{Action, Done, Entry, Job, List, entry, value_or_keyword};
use crate::app::state::State;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range};
use crate::settings::{FIELDS, Field, Kept};
use core::fmt::{self, Write};

pub(super) const ENTRIES: &[Entry] = &[
    entry("SETTings:LIST", Action::ListQuery(List::Settings), "all settings with their values"),
    entry("SETTings:SAVE", Action::Job(Job::Save), "write the settings to flash; the drive must be off, and the platform stand"),
    entry("SETTings:LOAD", Action::Job(Job::Load), "read the settings from flash; the drive must be off"),
    entry(
        "SETTings:RESet",
        Action::Event(|state| {
            state.require_at_rest()?;
            apply(state, state.settings.defaults)
        }),
        "use the default settings; SETTings:SAVE keeps them",
    ),
];

fn apply(state: &State<'_>, kept: Kept) -> Done {
    state.apply(kept).map_err(|error| ErrorEntry::with(Code::SETTING, error))
}

fn range(field: &Field, defaults: &Kept) -> Range {
    Range::new(field.quantity(), field.least, field.greatest, (field.read)(defaults))
}

/// Sets or queries a setting; `None` if there is none of this name.
pub(super) fn field(
    state: &State<'_>,
    name: &[u8],
    is_query: bool,
    parameters: &mut Parameters<'_>,
    reply: &mut dyn Write,
) -> Option<Done> {
    let field = Field::named(name)?;
    Some(if is_query { query(state, field, parameters, reply) } else { set(state, field, parameters) })
}

fn query(state: &State<'_>, field: &Field, parameters: &mut Parameters<'_>, reply: &mut dyn Write) -> Done {
    let range = range(field, &state.settings.defaults);
    let value = value_or_keyword(parameters, &range, || (field.read)(&state.settings.kept.get()))?;
    Ok(write!(reply, "{}", state.with_unit(value, range.quantity.unit))?)
}

fn set(state: &State<'_>, field: &Field, parameters: &mut Parameters<'_>) -> Done {
    let value = parameters.number(&range(field, &state.settings.defaults))?;
    parameters.end()?;
    state.require_at_rest()?;
    let mut kept = state.settings.kept.get();
    (field.write)(&mut kept, value);
    apply(state, kept)
}

/// Lines of `HELP?`: command and query of each setting.
pub(super) fn help(line: usize, out: &mut dyn Write) -> Result<bool, fmt::Error> {
    let Some(field) = FIELDS.get(line >> 1) else { return Ok(false) };
    write!(out, "SETTings:{}", field.name)?;
    if line & 1 == 1 {
        out.write_str("?  the setting")?;
    } else {
        let range = range(field, &Kept::default());
        let note = if field.is_scale { "scale; acts after SETTings:SAVE and the next power-on" } else { "the drive must be off" };
        write!(out, " <{range}>  {note}")?;
    }
    Ok(true)
}

/// A setting and its value.
pub(super) fn line(state: &State<'_>, line: usize, out: &mut dyn Write) -> Result<bool, fmt::Error> {
    let Some(field) = FIELDS.get(line) else { return Ok(false) };
    write!(out, "{} {}", field.name, state.with_unit((field.read)(&state.settings.kept.get()), field.quantity().unit))?;
    Ok(true)
}
