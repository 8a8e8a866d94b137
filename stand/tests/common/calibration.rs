//! Shared by the tests of calibrations.
#![allow(dead_code, clippy::unwrap_used, reason = "each test binary uses its part")]

use serde_json::Value;
use stand_acquire::calibration_session::drawn_dut::{Truth, drawn_sensor};
use stand_analysis::calibrate::Assumptions;

/// Two short steps at rates of both signs.
pub const SHORT: &str = "what = \"gyro\"\nsettle_s = 0.2\nserial = \"S-1\"\n[[steps]]\nname = \"one\"\nmode = \"rate\"\nprofile = \"staircase\"\namplitude = 2.0\n\
    levels = 1\ndwell_s = 0.6\nseconds = 3.0\n[[steps]]\nname = \"two\"\nmode = \"rate\"\nprofile = \"staircase\"\namplitude = 4.0\n\
    levels = 1\ndwell_s = 0.6\nseconds = 3.0\n";

/// A stand with a device under test and faults.
pub fn carrying(faults: &str) -> String {
    format!("[imu]\nradius_m = 0.05\n{faults}")
}

/// A fault from this time on.
pub fn fault(what: &str, from_s: f64, more: &str) -> String {
    format!("[[faults]]\nwhat = \"{what}\"\nfrom_s = {from_s:?}\n{more}\n")
}

#[track_caller]
pub fn number(of: &Value, key: &str) -> f64 {
    of[key].as_f64().unwrap_or_else(|| panic!("{key}: {of}"))
}

#[track_caller]
pub fn quantity(answer: &Value, name: &str) -> f64 {
    number(&answer[name], "value")
}

/// True values of the random device of this seed in the default session.
pub fn drawn(seed: u64) -> Truth {
    drawn_sensor(seed, &Assumptions::default(), 10.0).1
}

/// Asserts that the true values are within three expanded uncertainties.
#[track_caller]
pub fn holds(answer: &Value, truth: &Truth, names: &[&str]) {
    for name in names {
        let (_, wanted) = truth.iter().find(|(n, _)| n == name).unwrap();
        let (value, expanded) = (quantity(answer, name), number(&answer[*name], "U"));
        assert!((value - wanted).abs() < 3.0 * expanded, "{name}: {value} ± {expanded}, not {wanted}");
    }
}
