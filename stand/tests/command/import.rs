//! Logs of other programs: what is believed about them, what is accepted, and that the numbers arrive.
#![allow(clippy::unwrap_used)]

use crate::common;
use std::fmt::Write;
use std::path::Path;

use common::{folder, stand};
use identification::log::Log;
use serde_json::Value;

const RPM: f64 = 60.0 / std::f64::consts::TAU;

/// Rows of the log in the folder, as text with these columns.
fn table(folder: &Path, rows: usize, header: &str, separator: &str, decimal: char, cells: &dyn Fn(&Log, usize) -> Vec<f64>) -> String {
    let log = Log::read(folder.join("log.csv")).unwrap();
    let mut text = header.to_owned();
    for k in 0..rows.min(log.len()) {
        let line: Vec<String> = cells(&log, k).iter().map(|v| v.to_string().replace('.', &decimal.to_string())).collect();
        writeln!(text, "{}", line.join(separator)).unwrap();
    }
    text
}

fn of(log: &Log, column: &str, k: usize) -> f64 {
    log.column(column).unwrap()[k]
}

/// Time, voltage, current, rate in rpm, angle in degrees.
fn usual(log: &Log, k: usize) -> Vec<f64> {
    let at = |c| of(log, c, k);
    vec![1e3 * at("t_s"), at("u_V"), 1e3 * at("i_A"), RPM * at("omega_rad_s"), at("theta_rad").to_degrees()]
}

fn inspect(folder: &Path, file: &str, more: &[&str]) -> Value {
    stand(folder, &[&["log", "inspect", file, "--json", "-"], more].concat()).succeeded().json()
}

/// What the columns of a file are believed to be, with their units.
fn beliefs(answer: &Value) -> Vec<(String, String)> {
    let text = |v: &Value| v.as_str().unwrap_or("").to_owned();
    answer["columns"].as_array().unwrap().iter().map(|c| (text(&c["is"]), text(&c["unit"]))).collect()
}

/// The imported columns are those of the log, to rounding.
#[track_caller]
fn same_numbers(folder: &Path, file: &str, columns: &[&str]) {
    let (own, other) = (Log::read(folder.join("log.csv")).unwrap(), Log::read(folder.join(file)).unwrap());
    for name in columns {
        let (a, b) = (own.column(name).unwrap(), other.column(name).unwrap_or_else(|| panic!("{file}: no {name}")));
        let worst = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-9 * a.iter().fold(1.0, |m: f64, v| m.max(v.abs())), "{file}: {name} is off by {worst}");
    }
}

#[test]
fn names_with_units_are_understood_in_two_languages() {
    let folder = folder();
    let path = folder.path();
    let german = "Zeit [ms];Spannung [V];Strom [mA];Drehzahl [1/min];Winkel [°]\n";
    std::fs::write(path.join("german.csv"), table(path, 1000, german, ";", ',', &usual)).unwrap();
    let english = "Logger 3\nsaved by hand\n\nTime\tMotor voltage\tCurrent\tSpeed\tAngle\n(ms)\t(V)\t(mA)\t(rpm)\t(deg)\n\n";
    std::fs::write(path.join("english.txt"), table(path, 1000, english, "\t", '.', &usual)).unwrap();
    for file in ["german.csv", "english.txt"] {
        let answer = inspect(path, file, &[]);
        let found = beliefs(&answer);
        let names: Vec<&str> = found.iter().map(|f| f.0.as_str()).collect();
        assert_eq!(names, ["t_s", "u_V", "i_A", "omega_rad_s", "theta_rad"], "{answer}");
        assert_eq!((answer["rows"].as_u64(), answer["gaps"].as_u64(), answer["is_own"].as_bool()), (Some(1000), Some(0), Some(false)));
        let refused = stand(path, &["compare", file, "--model", "model.toml"]);
        assert!(refused.status == Some(2) && refused.err.contains("stand log inspect"), "{}", refused.err);
        stand(path, &["log", "inspect", file, "--accept"]).succeeded();
        same_numbers(path, file, &["t_s", "u_V", "i_A", "omega_rad_s", "theta_rad"]);
        let compared = stand(path, &["compare", file, "--model", "model.toml"]).succeeded();
        assert!(compared.out.contains("import.toml"), "the report says how the columns were read: {}", compared.out);
    }
}

