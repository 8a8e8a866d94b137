//! An effect added to the simulated stand without disclosure, as a task for identification.

use std::collections::BTreeMap;
use std::fmt;

use drive_model::{Card, Elastic, ParameterKind, cards};
use hal_sim::plant::Stand;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use identification::words::nearest;

/// The effect that was added.
#[derive(Debug, Clone, PartialEq)]
pub struct HiddenEffect {
    /// Identifier in the catalogue.
    pub effect: &'static str,
    /// Values of its parameters.
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

/// Why no effect was added.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum HideError {
    /// The argument is neither a number nor an effect.
    #[error("`{argument}` is neither a seed nor an effect of the catalogue{} (`stand effects` lists all)", near.as_ref().map_or(String::new(), |n| format!("; did you mean `{n}`?")))]
    Unknown {
        /// The argument.
        argument: String,
        /// The nearest identifier.
        near: Option<String>,
    },
    /// No effect is left to draw.
    #[error("the stand already has every effect of the catalogue")]
    NoneLeft,
}

/// Seed of the parameter values where the effect is named.
const NAMED_SEED: u64 = 1;
/// Separates the generator of the parameter values from that of the effect.
const PARAMETER_STREAM: u64 = 0x5741_4e44;

/// Adds an effect to `stand`: the effect named by `argument`, or one drawn with `argument` as seed from those that the stand lacks.
/// Parameter values are drawn from the ranges in the effect's card.
///
/// # Errors
/// `argument` is neither a seed nor an effect, or the stand has every effect.
pub fn hide(argument: &str, stand: &mut Stand) -> Result<HiddenEffect, HideError> {
    let (card, seed) = match argument.parse::<u64>() {
        Ok(seed) => {
            let free: Vec<_> = cards().iter().filter(|c| !stand.effects.contains_key(c.id) && !is_second_shaft(c, stand)).collect();
            let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
            let card = free.get((uniform(&mut generator) * free.len() as f64) as usize).ok_or(HideError::NoneLeft)?;
            (**card, seed)
        }
        Err(_) => {
            let card = drive_model::card(argument).ok_or_else(|| HideError::Unknown {
                argument: argument.to_owned(),
                near: nearest(argument, cards().iter().map(|c| c.id)),
            })?;
            (card, NAMED_SEED)
        }
    };
    Ok(add(card, seed, stand))
}

/// Adds an effect to `stand`, with parameter values drawn by `seed` from the ranges in its card.
pub fn add(card: &Card, seed: u64, stand: &mut Stand) -> HiddenEffect {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed ^ PARAMETER_STREAM);
    let mut parameters = BTreeMap::new();
    for p in card.parameters {
        let (low, high) = p.simulated_range;
        let mut value = low + (high - low) * uniform(&mut generator);
        match p.kind {
            ParameterKind::HarmonicOrder => value = value.round(),
            ParameterKind::Signed if uniform(&mut generator) < 0.5 => value = -value,
            _ => {}
        }
        parameters.insert(p.name.to_owned(), value);
    }
    stand.effects.insert(card.id.to_owned(), parameters.clone());
    HiddenEffect { effect: card.id, parameters }
}

/// The effect has a shaft, and the stand has one already: a drive has one shaft.
fn is_second_shaft(card: &Card, stand: &Stand) -> bool {
    let is_shaft = |card: &Card| card.elastic == Some(Elastic::Shaft);
    is_shaft(card) && cards().iter().any(|c| is_shaft(c) && stand.effects.contains_key(c.id))
}

/// Uniform in [0, 1), with 53 bits.
fn uniform(generator: &mut Xoshiro256PlusPlus) -> f64 {
    (generator.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}
