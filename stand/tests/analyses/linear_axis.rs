//! A linear axis: its columns, parameters and units, from a new model to an explained one.
#![allow(clippy::unwrap_used)]

use crate::common;
use std::path::Path;

use common::{folder, stand};
use serde_json::Value;

/// The log of a hidden load as one of a linear axis (1 rad is 1 m), and as one of a rotary axis.
fn logs(path: &Path) {
    stand(path, &["sim", "--out", "rotary.csv", "--seconds", "12", "--mode", "voltage", "--hidden", "load", "--seed", "5"]).succeeded();
    let text = std::fs::read_to_string(path.join("rotary.csv")).unwrap();
    let lines = text.lines().filter(|l| !l.starts_with("# ends_with") && !l.starts_with("# rows") && !l.starts_with("# sha256"));
    let linear: Vec<String> = lines
        .map(|l| match l.strip_prefix("# omega_rad_s:") {
            Some(rest) => format!("# v_m_s:{rest}"),
            None if l.starts_with("t_s,") => l.replace("theta_rad", "x_m").replace("omega_rad_s", "v_m_s"),
            None => l.to_owned(),
        })
        .collect();
    std::fs::write(path.join("linear.csv"), linear.join("\n") + "\n").unwrap();
}

const BASE: [(&str, &str, &str); 5] = [
    ("mass_kg", "inertia_kg_m2", "2.4e-4"),
    ("force_constant_N_A", "motor_constant_N_m_A", "0.0234"),
    ("resistance_ohm", "resistance_ohm", "2.32"),
    ("viscous_N_s_m", "viscous_N_m_s", "2e-5"),
    ("coulomb_N", "coulomb_N_m", "9e-4"),
];

#[test]
fn linear_axis_goes_round() {
    let folder = folder();
    let path = folder.path();
    logs(path);
    let effects = ["--effects", "viscous,coulomb,inductance"];
    let new = stand(path, &[&["model", "new", "linear.toml", "--axis", "linear"], &effects[..]].concat()).succeeded().out;
    assert!(new.contains("mass_kg") && new.contains("total moving mass m") && !new.contains("N_m"), "{new}");
    stand(path, &[&["model", "new", "rotary.toml"], &effects[..]].concat()).succeeded();
    for (linear, rotary, value) in BASE {
        stand(path, &["model", "set", "linear.toml", linear, value]).succeeded();
        stand(path, &["model", "set", "rotary.toml", rotary, value]).succeeded();
    }
    let fit = |axis: &str| {
        let (log, model) = (format!("{axis}.csv"), format!("{axis}.toml"));
        stand(path, &["fit", &log, "--model", &model, "--json", "-"]).succeeded().json()
    };
    let (linear, rotary) = (fit("linear"), fit("rotary"));
    for (name, other, _) in BASE {
        let value = |answer: &Value, name: &str| answer["parameters"][name]["value"].as_f64().unwrap_or_else(|| panic!("{name}: {answer}"));
        assert_eq!(value(&linear, name), value(&rotary, other), "{name}");
    }
    assert_eq!(linear["parameters"]["viscous_N_s_m"]["unit"], "N s/m");
    assert_eq!(linear["outputs"]["v_m_s"]["unit"], "m/s");
    let text = stand(path, &["fit", "linear.csv", "--model", "linear.toml", "--out", "fitted.toml", "--html", "fit.html"]).succeeded().out;
    let page = std::fs::read_to_string(path.join("fit.html")).unwrap();
    for told in [&text, &page, &linear.to_string()] {
        assert!(told.contains("v_m_s") && told.contains("coulomb_N"), "{told}");
        for rotary in ["rad/s", "omega_rad_s", "theta_rad", "N m ", "_N_m", "kg m²", "kg_m2"] {
            assert!(!told.contains(rotary), "{rotary}: {}", told.chars().take(3000).collect::<String>());
        }
    }
    // The missing force is found, written into the model, and the model describes the log.
    let explained = stand(path, &["explain", "linear.csv", "--model", "fitted.toml", "--apply", "--json", "-"]).succeeded().json();
    assert_eq!(explained["verdict"], "effect-found", "{explained}");
    let model = std::fs::read_to_string(path.join("fitted.toml")).unwrap();
    assert!(model.contains("axis = \"linear\"") && model.contains("mass_kg") && !model.contains("_N_m"), "{model}");
    let candidate = explained["candidates"].as_array().unwrap().iter().find(|c| c["effect"] == "load").unwrap();
    assert_eq!(candidate["parameters"]["load_N"]["unit"], "N", "{candidate}");
    let again = stand(path, &["compare", "linear.csv", "--model", "fitted.toml", "--json", "-"]).succeeded().json();
    assert!(again["outputs"]["v_m_s"]["ratio"].as_f64().unwrap() < 1.1, "{again}");
    stand(path, &["model", "add", "fitted.toml", "quadratic-drag"]).succeeded();
    assert!(std::fs::read_to_string(path.join("fitted.toml")).unwrap().contains("drag_N_s2_m2"));
    stand(path, &["model", "remove", "fitted.toml", "quadratic-drag"]).succeeded();
    assert!(!std::fs::read_to_string(path.join("fitted.toml")).unwrap().contains("drag"));
}