#[test]
fn statements_on_the_command_line_are_remembered() {
    let folder = folder();
    let path = folder.path();
    std::fs::write(path.join("bare.txt"), table(path, 500, "", " ", '.', &usual)).unwrap();
    let words = ["compare", "bare.txt", "--model", "model.toml"];
    let map = [
        "--map",
        "1=t_s",
        "--unit",
        "1=ms",
        "--map",
        "2=u_V",
        "--map",
        "3=i_A",
        "--unit",
        "3=mA",
        "--map",
        "4=omega_rad_s",
        "--unit",
        "4=rpm",
    ];
    stand(path, &[&words[..], &map].concat()).succeeded();
    same_numbers(path, "bare.txt", &["t_s", "u_V", "i_A", "omega_rad_s"]);
    stand(path, &words).succeeded();
    // Each further statement changes its column only.
    stand(path, &["log", "inspect", "bare.txt", "--map", "5=theta_rad", "--unit", "5=deg", "--accept"]).succeeded();
    same_numbers(path, "bare.txt", &["t_s", "i_A", "theta_rad"]);
    let wrong = |more: &[&str]| stand(path, &[&words[..], more].concat()).err;
    assert!(wrong(&["--unit", "3=rpm"]).contains("not a unit of i_A"), "{}", wrong(&["--unit", "3=rpm"]));
    assert!(wrong(&["--unit", "3=banana"]).contains("not a known unit"));
    assert!(wrong(&["--map", "speed=omega_rad_s"]).contains("no such column"));
    assert!(wrong(&["--map", "3=i A"]).contains("i A"));
}

#[test]
fn note_that_is_not_understood_is_refused_and_not_remembered() {
    let folder = folder();
    let ran = stand(folder.path(), &["compare", "log.csv", "--model", "model.toml", "--note", "omega_rad_s=magnitud"]);
    assert!(ran.status == Some(2) && ran.err.contains("“magnitud” was not understood") && ran.err.lines().count() == 1, "{ran:?}");
    assert!(!folder.path().join("log.import.toml").exists());
}

#[test]
fn what_is_not_certain_is_asked() {
    let folder = folder();
    let path = folder.path();
    let counts =
        |log: &Log, k: usize| vec![k as f64, of(log, "u_V", k), (of(log, "theta_rad", k) / std::f64::consts::TAU * 20_000.0).round()];
    std::fs::write(path.join("counts.csv"), table(path, 1000, "t,u,enc\n", ",", '.', &counts)).unwrap();
    let answer = inspect(path, "counts.csv", &[]);
    assert_eq!(beliefs(&answer)[0], ("t_s".to_owned(), "ms".to_owned()), "a kilohertz is a usual rate");
    assert!(answer["open"].as_str().unwrap().contains("counts"), "{answer}");
    let refused = stand(path, &["log", "inspect", "counts.csv", "--accept"]);
    assert!(refused.status == Some(2) && refused.err.contains("--unit enc=counts:N"), "{}", refused.err);
    let half = stand(path, &["log", "inspect", "counts.csv", "--unit", "enc=counts:20000", "--accept"]);
    assert!(half.status == Some(2) && half.err.contains("the number of the row") && half.err.contains("--unit t=ms"), "{}", half.err);
    stand(path, &["log", "inspect", "counts.csv", "--unit", "enc=counts:20000", "--unit", "t=ms", "--accept"]).succeeded();
    let log = Log::read(path.join("counts.csv")).unwrap();
    let lsb = log.quantization_step("theta_rad").unwrap();
    assert!((lsb / (std::f64::consts::TAU / 20_000.0) - 1.0).abs() < 1e-9, "the step of the counts is known: {lsb}");
    // Without units, rate and angle tell each other's.
    let bare = |log: &Log, k: usize| {
        vec![of(log, "t_s", k), of(log, "u_V", k), RPM * of(log, "omega_rad_s", k), of(log, "theta_rad", k).to_degrees()]
    };
    std::fs::write(path.join("bare.csv"), table(path, 2000, "time,voltage,speed,angle\n", ",", '.', &bare)).unwrap();
    let answer = inspect(path, "bare.csv", &[]);
    assert!(answer["open"].as_str().unwrap().contains("speed"), "deg and rpm, or rad and rev/s: {answer}");
    stand(path, &["log", "inspect", "bare.csv", "--unit", "speed=rpm", "--accept"]).succeeded();
    same_numbers(path, "bare.csv", &["omega_rad_s", "theta_rad"]);
}

