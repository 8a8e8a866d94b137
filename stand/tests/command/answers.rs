//! Fields and types of the JSON results; the demonstration.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{folder, stand};
use drive_model::{Coordinate, cards};
use serde_json::Value;

/// Type of a field.
#[derive(Clone, Copy, Debug)]
enum Is {
    Number,
    /// A number, or `null` if absent.
    NumberOrNull,
    Whole,
    Bool,
    Text,
    List,
    Object,
}

#[track_caller]
fn has(object: &Value, fields: &[(&str, Is)]) {
    for (name, is) in fields {
        let value = object.get(name).unwrap_or_else(|| panic!("{name} is missing in {object}"));
        let right = match is {
            Is::Number => value.is_number(),
            Is::NumberOrNull => value.is_number() || value.is_null(),
            Is::Whole => value.is_u64(),
            Is::Bool => value.is_boolean(),
            Is::Text => value.is_string(),
            Is::List => value.is_array(),
            Is::Object => value.is_object(),
        };
        assert!(right, "{name} is no {is:?}: {value}");
    }
}

const COMPARED: [(&str, Is); 4] = [("samples", Is::Whole), ("duration_s", Is::Number), ("outputs", Is::Object), ("failures", Is::List)];

#[track_caller]
fn outputs_and_failures(answer: &Value, names: &[&str]) {
    let outputs = answer["outputs"].as_object().unwrap();
    assert_eq!(outputs.keys().map(String::as_str).collect::<Vec<_>>(), names);
    for output in outputs.values() {
        has(
            output,
            &[
                ("rms", Is::Number),
                ("noise", Is::Number),
                ("ratio", Is::Number),
                ("fit_percent", Is::Number),
                ("white", Is::Bool),
                ("heldout_rms", Is::NumberOrNull),
            ],
        );
        let number = |key: &str| output[key].as_f64().unwrap();
        assert!((number("ratio") - number("rms") / number("noise")).abs() < 1e-9 * number("ratio"), "ratio = rms/noise: {output}");
        assert!(number("rms") > 0.0 && number("noise") > 0.0 && number("fit_percent") <= 100.0);
    }
    const COORDINATES: [Coordinate; 8] = [
        Coordinate::Theta,
        Coordinate::Omega,
        Coordinate::Current,
        Coordinate::Temperature,
        Coordinate::Time,
        Coordinate::Acceleration,
        Coordinate::History,
        Coordinate::Log,
    ];
    for failure in answer["failures"].as_array().unwrap() {
        has(
            failure,
            &[
                ("output", Is::Text),
                ("coordinate", Is::Text),
                ("share", Is::Number),
                ("p_value", Is::Number),
                ("log10_p", Is::Number),
                ("says", Is::Text),
            ],
        );
        assert!(COORDINATES.iter().any(|c| failure["coordinate"] == c.name()), "{failure}");
    }
}

#[test]
fn comparison_json_has_its_fields() {
    let folder = folder();
    let answer = stand(folder.path(), &["compare", "log.csv", "--model", "model.toml", "--json", "-"]).succeeded().json();
    has(&answer, &COMPARED);
    outputs_and_failures(&answer, &["omega_rad_s", "i_A", "theta_rad"]);
    assert_eq!(answer["samples"], 3000);
    assert!((answer["duration_s"].as_f64().unwrap() - 3.0).abs() < 1e-9);
}

#[test]
fn fit_json_has_its_fields() {
    let folder = folder();
    let answer = stand(folder.path(), &["fit", "log.csv", "--model", "model.toml", "--json", "-"]).succeeded().json();
    has(&answer, &COMPARED);
    has(&answer, &[("parameters", Is::Object), ("not_identifiable", Is::List)]);
    outputs_and_failures(&answer, &["omega_rad_s", "i_A", "theta_rad"]);
    let parameters = answer["parameters"].as_object().unwrap();
    assert_eq!(parameters.len(), 6);
    for parameter in parameters.values() {
        has(parameter, &[("value", Is::Number), ("sigma", Is::NumberOrNull)]);
        assert!(parameter["sigma"].as_f64().unwrap() > 0.0);
    }
    // Three seconds are enough for 1 % of the inertia.
    let inertia = parameters["inertia_kg_m2"]["value"].as_f64().unwrap();
    assert!((inertia / 2.5e-4 - 1.0).abs() < 0.01, "{inertia}");
}

