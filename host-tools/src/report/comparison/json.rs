//! A comparison or a fit as JSON.

use serde_json::{Map, Value, json};

use super::{Comparison, words};
use crate::identify::fit::ChannelFit;
use crate::identify::fit::prepared_log::ANGLE_INCREMENT_S;
use crate::model::Channel;
use crate::report::json::{failures_json, finite};
use crate::report::unit;

/// The answer of `stand compare --json`.
pub fn compare_json(c: &Comparison) -> Value {
    Value::Object(common(c))
}

/// The answer of `stand fit --json`: that of a comparison, and the parameters.
pub fn fit_json(c: &Comparison) -> Value {
    let mut answer = Map::new();
    answer.insert("parameters".into(), parameters(c));
    let held = c.held;
    answer.insert("not_identifiable".into(), held.not_identifiable.iter().map(|(name, _)| json!(name)).collect());
    let details = held.not_identifiable.iter().map(|(name, with)| {
        let (with, correlation) = with.as_ref().map_or((Value::Null, Value::Null), |(with, r)| (json!(with), finite(*r)));
        json!({"parameter": name, "with": with, "correlation": correlation})
    });
    answer.insert("not_identifiable_details".into(), details.collect());
    answer.insert("converged".into(), json!(held.converged));
    answer.insert("steps".into(), json!(held.steps));
    answer.append(&mut common(c));
    Value::Object(answer)
}

/// What every answer has.
fn common(c: &Comparison) -> Map<String, Value> {
    let mut answer = Map::new();
    answer.insert("log".into(), json!(c.log.path().display().to_string()));
    answer.insert("model".into(), json!(c.model.name()));
    answer.insert("samples".into(), json!(c.log.len()));
    answer.insert("duration_s".into(), finite(c.log.duration_s()));
    let outputs = c.held.channels.iter().map(|f| (f.channel.column().to_owned(), output(f)));
    answer.insert("outputs".into(), Value::Object(outputs.collect()));
    answer.insert("failures".into(), failures_json(&c.failures));
    answer.insert("remarks".into(), json!(c.all_remarks()));
    answer.insert("warnings".into(), json!(c.all_warnings()));
    answer.insert("seconds".into(), finite(c.seconds));
    answer
}

fn output(f: &ChannelFit) -> Value {
    let mut o = json!({
        "rms": finite(f.rms),
        "noise": finite(f.noise),
        "ratio": finite(f.rms / f.noise),
        "fit_percent": finite(f.fit_percent),
        "white": f.white(),
        "chi2_per_n": finite(f.chi2_per_n()),
        "heldout_rms": f.heldout_rms.map_or(Value::Null, finite),
        "rows": f.rows,
        "unit": unit(f.channel),
    });
    if f.channel == Channel::Angle {
        o["compared"] = json!(format!("increments over {} ms", (ANGLE_INCREMENT_S * 1e3).round()));
    }
    o
}

fn parameters(c: &Comparison) -> Value {
    let rows = words::parameters(c);
    let entries = rows.into_iter().map(|row| {
        let mut p = json!({"value": finite(row.value), "sigma": if row.undetermined.is_some() { Value::Null } else { finite(row.sigma) }, "unit": row.unit, "fixed": row.fixed, "start": finite(row.start)});
        if row.at_bound {
            p["at_bound"] = json!(true);
        }
        if row.out_of_range {
            p["out_of_range"] = json!(true);
        }
        (row.name, p)
    });
    Value::Object(entries.collect())
}
