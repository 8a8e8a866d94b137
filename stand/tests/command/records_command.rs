//! `stand records`: list, recomputation, trend.
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::calibration;
use std::path::Path;

use calibration::{SHORT, carrying, number};
use common::{RunOutput, stand};
use serde_json::{Value, json};

/// Three records of one gyro with a rising bias, in subfolders; otherwise they differ by noise.
fn history(folder: &Path) {
    std::fs::write(folder.join("s.toml"), SHORT).unwrap();
    for (k, (day, bias)) in [("01", 0.001), ("11", 0.001), ("21", 0.006)].iter().enumerate() {
        std::fs::write(folder.join("stand.toml"), carrying(&format!("gyro_bias_rad_s = {bias}\n"))).unwrap();
        let (out, seed) = (format!("kept/{day}"), format!("{}", k + 1));
        std::fs::create_dir_all(folder.join("kept")).unwrap();
        stand(folder, &["calibrate", "gyro", "--session", "s.toml", "--stand", "stand.toml", "--out", &out, "--seed", &seed]).succeeded();
        // Ten days apart; a simulated stand's number is its seed, set equal here for a single stand.
        change(folder, &format!("{out}/record.json"), |record| {
            record["record"]["began"] = format!("2026-03-{day}T12:00:00+00:00").into();
            record["record"]["stand"] = "Rotary Stand,simulated,SIM-1,0.1.0".into();
        });
    }
}

fn change(folder: &Path, file: &str, by: impl Fn(&mut Value)) {
    let mut record: Value = serde_json::from_slice(&std::fs::read(folder.join(file)).unwrap()).unwrap();
    by(&mut record);
    std::fs::write(folder.join(file), record.to_string()).unwrap();
}

fn records(folder: &Path, words: &[&str]) -> RunOutput {
    stand(folder, &[&["records"], words].concat()).succeeded()
}

#[test]
fn records_are_listed_by_date() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    history(path);
    std::fs::create_dir(path.join("kept/other")).unwrap();
    std::fs::write(path.join("kept/other/record.json"), "{}").unwrap();
    std::fs::write(path.join("kept/record.json"), "no json").unwrap();
    let text = records(path, &["list", "."]).out;
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 5, "{text}");
    for (line, day) in lines.iter().zip(["01", "11", "21"]) {
        assert!(
            line.starts_with(&format!("2026-03-{day}"))
                && line.contains("gyro   S-1")
                && line.contains("complete, ")
                && line.contains("results"),
            "{line}"
        );
    }
    assert!(lines[3..].iter().all(|line| line.starts_with("skipped: ") && line.contains("not a record of a calibration")), "{text}");
    let answer = records(path, &["list", "kept", "--json", "-"]).json();
    assert_eq!((answer["records"].as_array().unwrap().len(), answer["passed_over"].as_array().unwrap().len()), (3, 2));
    assert_eq!((&answer["records"][0]["serial"], &answer["records"][0]["whole"]), (&"S-1".into(), &true.into()));
    std::fs::create_dir(path.join("empty")).unwrap();
    assert_eq!(records(path, &["list", "empty"]).out, "no records found\n");
}

