//! `stand calibrate` on the simulated stand: session, folder, record, use of the result.
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::calibration;
use std::path::Path;

use calibration::{SHORT, drawn, holds, number, quantity};
use common::{MODEL, stand};
use serde_json::Value;

fn names(answer: &Value) -> Vec<&str> {
    answer.as_object().unwrap().keys().map(String::as_str).filter(|name| *name != "record").collect()
}

/// Every quantity has its documented fields, and its budget gives its uncertainty.
fn assert_documented_fields(answer: &Value) {
    for name in names(answer) {
        let q = &answer[name];
        assert!(q["unit"].is_string() && q["coverage"] == 0.95, "{name}: {q}");
        let (sigma, expanded, k) = (number(q, "sigma"), number(q, "U"), number(q, "k"));
        assert!(number(q, "value").is_finite() && sigma > 0.0 && (expanded / (k * sigma) - 1.0).abs() < 1e-12, "{name}: {q}");
        let budget = q["budget"].as_array().unwrap();
        // 1.645 is the factor of a single rectangle; without one, the normal distribution's is the least.
        let has_bounds = budget.iter().any(|line| line["distribution"] == "rectangular");
        assert!(k >= if has_bounds { 1.64 } else { 1.959 }, "{name}: {k}");
        let sum: f64 = budget.iter().map(|line| number(line, "contribution").powi(2)).sum();
        assert!((sum.sqrt() / sigma - 1.0).abs() < 1e-12, "{name}: {q}");
        for line in budget {
            assert!(line["type"] == "A" || line["type"] == "B", "{line}");
            assert!(
                (number(line, "u") * number(line, "sensitivity").abs() / number(line, "contribution").max(1e-300) - 1.0).abs() < 1e-9,
                "{line}"
            );
        }
    }
}

fn json_of(folder: &Path, words: &[&str]) -> Value {
    stand(folder, &[words, &["--json", "-"]].concat()).succeeded().json()
}

#[test]
fn gyro_calibration_is_reproduced_from_its_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let words =
        ["calibrate", "gyro", "--out", "g", "--serial", "G-7", "--operator", "Ada", "--seed", "4", "--html", "g.html", "--json", "g.json"];
    let text = stand(path, &words).succeeded().out;
    assert!(
        text.starts_with("calibration gyro G-7: 15 of 15 steps")
            && text.contains("  scale ")
            && text.contains("Not an accredited certificate")
    );
    let answer: Value = serde_json::from_slice(&std::fs::read(path.join("g.json")).unwrap()).unwrap();
    for name in [
        "scale",
        "bias_rad_s",
        "nonlinearity_percent_fs",
        "asymmetry_percent",
        "hysteresis_percent_fs",
        "bandwidth_Hz",
        "delay_s",
        "threshold_rad_s",
        "scale_whole_turns",
    ] {
        assert!(answer[name]["value"].is_number(), "{name}");
    }
    assert_documented_fields(&answer);
    // Sensitivities have their signs: a misalignment can only reduce the output.
    let lines = answer["scale"]["budget"].as_array().unwrap();
    assert!(lines.iter().any(|line| line["of"] == "misalignment" && number(line, "sensitivity") < 0.0), "{lines:?}");
    // The results agree with the random device within three expanded uncertainties; the coverage has its own test.
    holds(&answer, &drawn(4), &["scale", "bias_rad_s", "nonlinearity_percent_fs", "quadratic_s"]);
    let record = &answer["record"];
    assert_eq!((&record["serial"], &record["operator"], &record["whole"]), (&"G-7".into(), &"Ada".into(), &true.into()));
    assert_eq!(record["steps"].as_array().unwrap().len(), 15);
    assert!(record["statement"].as_str().unwrap().contains("not an accredited certificate"));
    let kept: Value = serde_json::from_slice(&std::fs::read(path.join("g/record.json")).unwrap()).unwrap();
    assert_eq!(kept, answer, "the record is the answer");
    let page = std::fs::read_to_string(path.join("g/record.html")).unwrap();
    assert_eq!(page, std::fs::read_to_string(path.join("g.html")).unwrap());
    assert!(
        page.contains("<svg")
            && page.contains("SHA-256")
            && page.contains("not an accredited certificate")
            && page.contains("misalignment")
    );
    // Recomputed from the raw logs.
    let again = json_of(path, &["calibrate", "gyro", "--from", "g"]);
    assert_eq!(names(&again), names(&answer));
    for name in names(&answer) {
        assert_eq!(again[name], answer[name], "{name}");
    }
    assert_eq!(again["record"]["steps"], record["steps"]);
    // A complete session cannot be resumed and remains unchanged.
    let logs = || std::fs::read(path.join("g/02-staircase.parquet")).unwrap();
    let before = logs();
    stand(path, &["calibrate", "gyro", "--out", "g", "--resume"]).succeeded();
    assert!(before == logs());
}

