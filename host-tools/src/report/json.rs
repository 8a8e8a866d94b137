//! JSON that several topics share: finite numbers, failures, findings.

use serde_json::{Value, json};

use crate::identify::residual::Misfit;
use crate::log::plausible::Finding;

/// Below this a probability is said as 0, with its logarithm beside it.
const SMALLEST_P: f64 = 1e-300;

/// A number, or `null` where there is none.
pub fn finite(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

/// The findings of plausibility, as in `problems`.
pub fn problems_json(problems: &[Finding]) -> Value {
    problems.iter().map(|f| json!({"code": f.code.name(), "says": f.says, "columns": f.columns})).collect()
}

/// Failures, as in `failures`.
pub fn failures_json(failures: &[Misfit]) -> Value {
    failures
        .iter()
        .map(|f| {
            json!({
                "output": f.output.column(),
                "coordinate": f.coordinate.name(),
                "share": finite(f.share),
                "order": f.order,
                "p_value": if f.p_value < SMALLEST_P { json!(0.0) } else { finite(f.p_value) },
                "log10_p": finite(f.log10_p),
                "says": f.says,
            })
        })
        .collect()
}