#[test]
fn undetermined_parameters_are_named_without_nan() {
    let folder = folder();
    let model = common::MODEL.replace("\"u_V\"", "\"u_V\"\noutputs = [\"omega_rad_s\"]");
    std::fs::write(folder.path().join("rate.toml"), model).unwrap();
    let ran = stand(folder.path(), &["fit", "log.csv", "--model", "rate.toml", "--json", "-"]).succeeded();
    assert!(!ran.out.contains("NaN") && !ran.out.contains("inf"), "{}", ran.out);
    let answer = ran.json();
    outputs_and_failures(&answer, &["omega_rad_s"]);
    // Of J, K, R and friction, a rate under a voltage determines one product less.
    let named: Vec<&str> = answer["not_identifiable"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
    assert!(named.contains(&"resistance_ohm") && named.contains(&"inertia_kg_m2"), "{named:?}");
}

#[test]
fn sim_json_describes_the_log() {
    let folder = folder();
    let path = folder.path();
    let words = ["sim", "--out", "s.parquet", "--seconds", "0.5", "--hidden", "cogging", "--json", "-"];
    let answer = stand(path, &words).succeeded().json();
    has(&answer, &[("log", Is::Text), ("samples", Is::Whole), ("duration_s", Is::Number), ("columns", Is::List), ("notes", Is::Object)]);
    let log = identification::log::Log::read(path.join("s.parquet")).unwrap();
    assert_eq!((answer["samples"].as_u64(), answer["log"].as_str()), (Some(log.len() as u64), Some("s.parquet")));
    let columns: Vec<&str> = log.columns().iter().map(|c| c.name.as_str()).collect();
    assert_eq!(answer["columns"].as_array().unwrap().iter().map(|c| c.as_str().unwrap()).collect::<Vec<_>>(), columns);
    for (key, value) in log.notes() {
        assert_eq!(answer["notes"][key], **value, "{key}");
    }
    // Notes of the log (docs/logs-and-models.md).
    for key in ["stand", "firmware", "profile", "date", "seed", "u_V", "i_A", "omega_rad_s", "theta_zero", "theta_lsb_rad"] {
        assert!(log.note(key).is_some(), "{key}");
    }
    let revealed = stand(path, &[&words[..], &["--reveal", "--force"]].concat()).succeeded().json();
    has(&revealed["hidden"], &[("effect", Is::Text), ("parameters", Is::Object)]);
}

#[test]
fn effects_json_lists_every_effect_and_parameter() {
    let folder = tempfile::tempdir().unwrap();
    let all = stand(folder.path(), &["effects", "--json", "-"]).succeeded().out;
    for card in cards() {
        assert!(all.contains(&format!("\"{}\"", card.id)), "{}", card.id);
        let one = stand(folder.path(), &["effects", card.id, "--json", "-"]).succeeded();
        one.json();
        for parameter in card.parameters {
            assert!(one.out.contains(&format!("\"{}\"", parameter.name)), "{}: {}", card.id, parameter.name);
        }
    }
}

/// `stand` without arguments: session, comparison, fit, report.
#[test]
fn demonstration_runs_without_arguments() {
    let folder = tempfile::tempdir().unwrap();
    let ran = stand(folder.path(), &[]).succeeded();
    for word in ["omega_rad_s", "inertia_kg_m2", "cogging"] {
        assert!(ran.out.contains(word), "{word}: {}", ran.out);
    }
    let files = common::files(folder.path());
    for ending in [".parquet", ".toml", ".html"] {
        assert!(files.iter().any(|(name, bytes)| name.ends_with(ending) && !bytes.is_empty()), "{ending}: {:?}", files.keys());
    }
    // Again, with the previous output present.
    stand(folder.path(), &[]).succeeded();
}
