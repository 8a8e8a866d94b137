//! Values of a calibrated characteristic, as text and JSON.

use super::{coverage_text, footnote, unit_suffix, with_expanded_u};
use crate::json::schema_of;
use crate::json::value;
use crate::{plain, significant};
use identification::statistics::uncertainty::COVERAGE_PROBABILITY;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use stand_analysis::calibrate::response_function::{Evaluated, StoredFunction};

/// One line for each value with its budget.
pub fn evaluated_text(function: &StoredFunction, values: &[(f64, Evaluated)]) -> String {
    let mut out = String::new();
    if let Some(t) = function.temperature {
        out += &format!("calibrated at {:.1} °C over ± {} {}\n", t.at_C, plain(function.full_scale, 4), function.input_unit);
    }
    for (at, q) in values {
        let (from, unit) = if q.name == "output" { ("rate", &function.input_unit) } else { ("output", &function.output_unit) };
        let to = if q.name == "output" { "output" } else { "rate" };
        out += &format!("{from} {}{}: {to} {}  ({})\n", plain(*at, 8), unit_suffix(unit), with_expanded_u(q), coverage_text(q));
        for c in q.contributions.iter().filter(|c| c.contribution() > 0.0) {
            out += &format!("  {:<24} {:>12}{}\n", c.source, significant(c.contribution(), 2), unit_suffix(&q.unit));
        }
    }
    out + &footnote() + "\n"
}

#[derive(Serialize, JsonSchema)]
struct Entry<'a> {
    at: f64,
    at_unit: &'a str,
    what: &'a str,
    value: f64,
    unit: &'a str,
    sigma: f64,
    dof: f64,
    k: f64,
    #[serde(rename = "U")]
    expanded_u: f64,
}

/// The answer of `stand records evaluate --json`.
pub fn evaluated_json(function: &StoredFunction, values: &[(f64, Evaluated)]) -> Value {
    let entry = |(at, q): &(f64, Evaluated)| {
        value(&Entry {
            at: *at,
            at_unit: if q.name == "output" { &function.input_unit } else { &function.output_unit },
            what: &q.name,
            value: q.value,
            unit: &q.unit,
            sigma: q.combined_u(),
            dof: q.effective_dof(),
            k: q.coverage_factor(COVERAGE_PROBABILITY),
            expanded_u: q.expanded_u(),
        })
    };
    Value::Array(values.iter().map(entry).collect())
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("records evaluate", schema_of::<Vec<Entry<'_>>>())]
}
