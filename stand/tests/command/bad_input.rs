//! Invalid files, models and arguments: one line on standard error, exit status 2, no file changed.
#![allow(clippy::unwrap_used)]

use crate::common;
use std::path::Path;

use common::{MODEL, RunOutput, command, files, folder, stand};
use identification::log::{Column, Log};
use serde_json::Value;

/// Asserts a refusal: status 2, empty standard output, one line on standard error that contains each of `expected`; no file is created,
/// changed or removed.
#[track_caller]
fn refused(folder: &Path, words: &[&str], expected: &[&str]) {
    let before = files(folder);
    let RunOutput { status, out, err } = stand(folder, words);
    assert_eq!((status, out.as_str()), (Some(2), ""), "{words:?}: {err}");
    assert!(err.starts_with("stand: ") && err.ends_with('\n') && err.trim_end().lines().count() == 1, "{words:?}: one line: {err:?}");
    for word in expected {
        assert!(err.contains(word), "{words:?} should say {word:?}: {err}");
    }
    assert!(!err.contains("panicked"), "{err}");
    let after = files(folder);
    assert!(before == after, "{words:?}: files before {:?}, after {:?}", before.keys(), after.keys());
}

/// With all outputs of a fit; two of them already exist and must remain.
#[track_caller]
fn refused_log(folder: &Path, log: &str, expected: &[&str]) {
    for kept in ["kept.json", "kept.toml"] {
        std::fs::write(folder.join(kept), "before").unwrap();
    }
    refused(folder, &["compare", log, "--model", "model.toml", "--json", "new.json", "--html", "new.html"], expected);
    refused(
        folder,
        &["fit", log, "--model", "model.toml", "--json", "kept.json", "--html", "new.html", "--out", "kept.toml", "--force"],
        expected,
    );
}

/// Lines of a valid log.
fn good() -> Vec<String> {
    let mut lines = vec!["# stand: 3".to_owned(), "t_s,u_V,omega_rad_s".to_owned()];
    lines.extend((0..40).map(|k| format!("{},{},{}", f64::from(k) * 0.001, k % 7, f64::from(k) * 0.01 + 0.005)));
    lines
}

/// Line number of row `row` (counted from 1).
fn line_of(row: usize) -> usize {
    row + 1
}

