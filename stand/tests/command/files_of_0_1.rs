//! Files that version 0.1.0 has written (`tests/data/of-0.1`) are read, with the answers of that version.
#![allow(clippy::unwrap_used)]

use crate::common::{RunOutput, stand};
use serde_json::Value;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Relative tolerance of numbers; one commit of the solver may round differently than another.
const TOLERANCE: f64 = 1e-6;

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/of-0.1")
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// A copy of the files, for commands to write into.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy(&data(), folder.path());
    // The log of the session is that of the store, under its SHA-256.
    let journal: Value = serde_json::from_slice(&std::fs::read(data().join("session/journal.json")).unwrap()).unwrap();
    let hash = journal["steps"][0]["sha256"].as_str().unwrap();
    std::fs::create_dir(folder.path().join("store/logs")).unwrap();
    std::fs::copy(data().join("session/01-one.parquet"), folder.path().join(format!("store/logs/{hash}.parquet"))).unwrap();
    folder
}

/// The answer of version 0.1.0.
fn answer(name: &str) -> Value {
    serde_json::from_slice(&std::fs::read(data().join("answers").join(name).with_extension("json")).unwrap()).unwrap()
}

/// Asserts that `new` has every number, word and list of `old`; keys that were added since are allowed.
#[track_caller]
fn agrees(old: &Value, new: &Value, path: &str) {
    match (old, new) {
        (Value::Number(old), Value::Number(new)) => {
            let (old, new) = (old.as_f64().unwrap(), new.as_f64().unwrap());
            assert!((old - new).abs() <= TOLERANCE * old.abs().max(new.abs()), "{path}: {old} in 0.1.0, now {new}");
        }
        (Value::Object(old), Value::Object(new)) => {
            for (key, old) in old {
                agrees(old, new.get(key).unwrap_or(&Value::Null), &format!("{path}.{key}"));
            }
        }
        (Value::Array(old), Value::Array(new)) => {
            assert_eq!(old.len(), new.len(), "{path}");
            for (k, (old, new)) in old.iter().zip(new).enumerate() {
                agrees(old, new, &format!("{path}[{k}]"));
            }
        }
        _ => assert_eq!(old, new, "{path}"),
    }
}

/// Asserts that a command gives the answer of version 0.1.0, in these parts of it.
#[track_caller]
fn gives(folder: &TempDir, words: &[&str], name: &str, parts: &[&str]) {
    let new = stand(folder.path(), &[words, &["--json", "-"]].concat()).succeeded().json();
    let old = answer(name);
    for part in parts {
        let of = |whole: &Value| if part.is_empty() { whole.clone() } else { whole[*part].clone() };
        assert!(!of(&old).is_null(), "{name}.json has no {part}");
        agrees(&of(&old), &of(&new), &format!("{name}.{part}"));
    }
}

#[test]
fn logs_and_models_give_the_same_fits() {
    let folder = folder();
    let parts = ["parameters", "outputs", "samples", "duration_s", "not_identifiable"];
    gives(&folder, &["fit", "run.parquet", "--model", "model.toml"], "fit-parquet", &parts);
    gives(&folder, &["fit", "run.csv", "--model", "model.toml"], "fit-csv", &parts);
    gives(&folder, &["fit", "run.parquet", "--model", "fitted.toml"], "fit-fitted", &parts);
}

#[test]
fn rows_of_a_killed_recording_are_read() {
    let folder = folder();
    gives(&folder, &["compare", "killed.part.csv", "--model", "fitted.toml"], "compare-killed", &["outputs", "samples", "duration_s"]);
    let text = stand(folder.path(), &["compare", "killed.part.csv", "--model", "fitted.toml"]).succeeded().out;
    assert!(text.contains("recording"), "a remark on the cut: {text}");
}

#[test]
fn log_of_another_program_is_read_as_it_was_accepted() {
    let folder = folder();
    gives(&folder, &["log", "inspect", "foreign.csv"], "inspect", &[""]);
    gives(&folder, &["compare", "foreign.csv", "--model", "plain.toml"], "compare-foreign", &["outputs", "samples", "duration_s"]);
}

#[test]
fn table_of_explained_logs_is_read() {
    gives(&folder(), &["fleet", "report", "table.parquet"], "fleet", &[""]);
}