#[test]
fn rows_without_a_value_are_left_out_and_counted() {
    let folder = folder();
    let path = folder.path();
    let text = table(path, 1000, "time_ms,u_V,i_mA,speed_rpm,angle_deg\n", ",", '.', &usual);
    let with_holes: Vec<String> = text
        .lines()
        .enumerate()
        .map(|(k, line)| {
            if (101..=110).contains(&k) {
                line.replacen(',', ",NaN,", 1).replacen(",NaN,", ",", 1).rsplit_once(',').unwrap().0.to_owned() + ","
            } else {
                line.to_owned()
            }
        })
        .collect();
    std::fs::write(path.join("holes.csv"), with_holes.join("\n") + "\n").unwrap();
    stand(path, &["log", "inspect", "holes.csv", "--accept"]).succeeded();
    let log = Log::read(path.join("holes.csv")).unwrap();
    assert_eq!((log.len(), log.segments().len()), (990, 2));
    let out = stand(path, &["compare", "holes.csv", "--model", "model.toml"]).succeeded().out;
    assert!(out.replace('\n', " ").contains("10 rows without a value"), "{out}");
}

#[test]
fn parquet_of_pandas_and_sample_rates_are_read() {
    let folder = folder();
    let path = folder.path();
    let untimed = |log: &Log, k: usize| usual(log, k)[1..].to_vec();
    std::fs::write(path.join("untimed.csv"), table(path, 1000, "u_V,i_mA,speed_rpm,angle_deg\n", ",", '.', &untimed)).unwrap();
    let refused = stand(path, &["log", "inspect", "untimed.csv", "--accept"]);
    assert!(refused.status == Some(2) && refused.err.contains("--sample-rate"), "{}", refused.err);
    stand(path, &["log", "inspect", "untimed.csv", "--sample-rate", "1000", "--accept"]).succeeded();
    same_numbers(path, "untimed.csv", &["t_s", "omega_rad_s"]);
    // A Parquet file with columns of the user's own.
    stand(path, &["convert", "log.csv", "own.parquet"]).succeeded();
    let answer = inspect(path, "own.parquet", &["--map", "supply_V=bench_supply"]);
    assert!(beliefs(&answer).iter().any(|b| b.0 == "bench_supply"), "{answer}");
}

#[test]
fn damaged_import_files_name_themselves() {
    let folder = folder();
    let path = folder.path();
    for (text, expected) in [
        ("columns = 3", "not an import file"),
        ("[columns]\na = { is = \"i_A\", unit = \"furlong\" }", "not a known unit"),
        ("[columns]\na = { is = \"i_A\", unit = \"rpm\" }", "not a unit of i_A"),
        ("[columns]\nnothing = { is = \"i_A\" }", "no such column"),
        ("[colums]\n", "not an import file"),
    ] {
        std::fs::write(path.join("log.import.toml"), text).unwrap();
        let refused = stand(path, &["compare", "log.csv", "--model", "model.toml"]);
        assert!(refused.status == Some(2) && refused.err.contains(expected) && refused.err.lines().count() == 1, "{text}: {}", refused.err);
    }
}

