//! Sessions of the complete firmware on the simulated stand: spin-up, every mode, every profile. Compared: firmware values, sensor
//! readings, true motion.
#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{Record, SessionRequest, run};
use rayon::prelude::*;
use stand_firmware::board::Hardware;
use stand_firmware::profile::{Profile, ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::{Fault, Limits, Mode};
use stand_tests::rate_accuracy::cogging_stand;

/// The stand of docs/rate-accuracy.md, just before its index.
fn session(mode: Mode, profile: ProfileConfig, seconds: f64) -> Record {
    let stand = cogging_stand();
    run(stand.setup(), Plant::new(&stand, -0.05).unwrap(), SessionRequest { mode, profile, seconds, seed: 1 }).unwrap()
}

fn greatest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| most.max(value.abs()))
}

/// Largest distance between two columns.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    greatest(a.iter().zip(b).map(|(a, b)| a - b))
}

#[test]
fn spin_up_to_1950_deg_s_agrees_in_command_sensor_and_truth() {
    // The drive goes to 2000 °/s, where the rate sensor clips.
    let rate = 1950_f64.to_radians();
    let record = session(Mode::Rate, ProfileConfig::new(ProfileKind::Constant, rate, 1), 3.0);
    assert_eq!(record.fault, Fault::None);
    let never = Limits(Limits::SLIPPED.0 | Limits::STARVED.0 | Limits::CURRENT.0 | Limits::VOLTAGE.0);
    assert!(record.limits.iter().all(|limits| limits.0 & never.0 == 0), "only the acceleration limit is in force");
    let column = |name| record.column(name).unwrap();
    let (commanded, measured, is) = (column("rate_cmd_rad_s"), column("omega_rad_s"), &record.true_omega_rad_s);
    let at_rate = is.iter().position(|omega| *omega > 0.98 * rate).unwrap() as f64 * 1e-3;
    let limit = Stand::default().firmware.acceleration_rad_s2;
    println!("98 % of {rate:.3} rad/s after {at_rate:.3} s; the limit alone takes {:.3} s", rate / limit);
    assert!(at_rate < rate / limit + 0.05, "{at_rate}");
    let mean = |values: &[f64]| values[2000..].iter().sum::<f64>() / (values.len() - 2000) as f64;
    assert!((mean(commanded) / rate - 1.0).abs() < 1e-9, "commanded {}", mean(commanded));
    // Over a second the platform's ripple averages out: 4 turns of 14 periods each.
    assert!((mean(is) / rate - 1.0).abs() < 1e-3, "is {}", mean(is));
    // The rate sensor's noise is 0.02 rad/s a sample at most.
    assert!((mean(measured) - mean(is)).abs() < 5e-3, "measured {} is {}", mean(measured), mean(is));
    let angles = apart(&column("theta_rad")[1..], &record.true_theta_rad[1..]);
    let zero = column("theta_rad")[0] - record.true_theta_rad[0];
    assert!(angles < zero.abs() + Hardware::default().rad_per_count() + 1e-9, "the counter is the angle to a count: {angles}");
}

#[test]
fn platform_follows_every_profile_in_rate_mode() {
    ProfileKind::ALL.par_iter().for_each(|kind| {
        let record = session(Mode::Rate, SessionRequest::usual_profile(Mode::Rate, *kind, 6.0, 3), 12.0);
        assert_eq!(record.fault, Fault::None, "{kind}");
        assert!(record.limits.iter().all(|l| !l.contains(Limits::SLIPPED) && !l.contains(Limits::STARVED)), "{kind}");
        // Angles count from the position at power-on.
        let turned: Vec<f64> = record.true_theta_rad.iter().map(|theta| theta - record.true_theta_rad[0]).collect();
        let error_rad = apart(&record.column("theta_cmd_rad").unwrap()[100..], &turned[100..]);
        let error_rad_s = apart(&record.column("rate_cmd_rad_s").unwrap()[100..], &record.true_omega_rad_s[100..]);
        println!("{kind}: angle within {error_rad:.4} rad, rate within {error_rad_s:.3} rad/s");
        assert!(error_rad < 0.02 && error_rad_s < 0.3, "{kind}: {error_rad} rad, {error_rad_s} rad/s");
        assert!(greatest(record.true_omega_rad_s.iter().copied()) > 3.0, "{kind}: the platform moves");
    });
}

#[test]
fn voltage_mode_applies_every_profile_to_half_a_compare_count() {
    ProfileKind::ALL.par_iter().filter(|kind| !kind.is_a_rate()).for_each(|kind| {
        let config = SessionRequest::usual_profile(Mode::Voltage, *kind, 0.7, 3);
        let record = session(Mode::Voltage, config, 6.0);
        assert_eq!(record.fault, Fault::None, "{kind}");
        let mut profile = Profile::new(&config).unwrap();
        let asked: Vec<f64> = (0..record.rows()).map(|_| profile.next_value()).collect();
        let off = apart(record.column("u_V").unwrap(), &asked);
        assert!(off <= 0.5 * Hardware::default().volt_per_duty() + 1e-12, "{kind}: {off}");
    });
}

#[test]
fn mode_off_applies_no_voltage() {
    let record = session(Mode::Off, ProfileConfig::new(ProfileKind::Constant, 5.0, 1), 1.0);
    assert!(record.column("u_V").unwrap().iter().all(|u| *u == 0.0));
    // Cogging may pull the platform into the nearest rest position.
    assert!(greatest(record.true_theta_rad.iter().map(|theta| theta + 0.05)) < TAU / 7.0);
}

#[test]
fn whole_turns_return_the_command_to_a_count() {
    for (turns, rate) in [(1, 3.0), (3, -10.0), (10, 12.0)] {
        let config = ProfileConfig { turns, ..ProfileConfig::new(ProfileKind::Turns, rate, 1) };
        let record = session(Mode::Rate, config, f64::from(turns) * TAU / rate.abs() + 1.5);
        let column = |name| record.column(name).unwrap();
        let way = f64::from(turns) * TAU * rate.signum();
        let command = column("theta_cmd_rad");
        let asked = command[command.len() - 1] - command[0];
        assert!((asked - way).abs() < Hardware::default().rad_per_count(), "{turns} turns: {asked}");
        let turned = record.true_theta_rad[command.len() - 1] - record.true_theta_rad[0];
        // Coulomb friction and cogging over the loop's stiffness: 3.9 mN m over 0.4 N m/rad; at the start the platform may move.
        assert!((turned - way).abs() < 0.02, "{turns} turns: {turned}");
    }
}