#[test]
fn bad_log_error_names_file_row_and_column() {
    let folder = folder();
    let path = folder.path();
    let csv = |name: &str, change: &dyn Fn(&mut Vec<String>)| {
        let mut lines = good();
        change(&mut lines);
        std::fs::write(path.join(name), lines.join("\n") + "\n").unwrap();
    };
    let row = |row: usize, text: &'static str| move |lines: &mut Vec<String>| lines[line_of(row)] = text.to_owned();

    csv("headless.csv", &|lines| drop(lines.remove(1)));
    refused_log(path, "headless.csv", &["headless.csv", "header is missing"]);
    csv("text.csv", &row(7, "0.006,much,0.065"));
    refused_log(path, "text.csv", &["text.csv", "row 7", "line 9", "column u_V", "much", "not a number"]);
    csv("nan.csv", &row(8, "0.007,1,NaN"));
    refused_log(path, "nan.csv", &["nan.csv", "row 8", "column omega_rad_s", "NaN"]);
    csv("infinite.csv", &row(8, "0.007,inf,0.1"));
    refused_log(path, "infinite.csv", &["infinite.csv", "row 8", "column u_V", "inf"]);
    csv("back.csv", &row(9, "0.0065,1,0.085"));
    refused_log(path, "back.csv", &["back.csv", "row 9", "column t_s", "steps back", "0.0065"]);
    csv("twice.csv", &row(9, "0.007,1,0.085"));
    refused_log(path, "twice.csv", &["twice.csv", "row 9", "column t_s", "repeats"]);
    csv("cut.csv", &|lines| *lines.last_mut().unwrap() = "0.039,4".to_owned());
    refused_log(path, "cut.csv", &["cut.csv", "row 40", "cut short", "2 of 3 cells"]);
    csv("hole.csv", &row(5, "0.004,,0.045"));
    refused_log(path, "hole.csv", &["hole.csv", "row 5", "column u_V", "empty"]);
    csv("wide.csv", &row(5, "0.004,1,0.045,9"));
    refused_log(path, "wide.csv", &["wide.csv", "row 5", "4 cells", "3 columns"]);
    csv("comma.csv", &row(1, "0,0,0,0,0,005"));
    refused_log(path, "comma.csv", &["comma.csv", "row 1", "decimal comma"]);
    csv("semicolon.csv", &|lines| lines.iter_mut().for_each(|l| *l = l.replace(',', ";").replace('.', ",")));
    refused_log(path, "semicolon.csv", &["semicolon.csv", "decimal point"]);
    csv("timeless.csv", &|lines| lines[1] = "time,u_V,omega_rad_s".to_owned());
    refused_log(path, "timeless.csv", &["timeless.csv", "no column t_s", "time, ", "u_V"].map(|w| if w == "time, " { "time" } else { w }));
    csv("doubled.csv", &|lines| lines[1] = "t_s,u_V,u_V".to_owned());
    refused_log(path, "doubled.csv", &["doubled.csv", "column u_V", "twice"]);
    csv("rowless.csv", &|lines| lines.truncate(2));
    refused_log(path, "rowless.csv", &["rowless.csv", "no rows"]);
    csv("notes.csv", &|lines| lines.truncate(1));
    refused_log(path, "notes.csv", &["notes.csv", "no header"]);
    csv("short.csv", &|lines| lines.truncate(10));
    refused_log(path, "short.csv", &["short.csv", "8 rows", "too few"]);
    csv("inputless.csv", &|lines| lines[1] = "t_s,i_A,omega_rad_s".to_owned());
    refused_log(path, "inputless.csv", &["inputless.csv", "u_V", "input"]);
    csv("outputless.csv", &|lines| lines[1] = "t_s,u_V,temp_C".to_owned());
    refused_log(path, "outputless.csv", &["outputless.csv", "can be compared with"]);
}

#[test]
fn error_of_a_file_that_is_not_a_log_names_the_file() {
    let folder = folder();
    let path = folder.path();
    std::fs::write(path.join("empty.csv"), "").unwrap();
    refused_log(path, "empty.csv", &["empty.csv", "empty"]);
    std::fs::write(path.join("empty.parquet"), "").unwrap();
    refused_log(path, "empty.parquet", &["empty.parquet"]);
    std::fs::write(path.join("text.parquet"), good().join("\n")).unwrap();
    refused_log(path, "text.parquet", &["text.parquet", "not a Parquet file"]);
    let whole = std::fs::read(path.join("log.parquet")).unwrap();
    std::fs::write(path.join("half.parquet"), &whole[..whole.len() / 2]).unwrap();
    refused_log(path, "half.parquet", &["half.parquet"]);
    std::fs::write(path.join("binary.csv"), &whole).unwrap();
    refused_log(path, "binary.csv", &["binary.csv"]);
    std::fs::copy(path.join("log.csv"), path.join("log.txt")).unwrap();
    refused_log(path, "log.txt", &["log.txt", "another program", "stand log inspect log.txt"]);
    refused_log(path, "log", &["log:", ".csv or .parquet"]);
    refused_log(path, "missing.csv", &["missing.csv", "cannot be read"]);
    refused_log(path, "missing.parquet", &["missing.parquet", "cannot be read"]);
    std::fs::create_dir(path.join("folder.csv")).unwrap();
    refused_log(path, "folder.csv", &["folder.csv"]);
    std::fs::create_dir(path.join("folder.parquet")).unwrap();
    refused_log(path, "folder.parquet", &["folder.parquet"]);
}

