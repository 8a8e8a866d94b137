//! Sequence of the rates: on a sensor that warms up, a sweep is wrong by the drift; a staircase and ABBA are not.
#![allow(clippy::unwrap_used)]

use identification::log::{Column, Log};
use stand_analysis::calibrate::gyro::{GyroSettings, calibrate};
use stand_analysis::calibrate::{Remark, Step};
use stand_tests::calibration::{assert_covers, calibrated, found, noise, recorded};

/// Warms by 10 K with a time constant of a minute: the bias changes by 20 mrad/s.
const WARMING: &str = "
[imu]
gyro_scale = 1.013
self_heating_K = 10.0
warm_up_s = 60.0
[imu.gyro]
bias_rad_s_per_K = 2e-3
";

/// The device is mounted without misalignment, and the session states that.
const KNOWN: &str = "[known]\nmisalignment_deg = 0.0\n";

const STAIRCASE: &str = "
[[steps]]
name = 'staircase'
mode = 'rate'
profile = 'staircase'
amplitude = 10.0
levels = 5
dwell_s = 1.5
seconds = 31.5
";

/// The rows of a log from the first greatest to the last smallest setpoint.
fn from_top_to_bottom(log: &Log) -> Log {
    let setpoints = log.column("rate_cmd_rad_s").unwrap();
    let (low, high) = setpoints.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let from = setpoints.iter().position(|v| *v == high).unwrap();
    let to = setpoints.iter().rposition(|v| *v == low).unwrap();
    let columns = log.columns().iter().map(|c| Column { name: c.name.clone(), values: c.values[from..=to].to_vec() }).collect();
    Log::new(log.path(), columns, log.notes().to_vec()).unwrap()
}

#[test]
fn budget_of_a_single_sweep_contains_the_drift() {
    let (steps, session) = recorded(WARMING, &format!("what = 'gyro'\n{KNOWN}{STAIRCASE}"), 1);
    let settings = GyroSettings::of(&session);
    let sweep: Vec<Step> = steps.iter().map(|s| Step { log: from_top_to_bottom(&s.log), ..s.clone() }).collect();
    let (swept, whole) = (calibrate(&sweep, &settings).unwrap(), calibrate(&steps, &settings).unwrap());
    let q = found(&swept, "scale");
    println!("sweep {} ± {} (noise {}), whole {:?}", q.value, q.expanded_u(), noise(q), found(&whole, "scale").value);
    // 10 K · 2 mrad/s/K · e^(−t/60 s) over some 17 s between the ends, of 20 rad/s: some 2e-4 of the scale.
    let off = (q.value - 1.013).abs();
    assert!(off > 3.0 * noise(q), "{off} {}", noise(q));
    assert!(q.contributions.iter().any(|c| c.source == "drift"));
    assert!(q.covers(1.013) && off > 1e-4);
    assert!(swept.remarks.contains(&Remark::DriftNotSeparable));
    let q = found(&whole, "scale");
    assert!((q.value - 1.013).abs() < noise(q), "{} {}", q.value, noise(q));
    assert!((q.value - 1.013).abs() < 0.1 * off);
}

#[test]
fn abba_is_right_within_its_scatter() {
    let session = "
[[steps]]
name = 'abba'
mode = 'rate'
profile = 'abba'
amplitude = 10.0
dwell_s = 1.5
cycles = 5
seconds = 41.0
";
    for seed in 1..4 {
        let record = calibrated(WARMING, &format!("what = 'gyro'\n{KNOWN}{session}"), seed);
        let q = found(&record.findings, "scale");
        assert!((q.value - 1.013).abs() < noise(q), "seed {seed}: {} {}", q.value, noise(q));
        assert_covers(&record.findings, "scale", 1.013, 3e-4);
    }
}

/// The bias of a warming device holds at a stated temperature: without the temperature in the fit it was 0.0155 ± 0.0013 rad/s beside no
/// temperature.
#[test]
fn bias_of_a_warming_device_has_its_temperature() {
    let rest = "\n[[steps]]\nname = 'rest'\nmode = 'off'\nseconds = 20.0\n";
    let record = calibrated(WARMING, &format!("what = 'gyro'\n{KNOWN}temperature_K = 0.1\nlatitude_deg = 0.0\n{rest}{STAIRCASE}"), 5);
    let q = found(&record.findings, "bias_rad_s");
    let t = q.conditions.temperature.expect("the bias has its temperature");
    assert!(t.high_C - t.low_C > 2.0, "{t:?}");
    // 2 mrad/s/K above 25 °C, times the scale.
    assert_covers(&record.findings, "bias_rad_s", 1.013 * 2e-3 * (t.at_C - 25.0), 4e-4);
    assert_covers(&record.findings, "bias_per_K_rad_s", 1.013 * 2e-3, 1e-4);
    assert_covers(&record.findings, "scale", 1.013, 3e-4);
}
