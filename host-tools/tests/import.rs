//! Logs of other programs: what is believed about them, what is accepted, and that the numbers arrive.
#![allow(clippy::unwrap_used)]

mod common;

use std::fmt::Write;
use std::path::Path;

use common::{folder, stand};
use host_tools::log::Log;
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
    stand(path, &["log", "inspect", "counts.csv", "--unit", "enc=counts:20000", "--accept"]).succeeded();
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
    std::fs::write(path.join("holes.csv"), with_holes.join("\n")).unwrap();
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
fn matlab_files_of_scipy_are_read() {
    // A file that scipy.io.savemat wrote: 40 rows of a structure `run` with time, u_V, speed_rpm, compressed.
    let folder = folder();
    let path = folder.path();
    std::fs::write(path.join("m.mat"), include_bytes!("data/scipy_struct.mat")).unwrap();
    stand(path, &["log", "inspect", "m.mat", "--accept"]).succeeded();
    let log = Log::read(path.join("m.mat")).unwrap();
    assert_eq!(log.len(), 40);
    let expected: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k)).collect();
    assert!(log.column("omega_rad_s").unwrap().iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-9));
    // Every cut of the file is an error, never a panic.
    let whole = include_bytes!("data/scipy_struct.mat");
    for length in (0..whole.len()).step_by(7) {
        std::fs::write(path.join("cut.mat"), &whole[..length]).unwrap();
        let outcome = host_tools::log::import::inspect(&path.join("cut.mat"), &Default::default());
        assert!(outcome.is_err() || length + 8 > whole.len(), "{length}");
    }
}