#[test]
fn bad_model_error_names_position_and_parameter() {
    let folder = folder();
    let path = folder.path();
    let bad = |text: &str, expected: &[&str]| {
        std::fs::write(path.join("bad.toml"), text).unwrap();
        let expected: Vec<&str> = expected.iter().copied().chain(["bad.toml"]).collect();
        refused(path, &["compare", "log.csv", "--model", "bad.toml", "--json", "-"], &expected);
        refused(path, &["fit", "log.parquet", "--model", "bad.toml", "--out", "model.toml", "--force"], &expected);
        refused(path, &["model", "show", "bad.toml"], &expected);
        refused(path, &["model", "add", "bad.toml", "cogging"], &expected);
        refused(path, &["model", "set", "bad.toml", "inertia_kg_m2", "3e-4"], &expected);
    };
    let with = |from: &str, to: &str| {
        assert!(MODEL.contains(from));
        MODEL.replace(from, to)
    };
    bad(&with("\"viscous\"", "\"vicsous\""), &["line 3", "vicsous", "did you mean 'viscous'"]);
    bad(&with("viscous_N_m_s", "viscous_N_ms"), &["line 9", "viscous_N_ms", "viscous_N_m_s"]);
    bad(&with("\"u_V\"", "\"u_v\""), &["line 2", "u_v", "u_V"]);
    bad(&with("\"u_V\"", "\"u_V\"\noutputs = [\"omega\"]"), &["line 3", "omega", "omega_rad_s"]);
    bad(&with("\"u_V\"", "\"u_V\"\noutputs = [\"torque_N_m\"]"), &["line 3", "torque_N_m", "u_V"]);
    bad(&with("\"u_V\"", "\"u_V\"\noutputs = []"), &["line 3", "outputs"]);
    bad(&with("inertia_kg_m2 = 2.2e-4", "inertia_kg_m2 = -2.2e-4"), &["line 6", "inertia_kg_m2", "outside the physical range"]);
    bad(&with("viscous_N_m_s = 1e-5", "viscous_N_m_s = -1e-5"), &["viscous_N_m_s", "outside the physical range"]);
    bad(&with("inertia_kg_m2 = 2.2e-4", "inertia_kg_m2 = nan"), &["inertia_kg_m2", "finite"]);
    bad(&with("inertia_kg_m2 = 2.2e-4", "inertia_kg_m2 = \"2.2e-4\""), &["inertia_kg_m2"]);
    bad(&with("inertia_kg_m2 = 2.2e-4\n", ""), &["inertia_kg_m2", "missing"]);
    bad(&with("inertia_kg_m2 = 2.2e-4", "inertia_kg_m2 = 2.2e-4\ninertia_kg_m2 = 3e-4"), &["line 7", "not TOML", "duplicate"]);
    bad(&with("\"viscous\",", "\"viscous\", \"viscous\","), &["viscous", "twice", "viscous#2"]);
    bad(&with("inertia_kg_m2 = 2.2e-4", "inertia_kg_m2 = "), &["line 6", "not TOML"]);
    bad(&with("[drive]", "[driv]"), &["driv"]);
    bad(&with("[drive]\ninput = \"u_V\"\neffects", "[drive]\neffects"), &["input", "missing"]);
    bad("", &["[drive]", "missing"]);
    let cogging = |order: &str| format!("{}cogging_order = {order}\n", MODEL.replace("\"viscous\"", "\"viscous\", \"cogging\""));
    bad(&cogging("7.5"), &["cogging_order", "7.5", "whole number"]);
    bad(&cogging("0"), &["cogging_order", "outside the physical range"]);
    bad(&with("\"viscous\"", "\"viscous\", \"inductance#2\""), &["inductance", "cannot have a second instance"]);
    bad(&with("\"viscous\"", "\"viscous\", \"compliance\", \"backlash\""), &["compliance", "backlash"]);
    bad(&with("\"viscous\"", "\"viscous\", \"cogging#x\""), &["cogging#x", "cogging#2"]);
    let own = |body: &str| format!("{MODEL}\n[effect.rub]\n{body}\n");
    bad(&own("torque_N_m = \"-a * tanh(omega\"\nparameters = { a = 1e-3 }"), &["line 14", "rub", "torque_N_m"]);
    bad(&own("torque_N_m = \"-a * speed\"\nparameters = { a = 1e-3 }"), &["rub", "speed"]);
    bad(&own("torque_N_m = \"-a * omega\"\nparameters = { a = 1e-3, b = 2.0 }"), &["rub", "'b'"]);
    bad(&own("parameters = { a = 1e-3 }"), &["rub", "torque_N_m"]);
    bad(&own("torque_N_m = \"-a\"\nvoltage_V = \"a\"\nparameters = { a = 1e-3 }"), &["rub", "2"]);
    bad(&own("torque_N_m = \"-pi * omega\"\nparameters = { pi = 3.0 }"), &["pi"]);

    refused(path, &["compare", "log.csv", "--model", "missing.toml"], &["missing.toml", "cannot be read"]);
    refused(path, &["compare", "log.csv", "--model", "."], &[".: ", "cannot be read"]);
    std::fs::write(path.join("binary.toml"), [0xff, 0xfe, 0x00]).unwrap();
    refused(path, &["compare", "log.csv", "--model", "binary.toml"], &["binary.toml"]);
    refused(path, &["compare", "log.csv", "--model", "log.csv"], &["log.csv", "not TOML"]);
}

