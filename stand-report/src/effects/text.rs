//! The catalogue as text for a terminal.

use drive_model::{Card, cards};

use super::{DOMAINS, description, of_domain, range, unit};
use crate::{Style, digits};

/// The catalogue by domain: name, meaning and equation of each effect.
pub fn list_text(colour: bool) -> String {
    let style = Style { colour, ..Style::default() };
    let width = cards().iter().map(|c| c.id.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for domain in DOMAINS {
        text.push_str(&format!("{}\n", style.strong(domain.title())));
        for card in of_domain(domain) {
            let indent = " ".repeat(width + 4);
            let name = format!("  {:width$}  ", card.id);
            text.push_str(&style.wrapped(&name, &indent, card.description.summary));
            text.push_str(&style.faint(&style.wrapped(&indent, &format!("{indent}  "), card.equation)));
        }
        text.push('\n');
    }
    text.push_str(&style.wrapped("", "", "`stand effects ID` describes an effect; `stand model add MODEL ID` adds it to a model."));
    text
}

/// The description of one effect.
pub fn effect_text(card: &Card, colour: bool) -> String {
    let style = Style { colour, ..Style::default() };
    let mut text = format!("{}  {}\n", style.strong(card.id), card.title);
    let domain = card.domain.title().to_lowercase();
    text.push_str(&style.faint(&format!("{domain}; coordinate: {}\n\n", card.coordinate.name())));
    text.push_str(&style.wrapped("    ", "      ", card.equation));
    text.push('\n');
    let columns: Vec<[String; 3]> = card.parameters.iter().map(|p| [p.name.to_owned(), unit(p.unit).to_owned(), range(p.range)]).collect();
    let width = |k: usize| columns.iter().map(|c| c[k].chars().count()).max().unwrap_or(0);
    let (names, units, ranges) = (width(0), width(1), width(2));
    for (p, [name, unit, range]) in card.parameters.iter().zip(&columns) {
        let line = format!("  {name:names$}  {unit:units$}  {range:ranges$}  start {}", digits(p.start));
        text.push_str(&format!("{}\n", line.trim_end()));
        text.push_str(&style.faint(&style.wrapped("      ", "      ", p.description)));
    }
    text.push('\n');
    let indent = " ".repeat(17);
    text.push_str(&style.wrapped(&format!("{:<17}", "Summary"), &indent, card.description.summary));
    for (term, entry) in description(card) {
        text.push_str(&style.wrapped(&format!("{term:<17}"), &indent, &entry));
    }
    text.push('\n');
    let next = format!("`stand model add MODEL {0}` adds it to a model; `stand effects {0} --html {0}.html` plots it.", card.id);
    text.push_str(&style.wrapped("", "", &next));
    text
}
