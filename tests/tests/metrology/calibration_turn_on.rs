//! A gyro after it is switched on: warm-up time, and the scatter of its bias from start to start. Harmonic orders of the encoder above 1.

use stand_analysis::calibrate::AbsenceReason;
use stand_tests::calibration::{assert_covers, calibrated, found};

const STAIRCASE: &str = "
[[steps]]
name = 'staircase'
mode = 'rate'
profile = 'staircase'
amplitude = 8.0
levels = 2
dwell_s = 1.5
seconds = 25.5
";

#[test]
fn warm_up_time_is_that_of_the_element() {
    let stand = "[imu]\nself_heating_K = 4.0\nwarm_up_s = 20.0\n[imu.gyro]\nbias_rad_s_per_K = 1e-3\n";
    let session = |band: &str| format!("what = 'gyro'\n{band}[[steps]]\nname = 'rest'\nmode = 'off'\nseconds = 120.0\n{STAIRCASE}");
    // 4e-3 rad/s at power-on, a tenth of it after 20 s ln 10.
    let findings = calibrated(stand, &session("warm_up_band_rad_s = 4e-4\n"), 1).findings;
    assert_covers(&findings, "warm_up_time_s", 20.0 * 10_f64.ln(), 5.0);
    let findings = calibrated(stand, &session(""), 1).findings;
    assert!(findings.absent.iter().any(|a| a.quantity == "warm_up_time_s" && a.reason == AbsenceReason::NeedsWarmUpBand));
}

#[test]
fn restarts_show_the_scatter_of_the_bias_from_start_to_start() {
    let start = |k: u32| format!("[[steps]]\nname = 'start {k}'\nmode = 'off'\nseconds = 8.0\nrestart_sensor = true\n");
    let starts: String = (1..=8).map(start).collect();
    let session = format!("what = 'gyro'\n{STAIRCASE}{starts}");
    for seed in 1..3 {
        let findings = calibrated("[imu]\ngyro_turn_on_rad_s = 2e-3\n", &session, seed).findings;
        // The upper end of χ² with seven degrees of freedom is 2.04 times the value.
        assert_covers(&findings, "turn_on_repeatability_rad_s", 2e-3, 4e-3);
        assert!(found(&findings, "turn_on_repeatability_rad_s").value > 5e-4);
    }
    let findings = calibrated("[imu]\n", &session, 1).findings;
    assert!(found(&findings, "turn_on_repeatability_rad_s").value < 1e-4);
}

#[test]
fn the_second_harmonic_order_of_the_encoder_is_found() {
    let turns = |name: &str, rate: f64| {
        format!("[[steps]]\nname = '{name}'\nmode = 'rate'\nprofile = 'turns'\namplitude = {rate}\nturns = 10\nseconds = 9.5\n")
    };
    let runs = [("a", 8.0), ("b", -8.0), ("c", -8.0), ("d", 8.0)].map(|(name, rate)| turns(name, rate)).concat();
    let session = format!("what = 'gyro'\n{STAIRCASE}{runs}");
    let (amplitude_rad, phase_rad) = (2e-3, 0.6_f64);
    let stand = format!(
        "[effects.coulomb]\ncoulomb_N_m = 9e-4\n[effects.viscous]\nviscous_N_m_s = 2e-5\n[effects.inductance]\ninductance_H = 2.38e-4\n\
         [effects.encoder-eccentricity]\neccentricity_rad = {amplitude_rad}\neccentricity_order = 2.0\neccentricity_phase_rad = {phase_rad}\n\
         [imu]\ngyro_scale = 1.01\n"
    );
    let findings = calibrated(&stand, &session, 1).findings;
    assert_covers(&findings, "encoder_cosine_2_rad", amplitude_rad * phase_rad.sin(), 1e-4);
    assert_covers(&findings, "encoder_sine_2_rad", amplitude_rad * phase_rad.cos(), 1e-4);
    assert_covers(&findings, "scale", 1.01, 1e-3);
    assert!(findings.get("encoder_cosine_3_rad").is_none() && findings.get("encoder_cosine_5_rad").is_none());
    let exact = calibrated("[imu]\ngyro_scale = 1.01\n", &session, 1).findings;
    assert!(exact.get("encoder_cosine_2_rad").is_none());
}
