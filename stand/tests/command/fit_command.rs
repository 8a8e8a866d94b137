//! The command `stand fit`: bounds, units, own parameters, files.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{MODEL, stand};
use serde_json::Value;
use std::path::Path;

/// A folder with the model and a log of the simulated stand.
fn folder(words: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model.toml"), MODEL).unwrap();
    stand(folder.path(), &[&["sim", "--out", "log.csv"], words].concat()).succeeded();
    folder
}

fn fit(path: &Path, words: &[&str]) -> Value {
    stand(path, &[&["fit", "log.csv", "--model", "model.toml", "--json", "-"], words].concat()).succeeded().json()
}

/// Changes the values of a column in the file.
fn change(path: &Path, column: &str, change: impl Fn(f64) -> f64) {
    let text = std::fs::read_to_string(path.join("log.csv")).unwrap();
    let mut position = None;
    let mut changed = String::new();
    for line in text.lines() {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        match position {
            _ if line.starts_with('#') => {}
            None => position = cells.iter().position(|name| name == column),
            Some(k) => cells[k] = change(cells[k].parse().unwrap()).to_string(),
        }
        changed.push_str(&cells.join(","));
        changed.push('\n');
    }
    std::fs::write(path.join("log.csv"), changed).unwrap();
}

#[test]
fn fitted_model_is_a_valid_model_where_an_effect_is_missing() {
    // Effects that make the free estimate of the viscous friction negative.
    for effect in ["stribeck", "brush-drop"] {
        let folder = folder(&["--seconds", "10", "--hidden", effect]);
        let path = folder.path();
        let answer = fit(path, &["--out", "fitted.toml"]);
        let viscous = &answer["parameters"]["viscous_N_m_s"];
        assert_eq!((&viscous["value"], &viscous["sigma"], &viscous["at_bound"]), (&Value::from(0.0), &Value::Null, &Value::from(true)));
        assert!(viscous["bound_excess_sigmas"].as_f64().unwrap() > 0.0, "{viscous}");
        assert_eq!(answer["converged"], true, "{effect}");
        let text = stand(path, &["fit", "log.csv", "--model", "model.toml"]).succeeded().out;
        // The mark follows on the next line where the first is full.
        let (_, row) = text.split_once("  viscous_N_m_s").unwrap();
        let (row, _) = row.split_once("  coulomb_N_m").unwrap();
        assert!(row.contains("at its bound") && !row.contains('±'), "{row}");
        // The free fit of the others at this bound is the fit with the parameter fixed there.
        stand(path, &["model", "set", "model.toml", "viscous_N_m_s", "0", "--fixed"]).succeeded();
        let fixed = fit(path, &[]);
        for name in ["inertia_kg_m2", "motor_constant_N_m_A", "coulomb_N_m"] {
            let [held, fixed] = [&answer, &fixed].map(|a| ["value", "sigma"].map(|key| a["parameters"][name][key].as_f64().unwrap()));
            assert!((held[0] - fixed[0]).abs() < 0.1 * fixed[1], "{name}: {held:?} and {fixed:?}");
            assert!((held[1] / fixed[1] - 1.0).abs() < 0.05, "{name}: {held:?} and {fixed:?}");
        }
        stand(path, &["compare", "log.csv", "--model", "fitted.toml"]).succeeded();
    }
}

#[test]
fn columns_in_thousandths_are_refused_with_their_unit() {
    for (column, suspicion) in [("i_A", "i_A looks like mA"), ("u_V", "u_V looks like mV")] {
        let folder = folder(&["--seconds", "8"]);
        let path = folder.path();
        change(path, column, |value| 1e3 * value);
        for verb in ["fit", "compare", "explain"] {
            let answer = stand(path, &[verb, "log.csv", "--model", "model.toml", "--json", "-"]).refused_the_log().json();
            assert_eq!(answer["verdict"], "bad-log", "{verb}, {column}");
            let problem = &answer["problems"][0];
            assert_eq!((&problem["code"], &problem["columns"]), (&Value::from("wrong-unit"), &serde_json::json!([column])));
            assert!(problem["says"].as_str().unwrap().contains(suspicion), "{problem}");
        }
        let text = stand(path, &["fit", "log.csv", "--model", "model.toml", "--out", "fitted.toml"]).refused_the_log().out;
        assert!(text.contains(suspicion) && text.contains("resistance_ohm would be"), "{text}");
        assert!(!path.join("fitted.toml").exists());
    }
}

#[test]
fn constant_a_decade_from_its_start_is_questioned() {
    let folder = folder(&["--seconds", "8"]);
    let path = folder.path();
    stand(path, &["model", "set", "model.toml", "resistance_ohm", "0.2"]).succeeded();
    for verb in ["fit", "compare"] {
        let answer = stand(path, &[verb, "log.csv", "--model", "model.toml", "--json", "-"]).succeeded().json();
        let warnings = answer["warnings"].to_string();
        assert!(warnings.contains("resistance_ohm would be") && !warnings.contains("inertia"), "{verb}: {warnings}");
        let text = stand(path, &[verb, "log.csv", "--model", "model.toml"]).succeeded().out;
        assert!(text.contains("! By a fit resistance_ohm would be"), "{text}");
    }
    let answer = stand(path, &["explain", "log.csv", "--model", "model.toml", "--json", "-"]).succeeded().json();
    assert!(answer["remarks"].to_string().contains("resistance_ohm would be"), "{}", answer["remarks"]);
    stand(path, &["model", "set", "model.toml", "resistance_ohm", "2.32"]).succeeded();
    assert_eq!(fit(path, &[])["warnings"], serde_json::json!([]));
}

#[test]
fn own_parameter_without_influence_is_not_determined() {
    let folder = folder(&["--seconds", "6"]);
    let path = folder.path();
    // A term far below the noise.
    let own = "\n[effect.seal]\ntorque_N_m = \"-1e-9*a*sin(3*theta)\"\nparameters = { a = 8 }\n";
    std::fs::write(path.join("model.toml"), format!("{MODEL}{own}")).unwrap();
    let answer = fit(path, &[]);
    assert!(answer["not_identifiable"].to_string().contains("seal.a"), "{}", answer["parameters"]);
    assert!(answer["parameters"]["seal.a"]["sigma"].is_null());
}

#[test]
fn report_with_the_ending_of_a_picture_is_refused() {
    let folder = folder(&["--seconds", "1"]);
    let ran = stand(folder.path(), &["compare", "log.csv", "--model", "model.toml", "--html", "x.png"]);
    assert_eq!(ran.status, Some(2), "{ran:?}");
    assert!(ran.err.contains("x.png") && ran.err.contains(".html or .htm"), "{}", ran.err);
    assert!(!folder.path().join("x.png").exists());
}

#[test]
fn wrapped_angle_is_compared_as_the_angle_over_the_turns() {
    let folder = folder(&["--seconds", "6"]);
    let path = folder.path();
    let before = fit(path, &[]);
    change(path, "theta_rad", |angle| angle.rem_euclid(std::f64::consts::TAU));
    let after = fit(path, &[]);
    assert!(after["warnings"].to_string().contains("wrapped to one turn"), "{}", after["warnings"]);
    let inertia = |answer: &Value| answer["parameters"]["inertia_kg_m2"]["value"].as_f64().unwrap();
    assert!((inertia(&after) / inertia(&before) - 1.0).abs() < 1e-6);
}
