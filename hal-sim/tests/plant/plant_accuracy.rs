//! Accuracy of the plant: reruns are equal to the last bit, a finer tick changes nothing that a sensor could see, and the times at which
//! the rotor stops or breaks away are located within the tick.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{Bench, Draw, Drive, Kind, ROW_S, Setup, TICK_S, close, stand_of};
use hal_sim::board::PlantPort;
use hal_sim::plant::Plant;

const DRIVE: Drive = Drive { inertia: 2.5e-4, motor_constant: 0.0234, resistance: 2.32 };

/// Friction and winding of the default stand, and one effect at the middle of its simulated range.
fn default_effects_and(id: &str) -> Vec<(String, Vec<f64>)> {
    let mut effects: Vec<(String, Vec<f64>)> =
        vec![("coulomb".to_owned(), vec![9e-4]), ("viscous".to_owned(), vec![2e-5]), ("inductance".to_owned(), vec![2.38e-4])];
    effects.retain(|effect| effect.0 != id);
    let middle = |p: &drive_model::Parameter| {
        let middle = 0.5 * (p.simulated_range.0 + p.simulated_range.1);
        match p.kind {
            drive_model::ParameterKind::HarmonicOrder => middle.ceil(),
            // Within the recorded second, and between two ticks.
            drive_model::ParameterKind::EventTime => 0.30037,
            _ => middle,
        }
    };
    effects.push((id.to_owned(), drive_model::card(id).unwrap().parameters.iter().map(middle).collect()));
    effects
}

/// One second in rows of 1 ms, under a voltage that is drawn anew each 10 ms: true rate (rad/s), true angle (rad), mean current of the row
/// (A), temperature (°C), sensed rate (rad/s).
fn record(effects: &[(String, Vec<f64>)], ticks_per_row: usize) -> Vec<[f64; 5]> {
    let mut plant = Plant::new(&stand_of(DRIVE, effects), 0.3).unwrap();
    let mut draw = Draw(31);
    let mut rows = Vec::new();
    let mut voltage_V = 0.0;
    for n in 0..1000 {
        if n % 10 == 0 {
            voltage_V = draw.signed_log(0.05, 1.5);
        }
        let mut mean_current_A = 0.0;
        for _ in 0..ticks_per_row {
            plant.advance(voltage_V, ROW_S / ticks_per_row as f64);
            mean_current_A += plant.mean_current_A() / ticks_per_row as f64;
        }
        rows.push([plant.true_rate_rad_s(), plant.true_theta_rad(), mean_current_A, plant.temp_C(), plant.rate_rad_s()]);
    }
    rows
}

#[test]
fn a_rerun_is_the_same_to_the_last_bit() {
    for card in drive_model::cards() {
        let effects = default_effects_and(card.id);
        let bits = |rows: Vec<[f64; 5]>| rows.concat().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(record(&effects, 10)), bits(record(&effects, 10)), "{}", card.id);
    }
}

#[test]
fn a_finer_tick_changes_nothing_that_a_sensor_could_see() {
    // A tenth of the noise of one sample: rate (rad/s), angle (rad; a tenth of an encoder count), mean current of a row (A).
    let limits = [("rate", 7e-4), ("angle", 3e-5), ("current", 4e-4)];
    // Where the winding is fast, both are integrated in shorter steps: 50 and 25 µs.
    println!("difference between ticks of 100 and 25 µs: rate (rad/s), angle (rad), mean current of a row (A)");
    for card in drive_model::cards() {
        let effects = default_effects_and(card.id);
        let (coarse, fine) = (record(&effects, 10), record(&effects, 40));
        // Backlash is chaotic: each impact multiplies the difference of neighbouring motions. There the rms is compared, elsewhere the
        // maximum.
        let is_chaotic = card.id == "backlash";
        let difference = |column: usize| {
            let differences = coarse.iter().zip(&fine).map(|(a, b)| (a[column] - b[column]).abs());
            if is_chaotic {
                (differences.map(|d| d * d).sum::<f64>() / coarse.len() as f64).sqrt()
            } else {
                differences.fold(0.0, f64::max)
            }
        };
        let differences = [difference(0), difference(1), difference(2)];
        println!("{:26} {:.1e} {:.1e} {:.1e}", card.id, differences[0], differences[1], differences[2]);
        for ((name, limit), difference) in limits.iter().zip(differences) {
            assert!(difference < *limit, "{} {name} {difference:e}", card.id);
        }
    }
}

