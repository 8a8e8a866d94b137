//! Devices in several mountings: effects that are confounded in one mounting are separated in another.

use stand_tests::calibration::{assert_covers, calibrated, found};

const G: f64 = 9.806_65;

const TWO_RADII: &str = "
what = 'gyro'
[[steps]]
name = 'near'
mode = 'rate'
profile = 'staircase'
amplitude = 20.0
levels = 4
dwell_s = 1.5
seconds = 25.5
[[steps]]
name = 'far'
mounted = { radius_m = 0.1 }
mode = 'rate'
profile = 'staircase'
amplitude = 20.0
levels = 4
dwell_s = 1.5
seconds = 25.5
";

#[test]
fn second_radius_separates_g_sensitivity_from_a_quadratic_scale() {
    let sensitivity_s_m = 2e-4;
    let stand = format!("[imu]\ngyro_scale = 1.02\n[imu.gyro]\ng_sensitivity_s_m = {sensitivity_s_m}\n");
    let findings = calibrated(&stand, TWO_RADII, 1).findings;
    // −Ω² r along the sensor's x, at 0.05 m: 1e-5 s, some 0.02 % of full scale. The radii are known to 0.5 mm: 1 % of their distance.
    let near = found(&findings, "quadratic_s");
    assert!(near.covers(-sensitivity_s_m * 0.05) && near.value.abs() > 5.0 * near.expanded_u(), "{}", near.value);
    // The coefficient of Ω² is known to some 8e-7 s at each radius, over 0.05 m of distance.
    assert_covers(&findings, "g_sensitivity_outward_rad_s_g", sensitivity_s_m * G, 3.5e-4);
    assert_covers(&findings, "quadratic_at_axis_s", 0.0, 3e-6);
}

#[test]
fn quadratic_scale_is_not_reported_as_g_sensitivity() {
    let findings = calibrated("[imu]\ngyro_scale = 1.02\n[imu.gyro]\nquadratic_s = 1e-5\n", TWO_RADII, 2).findings;
    assert_covers(&findings, "quadratic_s", 1e-5, 1e-6);
    assert_covers(&findings, "g_sensitivity_outward_rad_s_g", 0.0, 3.5e-4);
    assert_covers(&findings, "quadratic_at_axis_s", 1e-5, 3e-6);
}

#[test]
fn tilted_stand_determines_g_sensitivity() {
    let session = "
what = 'gyro'
[[steps]]
name = 'staircase'
mode = 'rate'
profile = 'staircase'
amplitude = 10.0
levels = 2
dwell_s = 1.2
seconds = 20.0
[[steps]]
name = 'tilted'
mounted = { tilt_deg = 30.0 }
mode = 'rate'
profile = 'constant'
amplitude = 6.0
seconds = 12.0
";
    for sensitivity_s_m in [0.0, 2e-4] {
        for seed in 1..4 {
            let stand = format!("[imu]\ngyro_scale = 1.02\n[imu.gyro]\ng_sensitivity_s_m = {sensitivity_s_m}\n");
            let findings = calibrated(&stand, session, seed).findings;
            // Level to 0.2°: 0.6 % of g sin 30°. The noise of 10 s: 5 mdps/√Hz, over half a g.
            assert_covers(&findings, "g_sensitivity_rad_s_g", sensitivity_s_m * G, 2e-4 + 0.01 * sensitivity_s_m * G);
        }
    }
}

#[test]
fn both_sides_separate_cross_axis_and_mounting() {
    let side = |name: &str, lying: &str| {
        format!(
            "[[steps]]\nname = '{name}'\nmounted = {{ lying = '{lying}' }}\nmode = 'rate'\nprofile = 'staircase'\namplitude = 10.0\nlevels = 2\ndwell_s = 1.2\nseconds = 20.0\n"
        )
    };
    let session = format!("what = 'gyro'\n{}{}{}", side("flat", "flat"), side("side", "side"), side("other", "other-side"));
    for (cross, seed) in [(0.015, 1), (-0.004, 2), (0.0, 3)] {
        let stand = format!("[imu]\ngyro_scale = 1.02\ngyro_bias_rad_s = 0.01\n[imu.gyro]\ncross_axis = {cross}\n");
        let findings = calibrated(&stand, &session, seed).findings;
        assert_covers(&findings, "cross_axis_percent", 100.0 * cross, 2e-3);
        // The simulated stand mounts the device in the plane.
        assert_covers(&findings, "mounting_deg", 0.0, 1e-3);
    }
}
