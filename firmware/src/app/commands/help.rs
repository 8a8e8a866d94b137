//! `HELP?`: all commands and queries, one per line, from the tables that dispatch them.
//!
//! A line consists of the header, the parameters in angle brackets or the reply after `->`, two spaces, and a description. An empty line
//! ends the list.

use super::{Action, Entry, GROUPS, List, entry, profile, settings};
use core::fmt::{self, Write};

pub(super) const ENTRIES: &[Entry] = &[entry("HELP", Action::ListQuery(List::Help), "this list")];

/// Writes one line of the list, numbered from 0; returns `false` after the last line.
pub(super) fn line(line: usize, out: &mut dyn Write) -> Result<bool, fmt::Error> {
    let entries = GROUPS.iter().flat_map(|group| group.iter());
    // An entry is listed as a command and as a query, as far as it has them.
    let forms = entries.flat_map(|entry| [false, true].map(|is_query| (entry, is_query)));
    let mut forms = forms.filter(|(entry, is_query)| entry.action.has(*is_query));
    let form_count = forms.clone().count();
    if let Some((entry, is_query)) = forms.nth(line) {
        write_entry(entry, is_query, out)?;
        return Ok(true);
    }
    let profile_line = line.saturating_sub(form_count);
    // Each parameter has two lines: command and query.
    let profile_lines = 2 * crate::profile::PARAMETERS.len();
    if profile_line < profile_lines { profile::help(profile_line, out) } else { settings::help(profile_line - profile_lines, out) }
}

fn write_entry(entry: &Entry, is_query: bool, out: &mut dyn Write) -> fmt::Result {
    write!(out, "{}{}", entry.header, if is_query { "?" } else { "" })?;
    match (&entry.action, is_query) {
        (Action::Number { range, .. }, false) => write!(out, " <{range}>")?,
        (Action::Choice { words, .. }, false) => {
            for (n, word) in words.iter().enumerate() {
                write!(out, "{}{word}", if n == 0 { " <" } else { "|" })?;
            }
            out.write_char('>')?;
        }
        (Action::Switch { .. }, false) => out.write_str(" <ON|OFF>")?,
        (Action::PartialListQuery(parameters, _), true)
        | (Action::Command(parameters, _) | Action::CommandAndQuery(parameters, ..), false) => write!(out, " {parameters}")?,
        (Action::Number { range, .. }, true) if !range.quantity.unit.is_empty() => write!(out, " -> {}", range.quantity.unit)?,
        (Action::NumberQuery(unit, _), true) if !unit.is_empty() => write!(out, " -> {unit}")?,
        (Action::TextQuery(reply, _), true) => write!(out, " -> {reply}")?,
        (Action::ListQuery(List::Errors), true) => out.write_str(" -> number,text{,number,text}")?,
        (Action::ListQuery(_), true) => out.write_str(" -> block")?,
        _ => {}
    }
    write!(out, "  {}", entry.help)
}
