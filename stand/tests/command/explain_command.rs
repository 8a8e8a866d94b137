//! `stand explain`: output, written models, input errors.
#![allow(clippy::unwrap_used)]

use crate::common;
use std::path::Path;

use common::{MODEL, RunOutput, stand};
use identification::log::{Column, Log};
use serde_json::Value;
use tempfile::TempDir;

/// Long enough for held-out blocks.
const SECONDS: &str = "7";

/// A folder with a commented model and a log of the default stand, with or without a hidden effect.
fn folder(hidden: Option<&str>) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model.toml"), format!("# by the data sheet\n{MODEL}")).unwrap();
    let mut words = vec!["sim", "--out", "log.csv", "--seconds", SECONDS];
    words.extend(hidden.map(|h| ["--hidden", h]).into_iter().flatten());
    stand(folder.path(), &words).succeeded();
    folder
}

fn model(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("model.toml")).unwrap()
}

/// Keys of the JSON; all numbers are finite, since JSON has neither NaN nor infinity.
fn keys(answer: &Value) -> Vec<&str> {
    answer.as_object().unwrap().keys().map(String::as_str).collect()
}

#[test]
fn hidden_load_is_found_and_written_into_the_model() {
    let folder = folder(Some("load"));
    let path = folder.path();
    let before = model(path);
    let RunOutput { out, .. } =
        stand(path, &["explain", "log.csv", "--model", "model.toml", "--json", "a.json", "--html", "a.html"]).succeeded();
    let answer: Value = serde_json::from_slice(&std::fs::read(path.join("a.json")).unwrap()).unwrap();

    for key in ["verdict", "missing", "steps", "candidates", "failures", "unexplained", "next_experiment", "seconds"] {
        assert!(keys(&answer).contains(&key), "{key}");
    }
    assert_eq!(answer["verdict"], "effect-found");
    // A constant torque has two explanations; the first in the catalogue's sequence is named, with the other as alternative.
    let named = answer["missing"][0].as_str().unwrap().to_owned();
    let first = answer["candidates"].as_array().unwrap().iter().find(|c| c["effect"] == named.as_str()).unwrap();
    let family: Vec<&str> = first["ambiguous_with"].as_array().unwrap().iter().filter_map(Value::as_str).chain([named.as_str()]).collect();
    assert!(family.contains(&"load"), "{family:?}");
    assert!(first["delta_bic"].as_f64().unwrap() < -6.0 && first["p_value"].as_f64().unwrap() < 0.002, "{first}");
    let steps = answer["steps"].as_array().unwrap();
    assert_eq!((steps[0]["added"].clone(), steps[1]["added"].as_str()), (Value::Null, Some(named.as_str())));
    for output in ["omega_rad_s", "i_A", "theta_rad"] {
        let ratio = |k: usize| steps[k]["ratio"][output].as_f64().unwrap();
        let consistent = steps[1]["rms"][output].as_f64().unwrap() / steps[1]["noise"][output].as_f64().unwrap();
        assert!((ratio(1) / consistent - 1.0).abs() < 1e-9, "the ratio is that of its definition");
        // 7000 rows and the angle's counts: a few per cent.
        assert!(ratio(1) < 1.1, "{output}: {}", ratio(1));
        assert!(steps[1]["heldout_rms"][output].as_f64().unwrap() < steps[0]["heldout_rms"][output].as_f64().unwrap());
    }
    assert!(steps[1]["share"].as_f64().unwrap() > 0.99, "all that was not noise: {}", steps[1]["share"]);

    for expected in
        [named.as_str(), "Missing effect", "Evidence", "Error reduction", "Similar effects", "Next experiment", "stand sim --out"]
    {
        assert!(out.contains(expected), "{expected}: {out}");
    }
    assert!(out.lines().all(|l| l.chars().count() <= 80 || l.contains("stand sim")), "80 columns: {out}");
    let page = std::fs::read_to_string(path.join("a.html")).unwrap();
    roxmltree::Document::parse_with_options(&page, roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() }).unwrap();
    assert!(page.contains(&named) && page.contains("ΔBIC"));
    assert_eq!(before, model(path), "who does not ask for it keeps the model");

    stand(path, &["explain", "log.csv", "--model", "model.toml", "--out", "better.toml"]).succeeded();
    assert_eq!(before, model(path), "--out writes elsewhere");
    let RunOutput { out, .. } = stand(path, &["explain", "log.csv", "--model", "model.toml", "--apply"]).succeeded();
    assert!(out.contains(&format!("model.toml: {named} added")), "{out}");
    let after = model(path);
    assert!(after.starts_with("# by the data sheet\n") && after.contains(&named), "comments stay: {after}");
    assert_eq!(after, std::fs::read_to_string(path.join("better.toml")).unwrap(), "the same model in both places");
    // A second run finds nothing missing.
    let again = stand(path, &["explain", "log.csv", "--model", "model.toml", "--json", "-"]).succeeded().json();
    assert_eq!((again["verdict"].as_str(), again["missing"].as_array().map(Vec::len)), (Some("adequate"), Some(0)));
}

#[test]
fn null_log_is_adequate_and_the_model_unchanged() {
    let folder = folder(None);
    let before = model(folder.path());
    let RunOutput { out, .. } = stand(folder.path(), &["explain", "log.csv", "--model", "model.toml", "--apply"]).succeeded();
    for expected in ["No missing effect is visible in this log", "Limits of this log", "is unchanged"] {
        assert!(out.contains(expected), "{expected}: {out}");
    }
    assert_eq!(before, model(folder.path()));
}