#[test]
fn invalid_edit_leaves_the_model_unchanged() {
    let folder = folder();
    let path = folder.path();
    refused(path, &["model", "add", "model.toml", "coging"], &["coging", "cogging"]);
    refused(path, &["model", "remove", "model.toml", "cogging"], &["model.toml", "cogging"]);
    refused(path, &["model", "set", "model.toml", "inertia", "1"], &["inertia", "inertia_kg_m2"]);
    refused(path, &["model", "set", "model.toml", "inertia_kg_m2", "-1"], &["inertia_kg_m2", "outside the physical range"]);
    refused(path, &["model", "set", "model.toml", "inertia_kg_m2", "nan"], &["inertia_kg_m2", "finite"]);
    refused(path, &["model", "set", "model.toml", "inertia_kg_m2", "much"], &["much", "VALUE"]);
    refused(path, &["model", "set", "model.toml", "inertia_kg_m2", "1", "--fixed", "--free"], &["--fixed", "--free"]);
    refused(path, &["model", "new", "model.toml"], &["model.toml", "--force"]);
    refused(path, &["model", "new", "model.toml", "--force", "--effects", "coging"], &["coging", "cogging"]);
    refused(path, &["model", "new", "model.toml", "--force", "--input", "u"], &["--input", "u_V"]);
    refused(path, &["model", "new", "nowhere/model.toml"], &["nowhere/model.toml"]);
    refused(path, &["model", "new", "."], &[".: "]);
    refused(path, &["model", "new", ".", "--force"], &[".: "]);
    refused(path, &["model", "add", "missing.toml", "cogging"], &["missing.toml"]);
}

#[test]
fn missing_folder_is_rejected_before_anything_is_written() {
    let folder = folder();
    let path = folder.path();
    let nowhere = ["nowhere/answer", "does not exist"];
    for option in ["--json", "--html"] {
        refused(path, &["compare", "log.csv", "--model", "model.toml", option, "nowhere/answer"], &nowhere);
        refused(path, &["fit", "log.csv", "--model", "model.toml", "--out", "fitted.toml", option, "nowhere/answer"], &nowhere);
        refused(path, &["effects", option, "nowhere/answer"], &nowhere);
        refused(path, &["effects", "cogging", option, "nowhere/answer"], &nowhere);
        refused(path, &["compare", "log.csv", "--model", "model.toml", option, "."], &[".: ", "folder"]);
    }
    refused(path, &["fit", "log.csv", "--model", "model.toml", "--json", "new.json", "--out", "nowhere/answer"], &nowhere);
    refused(path, &["sim", "--out", "log.csv", "--force", "--seconds", "1", "--json", "nowhere/answer"], &nowhere);
    refused(
        path,
        &["sim", "--out", "nowhere/answer.csv", "--seconds", "1", "--json", "new.json"],
        &["nowhere/answer.csv", "does not exist"],
    );
    std::fs::create_dir(path.join("folder.csv")).unwrap();
    refused(path, &["sim", "--out", "folder.csv", "--seconds", "1"], &["folder.csv", "folder"]);
}

