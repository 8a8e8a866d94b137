//! Pages as JSON.

use drive_model::{CATALOGUE, Card, Domain, ParameterKind};
use serde_json::{Value, json};

use super::family;
use crate::report::finite;

/// The catalogue: `{"effects": [card, …]}`.
pub fn list_json() -> Value {
    json!({"effects": CATALOGUE.iter().map(|c| effect_json(c)).collect::<Vec<_>>()})
}

/// One effect; the ends of an open range are `null`.
pub fn effect_json(card: &Card) -> Value {
    let parameters = card.parameters.iter().map(|p| {
        json!({
            "name": p.name,
            "unit": p.unit,
            "says": p.description,
            "range": [finite(p.range.0), finite(p.range.1)],
            "start": finite(p.start),
            "kind": kind(p.kind),
        })
    });
    json!({
        "id": card.id,
        "title": card.title,
        "equation": card.equation,
        "room": match card.domain {
            Domain::Torque => "torque",
            Domain::Electrical => "electrical",
            Domain::Measurement => "measurement",
        },
        "coordinate": card.coordinate.name(),
        "parameters": parameters.collect::<Vec<_>>(),
        "what": card.description.summary,
        "shows": card.description.signature,
        "experiment": card.description.experiment,
        "looks_like": card.description.similar,
        "family": family(card),
        "reference": card.description.reference,
    })
}

fn kind(kind: ParameterKind) -> &'static str {
    match kind {
        ParameterKind::NonNegative => "level",
        ParameterKind::Signed => "signed",
        ParameterKind::Positive => "positive",
        ParameterKind::Fraction => "share",
        ParameterKind::Phase => "phase",
        ParameterKind::HarmonicOrder => "order",
        ParameterKind::EventTime => "moment",
    }
}
