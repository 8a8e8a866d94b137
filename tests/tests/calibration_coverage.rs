//! A sample of the benchmark `calibration`: parts and drives drawn by number, calibrated, beside what is true of them. The table over a thousand is in
//! docs/calibration.md.

use host_tools::calibrate::session::What;
use stand_tests::drawn_parts::calibrated;

/// Of so few intervals of 95 % some may miss; none may miss by five of its u, and most must hold.
fn sample(what: What, seeds: std::ops::Range<u64>, wanted: &[&str]) {
    let (mut inside, mut all) = (0, 0);
    for seed in seeds {
        let folder = std::env::temp_dir().join(format!("calibration-sample-{}-{}-{seed}", std::process::id(), what.name()));
        let found = calibrated(what, seed, &folder);
        let _ = std::fs::remove_dir_all(&folder);
        for name in wanted {
            let c = found.iter().find(|c| c.name == *name).unwrap_or_else(|| panic!("{} {seed}: {name} was not found", what.name()));
            let off = (c.found.value - c.truth) / c.found.sigma();
            assert!(off.abs() < 5.0, "{} {seed}: {name} {} ± {}, and {} is true", what.name(), c.found.value, c.found.sigma(), c.truth);
            inside += u32::from(c.found.holds(c.truth));
            all += 1;
        }
    }
    // 95 % of them; fewer than 80 % of some twenty come by chance once in a thousand.
    assert!(f64::from(inside) >= 0.8 * f64::from(all), "{inside} of {all} intervals hold");
}

#[test]
fn gyros() {
    sample(What::Gyro, 2001..2004, &["scale", "bias_rad_s", "nonlinearity_percent_fs", "bandwidth_Hz", "delay_s", "damping"]);
}

#[test]
fn accelerometers() {
    sample(What::Accel, 2001..2004, &["scale", "angle_deg", "bias_x_m_s2"]);
}

#[test]
fn drives() {
    sample(What::Drive, 2001..2004, &["inertia_kg_m2", "motor_constant_N_m_A", "resistance_ohm", "viscous_N_m_s", "coulomb_N_m"]);
}