#[test]
fn counts_per_turn_follow_from_the_rate() {
    let folder = folder();
    let path = folder.path();
    let counts = |log: &Log, k: usize| {
        let count = (of(log, "theta_rad", k) / std::f64::consts::TAU * 20_000.0).round();
        vec![of(log, "t_s", k), of(log, "u_V", k), RPM * of(log, "omega_rad_s", k), (count + 32_768.0).rem_euclid(65_536.0) - 32_768.0]
    };
    std::fs::write(path.join("counts.csv"), table(path, 3000, "t_s,u_V,speed_rpm,enc\n", ",", '.', &counts)).unwrap();
    let text = stand(path, &["log", "inspect", "counts.csv"]).succeeded().out;
    assert!(text.contains("a turn has") && text.contains("probably 20000") && text.contains("--unit enc=counts:20000 --accept"), "{text}");
    stand(path, &["log", "inspect", "counts.csv", "--unit", "enc=counts:20000", "--accept"]).succeeded();
    same_numbers(path, "counts.csv", &["theta_rad"]);
}

#[test]
fn units_that_contradict_each_other_are_said() {
    let folder = folder();
    let path = folder.path();
    let wrong = |log: &Log, k: usize| vec![of(log, "t_s", k), of(log, "u_V", k), of(log, "omega_rad_s", k), of(log, "theta_rad", k)];
    std::fs::write(path.join("wrong.csv"), table(path, 3000, "t_s,u_V,speed_rpm,angle_rad\n", ",", '.', &wrong)).unwrap();
    let text = stand(path, &["log", "inspect", "wrong.csv"]).succeeded().out;
    assert!(text.contains("The rate is 0.104") && text.contains("a unit is wrong"), "{text}");
    // A reading in volts that is stated to be a current: what a volt means is asked.
    std::fs::write(path.join("scope.csv"), table(path, 3000, "t_s,u_V,CH2 [V],speed_rpm\n", ",", '.', &wrong)).unwrap();
    let refused = stand(path, &["log", "inspect", "scope.csv", "--map", "CH2 [V]=i_A", "--accept"]);
    assert!(refused.status == Some(2) && refused.err.contains("10 A"), "{}", refused.err);
    stand(path, &["log", "inspect", "scope.csv", "--map", "3=i_A", "--unit", "3=10 A", "--accept"]).succeeded();
    let scale = Log::read(path.join("scope.csv")).unwrap().column("i_A").unwrap()[1500]
        / of(&Log::read(path.join("log.csv")).unwrap(), "omega_rad_s", 1500);
    assert!((scale - 10.0).abs() < 1e-9, "{scale}");
}

#[test]
fn disorder_is_refused_with_its_row() {
    let folder = folder();
    let path = folder.path();
    let text = table(path, 1000, "time_ms,u_V,i_mA,speed_rpm,angle_deg\n", ",", '.', &usual);
    let mut lines: Vec<&str> = text.lines().collect();
    lines.swap(501, 502);
    std::fs::write(path.join("unsorted.csv"), lines.join("\n") + "\n").unwrap();
    let refused = stand(path, &["log", "inspect", "unsorted.csv", "--accept"]);
    assert!(refused.status == Some(2) && refused.err.contains("row 502") && refused.err.contains("steps back"), "{}", refused.err);
    assert!(stand(path, &["log", "inspect", "unsorted.csv"]).succeeded().out.contains("Refused: "));
    let coarse = |log: &Log, k: usize| vec![(of(log, "t_s", k) * 250.0).floor() * 4.0, of(log, "u_V", k), of(log, "omega_rad_s", k)];
    std::fs::write(path.join("coarse.csv"), table(path, 1000, "time_ms,u_V,speed_rpm\n", ",", '.', &coarse)).unwrap();
    let refused = stand(path, &["log", "inspect", "coarse.csv", "--accept"]).err;
    assert!(refused.contains("coarser than the rows") && refused.contains("the sample rate, about 10"), "{refused}");
    for (text, says) in [
        ("t,u\n0,001,1,5\n0,002,2,5\n0,003,2,5\n", "commas seem to separate the columns and the decimals"),
        ("t,u\n0x01,0x2A\n0x02,0x2B\n", "hexadecimal"),
        ("PK\u{3}\u{4}", "spreadsheet"),
        ("no numbers\nat all\n", "no table in the file"),
    ] {
        std::fs::write(path.join("bad.csv"), text).unwrap();
        let refused = stand(path, &["log", "inspect", "bad.csv"]);
        assert!(refused.status == Some(2) && refused.err.contains(says) && refused.err.lines().count() == 1, "{text}: {}", refused.err);
    }
}

