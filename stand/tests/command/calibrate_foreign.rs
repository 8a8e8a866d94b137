//! `stand calibrate --from --steps`: logs of another program with a table of their steps.
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::calibration;
use calibration::number;
use common::stand;
use hal_sim::peripherals::Noise;
use std::fmt::Write as _;
use std::path::Path;

/// A rate table's staircase: scale 1.02, bias 0.01 rad/s.
fn staircase(folder: &Path) {
    let mut noise = Noise::new(5, 0, 1e-3);
    let mut table = "file,from,to,rate_deg_s,temperature_C\n".to_owned();
    let mut log = "t_s,gyro_rad_s\n".to_owned();
    for (step, rate_deg_s) in [0.0, 20.0, 40.0, 60.0, 80.0, 0.0, -20.0, -40.0, -60.0, -80.0].into_iter().enumerate() {
        let from_s = 20.0 * step as f64;
        // Between the steps the table accelerates: these rows are not in the table of steps.
        for k in 0..2000 {
            let reading = 1.02 * f64::to_radians(rate_deg_s) + 0.01 + noise.draw() + if k < 400 { 0.3 } else { 0.0 };
            writeln!(log, "{:.2},{reading}", from_s + 0.01 * f64::from(k)).unwrap();
        }
        writeln!(table, "up.csv,{},{},{rate_deg_s},25", from_s + 5.0, from_s + 20.0).unwrap();
    }
    std::fs::write(folder.join("up.csv"), log).unwrap();
    std::fs::write(folder.join("steps.csv"), table).unwrap();
    std::fs::write(folder.join("known.toml"), "serial = \"F-1\"\nsettle_s = 0.2\n[known]\ncrystal_ppm = 100.0\n").unwrap();
}

#[test]
fn logs_with_a_table_of_steps_are_calibrated() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    staircase(path);
    let words = ["calibrate", "gyro", "--from", ".", "--steps", "steps.csv", "--known", "known.toml"];
    let answer = stand(path, &[&words[..], &["--json", "-"]].concat()).succeeded().json();
    for (name, truth) in [("scale", 1.02), ("bias_rad_s", 0.01)] {
        let (value, expanded) = (number(&answer[name], "value"), number(&answer[name], "U"));
        assert!((value - truth).abs() <= expanded && expanded < 1e-3, "{name}: {value} ± {expanded}, not {truth}");
    }
    assert_eq!(answer["record"]["serial"], "F-1");
    // The stated rates are as good as the half-width: 100 ppm of the scale.
    let lines = answer["scale"]["budget"].as_array().unwrap();
    let clock = lines.iter().find(|line| line["of"] == "clock").unwrap_or_else(|| panic!("{lines:?}"));
    assert!((number(clock, "contribution") / (1.02 * 1e-4 / 3_f64.sqrt()) - 1.0).abs() < 0.01, "{clock}");
    // Display units change the text only.
    let text = stand(path, &[&words[..], &["--units", "deg/h"]].concat()).succeeded().out;
    assert!(text.contains("logs of another program (1)"), "{text}");
    assert!(text.lines().any(|line| line.trim_start().starts_with("bias ") && line.contains("°/h")), "{text}");
}

#[test]
fn wrong_tables_are_refused_with_file_and_row() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    staircase(path);
    for (table, expected) in [
        ("file,from,to\nup.csv,0,1\n", &["rate_rad_s", "missing"][..]),
        ("file,from,to,rate_deg_s\nup.csv,5,x,0\n", &["row 2", "to: `x` is not a number"]),
        ("file,from,to,rate_deg_s\nup.csv,5,4,0\n", &["row 2", "must be before"]),
        ("file,from,to,rate_deg_s\nup.csv,5,15,0\nup.csv,10,20,1\n", &["row 3", "overlaps"]),
        ("file,from,to,rate_deg_s\nup.csv,500,600,0\n", &["row 2", "no rows from 500 to 600 s"]),
        ("file,from,to,rate_deg_s\nnone.csv,0,1,0\n", &["none.csv"]),
    ] {
        std::fs::write(path.join("bad.csv"), table).unwrap();
        let ran = stand(path, &["calibrate", "gyro", "--from", ".", "--steps", "bad.csv"]);
        assert!(ran.status == Some(2) && expected.iter().all(|word| ran.err.contains(word)), "{table}: {ran:?}");
        assert_eq!(ran.err.trim_end().lines().count(), 1, "{}", ran.err);
    }
}
