//! The catalogue of effects as text, HTML and JSON: a list, and a page for each effect with a simulated picture.
//!
//! In: a [`Card`]. Out: text; nothing is printed or written here. The picture shows the default stand, simulated without noise, with and
//! without the effect under a [`drive_model::Demonstration`]: both traces, and their difference over the coordinate of the effect. The
//! demonstration follows from the card, so that a new effect has its page at once.

mod demonstration;
mod html;
mod json;
mod markdown;
mod plots;
mod simulate;
mod text;

use drive_model::{Card, Domain, cards};

pub use demonstration::demonstration;
pub use html::{effect_html, list_html};
pub(crate) use json::schemas;
pub use json::{effect_json, list_json};
pub use markdown::catalogue_markdown;
pub use simulate::{SimulatedPair, Trace, simulated_pair};
pub use text::{effect_text, list_text};

/// The domains in the order of the list.
const DOMAINS: [Domain; 3] = [Domain::Torque, Domain::Electrical, Domain::Measurement];

/// The effects of a domain, in the catalogue's order.
fn of_domain(domain: Domain) -> impl Iterator<Item = &'static Card> {
    cards().iter().copied().filter(move |c| c.domain == domain)
}

/// The other effects of the same family: those that some logs do not distinguish from this one.
fn family(card: &Card) -> Vec<&'static str> {
    cards().iter().filter(|c| !card.family.is_empty() && c.family == card.family && c.id != card.id).map(|c| c.id).collect()
}

/// Terms of a page with their texts.
fn description(card: &Card) -> Vec<(&'static str, String)> {
    let d = &card.description;
    let mut entries = vec![
        ("Signature", d.signature.to_owned()),
        ("Experiment", d.experiment.to_owned()),
        ("Similar effects", d.similar.to_owned()),
        ("Reference", d.reference.to_owned()),
    ];
    let others = family(card);
    if !others.is_empty() {
        entries.insert(3, ("Family", format!("{}. Some logs do not distinguish these from {}.", others.join(", "), card.id)));
    }
    entries
}

/// A physical range.
fn range((low, high): (f64, f64)) -> String {
    let number = |x: f64| if (x - std::f64::consts::TAU).abs() < 1e-9 { "2π".to_owned() } else { crate::digits(x) };
    match (low.is_finite(), high.is_finite()) {
        (true, true) => format!("{} … {}", number(low), number(high)),
        (true, false) => format!("≥ {}", number(low)),
        (false, true) => format!("≤ {}", number(high)),
        (false, false) => "any".to_owned(),
    }
}

/// A unit; empty for a pure number.
fn unit(unit: &str) -> &str {
    if unit == "1" { "" } else { unit }
}

#[cfg(test)]
mod tests;
