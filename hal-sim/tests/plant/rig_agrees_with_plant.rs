//! Comparison of both integrators, rig and plant: every effect, open-loop voltage, 1 ms rows, 10 s.
//!
//! Their difference must not be visible in a log: below a tenth of the noise of the default stand in each channel, rms.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{ROW_S, TICK_S, span, stem};
use drive_model::{Card, ParameterKind};
use drive_rig::{DriveState, Input, Rig, RowInput};
use hal_sim::board::PlantPort;
use hal_sim::plant::{Plant, Stand};
use stand_firmware::profile::{Profile, ProfileConfig, ProfileKind};
use std::f64::consts::TAU;

const ROWS: usize = 10_000;
/// BMG160: 0.4 °/s in each sample.
const RATE_NOISE: f64 = 7e-3;
/// 20 conversions of 12 mA, and the reference.
const CURRENT_NOISE: f64 = 4e-3;
/// An increment of a counted angle: twice LSB²/12.
const ANGLE_NOISE: f64 = TAU / 20_000.0 / 2.449_489_742_783_178;
/// Rows of an increment: 20 ms.
const LAG: usize = 20;

/// Usual amplitude on the default stand, V.
const AMPLITUDE_V: f64 = 0.7;

/// The middle of the range of `--hidden`; an integer for a harmonic order, a time within the ten seconds (and within a row).
fn middle(card: &Card) -> Vec<f64> {
    let value = |p: &drive_model::Parameter| {
        let middle = 0.5 * (p.simulated_range.0 + p.simulated_range.1);
        match p.kind {
            ParameterKind::HarmonicOrder => middle.ceil(),
            ParameterKind::EventTime => 5.0003,
            _ => middle,
        }
    };
    card.parameters.iter().map(value).collect()
}

/// The default stand with one more effect, or with another value.
fn stand(name: &str, parameters: &[f64]) -> Stand {
    let mut stand = Stand::default();
    let card = drive_model::card(stem(name)).unwrap();
    let values = card.parameters.iter().zip(parameters).map(|(p, v)| (p.name.to_owned(), *v)).collect();
    stand.effects.insert(name.to_owned(), values);
    // At the reference temperature the temperature laws have no effect.
    stand.drive.ambient_C = 45.0;
    stand
}

fn rig(stand: &Stand) -> Rig<f64> {
    let drive = common::Drive {
        inertia: stand.drive.inertia_kg_m2,
        motor_constant: stand.drive.motor_constant_N_m_A,
        resistance: stand.drive.resistance_ohm,
    };
    let list: Vec<_> = stand.effect_parameters().unwrap().into_iter().map(|(id, p)| (id.to_owned(), p)).collect();
    common::rig(drive, Input::Voltage, &list)
}

/// Measured inputs of the model besides the voltage.
#[derive(Clone, Copy, PartialEq)]
enum Known {
    /// Angle and temperature, as in the logs of the stand.
    All,
    /// None: angle and temperature are simulated.
    Voltage,
}

/// rms differences of rate, angle increments and mean current, over their noise.
fn differences(stand: &Stand, kind: ProfileKind, known: Known, seed: u64) -> [f64; 3] {
    let mut plant = Plant::new(stand, 0.3).unwrap();
    let rig = rig(stand);
    let mut state = DriveState { heat_K: plant.temp_C() - drive_model::T0_C, ..DriveState::turning(0.0, 0.3) };
    let mut profile = Profile::new(&ProfileConfig::new(kind, AMPLITUDE_V, seed)).unwrap();
    // Lag and skew are filters of the finished series in the fitted model: the rate itself is compared.
    let filtered = rig.structure().lag_s.is_some() || rig.structure().skew_s.is_some();
    let (mut rate, mut current) = (0.0, 0.0);
    let mut angles = Vec::with_capacity(ROWS);
    for n in 0..ROWS {
        let volt = profile.next_value();
        let temp_C = plant.temp_C();
        let seen_rate = if filtered { plant.true_rate_rad_s() } else { plant.rate_rad_s() };
        let seen_theta = plant.theta_rad();
        let mut mean = 0.0;
        for _ in 0..10 {
            plant.advance(volt, TICK_S);
            mean += plant.mean_current_A() / 10.0;
        }
        let theta = (known == Known::All).then(|| (seen_theta, plant.theta_rad()));
        let temp_C = (known == Known::All).then_some(temp_C);
        let span = RowInput { theta, ..span(n as f64 * ROW_S, ROW_S, volt, temp_C) };
        let before = (state.omega, state.theta, state.heat_K);
        let i = rig.advance(&mut state, &span);
        let reading = rig.read(before, &span, i);
        let at = if n == 0 { 0.0 } else { (reading.omega - seen_rate) / RATE_NOISE };
        rate += at * at;
        angles.push(reading.theta - seen_theta);
        current += ((reading.current - mean) / CURRENT_NOISE).powi(2);
    }
    let angle: f64 = (LAG..ROWS).map(|n| ((angles[n] - angles[n - LAG]) / ANGLE_NOISE).powi(2)).sum();
    [(rate / ROWS as f64).sqrt(), (angle / (ROWS - LAG) as f64).sqrt(), (current / ROWS as f64).sqrt()]
}