#[test]
fn a_stop_within_a_tick_is_located_to_a_nanosecond() {
    // A torque of −1.5 c stops the rotor, then turns it back with the net torque −c/2: the rate at the end of the tick depends on the time
    // of the stop. Inertia J, kg m²; Coulomb torque c, N m; viscous coefficient b, N m s.
    let (j, c, b): (f64, f64, f64) = (1e-4, 1e-2, 1e-4);
    for part in [0.03, 0.31, 0.5, 0.77, 0.99] {
        let stop_s: f64 = part * TICK_S;
        // ω = (ω0 + s) e^(−bt/J) − s with s = 2.5 c/b, in rad/s.
        let s = 2.5 * c / b;
        let start_rad_s = s * (b / j * stop_s).exp_m1();
        let mut bench = Bench::new(Kind::Plant, &Setup::by_torque(j, &[("viscous", &[b]), ("coulomb", &[c])])).spin(start_rad_s);
        bench.hold(-1.5 * c, TICK_S);
        let after_s = TICK_S - stop_s;
        let exact = 0.5 * c / b * (-b / j * after_s).exp_m1();
        // The acceleration after the stop, c/(2 J) = 50 rad/s², times a nanosecond.
        close(bench.omega(), exact, 5e-8, &format!("stop at {part} of a tick"));
    }
}

#[test]
fn breaking_away_within_a_tick_is_located() {
    // The current rises exponentially towards twice the value that overcomes the Coulomb torque c, N m, and reaches that value at τ ln 2.
    // Inductance l, H; motor constant k, N m/A; resistance r, Ω; inertia J, kg m², so large that the back-EMF is negligible.
    let (l, c) = (0.1, 1e-2);
    let (k, r, j) = (0.02, 2.0, 1e3);
    let voltage_V = 2.0 * c / k * r;
    let mut bench = Bench::new(
        Kind::Plant,
        &Setup::by_voltage(Drive { inertia: j, motor_constant: k, resistance: r }, &[("coulomb", &[c]), ("inductance", &[l])]),
    );
    let tau: f64 = l / r;
    let breakaway_s = tau * 2.0_f64.ln();
    let end_s = 0.05;
    bench.hold(voltage_V, end_s);
    // ∫ (2c (1 − e^(−t/τ)) − c) dt from there.
    let exact = (c * (end_s - breakaway_s) - 2.0 * c * tau * ((-breakaway_s / tau).exp() - (-end_s / tau).exp())) / j;
    close(bench.omega(), exact, 1e-9 * exact.abs(), "rate after breaking away");
}

#[test]
fn a_stiff_bristle_is_finite_and_slides_at_the_coulomb_torque() {
    // The whole range of the card. At 1e4 N m/rad the time constant of the bristle is 2 ns at 40 rad/s.
    for stiffness_N_m_rad in [1e-3, 1.0, 1e2, 1e4] {
        let effects: &[(&str, &[f64])] = &[("coulomb", &[9e-4]), ("presliding", &[stiffness_N_m_rad])];
        let mut bench = Bench::new(Kind::Plant, &Setup::by_torque(2.5e-4, effects)).spin(40.0);
        bench.hold(0.0, 0.02);
        let omega = bench.omega();
        assert!(omega.is_finite(), "{stiffness_N_m_rad} N m/rad");
        if stiffness_N_m_rad >= 1.0 {
            // The deceleration is c/J = 3.6 rad/s², except over the first angle c/σ, in which the torque of the bristle builds up.
            close(omega, 40.0 - 3.6 * 0.02, 1e-3, &format!("{stiffness_N_m_rad} N m/rad"));
        }
    }
}
