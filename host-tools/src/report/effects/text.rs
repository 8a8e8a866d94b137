//! Pages for a terminal.

use drive_model::{CATALOGUE, Card};

use super::{ROOMS, family, of_room, range, unit};
use crate::report::{Style, digits};

/// The catalogue, room by room: name and equation of each effect.
pub fn list_text(colour: bool) -> String {
    let style = Style { colour, ..Style::default() };
    let width = CATALOGUE.iter().map(|c| c.id.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for room in ROOMS {
        text.push_str(&format!("{}\n", style.strong(room.title())));
        for card in of_room(room) {
            let indent = " ".repeat(width + 4);
            let name = format!("  {:width$}  ", card.id);
            text.push_str(&style.wrapped(&name, &indent, card.description.summary));
            text.push_str(&style.faint(&style.wrapped(&indent, &format!("{indent}  "), card.equation)));
        }
        text.push('\n');
    }
    text.push_str(&style.wrapped("", "", "`stand effects ID` tells of one; `stand model add MODEL ID` adds it to a model."));
    text
}

/// The account of one effect.
pub fn effect_text(card: &Card, colour: bool) -> String {
    let style = Style { colour, ..Style::default() };
    let mut text = format!("{}  {}\n", style.strong(card.id), card.title);
    text.push_str(&style.faint(&format!("{}; shows over {}\n\n", room_and(card), card.coordinate.name())));
    text.push_str(&style.wrapped("    ", "      ", card.equation));
    text.push('\n');
    let width = |of: &dyn Fn(usize) -> String| (0..card.parameters.len()).map(|k| of(k).chars().count()).max().unwrap_or(0);
    let column = |k: usize| card.parameters.get(k).map(|p| (p.name.to_owned(), unit(p.unit).to_owned(), range(p.range)));
    let names = width(&|k| column(k).map_or(String::new(), |c| c.0));
    let units = width(&|k| column(k).map_or(String::new(), |c| c.1));
    let ranges = width(&|k| column(k).map_or(String::new(), |c| c.2));
    for p in card.parameters {
        let line = format!("  {:names$}  {:units$}  {:ranges$}  start {}", p.name, unit(p.unit), range(p.range), digits(p.start));
        text.push_str(&format!("{}\n", line.trim_end()));
        text.push_str(&style.faint(&style.wrapped("      ", "      ", p.description)));
    }
    text.push('\n');
    let a = &card.description;
    let entries = [
        ("What it is", a.summary),
        ("How it shows", a.signature),
        ("Best seen by", a.experiment),
        ("Looks like it", a.similar),
        ("Read on", a.reference),
    ];
    let indent = " ".repeat(16);
    for (term, says) in entries {
        text.push_str(&style.wrapped(&format!("{term:<16}"), &indent, says));
    }
    let others = family(card);
    if !others.is_empty() {
        let says = format!("{}: some logs cannot tell these from {}", others.join(", "), card.id);
        text.push_str(&style.wrapped(&format!("{:<16}", "Family"), &indent, &says));
    }
    text.push('\n');
    let next = format!("`stand model add MODEL {0}` adds it; `stand effects {0} --html {0}.html` draws it.", card.id);
    text.push_str(&style.wrapped("", "", &next));
    text
}

fn room_and(card: &Card) -> String {
    card.domain.title().to_lowercase()
}
