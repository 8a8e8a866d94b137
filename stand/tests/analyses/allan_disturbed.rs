//! `stand allan` on records with lost rows, a changed sampling rate, a step, a warm-up: what is reported is covered, or not given.
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::gyro_noise;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::OnceLock;

use common::stand;
use gyro_noise::{DEG_H, Gyro};
use hal_sim::peripherals::Noise;
use serde_json::Value;

/// N = 0.3 °/√h.
const WHITE: Gyro = Gyro { quantisation: 0.0, white: 0.3 * 60.0 * DEG_H, flicker: 0.0, walk: 0.0, ramp: 0.0 };
const ROWS: usize = 1 << 16;
const INTERVAL_S: f64 = 0.05;

fn analysed(folder: &Path, rows: impl Iterator<Item = (f64, f64)>, more: &[&str]) -> Value {
    let mut text = "t_s,gyro_rad_s\n".to_owned();
    rows.for_each(|(t, rate)| writeln!(text, "{t:.6},{rate}").unwrap());
    std::fs::write(folder.join("log.csv"), text).unwrap();
    let words = ["allan", "log.csv", "--column", "gyro_rad_s", "--json", "-"];
    stand(folder, &[&words[..], more].concat()).succeeded().json()
}

/// U of N in an undisturbed record of [`ROWS`] rows.
fn undisturbed() -> f64 {
    static EXPANDED: OnceLock<f64> = OnceLock::new();
    *EXPANDED.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let rates = WHITE.rates(ROWS, INTERVAL_S, 2).into_iter().enumerate();
        let answer = analysed(folder.path(), rates.map(|(k, rate)| (k as f64 * INTERVAL_S, rate)), &[]);
        answer["angle_random_walk_deg_sqrt_h"]["U"].as_f64().unwrap()
    })
}

/// The interval of N contains the truth, and is about as narrow as that of an undisturbed record with as many rows: the processes that are
/// found by chance change its width by a few tenths, and a quantisation noise that is not significant by as much.
#[track_caller]
fn covers_n(answer: &Value) {
    let n = &answer["angle_random_walk_deg_sqrt_h"];
    let number = |key: &str| n[key].as_f64().unwrap_or_else(|| panic!("{key}: {answer:#}"));
    let (value, expanded) = (number("value"), number("U"));
    let most = 2.0 * undisturbed() * (ROWS as f64 / answer["samples"].as_f64().unwrap()).sqrt();
    assert!((value - 0.3).abs() <= expanded && expanded < most, "{n}, at most {most}");
    assert!((number("k") * number("sigma") / expanded - 1.0).abs() < 1e-9, "{n}");
}

fn says(answer: &Value) -> String {
    answer["says"].to_string()
}

/// The mean interval in place of the usual one makes N 5.4 % too large.
#[test]
fn a_tenth_of_lost_rows_does_not_change_the_angle_random_walk() {
    let folder = tempfile::tempdir().unwrap();
    let mut draw = Noise::new(1, 50, 1.0);
    let rates = WHITE.rates(ROWS, INTERVAL_S, 3);
    let kept = rates.into_iter().enumerate().filter(|_| draw.uniform(0.5) > -0.4).map(|(k, rate)| (k as f64 * INTERVAL_S, rate));
    let answer = analysed(folder.path(), kept, &[]);
    covers_n(&answer);
    assert!((answer["interval_s"].as_f64().unwrap() / INTERVAL_S - 1.0).abs() < 1e-6, "{}", answer["interval_s"]);
    let elapsed = answer["elapsed_per_row_s"].as_f64().unwrap() / INTERVAL_S;
    assert!((elapsed - 1.0 / 0.9).abs() < 0.01, "{elapsed}");
    assert!(says(&answer).contains("single rows are lost"), "{}", says(&answer));
}

/// Both halves as one series make N 29 % too large or too small.
#[test]
fn a_rate_halved_midway_splits_the_record() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (WHITE.rates(ROWS / 2, INTERVAL_S, 4), WHITE.rates(ROWS / 2, 2.0 * INTERVAL_S, 5));
    let change_s = (ROWS / 2) as f64 * INTERVAL_S;
    let rows = first.into_iter().enumerate().map(|(k, rate)| (k as f64 * INTERVAL_S, rate));
    let rows = rows.chain(second.into_iter().enumerate().map(|(k, rate)| (change_s + 2.0 * k as f64 * INTERVAL_S, rate)));
    let answer = analysed(folder.path(), rows, &[]);
    covers_n(&answer);
    assert!(says(&answer).contains("the sampling interval changes"), "{}", says(&answer));
}

/// As a random walk, one step of 60 °/h would be hundreds of °/h/√h.
#[test]
fn one_step_is_reported_and_is_no_random_walk() {
    let folder = tempfile::tempdir().unwrap();
    let step = 60.0 * DEG_H;
    let rates = WHITE.rates(ROWS, INTERVAL_S, 6).into_iter().enumerate();
    let rows = rates.map(|(k, rate)| (k as f64 * INTERVAL_S, rate + if k < ROWS / 3 { 0.0 } else { step }));
    let answer = analysed(folder.path(), rows, &[]);
    covers_n(&answer);
    let [found] = answer["steps"].as_array().unwrap().as_slice() else { panic!("{}", answer["steps"]) };
    let at_s = (ROWS / 3) as f64 * INTERVAL_S;
    assert!((found["t_s"].as_f64().unwrap() - at_s).abs() < 30.0 && (found["size"].as_f64().unwrap() / step - 1.0).abs() < 0.2, "{found}");
    let walk = &answer["rate_random_walk_deg_h_sqrt_h"];
    assert!(walk["value"].is_null() && walk["below"].as_f64().unwrap() < 40.0, "{walk}");
}

