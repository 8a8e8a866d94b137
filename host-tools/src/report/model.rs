//! Model files as text: contents, and changes made by an explanation.

use std::path::Path;

use super::{digits, plain};
use crate::identify::explain::Explanation;
use crate::model::Model;

/// Input, outputs, effects and parameters of a model.
pub fn text(model: &Model) -> String {
    let outputs = match model.outputs() {
        Some(outputs) => outputs.iter().map(|o| o.column()).collect::<Vec<_>>().join(", "),
        None => "all available in the log".to_owned(),
    };
    let effects = model.effect_names();
    let mut text = format!("{}\n", model.name());
    text += &format!("  input    {}\n  outputs  {outputs}\n", model.input().column());
    text += &format!("  effects  {}\n\n", if effects.is_empty() { "none".to_owned() } else { effects.join(", ") });
    let width = model.parameters().iter().map(|p| p.name.chars().count()).max().unwrap_or(0);
    for p in model.parameters() {
        let description = p.info.map_or("", |i| i.description);
        let mark = if p.fixed {
            "fixed"
        } else if p.filled_in {
            "start"
        } else {
            ""
        };
        text += &format!("  {:<width$}  {:>12}  {mark:<5}  {description}\n", p.name, digits(p.value));
    }
    for effect in model.user_effects() {
        text += &format!("\n  {}: {} += {}\n", effect.name, effect.summing_point.key(), effect.expression);
    }
    for remark in model.remarks() {
        text += &format!("  {remark}\n");
    }
    text
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
        text += &format!("\n  {:<24}  {line}", p.name);
    }
    text
}