#[test]
fn accelerometer_is_calibrated_as_a_rate_sensor() {
    let folder = tempfile::tempdir().unwrap();
    let answer = json_of(folder.path(), &["calibrate", "accel", "--out", "a", "--seed", "2"]);
    for name in ["scale", "radius_m", "angle_deg", "bias_x_m_s2", "bias_y_m_s2", "blind_below_rad_s", "combined_rms_rad_s"] {
        assert!(answer[name]["value"].is_number(), "{name}");
    }
    assert_documented_fields(&answer);
    assert!(number(&answer["scale"], "U") > 0.009, "the scale from one radius is no more accurate than the radius: 0.5 of 50 mm");
    let again = json_of(folder.path(), &["calibrate", "accel", "--from", "a"]);
    assert_eq!(
        names(&answer).iter().map(|n| &answer[*n]).collect::<Vec<_>>(),
        names(&again).iter().map(|n| &again[*n]).collect::<Vec<_>>()
    );
}

#[test]
fn drive_calibration_gives_a_model_that_fits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("model.toml"), MODEL).unwrap();
    let answer = json_of(path, &["calibrate", "drive", "--out", "d", "--seed", "3", "--into-model", "model.toml"]);
    assert_documented_fields(&answer);
    for name in [
        "inertia_kg_m2",
        "motor_constant_N_m_A",
        "resistance_ohm",
        "inductance_H",
        "viscous_N_m_s",
        "coulomb_N_m",
        "dead_band_V",
        "coast_decay_1_s",
    ] {
        assert!(answer[name]["value"].is_number(), "{name}");
    }
    let model = identification::model::Model::read(path.join("model.toml")).unwrap();
    for name in ["inertia_kg_m2", "motor_constant_N_m_A", "resistance_ohm", "coulomb_N_m"] {
        let shown = stand(path, &["model", "show", "model.toml"]).succeeded().out;
        let line = shown.lines().find(|l| l.trim_start().starts_with(name)).unwrap().to_owned();
        assert!(!MODEL.contains(line.split_whitespace().nth(1).unwrap()), "{line}");
    }
    assert_eq!(model.effect_names().len(), 3);
    let ratio = |model: &str| {
        let held = json_of(path, &["compare", "d/03-steps.parquet", "--model", model]);
        let outputs = held["outputs"].as_object().unwrap().clone();
        outputs.values().map(|o| number(o, "ratio")).fold(0.0, f64::max)
    };
    assert!(ratio("model.toml") < 1.2, "near noise: {}", ratio("model.toml"));
    std::fs::write(path.join("sheet.toml"), MODEL).unwrap();
    assert!(ratio("sheet.toml") > 5.0, "and the data sheet's is not: {}", ratio("sheet.toml"));
}

#[test]
fn rate_sensor_calibration_becomes_model_effects() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("model.toml"), MODEL).unwrap();
    std::fs::write(path.join("own.toml"), format!("column = \"omega_rad_s\"\n{SHORT}")).unwrap();
    // A rate sensor with a scale error of 2 %.
    std::fs::write(
        path.join("stand.toml"),
        "[effects.viscous]\nviscous_N_m_s = 2e-5\n[effects.coulomb]\ncoulomb_N_m = 1e-3\n[effects.rate-scale]\nrate_scale = 0.02\n",
    )
    .unwrap();
    let words = ["calibrate", "gyro", "--session", "own.toml", "--stand", "stand.toml", "--out", "g", "--into-model", "model.toml"];
    let answer = json_of(path, &words);
    assert!((quantity(&answer, "scale") - 1.02).abs() < 1e-3, "{}", answer["scale"]);
    let shown = stand(path, &["model", "show", "model.toml"]).succeeded().out;
    assert!(shown.contains("rate-scale") && shown.contains("rate-bias"), "{shown}");
    let value = |name: &str| -> f64 {
        let line = shown.lines().find(|l| l.trim_start().starts_with(name)).unwrap();
        let words: Vec<&str> = line.split_whitespace().collect();
        words[1].replace('−', "-").parse().unwrap_or_else(|_| panic!("{line}"))
    };
    assert!((value("rate_scale") - (quantity(&answer, "scale") - 1.0)).abs() < 1e-4, "{shown}");
}

