//! Random devices, calibrated and compared with their true values: other seeds than those of `campaign coverage` (docs/figures.md).

use stand_analysis::calibrate::DutKind;
use stand_tests::campaign::coverage::calibrate::calibrated;

/// Few 95 % intervals: none may miss the truth by more than 5 u, and most must cover it.
fn sample(what: DutKind, seeds: std::ops::Range<u64>, wanted: &[&str]) {
    let (mut inside, mut all) = (0, 0);
    for seed in seeds {
        let folder = std::env::temp_dir().join(format!("calibration-sample-{}-{}-{seed}", std::process::id(), what.name()));
        let (_, found) = calibrated(what, seed, &folder).unwrap_or_else(|e| panic!("{} {seed}: {e}", what.name()));
        let found = found.unwrap_or_else(|e| panic!("{} {seed}: {e}", what.name()));
        let _ = std::fs::remove_dir_all(&folder);
        for name in wanted {
            let c = found.iter().find(|c| c.name == *name).unwrap_or_else(|| panic!("{} {seed}: {name} was not found", what.name()));
            let off = c.error_u();
            assert!(off.abs() < 5.0, "{} {seed}: {name} {} ± {} (1σ), truth {}", what.name(), c.found.value, c.found.combined_u(), c.truth);
            println!("{} {seed}: {name} off by {off:.2} u, covers {}", what.name(), c.found.covers(c.truth));
            inside += u32::from(c.found.covers(c.truth));
            all += 1;
        }
    }
    // Expected 95 %; fewer than 80 % of twenty have a probability of 0.1 %.
    assert!(f64::from(inside) >= 0.8 * f64::from(all), "{inside} of {all} intervals cover the truth");
}

#[test]
fn gyros() {
    sample(
        DutKind::Gyro,
        2001..2004,
        &[
            "scale",
            "bias_rad_s",
            "nonlinearity_percent_fs",
            "asymmetry_percent",
            "scale_whole_turns",
            "scale_dynamic",
            "bandwidth_Hz",
            "delay_s",
            "damping",
        ],
    );
}

#[test]
fn accelerometers() {
    sample(DutKind::Accel, 2001..2004, &["scale", "angle_deg", "bias_x_m_s2"]);
}

#[test]
fn drives() {
    sample(DutKind::Drive, 2001..2004, &["inertia_kg_m2", "motor_constant_N_m_A", "resistance_ohm", "viscous_N_m_s", "coulomb_N_m"]);
}