#[test]
fn names_of_the_other_axis_are_refused() {
    let folder = folder();
    let path = folder.path();
    std::fs::write(path.join("m.toml"), "[drive]\naxis = \"linear\"\ninput = \"u_V\"\neffects = []\n[parameters]\ninertia_kg_m2 = 1.0\n")
        .unwrap();
    let refused = stand(path, &["model", "show", "m.toml"]);
    assert!(refused.status == Some(2) && refused.err.contains("mass_kg"), "{}", refused.err);
    stand(path, &["model", "new", "linear.toml", "--axis", "linear", "--force"]).succeeded();
    let refused = stand(path, &["compare", "log.csv", "--model", "linear.toml"]);
    assert!(refused.status == Some(2) && refused.err.contains("state the note axis: linear (--note)"), "{}", refused.err);
    let refused = stand(path, &["model", "new", "other.toml", "--axis", "linear", "--input", "torque_N_m"]);
    assert!(refused.status == Some(2) && refused.err.contains("force_N"), "{}", refused.err);
}

#[test]
fn lengths_of_another_program_are_a_linear_axis() {
    let folder = folder();
    let path = folder.path();
    logs(path);
    let log = identification::log::Log::read(path.join("rotary.csv")).unwrap();
    let column = |name: &str| log.column(name).unwrap();
    let mut text = "Zeit [s];Spannung [V];Weg [mm];Geschwindigkeit [mm/s]\n".to_owned();
    for k in 0..log.len() {
        let row = [log.t_s()[k], column("u_V")[k], 1e3 * column("theta_rad")[k], 1e3 * column("omega_rad_s")[k]];
        text += &(row.map(|v| format!("{v:.9}")).join(";").replace('.', ",") + "\n");
    }
    std::fs::write(path.join("weg.csv"), text).unwrap();
    let shown = stand(path, &["log", "inspect", "weg.csv", "--accept"]).succeeded().out;
    assert!(shown.contains("x_m") && shown.contains("v_m_s"), "{shown}");
    stand(path, &["convert", "weg.csv", "weg.parquet"]).succeeded();
    stand(path, &["convert", "weg.parquet", "again.csv"]).succeeded();
    let again = std::fs::read_to_string(path.join("again.csv")).unwrap();
    assert!(again.contains("\nt_s,v_m_s,u_V,x_m\n") && again.contains("# axis: linear"), "{}", again.chars().take(600).collect::<String>());
    let read = identification::log::Log::read(path.join("again.csv")).unwrap();
    assert!(read.column("omega_rad_s").unwrap().iter().zip(column("omega_rad_s")).all(|(a, b)| (a - b).abs() < 1e-9));
}
