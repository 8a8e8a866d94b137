//! Model files as text: contents, and changes made by an explanation.

use crate::json::schema_of;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::json::{Entries, value};
use super::{digits, plain};
use identification::identify::explain::Explanation;
use identification::model::{Model, ModelParameter};

/// Input, outputs, effects and parameters of a model.
pub fn text(model: &Model) -> String {
    let axis = model.axis();
    let outputs = match model.outputs() {
        Some(outputs) => outputs.iter().map(|o| axis.column(o.column())).collect::<Vec<_>>().join(", "),
        None => "all available in the log".to_owned(),
    };
    let effects = model.effect_names();
    let mut text = format!("{}\n", model.name());
    text += &format!("  input    {}\n  outputs  {outputs}\n", axis.column(model.input().column()));
    text += &format!("  effects  {}\n\n", if effects.is_empty() { "none".to_owned() } else { effects.join(", ") });
    let width = model.parameters().iter().map(|p| axis.parameter(&p.name).chars().count()).max().unwrap_or(0);
    for p in model.parameters() {
        let description = p.info.map_or("", |i| axis.quantity(i.description));
        let mark = if p.fixed {
            "fixed"
        } else if p.filled_in {
            "start"
        } else {
            ""
        };
        text += &format!("  {:<width$}  {:>12}  {mark:<5}  {description}\n", axis.parameter(&p.name), digits(p.value));
    }
    for effect in model.user_effects() {
        text += &format!("\n  {}: {} += {}\n", effect.name, effect.summing_point.key_on(axis), effect.expression);
    }
    for remark in model.remarks() {
        text += &format!("  {remark}\n");
    }
    text
}

#[derive(Serialize, JsonSchema)]
struct ModelJson<'a> {
    model: &'a str,
    axis: &'static str,
    input: &'static str,
    /// `null`: all that a log has.
    outputs: Option<Vec<&'static str>>,
    effects: Vec<String>,
    parameters: Entries<ParameterJson>,
    expressions: Vec<ExpressionJson<'a>>,
    remarks: Vec<String>,
}

#[derive(Serialize, JsonSchema)]
struct ParameterJson {
    value: f64,
    unit: Option<&'static str>,
    fixed: bool,
    /// The file omits it.
    is_start: bool,
    description: Option<&'static str>,
}

#[derive(Serialize, JsonSchema)]
struct ExpressionJson<'a> {
    name: &'a str,
    summing_point: &'static str,
    expression: String,
}

/// Input, outputs, effects and parameters of a model as JSON.
pub fn json(model: &Model) -> Value {
    let axis = model.axis();
    let parameter = |p: &ModelParameter| ParameterJson {
        value: p.value,
        unit: p.info.map(|info| axis.unit(info.unit)),
        fixed: p.fixed,
        is_start: p.filled_in,
        description: p.info.map(|info| axis.quantity(info.description)),
    };
    value(&ModelJson {
        model: model.name(),
        axis: axis.name(),
        input: axis.column(model.input().column()),
        outputs: model.outputs().map(|outputs| outputs.iter().map(|o| axis.column(o.column())).collect()),
        effects: model.effect_names(),
        parameters: Entries(model.parameters().iter().map(|p| (axis.parameter(&p.name), parameter(p))).collect()),
        expressions: model
            .user_effects()
            .iter()
            .map(|e| ExpressionJson { name: &e.name, summing_point: e.summing_point.key_on(axis), expression: e.expression.to_string() })
            .collect(),
        remarks: model.remarks().iter().map(ToString::to_string).collect(),
    })
}

/// Effects and parameter values that differ between the explained model, written to `path`, and the model as given.
pub fn changes_text(e: &Explanation, given: &Model, path: &Path) -> String {
    let mut text = format!("{}: ", path.display());
    text += &match e.missing.as_slice() {
        [] => "written with fitted parameters; no effect was added.".to_owned(),
        names => format!("{} added; all free parameters fitted.", names.join(", ")),
    };
    for p in e.model.parameters() {
        let line = match given.value(&p.name) {
            None => format!("new: {}", plain(p.value, 5)),
            Some(before) if before != p.value => format!("{}, was {}", plain(p.value, 5), plain(before, 5)),
            Some(_) => continue,
        };
        text += &format!("\n  {:<24}  {line}", e.model.axis().parameter(&p.name));
    }
    text
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("model", schema_of::<ModelJson<'_>>())]
}
