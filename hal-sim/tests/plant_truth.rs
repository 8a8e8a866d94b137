//! The plant is a truth: the same each time, the same at half the tick, its stops where they are.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Bench, Draw, Drive, Kind, ROW_S, Setup, close, stand_of};
use hal_sim::board::PlantPort;
use hal_sim::plant::Plant;

const DRIVE: Drive = Drive { inertia: 2.5e-4, motor_constant: 0.0234, resistance: 2.32 };

/// The default stand's friction and winding, and one effect at the middle of its hidden range.
fn with(id: &str) -> Vec<(String, Vec<f64>)> {
    let mut list: Vec<(String, Vec<f64>)> =
        vec![("coulomb".to_owned(), vec![9e-4]), ("viscous".to_owned(), vec![2e-5]), ("inductance".to_owned(), vec![2.38e-4])];
    list.retain(|e| e.0 != id);
    let middle = |p: &drive_model::Parameter| {
        let m = 0.5 * (p.simulated_range.0 + p.simulated_range.1);
        match p.kind {
            drive_model::ParameterKind::HarmonicOrder => m.ceil(),
            drive_model::ParameterKind::EventTime => 0.30037,
            _ => m,
        }
    };
    list.push((id.to_owned(), drive_model::card(id).unwrap().parameters.iter().map(middle).collect()));
    list
}

/// Rate, angle, current, temperature and sensed rate of a second of drawn levels, 10 ms each.
fn record(list: &[(String, Vec<f64>)], ticks_per_row: usize) -> Vec<[f64; 5]> {
    let mut plant = Plant::new(&stand_of(DRIVE, list), 0.3).unwrap();
    let mut draw = Draw(31);
    let mut rows = Vec::new();
    let mut volt = 0.0;
    for n in 0..1000 {
        if n % 10 == 0 {
            volt = draw.signed_log(0.05, 1.5);
        }
        let mut mean = 0.0;
        for _ in 0..ticks_per_row {
            plant.advance(volt, ROW_S / ticks_per_row as f64);
            mean += plant.mean_current_A() / ticks_per_row as f64;
        }
        rows.push([plant.true_rate_rad_s(), plant.true_theta_rad(), mean, plant.temp_C(), plant.rate_rad_s()]);
    }
    rows
}

#[test]
fn a_rerun_is_the_same_to_the_last_bit() {
    for card in drive_model::cards() {
        let list = with(card.id);
        let bits = |rows: Vec<[f64; 5]>| rows.concat().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(record(&list, 10)), bits(record(&list, 10)), "{}", card.id);
    }
}

#[test]
fn a_finer_tick_changes_nothing_that_a_sensor_could_see() {
    println!(
        "greatest difference of rate (rad/s), angle (rad), row-mean current (A) between ticks of 100 and 25 µs (steps of 50 and 25 µs where the winding asks for them)"
    );
    for card in drive_model::cards() {
        let list = with(card.id);
        let (coarse, fine) = (record(&list, 10), record(&list, 40));
        // Impacts in a play amplify the last digits of their instants (neighbouring motions part by a factor at each): rms there.
        let chaotic = card.id == "backlash";
        let greatest = |c: usize| {
            let off = coarse.iter().zip(&fine).map(|(a, b)| (a[c] - b[c]).abs());
            if chaotic { (off.map(|d| d * d).sum::<f64>() / coarse.len() as f64).sqrt() } else { off.fold(0.0, f64::max) }
        };
        let d = [greatest(0), greatest(1), greatest(2)];
        println!("{:26} {:.1e} {:.1e} {:.1e}", card.id, d[0], d[1], d[2]);
        // A tenth of the noise of one sample at its greatest, not in the mean: 7e-4 rad/s, 0.1 LSB of the encoder, 0.4 mA in a row.
        assert!(d[0] < 7e-4, "{} rate {:e}", card.id, d[0]);
        assert!(d[1] < 3e-5, "{} angle {:e}", card.id, d[1]);
        assert!(d[2] < 4e-4, "{} current {:e}", card.id, d[2]);
    }
}

#[test]
fn a_stop_within_a_tick_is_located_to_a_microsecond() {
    // Against 1.5 c it stops, turns, and goes on with c/2: the rate at the tick's end tells when it stopped.
    let (j, c, b): (f64, f64, f64) = (1e-4, 1e-2, 1e-4);
    for part in [0.03, 0.31, 0.5, 0.77, 0.99] {
        let stop_s: f64 = part * 1e-4;
        // ω = (ω0 + s) e^(−bt/J) − s with s = 2.5 c/b.
        let s = 2.5 * c / b;
        let omega = s * (b / j * stop_s).exp_m1();
        let mut bench = Bench::new(Kind::Plant, &Setup::by_torque(j, &[("viscous", &[b]), ("coulomb", &[c])])).spin(omega);
        bench.hold(-1.5 * c, 1e-4);
        let after_s = 1e-4 - stop_s;
        let exact = 0.5 * c / b * (-b / j * after_s).exp_m1();
        // 50 rad/s² times a nanosecond.
        close(bench.omega(), exact, 5e-8, &format!("stop at {part} of a tick"));
    }
}

#[test]
fn breaking_away_within_a_tick_is_located() {
    // A current that rises towards twice what the dry level needs passes it at τ ln 2.
    let (l, c) = (0.1, 1e-2);
    let (k, r, j) = (0.02, 2.0, 1e3);
    let u = 2.0 * c / k * r;
    let mut bench = Bench::new(
        Kind::Plant,
        &Setup::by_voltage(Drive { inertia: j, motor_constant: k, resistance: r }, &[("coulomb", &[c]), ("inductance", &[l])]),
    );
    let tau: f64 = l / r;
    let free_s = tau * 2.0_f64.ln();
    bench.hold(u, 0.05);
    // ∫ (2c (1 − e^(−t/τ)) − c) dt from there.
    let exact = (c * (0.05 - free_s) - 2.0 * c * tau * ((-free_s / tau).exp() - (-0.05 / tau).exp())) / j;
    close(bench.omega(), exact, 1e-9 * exact.abs(), "rate after breaking away");
}

#[test]
fn a_stiff_bristle_is_still_finite_and_slides_at_the_dry_level() {
    // The whole range of the card: at 1e4 N m/rad the bristle's constant is 2 ns at 40 rad/s.
    for sigma in [1e-3, 1.0, 1e2, 1e4] {
        let list: &[(&str, &[f64])] = &[("coulomb", &[9e-4]), ("presliding", &[sigma])];
        let mut bench = Bench::new(Kind::Plant, &Setup::by_torque(2.5e-4, list)).spin(40.0);
        bench.hold(0.0, 0.02);
        let omega = bench.omega();
        assert!(omega.is_finite(), "{sigma}");
        if sigma >= 1.0 {
            // c/J t but for the angle c/σ at the beginning.
            close(omega, 40.0 - 3.6 * 0.02, 1e-3, &format!("{sigma}"));
        }
    }
}
