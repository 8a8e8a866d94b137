//! An accelerometer as a rate sensor: scale, radius, angle, bias; a tilted stand; its insensitive range.

use stand_analysis::calibrate::{Findings, Remark};
use stand_tests::calibration::{assert_covers, calibrated, found};

fn turning(name: &str, mounted: &str) -> String {
    format!(
        "
[[steps]]
name = '{name}'
mounted = {{ {mounted} }}
mode = 'rate'
profile = 'staircase'
amplitude = 20.0
levels = 2
dwell_s = 1.5
seconds = 14.0
[[steps]]
name = '{name} to and fro'
mode = 'rate'
profile = 'sine'
amplitude = 8.0
frequency_Hz = 1.0
seconds = 8.0
"
    )
}

/// A device with 2 % scale error, misaligned by 1.2°, with biases on both axes. It has no flicker noise and no random walk, so that the
/// bias of each session, the mean over its steps, is the nominal one; with the default 40 µg it differs from it by up to 5e-4 m/s², more
/// than its U. The bench of the coverage has them.
fn accel(leans_rad: f64, steps: &str, seed: u64) -> Findings {
    let stand = format!(
        "[imu]\naccel_scale = 1.02\naccel_bias_m_s2 = 0.15\naccel_bias_instability_m_s2 = 0.0\nchi_rad = {}\ntilt_rad = {leans_rad}\n",
        1.2_f64.to_radians()
    );
    let record = calibrated(&stand, &format!("what = 'accel'\n[known]\nradius_error_m = 1e-4\n{steps}"), seed);
    record.findings
}

#[test]
fn one_radius_gives_only_the_product_of_scale_and_radius() {
    for seed in 1..3 {
        let findings = accel(0.0, &turning("near", "radius_m = 0.05"), seed);
        // The half-width of the radius is 0.1 mm, 0.2 %; times 1.13 for 95 % of a rectangle.
        assert_covers(&findings, "scale", 1.02, 2.5e-3);
        assert_covers(&findings, "angle_deg", 1.2, 0.05);
        assert_covers(&findings, "bias_x_m_s2", 0.15, 0.01);
        assert_covers(&findings, "bias_y_m_s2", 0.15, 0.01);
        // With an assumed scale of 1 the radius has the error of the scale, which dominates its budget.
        let radius = found(&findings, "radius_m");
        assert!((radius.value - 1.02 * 0.05).abs() < 2e-5, "{}", radius.value);
        let of_scale = radius.contributions.iter().find(|c| c.source == "scale").expect("the scale is assumed").contribution();
        assert!(of_scale > 0.95 * radius.combined_u() && (of_scale / radius.value - 0.01 / 3_f64.sqrt()).abs() < 1e-9);
    }
}

#[test]
fn two_radii_separate_scale_and_radius() {
    let steps = format!("{}{}", turning("near", "radius_m = 0.05"), turning("far", "radius_m = 0.09"));
    let findings = accel(0.0, &steps, 3);
    // 0.1 mm at each radius over 40 mm.
    assert_covers(&findings, "scale", 1.02, 5e-3);
    assert_covers(&findings, "radius_m", 0.05, 2.5e-4);
}

#[test]
fn saturated_windows_are_left_out() {
    // 20 rad/s at 0.1 m are 40 m/s², times 1.02: the range is 4 g.
    let steps = format!("{}{}", turning("near", "radius_m = 0.05"), turning("far", "radius_m = 0.1"));
    let findings = accel(0.0, &steps, 7);
    assert_covers(&findings, "scale", 1.02, 5e-3);
    assert_covers(&findings, "radius_m", 0.05, 2.5e-4);
}

#[test]
fn stand_tilt_changes_neither_scale_nor_angle() {
    for (tilt_deg, seed) in [(0.0_f64, 4), (5.0, 5), (5.0, 6), (5.0, 7)] {
        let findings = accel(0.0, &turning("near", &format!("radius_m = 0.05, tilt_deg = {tilt_deg}")), seed);
        assert_covers(&findings, "scale", 1.02, 2.5e-3);
        assert_covers(&findings, "angle_deg", 1.2, 0.1);
        assert_covers(&findings, "bias_x_m_s2", 0.15, 0.02);
        assert_covers(&findings, "bias_y_m_s2", 0.15, 0.02);
    }
}

#[test]
fn accelerometer_is_insensitive_near_rest() {
    let findings = accel(0.0, &turning("near", "radius_m = 0.05"), 6);
    let blind = found(&findings, "blind_below_rad_s");
    assert!(findings.remarks.contains(&Remark::SquareOfRate));
    // 60 µg/√Hz over 30 ms are at least 2.4 mm/s²: √(f/2r) is 0.15 rad/s.
    assert!(blind.value > 0.15 && blind.value < 1.0, "{}", blind.value);
    assert!(found(&findings, "combined_rms_rad_s").value < 0.02);
}

/// An encoder whose disc is off its axis by 4 mrad: φ = θ + e sin(θ + 0.7), counted from the index. The whole staircase turns in both
/// senses.
#[test]
fn an_eccentric_encoder_is_corrected() {
    let (eccentricity_rad, phase_rad) = (4e-3, 0.7_f64);
    let effects = format!(
        "[effects.coulomb]\ncoulomb_N_m = 9e-4\n[effects.viscous]\nviscous_N_m_s = 2e-5\n[effects.inductance]\ninductance_H = 2.38e-4\n\
         [effects.encoder-eccentricity]\neccentricity_rad = {eccentricity_rad}\neccentricity_order = 1.0\neccentricity_phase_rad = {phase_rad}\n"
    );
    let imu = format!(
        "[imu]\naccel_scale = 1.02\naccel_bias_m_s2 = 0.15\naccel_bias_instability_m_s2 = 0.0\nchi_rad = {}\n",
        1.2_f64.to_radians()
    );
    let wanted = [
        ("encoder_cosine_rad", eccentricity_rad * phase_rad.sin(), 1e-3),
        ("encoder_sine_rad", eccentricity_rad * phase_rad.cos(), 1e-3),
        ("scale", 1.02, 2.5e-3),
        ("angle_deg", 1.2, 0.1),
        ("bias_x_m_s2", 0.15, 0.02),
        ("bias_y_m_s2", 0.15, 0.02),
    ];
    let mut covered = [0; 6];
    for seed in 1..5 {
        let steps = turning("near", "radius_m = 0.05, tilt_deg = 1.0").replace("seconds = 14.0", "seconds = 25.5");
        let session = format!("what = 'accel'\n[known]\nradius_error_m = 1e-4\n{steps}");
        let findings = calibrated(&format!("{effects}{imu}"), &session, seed).findings;
        for (covered, (name, truth, max_U)) in covered.iter_mut().zip(wanted) {
            let quantity = found(&findings, name);
            assert!(quantity.expanded_u() <= max_U, "{name}: {quantity:?}");
            *covered += u32::from(quantity.covers(truth));
        }
    }
    // Two misses of four at 95 % have a probability of 1.4 %.
    assert!(covered.iter().all(|count| *count >= 3), "{covered:?}");
}