#[test]
fn implausible_log_has_verdict_bad_log() {
    let folder = folder(None);
    let path = folder.path();
    let log = Log::read(path.join("log.csv")).unwrap();
    let turned = |c: &Column| Column {
        name: c.name.clone(),
        values: if c.name == "omega_rad_s" { c.values.iter().map(|v| -v).collect() } else { c.values.clone() },
    };
    let columns = log.columns().iter().map(turned).collect();
    Log::new("bad.csv", columns, log.notes().to_vec()).unwrap().write(path.join("bad.csv")).unwrap();
    let words = ["explain", "bad.csv", "--model", "model.toml", "--html", "bad.html"];
    let printed = stand(path, &words).refused_the_log().out;
    assert!(printed.contains("wrong sign"), "{printed}");
    let answer = stand(path, &[&words[..], &["--json", "-"]].concat()).refused_the_log().json();
    assert_eq!((answer["verdict"].as_str(), answer["missing"].as_array().map(Vec::len)), (Some("bad-log"), Some(0)));
    assert!(std::fs::read_to_string(path.join("bad.html")).unwrap().contains("wrong sign"));
}

#[test]
fn folder_is_explained_log_by_log_and_files_together() {
    let folder = folder(None);
    let path = folder.path();
    std::fs::create_dir(path.join("logs")).unwrap();
    for (name, hidden) in [("a.csv", "load"), ("b.parquet", "none")] {
        let place = format!("logs/{name}");
        let mut words = vec!["sim", "--out", &place, "--seconds", "4"];
        if hidden != "none" {
            words.extend(["--hidden", hidden]);
        }
        stand(path, &words).succeeded();
    }
    std::fs::write(path.join("logs/readme.txt"), "no log").unwrap();
    let table = stand(path, &["explain", "logs", "--model", "model.toml", "--json", "all.json"]).succeeded().out;
    let line = |name: &str| table.lines().find(|l| l.starts_with(name)).unwrap_or_else(|| panic!("{name}: {table}")).to_owned();
    assert!(line("a.csv").contains("effect-found") && line("b.parquet").contains("adequate") && table.lines().count() == 3, "{table}");
    let all: Value = serde_json::from_slice(&std::fs::read(path.join("all.json")).unwrap()).unwrap();
    let verdicts: Vec<&str> = all.as_array().unwrap().iter().map(|a| a["verdict"].as_str().unwrap()).collect();
    assert_eq!(verdicts, ["effect-found", "adequate"]);

    let together = stand(path, &["explain", "logs/b.parquet", "log.csv", "--model", "model.toml", "--json", "-"]).succeeded().json();
    assert_eq!((together["samples"].as_u64(), together["verdict"].as_str()), (Some(11_000), Some("adequate")), "one answer for both");

    // An unreadable log is reported and does not hide the others.
    std::fs::write(path.join("logs/c.csv"), "t_s,u_V\n").unwrap();
    let RunOutput { status, out, err } = stand(path, &["explain", "logs", "--model", "model.toml"]);
    assert_eq!(status, Some(2));
    assert!(out.contains("effect-found") && out.contains("c.csv") && err.contains("1 of 3 logs"), "{out}{err}");
}

#[test]
fn invalid_arguments_give_one_line_and_status_2() {
    let folder = folder(None);
    let path = folder.path();
    std::fs::create_dir(path.join("empty")).unwrap();
    let log = std::fs::read_to_string(path.join("log.csv")).unwrap();
    let begin = log.lines().position(|l| l.starts_with("t_s")).unwrap();
    std::fs::write(path.join("one.csv"), log.lines().take(begin + 2).collect::<Vec<_>>().join("\n") + "\n").unwrap();
    std::fs::write(path.join("torque.toml"), "[drive]\ninput = \"torque_N_m\"\n[parameters]\ninertia_kg_m2 = 2e-4\n").unwrap();
    let slower: Vec<&str> = log.lines().enumerate().filter(|(k, _)| *k <= begin || (k - begin) % 2 == 1).map(|(_, l)| l).collect();
    std::fs::write(path.join("slower.csv"), slower.join("\n") + "\n").unwrap();
    for (words, expected) in [
        (&["missing.csv"][..], &["missing.csv", "cannot be read"][..]),
        (&["empty"], &["empty", "this folder has no logs"]),
        (&["empty", "log.csv"], &["empty", "a folder must be the only argument"]),
        (&["empty", "--apply"], &["--apply", "name a single log"]),
        (&["empty", "--html", "x.html"], &["--html", "name a single log"]),
        (&["one.csv"], &["one.csv", "too few"]),
        (&["log.csv", "slower.csv"], &["log.csv", "slower.csv", "2.0000 ms", "the same interval"]),
        (&["log.csv", "--out", "nowhere/m.toml"], &["nowhere", "does not exist"]),
    ] {
        let RunOutput { status, out, err } = stand(path, &[&["explain"], words, &["--model", "model.toml"]].concat());
        assert_eq!((status, out.as_str(), err.lines().count()), (Some(2), "", 1), "{words:?}: {err}");
        assert!(expected.iter().all(|s| err.contains(s)) && err.starts_with("stand: "), "{words:?} should say {expected:?}: {err}");
    }
    let err = stand(path, &["explain", "log.csv", "--model", "torque.toml"]).err;
    assert!(err.contains("torque_N_m") && err.contains("log.csv") && err.contains("torque.toml"), "{err}");
}
