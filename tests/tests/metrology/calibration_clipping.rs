//! A gyro beyond its full scale: flat tops are found, and the step is left out.

use stand_analysis::calibrate::{CalibrateError, Remark, gyro};
use stand_tests::calibration::{assert_covers, calibrated, recorded};

fn staircase(name: &str, amplitude: f64) -> String {
    format!(
        "[[steps]]\nname = '{name}'\nmode = 'rate'\nprofile = 'staircase'\namplitude = {amplitude}\nlevels = 2\ndwell_s = 1.2\nseconds = 20.0\n"
    )
}

/// The range of the simulated gyro, ± 2294 °/s, is 40.0 rad/s. With a scale of 2 it is reached at 20 rad/s: a staircase to 30 rad/s gave a
/// scale of 1.44 ± 0.025.
#[test]
fn clipped_staircase_is_left_out() {
    let session = format!("what = 'gyro'\n{}{}", staircase("within", 15.0), staircase("beyond", 30.0));
    let findings = calibrated("[imu]\ngyro_scale = 2.0\n", &session, 1).findings;
    assert_covers(&findings, "scale", 2.0, 1e-3);
    let clipped = findings.remarks.iter().find_map(|r| match r {
        Remark::Clipped { step, limit_rad_s, rows } => Some((step.as_str(), *limit_rad_s, *rows)),
        _ => None,
    });
    let (step, limit, rows) = clipped.expect("the step is named");
    assert!(step == "beyond" && limit.abs() > 30.0 && rows > 1000, "{step} {limit} {rows}");
}

#[test]
fn session_of_clipped_steps_alone_is_refused() {
    let (steps, session) = recorded("[imu]\ngyro_scale = 2.0\n", &format!("what = 'gyro'\n{}", staircase("beyond", 30.0)), 1);
    let error = gyro::calibrate(&steps, &gyro::GyroSettings::of(&session)).expect_err("nothing is left");
    assert!(matches!(&error, CalibrateError::Clipped { step, .. } if step == "beyond"), "{error}");
}

/// A coarse converter repeats its codes at every constant rate; it is not clipped.
#[test]
fn coarse_and_silent_outputs_are_not_clipped() {
    for stand in [
        "[imu]\ngyro_noise_rad_s_rtHz = 0.0\ngyro_bias_instability_rad_s = 0.0\ngyro_random_walk_rad_s_rts = 0.0\n",
        "[imu]\ngyro_scale = 1.02\n",
    ] {
        let findings = calibrated(stand, &format!("what = 'gyro'\n{}", staircase("staircase", 15.0)), 2).findings;
        assert!(!findings.remarks.iter().any(|r| matches!(r, Remark::Clipped { .. })), "{:?}", findings.remarks);
    }
}