/// `--out` is an existing log: it remains.
#[test]
fn bad_session_error_names_the_parameter() {
    let folder = folder();
    let path = folder.path();
    let bad = |words: &[&str], expected: &[&str]| {
        let all: Vec<&str> = ["sim", "--out", "log.csv", "--force", "--json", "new.json"].iter().chain(words).copied().collect();
        refused(path, &all, expected);
    };
    bad(&["--seconds", "0"], &["seconds", "0"]);
    bad(&["--seconds", "-1"], &["seconds", "-1"]);
    bad(&["--seconds", "nan"], &["seconds"]);
    bad(&["--seconds", "inf"], &["seconds"]);
    bad(&["--seconds", "1e9"], &["seconds"]);
    bad(&["--seconds", "long"], &["--seconds", "long"]);
    bad(&["--profile", "nonsense"], &["--profile", "multi-step", "staircase"]);
    bad(&["--profile", "sine", "--levels", "3"], &["--levels", "sine", "--frequency-hz"]);
    bad(&["--profile", "staircase", "--levels", "2.5"], &["--levels", "integer"]);
    bad(&["--profile", "abba", "--dwell-s", "-1"], &["--dwell-s", "-1"]);
    bad(&["--profile", "turns", "--mode", "voltage"], &["--profile", "rate mode"]);
    bad(&["--profile", "turns", "--turns", "1", "--amplitude", "34"], &["--amplitude", "34", "above the maximum"]);
    bad(&["--mode", "torque"], &["--mode", "torque", "rate", "voltage"]);
    bad(&["--amplitude", "nan"], &["amplitude"]);
    bad(&["--amplitude", "1e9"], &["amplitude"]);
    bad(&["--hidden", "nonsense"], &["--hidden", "nonsense"]);
    bad(&["--hidden", "coging"], &["--hidden", "coging", "cogging"]);
    bad(&["--hidden", "-1"], &["--hidden", "-1"]);
    bad(&["--seed", "-1"], &["-1"]);
    bad(&["--seed", "one"], &["--seed", "one"]);
    bad(&["--nonsense"], &["--nonsense"]);
    bad(&["nonsense"], &["nonsense"]);
    refused(path, &["sim"], &["--out"]);
    refused(path, &["sim", "--out", "session.txt"], &["session.txt", ".csv or .parquet"]);
    refused(path, &["nonsense"], &["nonsense"]);
    refused(path, &["model"], &["new"].map(|_| "stand"));
    refused(path, &["compare", "log.csv"], &["--model"]);
    refused(path, &["effects", "coging"], &["coging", "cogging"]);

    let stand = |text: &str, expected: &[&str]| {
        std::fs::write(path.join("bad.toml"), text).unwrap();
        let expected: Vec<&str> = expected.iter().copied().chain(["bad.toml"]).collect();
        bad(&["--stand", "bad.toml"], &expected);
    };
    stand("[drive\n", &["line 1"]);
    stand("[drive]\ninertia = 1.0\n", &["line 2", "inertia"]);
    stand("[drive]\ninertia_kg_m2 = -1.0\n", &["inertia_kg_m2", "positive"]);
    stand("[drive]\ninertia_kg_m2 = nan\n", &["inertia_kg_m2", "positive"]);
    stand("[drive]\ninertia_kg_m2 = \"heavy\"\n", &["line 2"]);
    stand("[effects.coging]\n", &["coging"]);
    stand("[effects.cogging]\ncogging_N = 1.0\n", &["cogging", "cogging_N", "cogging_N_m"]);
    stand("[effects.cogging]\ncogging_order = 7.5\n", &["cogging_order", "7.5", "whole number"]);
    stand("[effects.coulomb]\ncoulomb_N_m = -1.0\n", &["coulomb_N_m", "-1"]);
    stand("[sensors]\nrate_noise_rad_s = -1.0\n", &["rate_noise_rad_s"]);
    stand("[firmware]\nrate_gain_V_s_rad = nan\n", &["rate_gain_V_s_rad"]);
    stand("[hardware]\ncounts_per_turn = 0.0\n", &["counts_per_turn"]);
    bad(&["--stand", "missing.toml"], &["missing.toml", "cannot read"]);
    bad(&["--stand", "."], &[".: ", "cannot read"]);
}