#[test]
fn matlab_7_3_and_hdf5_are_read() {
    // A file of h5py in MATLAB's form: 50 rows of a structure `run`, compressed in part, and a matrix; and one without it.
    let folder = folder();
    let path = folder.path();
    let whole = include_bytes!("../data/h5py_matlab_7_3.mat");
    std::fs::write(path.join("m.mat"), whole).unwrap();
    stand(path, &["log", "inspect", "m.mat", "--accept"]).succeeded();
    let log = Log::read(path.join("m.mat")).unwrap();
    let expected = |k: usize| (0.04 * k as f64).sin();
    assert!(log.len() == 50 && log.column("u_V").unwrap().iter().enumerate().all(|(k, u)| (u - expected(k)).abs() < 1e-12));
    let rate = |k: usize| 3.0 * (0.04 * k as f64).cos();
    assert!(log.column("omega_rad_s").unwrap().iter().enumerate().all(|(k, w)| (w - rate(k)).abs() < 1e-6), "single precision, rpm");
    assert!(log.column("xy_2").is_none(), "columns of the user's own are read where a model names them");
    assert_eq!(Log::read_also(path.join("m.mat"), &["xy_2"]).unwrap().column("xy_2").unwrap()[7], expected(7));
    std::fs::write(path.join("plain.h5"), include_bytes!("../data/h5py_plain.h5")).unwrap();
    stand(path, &["log", "inspect", "plain.h5", "--map", "log_2=u_V", "--unit", "speed=0.01 rad/s", "--accept"]).succeeded();
    let log = Log::read(path.join("plain.h5")).unwrap();
    assert!((log.column("u_V").unwrap()[9] - expected(9)).abs() < 1e-12 && (log.column("omega_rad_s").unwrap()[9] - rate(9)).abs() < 0.01);
    // Every cut of the file is an error or a table, never a panic.
    for length in (0..whole.len()).step_by(101) {
        std::fs::write(path.join("cut.mat"), &whole[..length]).unwrap();
        let _ = identification::log::import::inspect(&path.join("cut.mat"), &Default::default());
    }
}

#[test]
fn matlab_files_of_scipy_are_read() {
    // A file that scipy.io.savemat wrote: 40 rows of a structure `run` with time, u_V, speed_rpm, compressed.
    let folder = folder();
    let path = folder.path();
    std::fs::write(path.join("m.mat"), include_bytes!("../data/scipy_struct.mat")).unwrap();
    stand(path, &["log", "inspect", "m.mat", "--accept"]).succeeded();
    let log = Log::read(path.join("m.mat")).unwrap();
    assert_eq!(log.len(), 40);
    let expected: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k)).collect();
    assert!(log.column("omega_rad_s").unwrap().iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-9));
    // Every cut of the file is an error, never a panic.
    let whole = include_bytes!("../data/scipy_struct.mat");
    for length in (0..whole.len()).step_by(7) {
        std::fs::write(path.join("cut.mat"), &whole[..length]).unwrap();
        let outcome = identification::log::import::inspect(&path.join("cut.mat"), &Default::default());
        assert!(outcome.is_err() || length + 8 > whole.len(), "{length}");
    }
}

