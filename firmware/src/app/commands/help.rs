//! `HELP?`: the whole tree, one line for each thing that can be said or asked, from the tables that dispatch.
//!
//! A line begins with the header as it can be typed, then what is behind it in angle brackets, two blanks, and words. An empty line ends the list.

use super::{Act, Entry, GROUPS, List, entry, profile, settings};
use crate::console::text::Writer;
use crate::words::words;

pub(super) const ENTRIES: &[Entry] = &[entry!("HELP", Act::List(List::Help), "this list; an empty line ends it")];

/// A line of the list; `None` after the last.
pub fn help_line(mut line: usize, out: &mut Writer<'_>) -> Option<()> {
    for entry in GROUPS.iter().flat_map(|group| group.iter()) {
        for asks in [false, true] {
            if !entry.act.is_possible(asks) {
                continue;
            }
            if line == 0 {
                write(entry, asks, out);
                return Some(());
            }
            line -= 1;
        }
    }
    let profiles = 2 * crate::profile::PARAMETERS.len();
    if line < profiles { profile::help(line, out) } else { settings::help(line - profiles, out) }
}

fn write(entry: &Entry, asks: bool, out: &mut Writer<'_>) {
    out.text(entry.header).text(if asks { "?" } else { "" });
    match (&entry.act, asks) {
        (Act::Number { range, .. }, false) => {
            range.write(out.text(" <"));
            out.byte(b'>');
        }
        (Act::Words { words, .. }, false) => {
            for (n, word) in words.iter().enumerate() {
                out.text(if n == 0 { " <" } else { "|" }).text(word);
            }
            out.byte(b'>');
        }
        (Act::Switch { .. }, false) => drop(out.text(" <ON|OFF>")),
        (Act::AskList(what, _), true) | (Act::Take(what, _) | Act::TakeAndSay(what, ..), false) => drop(out.byte(b' ').words(*what)),
        (Act::Number { range, .. }, true) if !range.quantity.unit.is_empty() => drop(out.text(" -> ").text(range.quantity.unit)),
        (Act::Ask(unit, _), true) if !unit.is_empty() => drop(out.text(" -> ").text(unit)),
        (Act::Say(what, _), true) => drop(out.text(" -> ").words(*what)),
        _ => {}
    }
    out.text("  ").words(entry.says);
}
