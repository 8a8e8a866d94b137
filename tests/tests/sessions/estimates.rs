//! The firmware's running estimates of drive and sensor, compared with a fit of the same rows and with the truth.
#![allow(clippy::unwrap_used)]

use hal_sim::peripherals::imu::ImuSetup;
use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{self, SessionRequest};
use identification::identify::fit::{self, FitResult};
use identification::log::{Column, Log};
use identification::model::Model;
use identification::recording;
use stand_firmware::measurement_loop::{Estimate, Instruments};
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;
use stand_tests::own;

const SECONDS: f64 = 40.0;

/// A session, its log, and the instruments' final values.
fn measured(stand: &Stand, mode: Mode, kind: ProfileKind, seed: u64) -> (Log, Instruments) {
    let request = SessionRequest::new(mode, kind, SECONDS, seed);
    let instruments = Instruments::new(stand.hardware);
    session::run_rows(stand.setup(), Plant::new(stand, 0.0).unwrap(), request, |row, _| instruments.add(row)).unwrap();
    (own::log(stand, mode, kind, SECONDS, seed), instruments)
}

/// Fit of all rows.
fn fitted(log: &Log, model: &Model) -> FitResult {
    let (record, _) = recording::prepare(log, model, false).unwrap();
    let (system, parameters) = fit::build::system(model, record.temp_C.is_some());
    fit::fit(&system, &parameters, &record).unwrap()
}

/// Distance of two estimates of the same rows, in combined σ.
fn apart(running: Estimate, held: &FitResult, name: &str) -> f64 {
    let k = held.parameters.list.iter().position(|p| p.name == name).unwrap();
    (running.value - held.parameters.list[k].value) / running.sigma.hypot(held.sigmas[k])
}

#[test]
fn drive_estimates_agree_with_the_fit_and_the_truth() {
    let stand = Stand::default();
    let cases = [
        (Mode::Voltage, ProfileKind::MultiStep),
        (Mode::Voltage, ProfileKind::Multisine),
        (Mode::Rate, ProfileKind::MultiStep),
        (Mode::Rate, ProfileKind::Chirp),
        (Mode::Rate, ProfileKind::Staircase),
    ];
    println!("running value, its σ in %; in σ: from the fit of all rows afterwards, from the truth");
    let (mut squares, mut count) = (0.0, 0.0);
    for (mode, kind) in cases {
        for seed in [1, 2] {
            let (log, instruments) = measured(&stand, mode, kind, seed);
            let drive = instruments.drive().unwrap();
            let held = fitted(&log, &own::model(&[1.0; 6]));
            println!("{mode:?} {kind} seed {seed}: {} windows", drive.windows);
            for (name, running, truth) in [
                ("resistance_ohm", drive.resistance_ohm, 2.32),
                ("motor_constant_N_m_A", drive.motor_constant_N_m_A, 2.34e-2),
                ("inertia_kg_m2", drive.inertia_kg_m2, 2.5e-4),
                ("viscous_N_m_s", drive.viscous_N_m_s, 2e-5),
                ("coulomb_N_m", drive.coulomb_N_m, 9e-4),
            ] {
                let (from_fit, from_truth) = (apart(running, &held, name), (running.value - truth) / running.sigma);
                println!(
                    "  {name:<22}{:>12.5e} {:>6.2} % {from_fit:>6.2} {from_truth:>6.2}",
                    running.value,
                    100.0 * running.sigma / running.value
                );
                // 50 draws of each: one in two thousand is beyond 3.5.
                assert!(from_fit.abs() < 3.5 && from_truth.abs() < 3.5, "{mode:?} {kind} seed {seed}: {name} {from_fit} {from_truth}");
                squares += from_truth * from_truth;
                count += 1.0;
            }
        }
    }
    // The stated uncertainties are neither too small nor too large.
    let rms = f64::sqrt(squares / count);
    println!("rms from the truth: {rms:.2} σ over {count}");
    assert!((0.4..1.6).contains(&rms), "{rms}");
}

#[test]
fn sensor_estimates_agree_with_the_fit_and_the_truth() {
    let (scale, bias) = (1.012, 0.021);
    let sensor = ImuSetup { gyro_scale: scale, gyro_bias_rad_s: bias, ..ImuSetup::default() };
    let stand = Stand { imu: Some(sensor), ..Stand::default() };
    let mut model = own::model(&[1.0; 6]);
    for effect in ["rate-scale", "rate-bias", "time-skew"] {
        model.add(effect).unwrap();
    }
    for (mode, kind) in
        [(Mode::Voltage, ProfileKind::MultiStep), (Mode::Rate, ProfileKind::Multisine), (Mode::Rate, ProfileKind::Staircase)]
    {
        for seed in [1, 2] {
            let (log, instruments) = measured(&stand, mode, kind, seed);
            let reading = instruments.sensor().unwrap();
            // The gyro replaces the rate sensor.
            let columns = log.columns().iter().filter(|c| c.name != "omega_rad_s").map(|c| Column {
                name: if c.name == "gyro_rad_s" { "omega_rad_s".to_owned() } else { c.name.clone() },
                values: c.values.clone(),
            });
            let notes = [("omega_rad_s", "gyro, filter 304.2 Hz"), ("theta_zero", "index")].map(|(k, v)| (k.to_owned(), v.to_owned()));
            let log = Log::new("gyro.parquet", columns.collect(), notes.to_vec()).unwrap();
            let held = fitted(&log, &model);
            println!("{mode:?} {kind} seed {seed}: delay {:.0} ± {:.0} µs", reading.delay_s.value * 1e6, reading.delay_s.sigma * 1e6);
            let name = |id: &str| held.parameters.list.iter().find(|p| p.name.starts_with(id)).unwrap().name.clone();
            let relative = Estimate { value: reading.scale.value - 1.0, ..reading.scale };
            for (name, running, truth) in [(name("rate_scale"), relative, scale - 1.0), (name("rate_bias"), reading.bias_rad_s, bias)] {
                let (from_fit, from_truth) = (apart(running, &held, &name), (running.value - truth) / running.sigma);
                println!("  {name:<18}{:>10.6} ± {:.6} {from_fit:>6.2} {from_truth:>6.2}", running.value, running.sigma);
                assert!(from_fit.abs() < 3.5 && from_truth.abs() < 3.5, "{mode:?} {kind} seed {seed}: {name} {from_fit} {from_truth}");
            }
            // The filter's 523 µs, plus a sample age of 0.14 to 0.8 ms.
            assert!((0.6e-3..1.4e-3).contains(&reading.delay_s.value), "{reading:?}");
        }
    }
}