#[test]
fn columns_and_parameters_are_used_in_expressions() {
    let folder = folder();
    let path = folder.path();
    // A known voltage that the log's u_V lacks, beside it as a column of the user's own.
    let own = Log::read(path.join("log.csv")).unwrap();
    let push: Vec<f64> = own.t_s().iter().map(|t| (7.0 * t).sin()).collect();
    let mut text = "t_s,u_V,i_A,omega_rad_s,theta_rad,push\n".to_owned();
    for (k, push) in push.iter().enumerate() {
        let at = |c| of(&own, c, k);
        writeln!(text, "{},{},{},{},{},{push}", at("t_s"), at("u_V") - 0.1 * push, at("i_A"), at("omega_rad_s"), at("theta_rad")).unwrap();
    }
    std::fs::write(path.join("pushed.csv"), text).unwrap();
    let with = |effect: &str, columns: &str| {
        let model = common::MODEL.replace("[drive]\n", &format!("[drive]\n{columns}\n")) + effect;
        std::fs::write(path.join("push.toml"), model).unwrap();
        stand(path, &["fit", "pushed.csv", "--model", "push.toml", "--json", "-"])
    };
    let fit = with("[effect.push]\nvoltage_V = \"g * push\"\nparameters = { g = 0.01 }\n", "columns = [\"push\"]").succeeded().json();
    let g = &fit["parameters"]["push.g"];
    let (value, sigma) = (g["value"].as_f64().unwrap(), g["sigma"].as_f64().unwrap());
    assert!((value - 0.1).abs() < 4.0 * sigma && sigma < 0.01, "{g}");
    // The resistance of the model in the expression: g is now a current.
    let fit = with("[effect.push]\nvoltage_V = \"g * resistance_ohm * push\"\nparameters = { g = 0.01 }\n", "columns = [\"push\"]")
        .succeeded()
        .json();
    let product = fit["parameters"]["push.g"]["value"].as_f64().unwrap() * fit["parameters"]["resistance_ohm"]["value"].as_f64().unwrap();
    assert!((product - value).abs() < 0.2 * sigma, "{product} {value}");
    let undeclared = with("[effect.push]\nvoltage_V = \"g * push\"\nparameters = { g = 0.01 }\n", "");
    assert!(undeclared.status == Some(2) && undeclared.err.contains("push"), "{}", undeclared.err);
    let missing = with("", "columns = [\"pull\"]");
    assert!(missing.status == Some(2) && missing.err.contains("pull"), "{}", missing.err);
}

#[test]
fn several_logs_are_fitted_together() {
    let folder = folder();
    let path = folder.path();
    stand(path, &["sim", "--out", "second.csv", "--seconds", "3", "--seed", "2"]).succeeded();
    let fit = |logs: &[&str]| stand(path, &[&["fit"], logs, &["--model", "model.toml", "--json", "-"]].concat()).succeeded().json();
    let sigma = |answer: &Value| answer["parameters"]["resistance_ohm"]["sigma"].as_f64().unwrap();
    let (one, both) = (fit(&["log.csv"]), fit(&["log.csv", "second.csv"]));
    assert_eq!(both["samples"].as_u64().unwrap(), 2 * one["samples"].as_u64().unwrap());
    assert!(sigma(&both) < 0.9 * sigma(&one), "{} {}", sigma(&both), sigma(&one));
    let text = stand(path, &["compare", "log.csv", "second.csv", "--model", "model.toml"]).succeeded().out;
    assert!(text.contains("2 segments are compared"), "{text}");
}

#[test]
fn segments_that_are_too_short_count_in_no_score() {
    let folder = folder();
    let path = folder.path();
    let log = std::fs::read_to_string(path.join("log.csv")).unwrap();
    // A gap of half a second, then five rows, then another gap.
    let rows: Vec<&str> = log.lines().collect();
    let first = rows.iter().position(|l| l.starts_with("t_s")).unwrap() + 1;
    let kept = |k: usize| k < first || !(first + 1000..first + 1500).contains(&k) && !(first + 1505..first + 2000).contains(&k);
    let text: Vec<&str> =
        rows.iter().enumerate().filter(|(k, l)| kept(*k) && !(*k > first && l.starts_with('#'))).map(|(_, l)| *l).collect();
    std::fs::write(path.join("gaps.csv"), text.join("\n") + "\n").unwrap();
    let out = stand(path, &["fit", "gaps.csv", "--model", "model.toml"]).succeeded().out.replace('\n', " ");
    assert!(out.contains("2 segments are compared") && out.contains("One more segment of 5 rows"), "{out}");
}
