//! The command `stand fit`: bounds, units, own parameters, files.
#![allow(clippy::unwrap_used)]

mod common;

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

#[test]
fn fitted_model_is_a_valid_model_where_an_effect_is_missing() {
    // Effects that make the free estimate of the viscous friction negative.
    for seed in ["5", "31"] {
        let folder = folder(&["--seconds", "10", "--hidden", seed]);
        let path = folder.path();
        let answer = fit(path, &["--out", "fitted.toml"]);
        let viscous = &answer["parameters"]["viscous_N_m_s"];
        assert_eq!((&viscous["value"], &viscous["sigma"], &viscous["at_bound"]), (&Value::from(0.0), &Value::Null, &Value::from(true)));
        assert!(viscous["bound_excess_sigmas"].as_f64().unwrap() > 0.0, "{viscous}");
        assert_eq!(answer["converged"], true, "seed {seed}");
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
