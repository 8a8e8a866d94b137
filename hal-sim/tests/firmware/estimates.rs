//! Online estimates of drive and sensor by the measurement loop, compared with the true values.
#![allow(clippy::unwrap_used)]

use hal_sim::peripherals::imu::ImuSetup;
use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{SessionRequest, run_rows};
use stand_firmware::measurement_loop::{Estimate, Instruments};
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;

const CASES: [(Mode, ProfileKind); 5] = [
    (Mode::Voltage, ProfileKind::MultiStep),
    (Mode::Voltage, ProfileKind::Multisine),
    (Mode::Rate, ProfileKind::MultiStep),
    (Mode::Rate, ProfileKind::Chirp),
    (Mode::Rate, ProfileKind::Staircase),
];
const SEEDS: std::ops::RangeInclusive<u64> = 1..=4;

fn measured(stand: &Stand, mode: Mode, kind: ProfileKind, seed: u64) -> Instruments {
    let request = SessionRequest::new(mode, kind, 40.0, seed);
    let instruments = Instruments::new(stand.hardware);
    run_rows(stand.setup(), Plant::new(stand, 0.0).unwrap(), request, |row, _| instruments.add(row)).unwrap();
    instruments
}

/// Prints the deviations from the true values in σ, checks the largest, and appends them to `rms`.
fn judge(title: &str, what: &[(&str, Estimate, f64)], rms: &mut Vec<f64>) {
    println!("{title}");
    for (name, estimate, truth) in what {
        let off = (estimate.value - truth) / estimate.sigma;
        println!("  {name:<10}{:>13.5e} ± {:>7.3} % {off:>6.2} σ", estimate.value, 100.0 * estimate.sigma / truth.abs());
        assert!(off.abs() < 4.0, "{title}: {name} {off} σ");
        rms.push(off);
    }
}

fn rms(deviations: &[f64]) -> f64 {
    (deviations.iter().map(|d| d * d).sum::<f64>() / deviations.len() as f64).sqrt()
}

#[test]
fn the_drives_constants_are_within_their_errors_of_the_truth() {
    let mut deviations = Vec::new();
    for (mode, kind) in CASES {
        for seed in SEEDS {
            let drive = measured(&Stand::default(), mode, kind, seed).drive().unwrap();
            let what = [
                ("R", drive.resistance_ohm, 2.32),
                ("K", drive.motor_constant_N_m_A, 2.34e-2),
                ("J", drive.inertia_kg_m2, 2.5e-4),
                ("b", drive.viscous_N_m_s, 2e-5),
                ("c", drive.coulomb_N_m, 9e-4),
            ];
            judge(&format!("{mode:?} {kind} seed {seed}, {} windows", drive.windows), &what, &mut deviations);
        }
    }
    println!("rms {:.2} σ over {}", rms(&deviations), deviations.len());
    // The stated standard deviations are neither too small nor too large.
    assert!((0.5..1.5).contains(&rms(&deviations)), "{}", rms(&deviations));
}

#[test]
fn the_sensors_scale_and_bias_are_within_their_errors_of_the_truth() {
    let (scale, bias) = (1.012, 0.021);
    let sensor = ImuSetup { gyro_scale: scale, gyro_bias_rad_s: bias, ..ImuSetup::default() };
    let stand = Stand { imu: Some(sensor), ..Stand::default() };
    let mut deviations = Vec::new();
    for (mode, kind) in CASES {
        for seed in SEEDS {
            let reading = measured(&stand, mode, kind, seed).sensor().unwrap();
            let what = [("scale", reading.scale, scale), ("bias", reading.bias_rad_s, bias)];
            judge(&format!("{mode:?} {kind} seed {seed}, delay {:.0} µs", 1e6 * reading.delay_s.value), &what, &mut deviations);
            // The filter's 523 µs, and a sample that is 0.14 to 0.8 ms old at its row.
            assert!((0.7e-3..1.4e-3).contains(&reading.delay_s.value), "{reading:?}");
        }
    }
    println!("rms {:.2} σ over {}", rms(&deviations), deviations.len());
    assert!((0.5..1.5).contains(&rms(&deviations)), "{}", rms(&deviations));
}
