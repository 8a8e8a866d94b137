//! `effects`: the catalogue.

use drive_model::card;
use pyo3::prelude::*;
use stand_report as report;

use crate::answer::Answer;
use crate::model::chosen;

/// The catalogue of effects, or one effect of it.
#[pyfunction]
#[pyo3(signature = (effect=None))]
pub fn effects(effect: Option<&str>) -> PyResult<Answer> {
    let Some(id) = effect else {
        return Ok(Answer::new(&report::effects::list_json(), report::effects::list_text(false), report::effects::list_html()));
    };
    let known: Vec<&'static str> = drive_model::cards().iter().map(|card| card.id).collect();
    let card = chosen("effect", id, &known, card(id))?;
    Ok(Answer::new(&report::effects::effect_json(card), report::effects::effect_text(card, false), report::effects::effect_html(card)))
}
