//! The catalogue: the built-in effects, and those that a program adds before it uses the catalogue.

use std::sync::OnceLock;

use crate::effects::BUILT_IN;
use crate::{Card, Law, LawScalar};

/// Why the catalogue cannot be extended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExtendError {
    /// The catalogue has been read already, or extended before.
    InUse,
    /// An effect of the catalogue has this identifier already.
    Duplicate(&'static str),
}

impl std::fmt::Display for ExtendError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ExtendError::InUse => f.write_str("the catalogue is in use already: extend it once, before anything reads it"),
            ExtendError::Duplicate(id) => write!(f, "the catalogue already has an effect `{id}`"),
        }
    }
}

impl std::error::Error for ExtendError {}

/// The cards of all effects, set at the first use and constant from then on.
static CARDS: OnceLock<Vec<&'static Card>> = OnceLock::new();

/// Adds effects behind the built-in ones, once, before anything reads the catalogue.
///
/// # Errors
/// The catalogue is in use already, or an identifier exists twice.
pub fn extend(extension: &[&'static Card]) -> Result<(), ExtendError> {
    let mut cards = BUILT_IN.to_vec();
    for new in extension {
        if cards.iter().any(|card| card.id == new.id) {
            return Err(ExtendError::Duplicate(new.id));
        }
        cards.push(new);
    }
    CARDS.set(cards).map_err(|_| ExtendError::InUse)
}

/// The cards of all effects, in the order of the catalogue.
pub fn cards() -> &'static [&'static Card] {
    CARDS.get_or_init(|| BUILT_IN.to_vec())
}

/// The card of the effect with this identifier.
pub fn card(id: &str) -> Option<&'static Card> {
    cards().iter().copied().find(|card| card.id == id)
}

/// The law of the effect with this identifier, in the scalar `S`.
pub fn law<S: LawScalar>(id: &str) -> Option<Box<dyn Law<S>>> {
    card(id).map(|card| S::law(card.law))
}
