//! Names of effects in sentences.

use drive_model::Card;

/// The card of an effect: that of `cogging` for `cogging#2`.
pub fn card(name: &str) -> Option<&'static Card> {
    drive_model::card(name.split('#').next().unwrap_or(name))
}

/// A sentence as a clause of another: its first letter in lower case.
pub fn first_lower(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |c| c.to_lowercase().to_string() + letters.as_str())
}
