//! Rest and small rates: temperature, dead band, repeatability; and whole turns without plateaus.

use identification::log::{Column, Log};
use stand_analysis::calibrate::{Remark, gyro};
use stand_tests::calibration::{assert_covers, calibrated, found, recorded};

#[test]
fn temperature_coefficients_are_found_during_warm_up() {
    let stand = "
[imu]
gyro_scale = 0.98
self_heating_K = 8.0
warm_up_s = 25.0
[imu.gyro]
bias_rad_s_per_K = 4e-4
scale_per_K = 5e-4
";
    let session = "
what = 'gyro'
[known]
temperature_K = 0.1
[[steps]]
name = 'rest'
mode = 'off'
seconds = 20.0
[[steps]]
name = 'staircase'
mode = 'rate'
profile = 'staircase'
amplitude = 10.0
levels = 2
dwell_s = 1.2
seconds = 30.0
";
    let findings = calibrated(stand, session, 1).findings;
    // Twenty means over a second scatter by 9e-5 rad/s over 4 K; the thermometer's error is up to 0.1 K. The reading includes the scale
    // factor.
    assert_covers(&findings, "bias_per_K_rad_s", 0.98 * 4e-4, 0.1 * 4e-4);
    // Relative to the scale at its mean temperature, about 6 K above 25 °C: 0.3 %.
    assert_covers(&findings, "scale_per_K", 5e-4 / (1.0 + 6.0 * 5e-4), 0.1 * 5e-4);
}

fn small(band_rad_s: f64, seed: u64) -> stand_analysis::calibrate::Findings {
    let stand = format!("[imu]\ngyro_scale = 1.01\ngyro_bias_rad_s = 0.004\n[imu.gyro]\ndead_band_rad_s = {band_rad_s}\n");
    let session = "
what = 'gyro'
[[steps]]
name = 'staircase'
mode = 'rate'
profile = 'staircase'
amplitude = 10.0
levels = 3
dwell_s = 1.5
seconds = 37.5
[[steps]]
name = 'small rates'
mode = 'rate'
profile = 'staircase'
amplitude = 0.1
levels = 5
dwell_s = 2.0
seconds = 42.0
";
    calibrated(&stand, session, seed).findings
}

#[test]
fn dead_band_is_found_and_null_is_zero() {
    for (band, seed) in [(0.0, 1), (0.02, 2), (0.05, 3)] {
        let findings = small(band, seed);
        assert_covers(&findings, "dead_band_rad_s", band, 2e-3);
        // A dead band is not a curve: its residual is scatter, in per cent of 10 rad/s.
        assert_covers(&findings, "hysteresis_percent_fs", 0.0, 0.01 + 100.0 * 0.3 * band / 10.0);
    }
}

#[test]
fn repeatability_of_a_plateau_is_that_of_its_noise() {
    // 5 mdps/√Hz over some 0.9 s (1 s, cut to whole turns), of 10 rad/s.
    let predicted = 100.0 * 5e-3_f64.to_radians() / (2.0 * 0.9_f64).sqrt() / 10.0;
    // Eleven repetitions per session give a standard deviation to 20 %, six sessions together to 8 %; three times that is 25 %.
    let each: Vec<f64> = (4..10).map(|seed| found(&small(0.0, seed), "repeatability_percent_fs").value).collect();
    let pooled = (each.iter().map(|value| value * value).sum::<f64>() / each.len() as f64).sqrt();
    assert!((pooled / predicted - 1.0).abs() < 0.25, "{each:?}: {pooled} %, predicted {predicted} %");
}

#[test]
fn step_ends_when_the_temperature_is_stable() {
    let stand = "[imu]\nself_heating_K = 2.0\nwarm_up_s = 20.0\n";
    let session = |below_K_min: f64| {
        format!("what = 'gyro'\n[[steps]]\nname = 'warm up'\nmode = 'off'\nseconds = 120.0\nstable_K_min = {below_K_min}\n")
    };
    for (below_K_min, earliest_s, latest_s) in [(0.5, 65.0, 110.0), (0.001, 119.9, 120.1)] {
        let (steps, _) = recorded(stand, &session(below_K_min), 1);
        let log = &steps[0].log;
        // 6 K/min at power-on, falling by a factor e each 20 s; averaged over the last minute.
        assert!((earliest_s..latest_s).contains(&log.duration_s()), "{}", log.duration_s());
        let note = log.note("stable").unwrap();
        assert!(note.contains("the slope of sensor_C was +0."), "{note}");
    }
}

fn turns() -> String {
    let turns = |name: &str, rate: f64| {
        format!("[[steps]]\nname = '{name}'\nmode = 'rate'\nprofile = 'turns'\namplitude = {rate}\nturns = 5\nseconds = 5.5\n")
    };
    format!(
        "what = 'gyro'\n[[steps]]\nname = 'staircase'\nmode = 'rate'\nprofile = 'staircase'\namplitude = 8.0\nlevels = 2\ndwell_s = 1.5\nseconds = 25.5\n{}{}{}{}",
        turns("a", 8.0),
        turns("b", -8.0),
        turns("c", -8.0),
        turns("d", 8.0)
    )
}

#[test]
fn turns_with_lost_rows_are_excluded_with_a_remark() {
    let (mut steps, session) = recorded("[imu]\ngyro_scale = 0.96\ngyro_bias_rad_s = 0.02\n", &turns(), 2);
    // Removes a tenth of a second from step `b`.
    let log = &steps[2].log;
    let t_s = log.t_s().to_vec();
    let columns = log.columns().iter().map(|column| Column {
        name: column.name.clone(),
        values: column.values.iter().zip(&t_s).filter(|(_, t)| !(2.0..2.1).contains(*t)).map(|(value, _)| *value).collect(),
    });
    steps[2].log = Log::new("b.csv", columns.collect(), log.notes().to_vec()).unwrap();
    let findings = gyro::calibrate(&steps, &gyro::GyroSettings::of(&session)).unwrap();
    assert_covers(&findings, "scale_whole_turns", 0.96, 2e-3);
    assert!(findings.remarks.contains(&Remark::IncompleteTurns { left_out: 1, total: 4 }), "{:?}", findings.remarks);
}

#[test]
fn whole_turns_give_the_scale_without_a_plateau() {
    let session = turns();
    for (scale, seed) in [(1.0, 1), (0.96, 2), (1.03, 3)] {
        let stand = format!("[imu]\ngyro_scale = {scale}\ngyro_bias_rad_s = 0.02\n[imu.gyro]\nquadratic_s = 1e-4\n");
        let findings = calibrated(&stand, &session, seed).findings;
        assert_covers(&findings, "scale_whole_turns", scale, 2e-3 * scale);
        assert_covers(&findings, "scale", scale, 2e-3 * scale);
        let turns = found(&findings, "scale_whole_turns");
        assert!(turns.contributions.iter().any(|c| c.source == "misalignment"), "{:?}", turns.contributions);
    }
}