#[test]
#[cfg(unix)]
fn rate_sensor_calibration_needs_no_dut() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("own.toml"), format!("column = \"omega_rad_s\"\n{SHORT}")).unwrap();
    let one = common::served::Served::new(path, &[]);
    let answer = json_of(path, &["calibrate", "gyro", "--session", "own.toml", "--port", &one.port, "--out", "g"]);
    assert!((quantity(&answer, "scale") - 1.0).abs() < 1e-2, "{}", answer["scale"]);
    // A missing device under test is refused before anything moves.
    std::fs::write(path.join("s.toml"), SHORT).unwrap();
    let ran = stand(path, &["calibrate", "gyro", "--session", "s.toml", "--port", &one.port, "--out", "h"]);
    assert!(ran.status == Some(2) && ran.err.contains("no running device under test") && !path.join("h").exists(), "{ran:?}");
}

#[test]
fn default_session_can_be_written_edited_and_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for what in ["gyro", "accel", "drive"] {
        let file = format!("{what}.toml");
        assert!(stand(path, &["calibrate", what, "--write-session", &file]).succeeded().out.contains(&file));
        assert!(std::fs::read_to_string(path.join(&file)).unwrap().contains("[[steps]]"));
    }
    let text = std::fs::read_to_string(path.join("gyro.toml")).unwrap();
    // Only the first two steps, with another serial number in the file.
    let third = text.match_indices("[[steps]]").nth(2).unwrap().0;
    std::fs::write(path.join("gyro.toml"), text[..third].replace("serial = \"\"", "serial = \"F-1\"")).unwrap();
    let answer = json_of(path, &["calibrate", "gyro", "--session", "gyro.toml", "--out", "g"]);
    assert_eq!((&answer["record"]["serial"], answer["record"]["steps"].as_array().unwrap().len()), (&"F-1".into(), 2));
    assert!(answer["scale"]["value"].is_number() && answer.get("bandwidth_Hz").is_none());
    let absent = answer["record"]["absent"].as_array().unwrap();
    assert!(absent.iter().any(|a| a["name"] == "bandwidth_Hz" && a["why"].as_str().unwrap().contains("sines")), "{absent:?}");
}

#[test]
fn operator_actions_are_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let step = "[[steps]]\nname = \"again\"\nask = \"Turn the part over.\"\nmounted = { radius_m = 0.05, lying = \"side\" }\nmode = \"off\"\nseconds = 2.0\n";
    std::fs::write(path.join("s.toml"), format!("{SHORT}{step}")).unwrap();
    let answer = json_of(path, &["calibrate", "gyro", "--session", "s.toml", "--out", "g"]);
    let last = &answer["record"]["steps"][2];
    assert_eq!((&last["asked"][0], &last["mounted"]["lying"]), (&"Turn the part over.".into(), &"side".into()));
    assert!(last["asked"][1].as_str().unwrap().contains("simulated operator"), "{last}");
    assert!(std::fs::read_to_string(path.join("g/record.html")).unwrap().contains("Turn the part over."));
}

#[test]
#[cfg(unix)]
fn operator_replies_at_a_serial_stand_are_recorded() {
    use std::io::Write;
    use std::process::Stdio;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let session = "what = \"drive\"\n[[steps]]\nname = \"free\"\nask = \"Take the weight off.\"\nmode = \"voltage\"\nprofile = \"multi-step\"\n\
        amplitude = 0.8\ndwell_s = 0.4\nseconds = 6.0\n";
    std::fs::write(path.join("s.toml"), session).unwrap();
    let one = common::served::Served::new(path, &[]);
    // Without operator input nothing moves, and the session waits.
    let ran = stand(path, &["calibrate", "drive", "--session", "s.toml", "--port", &one.port, "--out", "d"]);
    assert!(ran.status == Some(2) && ran.err.contains("Take the weight off.") && ran.err.contains("step `free`: not done"), "{ran:?}");
    let mut words = common::command(path, &["calibrate", "drive", "--out", "d", "--resume", "--port", &one.port, "--json", "d.json"]);
    let mut child = words.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(b"off, 20 g\n").unwrap();
    let ran: common::RunOutput = child.wait_with_output().unwrap().into();
    assert_eq!((ran.status, ran.err.as_str()), (Some(0), "Take the weight off.\n"), "{ran:?}");
    let answer: Value = serde_json::from_slice(&std::fs::read(path.join("d.json")).unwrap()).unwrap();
    assert_eq!(answer["record"]["steps"][0]["asked"], serde_json::json!(["Take the weight off.", "off, 20 g"]));
    assert!(answer["record"]["interruptions"].to_string().contains("not done"));
}
