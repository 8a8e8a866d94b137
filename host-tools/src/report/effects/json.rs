//! Pages as JSON.

use drive_model::{CATALOGUE, Card, Kind, Room};
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
            "says": p.says,
            "range": [finite(p.range.0), finite(p.range.1)],
            "start": finite(p.start),
            "kind": kind(p.kind),
        })
    });
    json!({
        "id": card.id,
        "title": card.title,
        "equation": card.equation,
        "room": match card.room {
            Room::Torque => "torque",
            Room::Electrical => "electrical",
            Room::Measurement => "measurement",
        },
        "coordinate": card.coordinate.name(),
        "parameters": parameters.collect::<Vec<_>>(),
        "what": card.account.what,
        "shows": card.account.shows,
        "experiment": card.account.experiment,
        "looks_like": card.account.looks_like,
        "family": family(card),
        "reference": card.account.reference,
    })
}

fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Level => "level",
        Kind::Signed => "signed",
        Kind::Positive => "positive",
        Kind::Share => "share",
        Kind::Phase => "phase",
        Kind::Order => "order",
        Kind::Moment => "moment",
    }
}