#[test]
fn calibration_record_follows_from_its_session_again() {
    let folder = folder();
    let text = stand(folder.path(), &["records", "show", "session"]).succeeded().out;
    assert!(
        text.contains("01-one.parquet: unchanged by its SHA-256") && text.contains("computed again from these logs: same results"),
        "{text}"
    );
    let old: Value = serde_json::from_slice(&std::fs::read(data().join("session/record.json")).unwrap()).unwrap();
    let new = stand(folder.path(), &["calibrate", "gyro", "--from", "session", "--json", "-"]).succeeded().json();
    for name in ["scale", "bias_rad_s", "nonlinearity_percent_fs", "asymmetry_percent", "quadratic_s"] {
        for part in ["value", "sigma", "dof", "k", "U", "coverage", "unit"] {
            agrees(&old[name][part], &new[name][part], &format!("{name}.{part}"));
        }
    }
}

#[test]
fn record_store_lists_evaluates_and_verifies_its_session() {
    let folder = folder();
    gives(&folder, &["records", "list", "store"], "list", &[""]);
    gives(&folder, &["records", "evaluate", "store", "--session", "1", "--rate", "-3,0,3"], "evaluate", &[""]);
    let text = stand(folder.path(), &["records", "show", "store", "--session", "1"]).succeeded().out;
    assert!(text.contains("computed again from these logs: same results"), "{text}");
    // Another session goes into the same store.
    stand(folder.path(), &["calibrate", "gyro", "--from", "session", "--json", "session/record.json"]).succeeded();
    let added = stand(folder.path(), &["records", "add", "store", "session"]).succeeded().out;
    assert!(added.contains("session 2 of store"), "{added}");
}

#[test]
fn killed_session_is_resumed_at_its_second_step() {
    let folder = folder();
    let path = folder.path();
    let log = std::fs::read(path.join("session/01-one.parquet")).unwrap();
    let answer = stand(path, &["calibrate", "gyro", "--out", "session", "--resume", "--stand", "stand.toml", "--force", "--json", "-"])
        .succeeded()
        .json();
    let journal: Value = serde_json::from_slice(&std::fs::read(path.join("session/journal.json")).unwrap()).unwrap();
    assert_eq!(journal["steps"].as_array().unwrap().len(), 2, "{journal}");
    assert!(journal["interruptions"].to_string().contains("02-two.attempt-1.csv"), "{journal}");
    assert_eq!(std::fs::read(path.join("session/01-one.parquet")).unwrap(), log, "the first step is kept");
    let [kept, killed] =
        [path.join("session/02-two.attempt-1.csv"), data().join("session/02-two.parquet.csv")].map(|file| std::fs::read(file).unwrap());
    // All but the last row, within which the file ends.
    assert!(kept.len() > 7800 && killed.starts_with(&kept), "{} of {} bytes", kept.len(), killed.len());
    let old: Value = serde_json::from_slice(&std::fs::read(data().join("session/record.json")).unwrap()).unwrap();
    let number = |record: &Value, part: &str| record["scale"][part].as_f64().unwrap();
    assert!((number(&answer, "value") - number(&old, "value")).abs() < number(&old, "U"), "{answer}");
}

#[test]
fn stand_file_describes_the_same_stand() {
    let folder = folder();
    stand(folder.path(), &["sim", "--out", "new.parquet", "--stand", "stand.toml", "--seconds", "4"]).succeeded();
    let fit = stand(folder.path(), &["fit", "new.parquet", "--model", "model.toml", "--json", "-"]).succeeded().json();
    let of = |name: &str| fit["parameters"][name]["value"].as_f64().unwrap();
    // The file states cogging of order 7.
    assert!((of("hump.a") / 1.5e-3 - 1.0).abs() < 0.02 && (of("hump.p") - 1.0).abs() < 0.02, "{fit}");
}

#[cfg(unix)]
#[test]
fn settings_pass_through_a_stand_unchanged() {
    let folder = folder();
    let path = folder.path();
    // Without the remarks; settings that were added since are allowed.
    let values = |text: &str| -> Vec<String> {
        let is_identity = |line: &str| ["model", "serial", "firmware", "exported"].iter().any(|key| line.starts_with(key));
        text.lines().filter(|line| !is_identity(line)).map(|line| line.split('#').next().unwrap().trim_end().to_owned()).collect()
    };
    let old = std::fs::read_to_string(path.join("settings.toml")).unwrap();
    // The file has another value than the stand, so that the import has something to do.
    let changed = old.replace("current_limit_A = ", "current_limit_A = 0.5 # ");
    assert_ne!(changed, old);
    std::fs::write(path.join("settings.toml"), &changed).unwrap();
    let served = crate::common::served::Served::new(path, &[]);
    let import: RunOutput = stand(path, &["settings", "import", "--port", &served.port, "--file", "settings.toml"]);
    assert!(import.succeeded().out.contains("current_limit_A"));
    let exported = stand(path, &["settings", "export", "--port", &served.port]).succeeded().out;
    let exported = values(&exported);
    for line in values(&changed) {
        assert!(exported.contains(&line), "{line}: {exported:#?}");
    }
}
