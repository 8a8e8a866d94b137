//! Allan analysis as JSON.

use serde_json::{Map, Value, json};

use super::words::{not_shown, note};
use crate::allan::answer::{Answer, Interpretation, Point, WHITE};
use crate::allan::units::PROCESSES;
use crate::report::finite;

/// The answer as JSON: lists over the averaging times in SI units; coefficients in both units.
pub fn json(answer: &Answer) -> Value {
    let list = |of: &dyn Fn(&Point) -> f64| answer.points.iter().map(|p| finite(of(p))).collect::<Vec<_>>();
    let counts = |of: &dyn Fn(&Point) -> usize| answer.points.iter().map(of).collect::<Vec<_>>();
    let pairs = |of: &dyn Fn(&Point) -> [f64; 2]| answer.points.iter().map(|p| of(p).map(finite)).collect::<Vec<_>>();
    let mut object = json!({
        "log": answer.log,
        "column": answer.column,
        "unit": answer.unit.name,
        "taken_as": match answer.interpretation { Interpretation::Value => "value", Interpretation::Integral => "integral" },
        "samples": answer.rows,
        "interval_s": finite(answer.interval_s),
        "duration_s": finite(answer.duration_s()),
        "segments": answer.segments,
        "missing_samples": finite(answer.missing),
        "bursts": answer.bursts,
        "quantum": answer.quantum.map_or(Value::Null, finite),
        "tau_s": list(&|p| p.tau_s),
        "oadev": list(&|p| p.oadev),
        "adev": list(&|p| p.adev),
        "n": counts(&|p| p.terms),
        "n_adev": counts(&|p| p.plain_terms),
        "degrees_of_freedom": list(&|p| p.degrees),
        "interval_68": pairs(&|p| p.within_68),
        "interval_95": pairs(&|p| p.within_95),
        "fitted": list(&|p| p.fitted),
        "strongest": answer.points.iter().map(|p| PROCESSES[p.strongest].letter).collect::<Vec<_>>(),
        "read_s": answer.read_s.map_or(Value::Null, |read| json!(read.map(finite))),
        "chi2_per_degree": answer.misfit.map_or(Value::Null, finite),
    });
    let Some(map) = object.as_object_mut() else { return object };
    for (p, process) in PROCESSES.iter().enumerate() {
        let scale = answer.hours(process);
        let shown = scale.map_or_else(
            || json!({"value": null, "sigma": null, "unit": process.deg_unit, "says": "the column is not a rate: see coefficients"}),
            |scale| one(answer, p, scale, process.deg_unit),
        );
        map.insert(process.deg_key.to_owned(), shown);
    }
    let density = |scale: f64, unit: &str| one(answer, WHITE, std::f64::consts::SQRT_2 * scale, unit);
    let mut densities = Map::new();
    densities.insert("column".to_owned(), density(1.0, &answer.unit.times("/√Hz")));
    if let Some(rad) = answer.unit.rad {
        densities.insert("deg_h_sqrt_Hz".to_owned(), density(rad.to_degrees() * 3600.0, "(°/h)/√Hz"));
        densities.insert("deg_s_sqrt_Hz".to_owned(), density(rad.to_degrees(), "(°/s)/√Hz"));
    }
    map.insert("density_one_sided".to_owned(), Value::Object(densities));
    let in_unit =
        PROCESSES.iter().enumerate().map(|(p, process)| (process.key.to_owned(), one(answer, p, 1.0, &answer.unit.times(process.unit))));
    map.insert("coefficients".to_owned(), Value::Object(in_unit.collect()));
    let (scale, unit) = answer.shown_deviation();
    let lowest = answer.lowest.map_or(Value::Null, |l| {
        json!({"tau_s": finite(l.tau_s), "oadev": finite(l.oadev * scale), "over_0_664": finite(l.over_floor * scale),
                   "sigma": finite(l.sigma * scale), "unit": unit, "inside": l.inside})
    });
    map.insert("lowest".to_owned(), lowest);
    map.insert("says".to_owned(), json!(answer.notes.iter().map(note).collect::<Vec<_>>()));
    object
}

/// A coefficient as JSON; `p` is its index.
fn one(answer: &Answer, p: usize, scale: f64, unit: &str) -> Value {
    let coefficient = &answer.coefficients[p];
    let number = |x: Option<f64>| x.map_or(Value::Null, |x| finite(x * scale));
    let mut object = json!({"value": number(coefficient.value), "sigma": number(coefficient.sigma), "unit": unit});
    if let (Some(message), Some(map)) = (not_shown(answer, p), object.as_object_mut()) {
        map.insert("below".to_owned(), number(coefficient.below));
        map.insert("says".to_owned(), json!(message));
    }
    object
}
