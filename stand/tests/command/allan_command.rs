//! `stand allan`: coefficients in degrees and hours, gaps, bursts, input errors.
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::gyro_noise;
use std::fmt::Write as _;
use std::path::Path;

use common::{RunOutput, stand};
use gyro_noise::{DEG_H, Gyro};
use serde_json::Value;
use tempfile::TempDir;

/// A gyro of 0.3 °/√h and 6 °/h.
const GYRO: Gyro = Gyro { quantisation: 0.0, white: 0.3 * 60.0 * DEG_H, flicker: 6.0 * DEG_H, walk: 0.0, ramp: 0.0 };

/// A log of these times and rates.
fn log(times_s: &[f64], rates: &[f64], column: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut text = format!("t_s,{column}\n");
    times_s.iter().zip(rates).for_each(|(t, rate)| writeln!(text, "{t},{rate}").unwrap());
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    folder
}

fn evenly(rows: usize, interval_s: f64) -> Vec<f64> {
    (0..rows).map(|k| k as f64 * interval_s).collect()
}

fn allan(folder: &Path, column: &str) -> Value {
    stand(folder, &["allan", "log.csv", "--column", column, "--json", "-"]).succeeded().json()
}

fn number(answer: &Value, path: &str) -> f64 {
    answer.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: {answer:#}"))
}

fn notes(answer: &Value) -> String {
    answer["says"].to_string()
}

#[track_caller]
fn within(answer: &Value, key: &str, wanted: f64, sigmas: f64) {
    let (value, sigma) = (number(answer, &format!("/{key}/value")), number(answer, &format!("/{key}/sigma")));
    assert!((value - wanted).abs() < sigmas * sigma, "{key}: {value} ± {sigma}, not {wanted}");
    assert!(sigma < 0.5 * value, "{key}: {value} ± {sigma} is too uncertain");
}

#[test]
fn gyro_coefficients_are_in_degrees_and_hours() {
    let rows = 1 << 18;
    let folder = log(&evenly(rows, 0.05), &GYRO.rates(rows, 0.05, 2), "gyro_rad_s");
    let answer = allan(folder.path(), "gyro_rad_s");
    within(&answer, "angle_random_walk_deg_sqrt_h", 0.3, 3.0);
    within(&answer, "bias_instability_deg_h", 6.0, 3.0);
    for key in ["rate_random_walk_deg_h_sqrt_h", "quantisation_deg", "rate_ramp_deg_h_h"] {
        assert!(answer[key]["value"].is_null() && answer[key]["sigma"].is_null(), "{key}: {}", answer[key]);
        assert!(answer[key]["says"].as_str().unwrap().starts_with("not significant in this record: below "), "{}", answer[key]);
    }
    // √2 N: N in °/√h is a sixtieth of that in (°/h)/√Hz.
    let n = number(&answer, "/angle_random_walk_deg_sqrt_h/value");
    let density = number(&answer, "/density_one_sided/deg_h_sqrt_Hz/value");
    assert!((density / (2_f64.sqrt() * 60.0 * n) - 1.0).abs() < 1e-12);
    assert!((number(&answer, "/density_one_sided/deg_s_sqrt_Hz/value") / (density / 3600.0) - 1.0).abs() < 1e-12);
    // The lists have equal lengths, and no number exceeds the record's resolution.
    let count = answer["tau_s"].as_array().unwrap().len();
    for list in ["oadev", "adev", "n", "n_adev", "degrees_of_freedom", "interval_68", "interval_95", "fitted", "strongest"] {
        assert_eq!(answer[list].as_array().unwrap().len(), count, "{list}");
    }
    assert_eq!((count, number(&answer, "/samples")), (18, f64::from(1 << 18)));
    assert!(number(&answer, "/read_s/1") <= number(&answer, "/duration_s") / 10.0);
    // The text gives the results of the JSON.
    let text = stand(folder.path(), &["allan", "log.csv", "--column", "gyro_rad_s"]).succeeded().out;
    for word in ["angle random walk  N  0.", "one-sided density √2 N = ", "bias instability   B  ", "T/10", "0.664", "beyond T/10"] {
        assert!(text.contains(word), "{word}: {text}");
    }
}

#[test]
fn white_noise_has_no_bias_instability() {
    let gyro = Gyro { white: 1e-4, ..Gyro::default() };
    let folder = log(&evenly(40_000, 0.01), &gyro.rates(40_000, 0.01, 9), "gyro_rad_s");
    let answer = allan(folder.path(), "gyro_rad_s");
    assert!(answer["bias_instability_deg_h"]["value"].is_null(), "{answer:#}");
    assert!(number(&answer, "/bias_instability_deg_h/below") > 0.0);
    within(&answer, "angle_random_walk_deg_sqrt_h", 1e-4_f64.to_degrees() * 60.0, 3.0);
}

#[test]
fn coefficients_have_the_unit_of_the_column() {
    let gyro = Gyro { white: 2e-3, ..Gyro::default() };
    let folder = log(&evenly(20_000, 0.01), &gyro.rates(20_000, 0.01, 3), "accel_x_m_s2");
    let answer = allan(folder.path(), "accel_x_m_s2");
    assert_eq!((&answer["unit"], &answer["coefficients"]["white_noise"]["unit"]), (&"m/s²".into(), &"m/s² √s".into()));
    assert!(answer["angle_random_walk_deg_sqrt_h"]["value"].is_null());
    assert!((number(&answer, "/coefficients/white_noise/value") / 2e-3 - 1.0).abs() < 0.05);
    assert!((number(&answer, "/density_one_sided/column/value") / (2_f64.sqrt() * 2e-3) - 1.0).abs() < 0.05);
}

#[test]
fn angle_gives_the_deviation_of_its_rate() {
    let rates = GYRO.rates(20_000, 0.05, 5);
    let mut angle = 1.0;
    let angles: Vec<f64> = std::iter::once(angle)
        .chain(rates.iter().map(|rate| {
            angle += rate * 0.05;
            angle
        }))
        .collect();
    let by_rate = allan(log(&evenly(20_000, 0.05), &rates, "gyro_rad_s").path(), "gyro_rad_s");
    let by_angle = allan(log(&evenly(20_001, 0.05), &angles, "theta_rad").path(), "theta_rad");
    assert_eq!((&by_angle["unit"], &by_angle["taken_as"], &by_angle["n"]), (&"rad/s".into(), &"integral".into(), &by_rate["n"]));
    for k in 0..10 {
        let (one, other) = (number(&by_rate, &format!("/oadev/{k}")), number(&by_angle, &format!("/oadev/{k}")));
        assert!((one / other - 1.0).abs() < 1e-8, "{k}: {one} {other}");
    }
    assert!(
        stand(log(&evenly(20_001, 0.05), &angles, "theta_rad").path(), &["allan", "log.csv", "--column", "theta_rad"])
            .succeeded()
            .out
            .contains("interpreted as an integral")
    );
}

#[test]
fn gaps_are_reported_and_not_crossed() {
    let rates = Gyro { white: 1e-4, ..Gyro::default() }.rates(30_000, 0.01, 6);
    // Two gaps, each followed by another bias: a difference across a gap would appear as a random walk.
    let (mut times, mut values) = (Vec::new(), Vec::new());
    for (k, rate) in rates.iter().enumerate() {
        if !(10_000..11_000).contains(&k) && !(20_000..20_003).contains(&k) {
            times.push(k as f64 * 0.01);
            values.push(rate + 0.1 * (k / 10_000) as f64);
        }
    }
    let answer = allan(log(&times, &values, "gyro_rad_s").path(), "gyro_rad_s");
    assert_eq!((&answer["segments"], &answer["samples"]), (&3.into(), &28_997.into()));
    assert!((number(&answer, "/missing_samples") - 1003.0).abs() < 0.1);
    assert!(notes(&answer).contains("2 gaps, about 1003 samples missing"), "{}", notes(&answer));
    assert!((number(&answer, "/interval_s") / 0.01 - 1.0).abs() < 1e-9);
    within(&answer, "angle_random_walk_deg_sqrt_h", 1e-4_f64.to_degrees() * 60.0, 3.5);
    assert!(answer["rate_random_walk_deg_h_sqrt_h"]["value"].is_null());
    // Runs of 10 000, 9000 and 9997 rows.
    assert_eq!(answer["n"][0], 28_997 - 3);
}

#[test]
fn bursts_are_spaced_evenly() {
    let rows = 32_000;
    let rates = Gyro { white: 1e-4, ..Gyro::default() }.rates(rows, 0.01, 7);
    // Bursts of 32 samples, fetched up to 60 ms late; time stamps within a burst are 10 µs apart. 320 samples are lost in the middle.
    let mut state = 3_u64;
    let mut times = Vec::new();
    for burst in 0..rows / 32 {
        state = state * 16_807 % 2_147_483_647;
        let late = 0.06 * (state as f64 / 2_147_483_647.0);
        let lost = if burst >= 500 { 3.2 } else { 0.0 };
        times.extend((0..32).map(|k| burst as f64 * 0.32 + late + lost + f64::from(k) * 1e-5));
    }
    let answer = allan(log(&times, &rates, "gyro_rad_s").path(), "gyro_rad_s");
    assert_eq!((&answer["bursts"], &answer["segments"], &answer["samples"]), (&true.into(), &2.into(), &32_000.into()));
    assert!((number(&answer, "/interval_s") / 0.01 - 1.0).abs() < 1e-3, "{}", answer["interval_s"]);
    assert!((number(&answer, "/missing_samples") - 320.0).abs() < 10.0);
    assert!(notes(&answer).contains("time stamps come in bursts of 32.0 rows") && notes(&answer).contains("1 gap,"), "{}", notes(&answer));
    within(&answer, "angle_random_walk_deg_sqrt_h", 1e-4_f64.to_degrees() * 60.0, 3.5);
    // Without the loss there is no gap.
    let whole: Vec<f64> = times.iter().enumerate().map(|(k, t)| if k >= 16_000 { t - 3.2 } else { *t }).collect();
    assert_eq!(allan(log(&whole, &rates, "gyro_rad_s").path(), "gyro_rad_s")["segments"], 1);
}

#[test]
fn quantisation_is_reported_and_harmless() {
    let rates = Gyro { white: 1e-3, ..Gyro::default() }.rates(50_000, 0.01, 8);
    let steps: Vec<f64> = rates.iter().map(|rate| (rate / 5e-3).round() * 5e-3).collect();
    let answer = allan(log(&evenly(50_000, 0.01), &steps, "gyro_rad_s").path(), "gyro_rad_s");
    assert!((number(&answer, "/quantum") / 5e-3 - 1.0).abs() < 1e-6);
    // The rounding adds LSB²/12 to the variance of a row, 2 %, which is subtracted.
    assert!(notes(&answer).contains("the rounding of the column is 2.0 % of the variance"), "{}", notes(&answer));
    within(&answer, "angle_random_walk_deg_sqrt_h", 1e-3_f64.to_degrees() * 60.0, 3.5);
}

#[test]
fn periodic_disturbance_is_reported_and_removed() {
    let mut rates = Gyro { white: 1e-4, ..Gyro::default() }.rates(50_000, 0.01, 8);
    rates.iter_mut().enumerate().for_each(|(k, rate)| *rate += 2e-3 * (k as f64 * 0.05).sin());
    let answer = allan(log(&evenly(50_000, 0.01), &rates, "gyro_rad_s").path(), "gyro_rad_s");
    // A vibration of 0.796 Hz.
    assert!(notes(&answer).contains("a periodic signal") && notes(&answer).contains("(0.796 Hz)"), "{}", notes(&answer));
    within(&answer, "angle_random_walk_deg_sqrt_h", 1e-4_f64.to_degrees() * 60.0, 3.5);
}

#[track_caller]
fn refused(ran: &RunOutput, words: &[&str]) {
    assert_eq!((ran.status, ran.out.as_str()), (Some(2), ""), "{ran:?}");
    assert_eq!(ran.err.trim_end().lines().count(), 1, "{}", ran.err);
    words.iter().for_each(|word| assert!(ran.err.contains(word), "{word}: {}", ran.err));
}

#[test]
fn invalid_column_is_an_input_error() {
    let folder = tempfile::tempdir().unwrap();
    let with_file = |text: &str, words: &[&str]| {
        std::fs::write(folder.path().join("log.csv"), text).unwrap();
        stand(folder.path(), &[&["allan", "log.csv", "--column"], words].concat())
    };
    let rows = "t_s,u_V,gyro_rad_s\n0,1,2\n1,1,3\n2,1,5\n3,1,4\n";
    refused(&with_file(rows, &["nonesuch"]), &["log.csv", "nonesuch", "the file has", "u_V, gyro_rad_s"]);
    refused(&with_file(rows, &["t_s"]), &["t_s is the time"]);
    refused(&with_file(rows, &["u_V"]), &["column u_V is 1 in every row"]);
    refused(&with_file(rows, &["gyro_rad_s", "--from", "2.5"]), &["1 rows from 2.5 s", "too few"]);
    refused(&with_file(rows, &["gyro_rad_s", "--from", "nan"]), &["time range NaN s to inf s", "(--from, --to)"]);
    refused(&with_file("gyro_rad_s\n1\n2\n", &["gyro_rad_s"]), &["no column t_s"]);
    refused(&with_file("t_s,gyro_rad_s\n", &["gyro_rad_s"]), &["no rows"]);
    refused(&with_file("t_s,gyro_rad_s\n0,1\n1,NaN\n2,3\n", &["gyro_rad_s"]), &["row 2", "column gyro_rad_s", "NaN"]);
    refused(&with_file("t_s,gyro_rad_s\n0,1\n1,2\n1,3\n", &["gyro_rad_s"]), &["row 3", "time 1 s repeats"]);
    refused(&with_file("t_s,theta_rad\n0,1\n1,2\n2,3\n3,4\n", &["theta_rad"]), &["column theta_rad is a straight line"]);
    for rows in 1..=2 {
        let text: String = (0..rows).fold("t_s,gyro_rad_s\n".to_owned(), |text, k| text + &format!("{k},{}\n", k * k));
        refused(&with_file(&text, &["gyro_rad_s"]), &["too few"]);
    }
    refused(&stand(folder.path(), &["allan", "nowhere.parquet", "--column", "u_V"]), &["nowhere.parquet", "cannot be read"]);
}

#[test]
fn few_rows_give_no_coefficients() {
    for rows in [3, 4, 5, 9, 20, 79, 80, 200] {
        let rates = Gyro { white: 1.0, ..Gyro::default() }.rates(rows, 1.0, rows as u64);
        for column in ["gyro_rad_s", "theta_rad", "anything"] {
            let folder = log(&evenly(rows, 1.0), &rates, column);
            let answer =
                stand(folder.path(), &["allan", "log.csv", "--column", column, "--json", "-", "--html", "page.html"]).succeeded().json();
            assert!(number(&answer, "/oadev/0") > 0.0, "{rows} {column}");
            if rows < 80 {
                assert!(answer["coefficients"]["white_noise"]["value"].is_null());
                assert!(notes(&answer).contains("too few to separate the processes"), "{answer:#}");
            }
        }
    }
    // Every time step is different.
    let times: Vec<f64> = (0..40).map(|k| f64::from(k * k)).collect();
    let rates = Gyro { white: 1.0, ..Gyro::default() }.rates(40, 1.0, 1);
    assert_eq!(stand(log(&times, &rates, "u_V").path(), &["allan", "log.csv", "--column", "u_V"]).status, Some(0));
}
