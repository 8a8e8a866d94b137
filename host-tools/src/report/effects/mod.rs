//! The catalogue of effects as pages: a list, and for each effect an account with a picture that is computed, not drawn.
//!
//! In: a [`Card`]. Out: text for a terminal, JSON, one HTML file. The picture is the default stand, simulated with and without the effect
//! under an [`Experiment`] that shows it: both traces, and their difference over the coordinate in which it shows. An effect that is new
//! in the catalogue has its page at once: the experiment follows from its room and coordinate.

mod experiment;
mod html;
mod json;
mod picture;
mod simulate;
mod text;

use drive_model::{CATALOGUE, Card, Domain};

pub use experiment::{Experiment, Motion, Over, Shown};
pub use html::{effect_html, list_html};
pub use json::{effect_json, list_json};
pub use simulate::{Beside, Trace, beside};
pub use text::{effect_text, list_text};

/// The rooms in the order in which they are listed.
const ROOMS: [Domain; 3] = [Domain::Torque, Domain::Electrical, Domain::Measurement];

/// The effects of a room, in the catalogue's order.
fn of_room(room: Domain) -> impl Iterator<Item = &'static Card> {
    CATALOGUE.iter().copied().filter(move |c| c.domain == room)
}

/// The other effects of the same family: those that some logs cannot tell from this one.
fn family(card: &Card) -> Vec<&'static str> {
    CATALOGUE.iter().filter(|c| !card.family.is_empty() && c.family == card.family && c.id != card.id).map(|c| c.id).collect()
}

/// A physical range in words.
fn range((low, high): (f64, f64)) -> String {
    let number = |x: f64| if (x - std::f64::consts::TAU).abs() < 1e-9 { "2π".to_owned() } else { crate::report::digits(x) };
    match (low.is_finite(), high.is_finite()) {
        (true, true) => format!("{} … {}", number(low), number(high)),
        (true, false) => format!("≥ {}", number(low)),
        (false, true) => format!("≤ {}", number(high)),
        (false, false) => "any".to_owned(),
    }
}

/// A unit, empty for a pure number.
fn unit(unit: &str) -> &str {
    if unit == "1" { "" } else { unit }
}

#[cfg(test)]
mod tests;