#[test]
fn rig_and_plant_agree_to_a_tenth_of_the_noise_for_each_effect() {
    let kinds = [ProfileKind::MultiStep, ProfileKind::Multisine, ProfileKind::Prbs];
    println!("rms difference over noise: rate, angle increments, current");
    println!("{:26} {:>20} {:>20} {:>20}", "effect", "multi-step", "multisine", "prbs");
    let mut wrong = Vec::new();
    for card in drive_model::cards() {
        let stand = stand(card.id, &middle(card));
        let mut line = format!("{:26}", card.id);
        for kind in kinds {
            // The worst of three seeds: a voltage step may or may not coincide with a passage through rest.
            let each = [1, 2, 4].map(|seed| differences(&stand, kind, Known::All, seed));
            let d: [f64; 3] =
                std::array::from_fn(|c| each.iter().map(|d| if d[c].is_nan() { f64::INFINITY } else { d[c] }).fold(0.0, f64::max));
            line += &format!("  {:5.3} {:5.3} {:5.3} ", d[0], d[1], d[2]);
            if d.iter().any(|d| *d > 0.1) {
                wrong.push(format!("{} {kind}: {d:?}", card.id));
            }
        }
        println!("{line}");
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_rig_with_simulated_angle_and_temperature_agrees() {
    for id in ["torque-ripple", "cable-spring", "rate-g-sensitivity"] {
        let stand = stand(id, &middle(drive_model::card(id).unwrap()));
        let d = differences(&stand, ProfileKind::MultiStep, Known::Voltage, 1);
        println!("{id} {d:?}");
        assert!(d.iter().all(|d| *d < 0.1), "{id} {d:?}");
    }
    // The ambient temperature of the model is 25 °C.
    let mut stand = stand("resistance-temperature", &[0.0039, 15.0, 12.0]);
    stand.drive.ambient_C = 25.0;
    let d = differences(&stand, ProfileKind::MultiStep, Known::Voltage, 1);
    assert!(d.iter().all(|d| *d < 0.1), "heat {d:?}");
}

/// A current that is sampled along a ramp of the rate, with rows longer than L/R, is that of short steps.
#[test]
fn current_at_a_row_is_independent_of_the_step() {
    let rig = rig(&Stand::default());
    assert!(rig.structure().inductance_H.is_some());
    let sampled = |steps_per_row: usize| {
        let mut state = DriveState::turning(0.0, 0.3);
        let step_s = ROW_S / steps_per_row as f64;
        let mut currents = Vec::new();
        for n in 0..400 * steps_per_row {
            let row = span(n as f64 * step_s, step_s, if n < 200 * steps_per_row { 3.0 } else { -2.0 }, None);
            if n % steps_per_row == 0 {
                currents.push(rig.current_now(&state, &row));
            }
            rig.advance(&mut state, &row);
        }
        currents
    };
    let (coarse, fine) = (sampled(1), sampled(50));
    // Not in the first row after a step of the voltage.
    for n in (3..200).chain(203..400) {
        assert!((coarse[n] - fine[n]).abs() < 2e-4 * fine[n].abs().max(0.05), "row {n}: {} A, {} A", coarse[n], fine[n]);
    }
}
