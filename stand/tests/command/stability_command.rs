//! `stand stability`: rate stability of a recorded session, limits, refusals.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::stand;
use serde_json::Value;

/// A stand with cogging: parts of a turn scatter, whole turns do not.
#[test]
fn parts_of_a_turn_scatter_and_whole_turns_do_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let sim = ["sim", "--hidden", "cogging", "--profile", "constant", "--amplitude", "2", "--seconds", "40", "--out", "log.parquet"];
    stand(path, &sim).succeeded();
    let words = ["stability", "log.parquet", "--limit", "20000", "--json", "-", "--html", "s.html"];
    let answer = stand(path, &words).succeeded().json();
    let [plateau] = answer["plateaus"].as_array().unwrap().as_slice() else { panic!("{answer:#}") };
    let number = |of: &Value, key: &str| of[key].as_f64().unwrap_or_else(|| panic!("{key}: {of:#}"));
    let mean = &plateau["rate_rad_s"];
    assert!((number(mean, "value") - 2.0).abs() <= number(mean, "U") && number(mean, "U") < 1e-3, "{mean}");
    let widths = plateau["widths"].as_array().unwrap();
    let degrees: Vec<Option<f64>> = widths.iter().map(|w| w["width_deg"].as_f64()).collect();
    assert_eq!(degrees, [Some(1.0), Some(10.0), Some(360.0), None], "{answer:#}");
    let sigma = |k: usize| number(&widths[k]["sigma_relative"], "value");
    assert!(sigma(3) < 2e-6 && sigma(3) < 0.1 * sigma(1), "{} {}", sigma(3), sigma(1));
    assert!(widths.iter().all(|w| w["within_limit"] == "yes"), "{answer:#}");
    let page = std::fs::read_to_string(path.join("s.html")).unwrap();
    assert_eq!(page.matches("<svg").count(), 4);
    let strict = stand(path, &["stability", "log.parquet", "--limit", "1e-9"]).succeeded().out;
    assert!(strict.contains("undecided: the limit lies within the uncertainty") || strict.contains("exceeds the limit"), "{strict}");
    assert!(!strict.contains("; within the limit"), "{strict}");
}

#[test]
fn logs_without_angle_or_rate_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("a.csv"), "t_s,omega_rad_s\n0,1\n0.1,1\n0.2,1\n0.3,1\n").unwrap();
    std::fs::write(path.join("b.csv"), "t_s,theta_rad\n0,1\n0.1,1\n0.2,1\n0.3,1\n0.4,1\n").unwrap();
    for (log, more, expected) in [
        ("a.csv", &[][..], "no column `theta_rad`"),
        ("b.csv", &[], "no stretch of constant rate"),
        ("b.csv", &["--settle", "-1"], "settle_s = -1: must be a number from 0 (--settle)"),
        ("b.csv", &["--limit", "0"], "(--limit)"),
    ] {
        let ran = stand(path, &[&["stability", log], more].concat());
        assert!(ran.status == Some(2) && ran.err.contains(expected) && ran.err.trim_end().lines().count() == 1, "{log} {more:?}: {ran:?}");
    }
}
