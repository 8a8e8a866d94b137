//! One effect at the values from which it is tried.

use drive_model::{Card, Elastic, Screening};

use super::reasons::NotVisible;
use crate::identify::fit::PreparedLog;

/// One effect at one set of values.
#[derive(Debug, Clone)]
pub struct Trial {
    /// The effect.
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