#[test]
fn record_is_reproduced_from_itself_and_its_logs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    history(path);
    // Only the record and the logs.
    for file in ["journal.json", "session.toml", "record.html"] {
        std::fs::remove_file(path.join("kept/01").join(file)).unwrap();
    }
    let text = records(path, &["show", "kept/01"]).out;
    for word in [
        "calibration gyro S-1: 2 of 2 steps",
        "  clock",
        "01-one.parquet: unchanged by its SHA-256",
        "computed again from these logs: same results",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    let answer = records(path, &["show", "kept/01/record.json", "--json", "-"]).json();
    // A number read from JSON may differ in its last bit.
    assert!(
        answer["checked"]["same_results"] == true && number(&answer["checked"], "greatest_difference") < 1e-15,
        "{}",
        answer["checked"]
    );
    // A manipulated result.
    change(path, "kept/01/record.json", |record| record["scale"]["value"] = (number(&record["scale"], "value") * (1.0 + 1e-9)).into());
    let text = records(path, &["show", "kept/01"]).out;
    assert!(text.contains("DIFFERENT results"), "{text}");
    let checked = records(path, &["show", "kept/01", "--json", "-"]).json()["checked"].clone();
    assert!(checked["same_results"] == false && (number(&checked, "greatest_difference") / 1e-9 - 1.0).abs() < 1e-3, "{checked}");
    // A changed log.
    std::fs::copy(path.join("kept/11/01-one.parquet"), path.join("kept/01/01-one.parquet")).unwrap();
    std::fs::remove_file(path.join("kept/01/02-two.parquet")).unwrap();
    let text = records(path, &["show", "kept/01"]).out;
    assert!(text.contains("01-one.parquet: has changed: its SHA-256 is ") && text.contains("02-two.parquet: is missing"), "{text}");
    assert!(text.contains("not computed again: 01-one.parquet has changed"), "{text}");
}

#[test]
fn trend_separates_changed_bias_from_constant_scale() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    history(path);
    let answer = records(path, &["trend", ".", "--serial", "S-1", "--json", "-"]).json();
    let of = |name: &str| answer["quantities"][name].clone();
    let bias = of("bias_rad_s");
    let days: Vec<f64> = bias["points"].as_array().unwrap().iter().map(|p| number(p, "day")).collect();
    assert_eq!(days, [0.0, 10.0, 20.0]);
    let [second, third] = [&bias["points"][1], &bias["points"][2]];
    assert_eq!(
        [&second["from_first"]["beyond"], &third["from_first"]["beyond"], &third["from_before"]["beyond"]],
        [&json!(false), &json!(true), &json!(true)]
    );
    assert!((number(&third["from_first"], "value") - 0.005).abs() < number(&third["from_first"], "U").max(3e-4), "{third}");
    assert!(
        answer["beyond"].as_array().unwrap().contains(&"bias_rad_s".into())
            && !answer["beyond"].as_array().unwrap().contains(&"scale".into()),
        "{answer}"
    );
    // The crystal is common to all three: a difference is more accurate than its end values.
    let scale = of("scale");
    let change = &scale["points"][2]["from_first"];
    assert!(change["common"].as_array().unwrap().contains(&"clock".into()), "{change}");
    assert!(number(change, "U") < number(change, "U_if_nothing_is_common"), "{change}");
    // 5 mrad/s in 20 days, and a nonlinear trend.
    let line = &bias["line"];
    assert!((number(line, "per_day") - 2.5e-4).abs() < 1e-4 && line["unit"] == "rad/s/d", "{line}");
    let text = records(path, &["trend", ".", "--serial", "S-1", "--quantity", "bias_rad_s", "--html", "t.html"]).out;
    assert!(
        text.contains("significant change since the first record: bias_rad_s") && text.contains("rad/s/d") && !text.contains("\nscale"),
        "{text}"
    );
    let page = std::fs::read_to_string(path.join("t.html")).unwrap();
    assert!(page.contains("whisker") && page.contains("path") && page.contains("bias_rad_s"), "the plot with its bars and its line");
}

#[test]
fn trend_needs_two_records_of_one_kind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    history(path);
    std::fs::rename(path.join("kept/01"), path.join("one")).unwrap();
    let text = records(path, &["trend", "one", "--serial", "S-1"]).out;
    assert!(text.contains("one record: nothing to compare") && !text.contains("since the first"), "{text}");
    // The drive of this stand has an identical number.
    change(path, "kept/11/record.json", |record| {
        record["record"]["what"] = "drive".into();
        record["record"]["session"]["what"] = "drive".into();
    });
    let ran = stand(path, &["records", "trend", ".", "--serial", "S-1"]);
    assert!(ran.status == Some(2) && ran.err.contains("drive, gyro") && ran.err.contains("--what"), "{ran:?}");
    let answer = records(path, &["trend", ".", "--serial", "S-1", "--what", "gyro", "--json", "-"]).json();
    assert_eq!(answer["records"].as_array().unwrap().len(), 2);
}
