//! One effect at the values from which it is tried.

use std::ops::Range;

use drive_model::{Card, Elastic, ParameterKind, Screening};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::identify::explain::answer::reasons::NotVisible;
use crate::identify::fit::Parameters;
use crate::model::Model;
use crate::recording::PreparedLog;

/// One effect at one set of values.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Trial {
    /// The effect.
    #[serde(with = "by_name")]
    pub card: &'static Card,
    /// Values of its parameters, in the card's order.
    pub values: Vec<f64>,
    /// Range of each.
    pub ranges: Vec<(f64, f64)>,
    /// The parameters that are free while it is screened.
    pub screened: Vec<bool>,
    /// The parameters that are free while the model is fitted with it.
    pub fitted: Vec<bool>,
    /// The effect is absent at these values: its sensitivity is enough, and many trials share one simulation.
    pub absent: bool,
    /// Source of the rate channel, where the effect depends on it and the log does not state it.
    pub rate_from_encoder: Option<bool>,
}

impl Trial {
    /// Its simulation takes many steps per row: an effect with a shaft.
    pub fn is_expensive(&self) -> bool {
        self.card.elastic == Some(Elastic::Shaft)
    }

    /// It acts in a few rows: the held-out rows need not contain any of them, and then neither confirm nor refute it.
    pub fn acts_in_few_rows(&self) -> bool {
        matches!(self.card.screening, Screening::AngleJumps(_))
    }

    /// It adds the winding temperature to the state of the model, which cannot be shared with other trials.
    pub fn adds_thermal_state(&self, data: &PreparedLog) -> bool {
        matches!(self.card.screening, Screening::HeatCapacities(_)) && data.temp_C.is_none()
    }

    /// A model with this effect at fitted values (all parameters; the effect's `own` ones are last), and the name of the effect there.
    pub fn added_to(&self, model: &Model, parameters: &Parameters, own: Range<usize>) -> (Model, String) {
        let name = model.next_name(self.card.id);
        let mut next = model.clone();
        if next.add(&name).is_err() {
            return (next, name);
        }
        for p in &parameters.list[..own.start] {
            let _ = next.set(&p.name, p.value);
        }
        let names: Vec<String> = match next.effects().iter().find(|e| e.name() == name) {
            Some(found) => found.parameters.iter().map(|&k| next.parameters()[k].name.clone()).collect(),
            None => return (next, name),
        };
        for (k, name) in names.iter().enumerate() {
            let p = &parameters.list[own.start + k];
            let _ = next.set(name, p.value.clamp(p.range.0, p.range.1));
            if !self.fitted[k] && p.kind != ParameterKind::HarmonicOrder {
                let _ = next.fix(name, true);
            }
        }
        (next, name)
    }

    /// It has the same structure: effect, free parameters and values of the others.
    pub fn has_structure_of(&self, other: &Trial) -> bool {
        let held = |t: &Trial| t.values.iter().zip(&t.fitted).filter(|(_, fitted)| !**fitted).map(|(v, _)| *v).collect::<Vec<_>>();
        self.card.id == other.card.id
            && self.fitted == other.fitted
            && held(self) == held(other)
            && self.rate_from_encoder == other.rate_from_encoder
    }
}

/// An effect that the logs cannot show.
#[derive(Debug, Clone)]
pub struct Invisible {
    /// The effect.
    pub card: &'static Card,
    /// The reason.
    pub reason: NotVisible,
}

/// An effect of the catalogue by its name.
mod by_name {
    use super::*;

    pub fn serialize<S: Serializer>(card: &&'static Card, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(card.id)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<&'static Card, D::Error> {
        let id = String::deserialize(from)?;
        drive_model::card(&id).ok_or_else(|| serde::de::Error::custom(format!("no effect {id:?} in the catalogue")))
    }
}
