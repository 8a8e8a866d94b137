//! The answer of `stand explain --json` (interfaces.md).

use serde_json::{Map, Value, json};

use super::{sentences, words};
use crate::identify::explain::{Candidate, ChannelError, Estimate, Explanation, Shape, Stage};
use crate::log::Log;
use crate::log::plausible::Finding;
use crate::report::json::{failures_json, finite};
use crate::report::{bad_log_json, log_warnings};

/// Below this a probability is said as 0, with its logarithm beside it.
const SMALLEST_P: f64 = 1e-300;

/// The whole answer.
pub fn explain_json(e: &Explanation) -> Value {
    json!({
        "verdict": e.verdict.name(),
        "missing": e.missing,
        "says": words::headline(e),
        "log": e.log.path().display().to_string(),
        "model": e.model.name(),
        "samples": e.log.len(),
        "duration_s": finite(e.log.duration_s()),
        "steps": e.stages.iter().enumerate().map(|(k, s)| stage(e, k, s)).collect::<Vec<_>>(),
        "candidates": e.candidates.iter().map(|c| candidate(e, c)).collect::<Vec<_>>(),
        "failures": failures_json(&e.failures),
        "unexplained": e.unexplained.iter().map(shape).collect::<Vec<_>>(),
        "next_experiment": e.next.as_ref().map_or(Value::Null, |n| {
            json!({"says": sentences::next_experiment(e), "command": sentences::command(&n.run)})
        }),
        "parameters": e.stages.last().map_or(json!({}), |s| estimates(&s.parameters)),
        "not_shown": words::blind(e),
        "remarks": sentences::remarks(e),
        "warnings": log_warnings(&e.log),
        "seconds": finite(e.seconds),
    })
}

/// The answer about a log that is no record of a drive: the keys of every explanation, empty.
pub fn explain_bad_log_json(log: &Log, problems: &[Finding]) -> Value {
    let mut answer = bad_log_json(log, problems);
    for key in ["missing", "steps", "candidates", "unexplained"] {
        answer[key] = json!([]);
    }
    answer["next_experiment"] = Value::Null;
    answer
}

fn stage(e: &Explanation, k: usize, s: &Stage) -> Value {
    json!({
        "effects": s.effects,
        "added": s.added,
        "rms": by_output(&s.outputs, |o| finite(o.rms)),
        "heldout_rms": by_output(&s.outputs, heldout),
        "ratio": by_output(&s.outputs, |o| finite(o.ratio())),
        "noise": by_output(&s.outputs, |o| finite(o.noise)),
        "share": words::share(e, k).map_or(Value::Null, finite),
    })
}

fn candidate(e: &Explanation, c: &Candidate) -> Value {
    let (fate, why) = words::fate(e, c);
    json!({
        "effect": c.effect,
        "parameters": estimates(&c.parameters),
        "heldout_rms": by_output(&c.outputs, heldout),
        "delta_bic": c.delta_bic.map_or(Value::Null, finite),
        "p_value": if !words::has_chance(e, c) { Value::Null } else if c.p_value < SMALLEST_P { json!(0.0) } else { finite(c.p_value) },
        "log10_p": if words::has_chance(e, c) { finite(c.log10_p) } else { Value::Null },
        "ambiguous_with": c.ambiguous_with,
        "refitted": c.refitted,
        "fate": fate,
        "refused": why,
    })
}

fn heldout(o: &ChannelError) -> Value {
    o.heldout_rms.map_or(Value::Null, finite)
}

fn by_output(outputs: &[ChannelError], value: impl Fn(&ChannelError) -> Value) -> Value {
    Value::Object(outputs.iter().map(|o| (o.channel.column().to_owned(), value(o))).collect::<Map<_, _>>())
}

fn estimates(list: &[Estimate]) -> Value {
    let entries = list.iter().map(|p| (p.name.clone(), json!({"value": finite(p.value), "sigma": finite(p.sigma), "unit": p.unit})));
    Value::Object(entries.collect::<Map<_, _>>())
}

fn shape(s: &Shape) -> Value {
    json!({
        "acts_on": s.acts_on.key(),
        "coordinate": s.coordinate.name(),
        "along": sentences::along(s),
        "bins": s.bins.iter().map(|b| json!({"at": finite(b.at), "mean": finite(b.mean), "confidence": finite(b.confidence)})).collect::<Vec<_>>(),
        "expression": s.expression,
        "delta_bic": finite(s.delta_bic),
        "says": sentences::shape(s),
    })
}
