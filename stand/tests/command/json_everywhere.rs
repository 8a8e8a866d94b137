//! Every command answers with JSON, the ones that compute nothing too.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use crate::common;
use common::served::Served;
use common::{command, stand};
use std::io::Write;
use std::process::Stdio;

#[test]
fn every_command_has_the_option() {
    let folder = tempfile::tempdir().unwrap();
    stand(folder.path(), &["man", "--out", "man1"]).succeeded();
    let pages: Vec<String> = std::fs::read_dir(folder.path().join("man1"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap().trim_end_matches(".1").to_owned())
        .collect();
    let mut leaves = 0;
    for page in &pages {
        let has_subcommands = pages.iter().any(|other| other.strip_prefix(page.as_str()).is_some_and(|rest| rest.starts_with('-')));
        // These print a script or a page for another program, or serve a page.
        if has_subcommands || ["stand-completions", "stand-man", "stand-panel", "stand-schema"].contains(&page.as_str()) {
            continue;
        }
        let text = std::fs::read_to_string(folder.path().join("man1").join(format!("{page}.1"))).unwrap();
        assert!(text.contains("\\-\\-json"), "{page}");
        leaves += 1;
    }
    assert!(leaves > 25, "{leaves}");
}

#[test]
fn edits_of_a_model_answer_with_the_model() {
    let folder = tempfile::tempdir().unwrap();
    let answer = |words: &[&str]| stand(folder.path(), &[&["model"], words, &["--json", "-"]].concat()).succeeded().json();
    let new = answer(&["new", "a.toml", "--effects", "coulomb"]);
    assert_eq!((&new["input"], &new["outputs"], &new["effects"][0]), (&"u_V".into(), &serde_json::Value::Null, &"coulomb".into()));
    assert_eq!(answer(&["add", "a.toml", "cogging"])["effects"].as_array().unwrap().len(), 2);
    let set = answer(&["set", "a.toml", "inertia_kg_m2", "3e-4", "--fixed"]);
    let inertia = &set["parameters"]["inertia_kg_m2"];
    assert_eq!((inertia["value"].as_f64(), inertia["fixed"].as_bool(), inertia["unit"].as_str()), (Some(3e-4), Some(true), Some("kg m²")));
    assert_eq!(answer(&["remove", "a.toml", "cogging"])["effects"].as_array().unwrap().len(), 1);
    assert_eq!(answer(&["show", "a.toml"])["parameters"]["inertia_kg_m2"], *inertia);
}

#[test]
fn console_and_settings_answer_with_what_was_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let served = Served::new(path, &[]);
    let mut console = command(path, &["console", "--port", &served.port, "--json", "said.json"]).stdin(Stdio::piped()).spawn().unwrap();
    console.stdin.take().unwrap().write_all(b"SOURce:RATE? MAX;:SYSTem:VERSion?\nNONSENSE\n").unwrap();
    assert_eq!(console.wait().unwrap().code(), Some(2), "one command was rejected");
    let said: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path.join("said.json")).unwrap()).unwrap();
    assert_eq!(said[0], serde_json::json!({"line": "SOURce:RATE? MAX;:SYSTem:VERSion?", "replies": ["34.906585;1999.0"], "errors": []}));
    assert!(said[1]["errors"][0].as_str().unwrap().starts_with("-113,"), "{said}");
    let exported = stand(path, &["settings", "export", "--port", &served.port, "--file", "a.toml", "--json", "-"]).succeeded().json();
    let slip = &exported["settings"]["slip_rad"];
    assert_eq!((slip["value"].as_f64(), slip["unit"].as_str(), slip["is_scale"].as_bool()), (Some(0.1), Some("RAD"), Some(false)));
    let text = std::fs::read_to_string(path.join("a.toml")).unwrap().replace("slip_rad = 0.1 ", "slip_rad = 0.2 ");
    std::fs::write(path.join("b.toml"), text).unwrap();
    let imported = stand(path, &["settings", "import", "--port", &served.port, "--file", "b.toml", "--json", "-"]).succeeded().json();
    assert_eq!(imported["differences"], serde_json::json!(["slip_rad: 0.1 → 0.2 RAD"]));
    assert_eq!(imported["needs_power_cycle"], false);
}
