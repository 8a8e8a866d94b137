//! The catalogue as JSON.

use drive_model::{Card, Domain, ParameterKind, cards};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::family;
use crate::json::schema_of;
use crate::json::value;

#[derive(Serialize, JsonSchema)]
struct ListJson {
    effects: Vec<EffectJson>,
}

#[derive(Serialize, JsonSchema)]
struct EffectJson {
    id: &'static str,
    title: &'static str,
    equation: &'static str,
    room: &'static str,
    coordinate: &'static str,
    parameters: Vec<ParameterJson>,
    what: &'static str,
    shows: &'static str,
    experiment: &'static str,
    looks_like: &'static str,
    family: Vec<&'static str>,
    reference: &'static str,
}

#[derive(Serialize, JsonSchema)]
struct ParameterJson {
    name: &'static str,
    unit: &'static str,
    says: &'static str,
    /// The ends of an open range are infinite, which is `null` in JSON.
    range: [f64; 2],
    start: f64,
    kind: &'static str,
}

/// The catalogue: `{"effects": [card, …]}`.
pub fn list_json() -> Value {
    value(&ListJson { effects: cards().iter().map(|c| effect(c)).collect() })
}

/// One effect.
pub fn effect_json(card: &Card) -> Value {
    value(&effect(card))
}

fn effect(card: &Card) -> EffectJson {
    let parameters = card.parameters.iter().map(|p| ParameterJson {
        name: p.name,
        unit: p.unit,
        says: p.description,
        range: [p.range.0, p.range.1],
        start: p.start,
        kind: kind(p.kind),
    });
    let d = &card.description;
    EffectJson {
        id: card.id,
        title: card.title,
        equation: card.equation,
        room: domain(card.domain),
        coordinate: card.coordinate.name(),
        parameters: parameters.collect(),
        what: d.summary,
        shows: d.signature,
        experiment: d.experiment,
        looks_like: d.similar,
        family: family(card),
        reference: d.reference,
    }
}

fn domain(domain: Domain) -> &'static str {
    match domain {
        Domain::Torque => "torque",
        Domain::Electrical => "electrical",
        Domain::Measurement => "measurement",
    }
}

fn kind(kind: ParameterKind) -> &'static str {
    match kind {
        ParameterKind::NonNegative => "level",
        ParameterKind::Signed => "signed",
        ParameterKind::Positive => "positive",
        ParameterKind::Fraction => "share",
        ParameterKind::Phase => "phase",
        ParameterKind::HarmonicOrder => "order",
        ParameterKind::Periodicity => "periodicity",
        ParameterKind::EventTime => "moment",
    }
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("effects", schema_of::<ListJson>()), ("effects ID", schema_of::<EffectJson>())]
}