#[test]
fn stand_needs_a_finite_ambient_temperature() {
    let folder = folder();
    let path = folder.path();
    std::fs::write(path.join("bad.toml"), "[drive]\nambient_C = nan\n").unwrap();
    refused(path, &["sim", "--out", "log.csv", "--force", "--seconds", "1", "--stand", "bad.toml"], &["bad.toml", "ambient_C"]);
}

/// A log derived from the valid one with changed columns.
fn spoilt(folder: &Path, name: &str, change: impl Fn(&mut Column, &Log)) {
    let log = Log::read(folder.join("log.csv")).unwrap();
    let mut columns = log.columns().to_vec();
    columns.iter_mut().for_each(|column| change(column, &log));
    let notes: Vec<_> = log.notes().iter().filter(|(k, _)| !k.contains("lsb")).cloned().collect();
    Log::new(name, columns, notes).unwrap().write(folder.join(name)).unwrap();
}

#[test]
fn implausible_log_is_refused_with_its_problems() {
    let folder = folder();
    let path = folder.path();
    // From about 3 s on there are enough windows for a slope.
    stand(path, &["sim", "--out", "log.csv", "--force", "--seconds", "8"]).succeeded();
    let scaled = |column: &'static str, factor: f64| {
        move |c: &mut Column, _: &Log| {
            if c.name == column {
                c.values.iter_mut().for_each(|v| *v *= factor);
            }
        }
    };
    spoilt(path, "degrees.csv", scaled("omega_rad_s", 180.0 / std::f64::consts::PI));
    spoilt(path, "rpm.csv", scaled("omega_rad_s", 30.0 / std::f64::consts::PI));
    spoilt(path, "minus.csv", scaled("omega_rad_s", -1.0));
    spoilt(path, "swapped.csv", |c, log| match c.name.as_str() {
        "omega_rad_s" => c.values = log.column("theta_rad").unwrap().to_vec(),
        "theta_rad" => c.values = log.column("omega_rad_s").unwrap().to_vec(),
        _ => {}
    });
    spoilt(path, "backwards.csv", |c, _| {
        if ["omega_rad_s", "theta_rad"].contains(&c.name.as_str()) {
            c.values.iter_mut().for_each(|v| *v = -*v);
        }
    });
    spoilt(path, "whole.csv", |c, _| {
        if c.name == "omega_rad_s" {
            c.values.iter_mut().for_each(|v| *v = v.round());
        }
    });
    spoilt(path, "unplugged.csv", scaled("i_A", 0.0));
    // The voltage of another place; the answer to a constant voltage of the motor is one (identification, plain_benches).
    spoilt(path, "constant.csv", |c, _| {
        if c.name == "u_V" {
            c.values.fill(12.0);
        }
    });
    // 10 mV cause 4 mA, a tenth of the Coulomb friction.
    stand(path, &["sim", "--out", "still.csv", "--seconds", "3", "--mode", "voltage", "--amplitude", "0.01"]).succeeded();
    let expected = [
        ("degrees.csv", "wrong-unit", "degrees per second?"),
        ("rpm.csv", "wrong-unit", "rpm"),
        ("minus.csv", "wrong-sign", "sign"),
        ("swapped.csv", "swapped", "exchanged"),
        ("backwards.csv", "negative-motor-constant", "negative motor constant"),
        ("whole.csv", "whole-numbers", "decimal"),
        ("unplugged.csv", "constant-channel", "i_A"),
        ("constant.csv", "constant-input", "u_V"),
        ("still.csv", "no-motion", "does not move"),
    ];
    refused(path, &["compare", "log.csv", "--model", "model.toml", "--plots", "log.csv"], &["log.csv", "--plots", "folder"]);
    for (log, code, expected) in expected {
        for verb in ["compare", "fit"] {
            let ran = stand(path, &[verb, log, "--model", "model.toml", "--json", "-"]).refused_the_log();
            let answer = ran.json();
            assert_eq!(answer["verdict"], "bad-log", "{verb} {log}: {}", ran.out);
            let problems: Vec<&Value> = answer["problems"].as_array().unwrap().iter().collect();
            assert_eq!(problems[0]["code"], code, "{verb} {log}: {problems:?}");
            assert!(problems[0]["says"].as_str().unwrap().contains(expected), "{verb} {log}: {problems:?}");
            // The report also states the problem, and no result is computed from such a log.
            let ran = stand(path, &[verb, log, "--model", "model.toml", "--html", "report.html"]).refused_the_log();
            // Lines are wrapped for the terminal.
            let text = ran.out.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(text.contains(expected), "{verb} {log}: {}", ran.out);
            assert!(std::fs::read_to_string(path.join("report.html")).unwrap().contains(expected), "{verb} {log}");
        }
        stand(path, &["fit", log, "--model", "model.toml", "--out", "fitted.toml", "--force"]).refused_the_log();
        assert!(!path.join("fitted.toml").exists(), "{log}: no model is fitted to it");
    }
    let good = stand(path, &["compare", "log.csv", "--model", "model.toml", "--json", "-"]).succeeded().json();
    assert_eq!(good.get("verdict"), None, "the log that these were made of is sound");
}