/// A warm-up of 40 °/h with a time constant of 300 s.
#[test]
fn a_warm_up_hides_slow_noise_until_it_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let rows = || {
        let rates = WHITE.rates(ROWS, INTERVAL_S, 7).into_iter().enumerate();
        rates.map(|(k, rate)| (k as f64 * INTERVAL_S, rate + 40.0 * DEG_H * (-(k as f64) * INTERVAL_S / 300.0).exp()))
    };
    let answer = analysed(folder.path(), rows(), &[]);
    covers_n(&answer);
    for key in ["bias_instability_deg_h", "rate_random_walk_deg_h_sqrt_h", "rate_ramp_deg_h_h"] {
        let coefficient = &answer[key];
        assert!(coefficient["value"].is_null() && coefficient["says"].as_str().unwrap().contains("transient"), "{key}: {coefficient}");
    }
    let said = says(&answer);
    let from = said.split("--from ").nth(1).and_then(|text| text.split('`').next()).unwrap_or_else(|| panic!("{said}"));
    let rest = analysed(folder.path(), rows(), &["--from", from]);
    covers_n(&rest);
    assert!(!says(&rest).contains("transient") && rest["rate_random_walk_deg_h_sqrt_h"]["value"].is_null(), "{}", says(&rest));
}

/// Twelve rows of 65 536 are off by 40 standard deviations: as noise, N would be 14 % larger.
#[test]
fn wild_rows_are_replaced_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let mut rates = WHITE.rates(ROWS, INTERVAL_S, 8);
    let size = 40.0 * WHITE.white / INTERVAL_S.sqrt();
    (0..12).for_each(|k| rates[5000 * k + 77] += if k % 3 == 0 { -size } else { size });
    let answer = analysed(folder.path(), rates.into_iter().enumerate().map(|(k, rate)| (k as f64 * INTERVAL_S, rate)), &[]);
    covers_n(&answer);
    let note = answer["notes"].as_array().unwrap().iter().find(|note| note["kind"] == "wild-rows").unwrap();
    assert_eq!(note["count"], 12);
    assert!(note["oadev_with"].as_f64().unwrap() > 1.1 * note["oadev_without"].as_f64().unwrap(), "{note}");
}

/// The temperature of a room swings with 30 min: a ramp of the level, if only the curve is looked at.
#[test]
fn a_periodic_temperature_is_no_ramp() {
    for (seed, period_s) in [(9, 1800.0), (10, 700.0), (11, 12.5)] {
        let folder = tempfile::tempdir().unwrap();
        let swing = |t: f64| 20.0 * DEG_H * (std::f64::consts::TAU * t / period_s + 1.0).sin();
        let rates = WHITE.rates(ROWS, INTERVAL_S, seed).into_iter().enumerate();
        let answer = analysed(folder.path(), rates.map(|(k, rate)| (k as f64 * INTERVAL_S, rate + swing(k as f64 * INTERVAL_S))), &[]);
        covers_n(&answer);
        // Of 1800 s the record has 1.8 periods: they could be anything slow.
        let kind = if period_s > 1000.0 { "slow-motion" } else { "periodic" };
        let note = answer["notes"].as_array().unwrap().iter().find(|note| note["kind"] == kind).unwrap();
        assert!((note["period_s"].as_f64().unwrap() / period_s - 1.0).abs() < 0.05, "{period_s}: {note}");
        for key in ["bias_instability_deg_h", "rate_random_walk_deg_h_sqrt_h", "rate_ramp_deg_h_h"] {
            assert!(answer[key]["value"].is_null(), "{period_s}: {}", answer[key]);
        }
        let hidden = answer["rate_ramp_deg_h_h"]["says"].as_str().unwrap().contains("slow motion");
        assert_eq!(hidden, period_s > 1000.0, "{period_s}: {}", answer["rate_ramp_deg_h_h"]);
    }
}

/// The last two rows of 10 002 have two values, which are no steps of a converter.
#[test]
fn rows_that_are_not_rounded_have_no_resolution() {
    for rows in [30, 10_002, 10_003] {
        let folder = tempfile::tempdir().unwrap();
        let rates = WHITE.rates(rows, INTERVAL_S, 13).into_iter().enumerate();
        let answer = analysed(folder.path(), rates.map(|(k, rate)| (k as f64 * INTERVAL_S, rate)), &[]);
        assert!(answer["quantum"].as_f64().is_none_or(|q| q < 1e-9), "{rows}: {}", answer["quantum"]);
    }
}

/// A step of one standard deviation adds a twelfth to the variance; one of three hides the noise.
#[test]
fn rounding_is_subtracted_or_hides_the_noise() {
    let row_sigma = WHITE.white / INTERVAL_S.sqrt();
    let rounded = |steps: f64| {
        let folder = tempfile::tempdir().unwrap();
        let lsb = steps * row_sigma;
        let rates = WHITE.rates(ROWS, INTERVAL_S, 12).into_iter().enumerate();
        analysed(folder.path(), rates.map(|(k, rate)| (k as f64 * INTERVAL_S, (rate / lsb).round() * lsb)), &[])
    };
    let fine = rounded(1.0);
    covers_n(&fine);
    let note = fine["notes"].as_array().unwrap().iter().find(|note| note["kind"] == "resolution").unwrap();
    assert!((note["percent"].as_f64().unwrap() - 100.0 / 13.0).abs() < 0.2, "{note}");
    let coarse = rounded(3.0);
    let n = &coarse["angle_random_walk_deg_sqrt_h"];
    assert!(n["value"].is_null() && n["reason"]["kind"] == "coarse-resolution", "{n}");
}
