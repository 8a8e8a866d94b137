//! An effect hidden in the simulated stand, of which nobody is told.

use std::collections::BTreeMap;
use std::fmt;

use drive_model::{CATALOGUE, ParameterKind};
use hal_sim::plant::Stand;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use crate::words::nearest;

/// What was hidden.
#[derive(Debug, Clone, PartialEq)]
pub struct HiddenEffect {
    /// The effect.
    pub effect: &'static str,
    /// Its parameters.
    pub parameters: BTreeMap<String, f64>,
}

impl fmt::Display for HiddenEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.effect)?;
        for (k, (name, value)) in self.parameters.iter().enumerate() {
            write!(f, "{} {name} = {value:.4e}", if k == 0 { ":" } else { "," })?;
        }
        Ok(())
    }
}

/// Seed of the magnitudes where an effect is named and no number given.
const NAMED_SEED: u64 = 1;

/// Hides an effect in `stand`: the one named, or one drawn by the number, among those that the stand does not have.
///
/// # Errors
/// A word that is neither a number nor an effect, with the nearest that is.
pub fn hide(word: &str, stand: &mut Stand) -> Result<HiddenEffect, String> {
    let (card, seed) = match word.parse::<u64>() {
        Ok(seed) => {
            let free: Vec<_> =
                CATALOGUE.iter().filter(|c| !stand.effects.contains_key(c.id) && !replaces_what_is_there(c.id, stand)).collect();
            let mut draw = Xoshiro256PlusPlus::seed_from_u64(seed);
            let card = free.get((uniform(&mut draw) * free.len() as f64) as usize).ok_or("the stand already has every effect")?;
            (**card, seed)
        }
        Err(_) => {
            let card = drive_model::card(word).ok_or_else(|| {
                let hint = nearest(word, CATALOGUE.iter().map(|c| c.id)).map_or(String::new(), |n| format!("; did you mean `{n}`?"));
                format!("`{word}` is neither a number nor an effect of the catalogue{hint} (`stand effects` lists them)")
            })?;
            (card, NAMED_SEED)
        }
    };
    let mut draw = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x5741_4e44);
    let mut parameters = BTreeMap::new();
    for p in card.parameters {
        let (low, high) = p.simulated_range;
        let mut value = low + (high - low) * uniform(&mut draw);
        match p.kind {
            ParameterKind::HarmonicOrder => value = value.round(),
            ParameterKind::Signed if uniform(&mut draw) < 0.5 => value = -value,
            _ => {}
        }
        parameters.insert(p.name.to_owned(), value);
    }
    stand.effects.insert(card.id.to_owned(), parameters.clone());
    Ok(HiddenEffect { effect: card.id, parameters })
}

/// A drive has one shaft.
fn replaces_what_is_there(id: &str, stand: &Stand) -> bool {
    let shafts = ["compliance", "backlash"];
    shafts.contains(&id) && shafts.iter().any(|s| stand.effects.contains_key(*s))
}

/// In [0, 1), with 53 bits.
fn uniform(draw: &mut Xoshiro256PlusPlus) -> f64 {
    (draw.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}