/// A cell with a physically impossible number, as in a damaged file.
#[test]
fn huge_values_cause_no_panic() {
    let folder = folder();
    let path = folder.path();
    for huge in [1e160, -1e300] {
        spoilt(path, "huge.csv", |c, _| {
            if c.name == "omega_rad_s" {
                c.values[1500] = huge;
            }
        });
        for verb in ["compare", "fit"] {
            let ran = stand(path, &[verb, "huge.csv", "--model", "model.toml", "--html", "huge.html", "--json", "huge.json"]);
            assert!(matches!(ran.status, Some(0 | 2)) && !ran.err.contains("panicked"), "{verb} {huge}: {ran:?}");
        }
    }
}

#[test]
fn unknown_column_is_listed_and_ignored() {
    let folder = folder();
    let path = folder.path();
    let text = std::fs::read_to_string(path.join("log.csv")).unwrap();
    let (mut named, mut made) = (false, String::new());
    for line in text.lines() {
        made += line;
        if !line.starts_with('#') {
            made += if named { ",some" } else { ",pulse_flag" };
            named = true;
        }
        made += "\n";
    }
    std::fs::write(path.join("more.csv"), made).unwrap();
    let plain = stand(path, &["compare", "log.csv", "--model", "model.toml", "--json", "-"]).succeeded().json();
    let more = stand(path, &["compare", "more.csv", "--model", "model.toml", "--json", "-"]).succeeded().json();
    assert_eq!(plain["outputs"], more["outputs"]);
    let warnings = more["warnings"].as_array().unwrap();
    assert!(warnings.iter().any(|w| w.as_str().unwrap().contains("pulse_flag")), "{warnings:?}");
    let printed = stand(path, &["compare", "more.csv", "--model", "model.toml"]).succeeded().out;
    assert!(printed.contains("pulse_flag"), "{printed}");
}

#[test]
fn closed_pipe_is_not_an_error() {
    let folder = folder();
    let path = folder.path();
    let commands: [&[&str]; 6] = [
        &["effects"],
        &["effects", "--json", "-"],
        &["--help"],
        &["compare", "log.csv", "--model", "model.toml"],
        &["fit", "log.csv", "--model", "model.toml", "--json", "-"],
        &["model", "show", "model.toml"],
    ];
    for words in commands {
        // Closed before the first byte, as by `| true`.
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = command(path, words).stdout(writer).output().unwrap();
        assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""), "{words:?}");
    }
}
