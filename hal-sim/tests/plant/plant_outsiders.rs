//! Disturbances outside the catalogue, compared with closed forms.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{Draw, Drive, ROW_S, Setup, TICK_S, close, close_rel, stand_of};
use hal_sim::board::PlantPort;
use hal_sim::plant::outsiders::{
    BadContact, BadLines, BallDefect, FluidRotor, GrindingBearing, HuntingSupply, Outsiders, SaggingConverter, SectorRub, SlippingClutch,
    StickyRateSensor, WanderingLoad,
};
use hal_sim::plant::{Plant, Stand, StandError};
use std::f64::consts::TAU;

const J: f64 = 2.5e-4;
const DRIVE: Drive = Drive { inertia: J, motor_constant: 0.0234, resistance: 2.32 };

fn rubs(sector_rub: SectorRub) -> Outsiders {
    Outsiders { sector_rub: Some(sector_rub), ..Outsiders::default() }
}

fn hunts(hunting_supply: HuntingSupply) -> Outsiders {
    Outsiders { hunting_supply: Some(hunting_supply), ..Outsiders::default() }
}

fn slips(clutch_N_m: f64, motor_inertia_share: f64) -> Outsiders {
    Outsiders { slipping_clutch: Some(SlippingClutch { clutch_N_m, motor_inertia_share }), ..Outsiders::default() }
}

fn grinds(grinding_bearing: GrindingBearing) -> Outsiders {
    Outsiders { grinding_bearing: Some(grinding_bearing), ..Outsiders::default() }
}

fn plant(setup: &Setup, outsiders: Outsiders) -> Plant {
    Plant::new(&Stand { outsiders, ..stand_of(setup.drive, &setup.effects) }, setup.theta).unwrap()
}

/// Holds the input for `seconds` in control ticks.
fn hold(plant: &mut Plant, input: f64, seconds: f64) {
    for _ in 0..(seconds / TICK_S).round() as usize {
        plant.advance(input, TICK_S);
    }
}

#[test]
fn a_rub_dissipates_torque_times_width_per_turn() {
    let rub = SectorRub { rub_N_m: 2e-3, rub_N_m_s: 0.0, from_rad: 1.0, width_rad: 0.6 };
    for start in [30.0, -30.0] {
        let mut plant = plant(&Setup::by_torque(J, &[]), rubs(rub));
        plant.spin(start);
        for turns in 1..5 {
            while plant.true_theta_rad().abs() < f64::from(turns) * TAU {
                plant.advance(0.0, TICK_S);
            }
            let exact = (start * start - 2.0 * f64::from(turns) * 2e-3 * 0.6 / J).sqrt();
            // Edges are found to a nanosecond: 8 rad/s² of it are 1e-8.
            close(plant.true_rate_rad_s().abs(), exact, 1e-7, &format!("rate after {turns} turns from {start} rad/s"));
        }
    }
}

#[test]
fn a_slow_rotor_stops_in_the_sector_and_stays() {
    let rub = SectorRub { rub_N_m: 2e-3, rub_N_m_s: 0.0, from_rad: 1.0, width_rad: 0.6 };
    let mut plant = plant(&Setup::by_torque(J, &[]), rubs(rub));
    plant.spin(2.0);
    hold(&mut plant, 0.0, 1.0);
    // A nanosecond at 2 rad/s either side of the edge.
    close(plant.true_theta_rad(), 1.0 + J * 4.0 / (2.0 * 2e-3), 1e-8, "angle at rest");
    assert_eq!(plant.true_rate_rad_s(), 0.0);
    hold(&mut plant, 1.999e-3, 0.1);
    assert_eq!(plant.true_rate_rad_s(), 0.0, "a torque below the Coulomb torque does not move the rotor");
    hold(&mut plant, 2.2e-3, 0.1);
    close_rel(plant.true_rate_rad_s(), 0.2e-3 / J * 0.1, 1e-9, "rate by the excess torque");
}

#[test]
fn a_viscous_rub_reduces_the_rate_in_proportion_to_its_width() {
    let rub = SectorRub { rub_N_m: 0.0, rub_N_m_s: 4e-4, from_rad: -0.2, width_rad: 0.5 };
    let mut plant = plant(&Setup::by_torque(J, &[]).at(-1.0), rubs(rub));
    plant.spin(10.0);
    hold(&mut plant, 0.0, 0.2);
    // dω/dθ = −b/J at any rate.
    close(plant.true_rate_rad_s(), 10.0 - 4e-4 / J * 0.5, 1e-7, "rate after the sector");
}

#[test]
fn an_oscillating_supply_acts_by_the_transfer_function_and_is_not_measured() {
    let hunting = HuntingSupply { hunting: 0.1, hunting_Hz: 1.5, hunting_phase_rad: 0.7 };
    let mut plant = plant(&Setup::by_voltage(DRIVE, &[]), hunts(hunting));
    let (k, tau) = (DRIVE.motor_constant, J * DRIVE.resistance / DRIVE.motor_constant.powi(2));
    let w = TAU * hunting.hunting_Hz;
    let (gain, lag) = (0.1 / (1.0 + (w * tau).powi(2)).sqrt(), (w * tau).atan());
    let swing = |t: f64| gain * (w * t + 0.7 - lag).sin();
    let u = 0.6;
    for n in 1..=20_000 {
        plant.advance(u, TICK_S);
        assert_eq!(plant.supply_V(), 12.0);
        let t = f64::from(n) * TICK_S;
        let exact = u / k * (1.0 + swing(t) - (1.0 + swing(0.0)) * (-t / tau).exp());
        // Runge-Kutta error (h/τ)⁴ of 26 rad/s, and the sum of the ticks' lengths.
        close(plant.true_rate_rad_s(), exact, 1e-9, "rate");
    }
}

#[test]
fn a_clutch_below_its_limit_is_a_rigid_shaft() {
    let list: &[(&str, &[f64])] = &[("coulomb", &[9e-4]), ("viscous", &[2e-5]), ("inductance", &[2.38e-4])];
    let setup = Setup::by_voltage(DRIVE, list);
    let (mut rigid, mut coupled) = (plant(&setup, Outsiders::default()), plant(&setup, slips(1.0, 0.3)));
    let mut draw = Draw(5);
    for _ in 0..200 {
        let volt = draw.signed_log(0.02, 1.0);
        hold(&mut rigid, volt, 0.01);
        hold(&mut coupled, volt, 0.01);
        // Equal equations, with another sequence of additions.
        close(coupled.true_rate_rad_s(), rigid.true_rate_rad_s(), 1e-9, "rate");
    }
}

#[test]
fn a_slipping_clutch_transmits_its_limit_and_conserves_momentum() {
    let (limit, share, torque) = (1e-3, 0.3, 6e-3);
    let mut plant = plant(&Setup::by_torque(J, &[]), slips(limit, share));
    hold(&mut plant, torque, 0.05);
    let platform = limit / (J * (1.0 - share)) * 0.05;
    close_rel(plant.true_rate_rad_s(), platform, 1e-9, "the platform while it slips");
    let motor = (torque - limit) / (J * share) * 0.05;
    let energy = 0.5 * J * (share * motor * motor + (1.0 - share) * platform * platform);
    close_rel(plant.mechanical_energy_J(), energy, 1e-9, "energy of both");
    // Without torque the difference goes by the limit on both sides: J r (1 − r) (ω_m − ω_p)/limit.
    let catches_s = J * share * (1.0 - share) * (motor - platform) / limit;
    let before_s = (catches_s / TICK_S).floor() * TICK_S;
    hold(&mut plant, 0.0, before_s);
    close_rel(plant.true_rate_rad_s(), platform + limit / (J * (1.0 - share)) * before_s, 1e-9, "just before the slip ends");
    hold(&mut plant, 0.0, 0.1);
    // The clutch takes energy, no momentum; the slip ends within a nanosecond of 25 rad/s².
    close(plant.true_rate_rad_s(), torque * 0.05 / J, 1e-7, "together");
    let together = 0.5 * J * (torque * 0.05 / J).powi(2);
    close_rel(plant.mechanical_energy_J(), together, 1e-7, "energy together");
}

#[test]
fn the_time_at_which_a_clutch_opens_is_located() {
    // A current that rises towards u/R: the clutch holds until (1 − r) K i passes its limit, at τ ln 2 here.
    let (l, share, limit) = (0.1, 0.4, 1e-2);
    let drive = Drive { inertia: 1e3, motor_constant: 0.02, resistance: 2.0 };
    let mut plant = plant(&Setup::by_voltage(drive, &[("inductance", &[l])]), slips(limit, share));
    let full = 2.0 * limit / (1.0 - share);
    let tau: f64 = l / drive.resistance;
    let lets_go_s = tau * 2.0_f64.ln();
    hold(&mut plant, full / drive.motor_constant * drive.resistance, 0.06);
    let until = full * (lets_go_s - tau * (1.0 - (-lets_go_s / tau).exp())) / drive.inertia;
    let exact = until + limit / (drive.inertia * (1.0 - share)) * (0.06 - lets_go_s);
    close_rel(plant.true_rate_rad_s(), exact, 1e-8, "platform");
}

#[test]
fn a_platform_slips_to_rest_on_a_stuck_motor() {
    let (limit, share, dry, start) = (1e-3, 0.3, 8e-3, 5.0);
    let mut plant = plant(&Setup::by_torque(J, &[("coulomb", &[dry])]), slips(limit, share));
    plant.spin(start);
    let rest_s = J * (1.0 - share) * start / limit;
    hold(&mut plant, 0.0, 0.5 * rest_s);
    close_rel(plant.true_rate_rad_s(), 0.5 * start, 1e-6, "half of the time");
    hold(&mut plant, 0.0, rest_s);
    assert_eq!(plant.true_rate_rad_s(), 0.0);
    close(plant.true_theta_rad(), 0.5 * start * rest_s, 1e-7, "angle to rest");
    assert_eq!(plant.mechanical_energy_J(), 0.0);
}

/// Additional Coulomb torque of a continuously sliding bearing per row of 1 ms, relative to its rms.
fn ground(bearing: GrindingBearing, rows: usize) -> Vec<f64> {
    let torque = 20.0 * bearing.grinding_N_m;
    let mut plant = plant(&Setup::by_torque(J, &[]), grinds(bearing));
    let mut last = 0.0;
    (0..rows)
        .map(|_| {
            hold(&mut plant, torque, ROW_S);
            let gained = plant.true_rate_rad_s() - last;
            last = plant.true_rate_rad_s();
            (torque - J * gained / ROW_S) / bearing.grinding_N_m
        })
        .collect()
}

#[test]
fn a_grinding_bearing_has_the_set_torque_and_correlation_time() {
    let bearing = GrindingBearing { grinding_N_m: 1e-3, grinding_s: 0.05, seed: 3 };
    let rows = 200_000;
    let levels = ground(bearing, rows);
    let n = rows as f64;
    // 200 s hold 4000 correlation times. |x| has mean √(2/π) and variance 1 − 2/π, its own memory is near τ/2: 4 σ of the mean are 0.04.
    let mean = levels.iter().sum::<f64>() / n;
    close(mean, (2.0 / std::f64::consts::PI).sqrt(), 0.04, "mean level");
    let square = levels.iter().map(|x| x * x).sum::<f64>() / n;
    close(square, 1.0, 0.1, "mean square");
    // The correlation of x² of a Gaussian process is the square of that of x: e^(−2Δ/τ), 1/e after half of τ.
    let var = levels.iter().map(|x| (x * x - square).powi(2)).sum::<f64>() / n;
    let lag = 25;
    let shared = levels.windows(lag + 1).map(|w| (w[0] * w[0] - square) * (w[lag] * w[lag] - square)).sum::<f64>() / n;
    close(shared / var, (-1.0_f64).exp(), 0.08, "memory over 25 ms");
    assert!(levels.iter().all(|x| *x > -1e-6), "a Coulomb torque is not negative");
    assert!(levels[..100] != ground(GrindingBearing { seed: 4, ..bearing }, 100), "another seed, another path");
}

#[test]
fn pulses_of_a_ball_dissipate_their_mean_torque_per_turn() {
    // A whole number of pulses: the modulation over the turn averages out.
    let ball = BallDefect { ball_N_m: 4e-3, ball_per_turn: 4.0, ball_width: 0.2, ball_modulation: 0.7 };
    let mut plant = plant(&Setup::by_torque(J, &[]), Outsiders { ball_defect: Some(ball), ..Outsiders::default() });
    plant.spin(30.0);
    while plant.true_theta_rad() < 3.0 * TAU {
        plant.advance(0.0, TICK_S);
    }
    // The pulses are in the middle of each period: none acts at the end of a turn, where the tick overshoots.
    let exact = (900.0 - 2.0 * 3.0 * TAU * 4e-3 * 0.1 / J).sqrt();
    close(plant.true_rate_rad_s(), exact, 1e-5, "rate after three turns");
}

#[test]
fn a_ball_of_another_number_of_pulses_moves_from_turn_to_turn() {
    let ball = BallDefect::default();
    let centre = 0.5 * TAU / ball.ball_per_turn;
    close_rel(ball.coulomb_N_m(centre), ball.ball_N_m * (1.0 + ball.ball_modulation * centre.cos()), 1e-12, "height at the first pulse");
    assert!(ball.coulomb_N_m(centre + TAU) < 0.01 * ball.ball_N_m, "a turn later the pulse is elsewhere");
}

#[test]
fn a_bad_contact_has_the_set_resistance_and_duty() {
    let contact = BadContact { contact_ohm: 6.0, good_for_s: 0.05, bad_for_s: 0.02, seed: 5 };
    let heavy = Drive { inertia: 1e9, ..DRIVE };
    let mut plant = plant(&Setup::by_voltage(heavy, &[]), Outsiders { bad_contact: Some(contact), ..Outsiders::default() });
    let (good, bad) = (1.0 / DRIVE.resistance, 1.0 / (DRIVE.resistance + 6.0));
    let rows = 200_000;
    let mut bad_rows = 0;
    for _ in 0..rows {
        plant.advance(1.0, ROW_S);
        let current = plant.mean_current_A();
        let is_bad = (current - bad).abs() < 1e-9;
        assert!(is_bad || (current - good).abs() < 1e-9, "{current}");
        bad_rows += usize::from(is_bad);
    }
    // 2857 cycles: the duty 2/7 has a standard deviation of 0.0054 of an alternating renewal process.
    close(bad_rows as f64 / f64::from(rows), 2.0 / 7.0, 0.02, "fraction of the time");
}

#[test]
fn a_rotor_in_a_fluid_takes_momentum_over_exponentially() {
    let rotor = FluidRotor { fluid_kg_m2: 1e-4, fluid_N_m_s: 5e-4 };
    let mut plant = plant(&Setup::by_torque(J, &[]), Outsiders { fluid_rotor: Some(rotor), ..Outsiders::default() });
    // A kick: the rotor turns, the second one does not yet.
    plant.advance(5e-3 / TICK_S, TICK_S);
    let kicked = 5e-3 / J;
    let together = 5e-3 / (J + 1e-4);
    let decay = 5e-4 * (1.0 / J + 1.0 / 1e-4);
    for n in 1..=3000 {
        plant.advance(0.0, TICK_S);
        let t = (f64::from(n) + 0.5) * TICK_S;
        // The kick lasts a tick, in which the rate rises linearly: its middle is the origin, to (decay h)²/24.
        close(plant.true_rate_rad_s(), together + (kicked - together) * (-decay * t).exp(), 1e-5, "rate");
    }
    let mut spun = self::plant(&Setup::by_torque(J, &[]), Outsiders { fluid_rotor: Some(rotor), ..Outsiders::default() });
    spun.spin(7.0);
    hold(&mut spun, 0.0, 0.1);
    close(spun.true_rate_rad_s(), 7.0, 1e-12, "two rotors of one rate go on");
    close_rel(spun.mechanical_energy_J(), 0.5 * (J + 1e-4) * 49.0, 1e-12, "energy of both");
}

#[test]
fn a_wandering_load_has_independent_increments_of_the_set_variance() {
    let load = WanderingLoad { wander_N_m: 2e-4, seed: 9 };
    let mut plant = plant(&Setup::by_torque(J, &[]), Outsiders { wandering_load: Some(load), ..Outsiders::default() });
    let mut last = 0.0;
    let torques: Vec<f64> = (0..50_000)
        .map(|_| {
            hold(&mut plant, 0.0, ROW_S);
            let gained = plant.true_rate_rad_s() - last;
            last = plant.true_rate_rad_s();
            J * gained / ROW_S
        })
        .collect();
    // Means of rows: increments over 100 rows have the variance σ² (100 − 1/3) ms. 500 of them: 4 σ of the variance are 25 %.
    let increments: Vec<f64> = torques.iter().step_by(100).zip(torques.iter().skip(100).step_by(100)).map(|(a, b)| b - a).collect();
    let variance = increments.iter().map(|x| x * x).sum::<f64>() / increments.len() as f64;
    close_rel(variance, 4e-8 * 0.1 * (1.0 - 1.0 / 300.0), 0.25, "variance over 0.1 s");
    let shared = increments.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / increments.len() as f64;
    close(shared / variance, 0.0, 0.2, "correlation of increments");
}

#[test]
fn a_sagging_converter_acts_by_the_two_time_constants() {
    let converter = SaggingConverter { sag_per_V: 0.2, sag_s: 0.7 };
    let mut plant = plant(&Setup::by_voltage(DRIVE, &[]), Outsiders { sagging_converter: Some(converter), ..Outsiders::default() });
    let (k, tau) = (DRIVE.motor_constant, J * DRIVE.resistance / DRIVE.motor_constant.powi(2));
    let (u, sag) = (-0.6, 0.2 * 0.6);
    for n in 1..=20_000 {
        plant.advance(u, TICK_S);
        let t = f64::from(n) * TICK_S;
        let rise = 1.0 - (-t / tau).exp();
        let memory = ((-t / 0.7).exp() - (-t / tau).exp()) / (1.0 - tau / 0.7);
        close(plant.true_rate_rad_s(), u / k * ((1.0 - sag) * rise + sag * memory), 1e-9, "rate");
    }
    assert_eq!(plant.supply_V(), 12.0);
}

#[test]
fn a_sticky_rate_sensor_lags_by_its_half_width_in_both_directions() {
    let sensor = StickyRateSensor { sticks_rad_s: 0.3 };
    let mut plant = plant(&Setup::by_torque(J, &[]), Outsiders { sticky_rate_sensor: Some(sensor), ..Outsiders::default() });
    hold(&mut plant, 1e-3, 0.5);
    close(plant.rate_rad_s(), 2.0 - 0.3, 1e-9, "while the rate rises");
    hold(&mut plant, -1e-3, 0.1);
    close(plant.rate_rad_s(), 1.7, 1e-9, "within the play");
    hold(&mut plant, -1e-3, 0.4);
    close(plant.rate_rad_s(), 0.3, 1e-9, "while the rate falls");
    assert!(plant.true_rate_rad_s().abs() < 1e-9);
}

#[test]
fn bad_lines_change_the_angle_reading_in_their_sector_alone() {
    let lines = BadLines { lines_rad: 0.02, from_rad: 1.0, width_rad: 0.4 };
    let mut plant = plant(&Setup::by_torque(J, &[]), Outsiders { bad_lines: Some(lines), ..Outsiders::default() });
    plant.spin(10.0);
    for _ in 0..20_000 {
        plant.advance(0.0, TICK_S);
        let truth = plant.true_theta_rad();
        let part = (truth - 1.0).rem_euclid(TAU) / 0.4;
        let exact = if part < 1.0 { 0.02 * (std::f64::consts::PI * part).sin().powi(2) } else { 0.0 };
        close(plant.theta_rad() - truth, exact, 1e-12, "error of the reading");
    }
    close(plant.true_rate_rad_s(), 10.0, 1e-12, "the motion does not change");
}

/// Rows of [`record`].
const ROWS: usize = 5000;

/// Readings of rate, angle and current per row over 5 s of random voltage levels of 0.2 s on the default stand.
fn record(outsiders: Outsiders, ticks_per_row: usize) -> Vec<[f64; 3]> {
    let mut plant = Plant::new(&Stand { outsiders, ..Stand::default() }, 0.3).unwrap();
    let mut draw = Draw(31);
    let mut volt = 0.0;
    (0..ROWS)
        .map(|n| {
            if n % 200 == 0 {
                volt = draw.signed_log(0.05, 1.5);
            }
            let mut mean = 0.0;
            for _ in 0..ticks_per_row {
                plant.advance(volt, ROW_S / ticks_per_row as f64);
                mean += plant.mean_current_A() / ticks_per_row as f64;
            }
            [plant.rate_rad_s(), plant.theta_rad(), mean]
        })
        .collect()
}

fn each() -> [(&'static str, Outsiders); 11] {
    let none = Outsiders::default();
    [
        ("sector-rub", rubs(SectorRub::default())),
        ("hunting-supply", hunts(HuntingSupply::default())),
        ("slipping-clutch", slips(1.2e-3, 0.3)),
        ("grinding-bearing", grinds(GrindingBearing::default())),
        ("ball-defect", Outsiders { ball_defect: Some(BallDefect::default()), ..none }),
        ("bad-contact", Outsiders { bad_contact: Some(BadContact::default()), ..none }),
        ("fluid-rotor", Outsiders { fluid_rotor: Some(FluidRotor::default()), ..none }),
        ("wandering-load", Outsiders { wandering_load: Some(WanderingLoad::default()), ..none }),
        ("sagging-converter", Outsiders { sagging_converter: Some(SaggingConverter::default()), ..none }),
        ("sticky-rate-sensor", Outsiders { sticky_rate_sensor: Some(StickyRateSensor::default()), ..none }),
        ("bad-lines", Outsiders { bad_lines: Some(BadLines::default()), ..none }),
    ]
}

#[test]
fn a_finer_tick_changes_nothing_that_a_sensor_could_see() {
    for (name, outsiders) in each() {
        let (coarse, fine) = (record(outsiders, 10), record(outsiders, 40));
        let greatest = |c: usize| coarse.iter().zip(&fine).map(|(a, b)| (a[c] - b[c]).abs()).fold(0.0, f64::max);
        // A tenth of one sample's noise: 7e-4 rad/s, 0.1 LSB of the encoder, 0.4 mA in a row.
        for (c, limit) in [7e-4, 3e-5, 4e-4].into_iter().enumerate() {
            assert!(greatest(c) < limit, "{name}, channel {c}: {:e}", greatest(c));
        }
    }
}

#[test]
fn each_disturbance_is_visible_and_a_rerun_is_identical() {
    let without = record(Outsiders::default(), 10);
    for (name, outsiders) in each() {
        let with = record(outsiders, 10);
        let rms = |c: usize| (with.iter().zip(&without).map(|(a, b)| (a[c] - b[c]).powi(2)).sum::<f64>() / ROWS as f64).sqrt();
        // Ten times the rate sensor's noise of one sample, or ten steps of the encoder.
        let (rate, angle) = (rms(0), rms(1));
        assert!(rate > 0.07 || angle > 3e-3, "{name} moves the rate by {rate} rad/s, the angle by {angle} rad");
        let bits = |rows: &[[f64; 3]]| rows.concat().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert!(bits(&with) == bits(&record(outsiders, 10)), "{name}");
    }
}

#[test]
fn a_stand_file_sets_disturbances_and_an_invalid_value_is_refused_by_name() {
    let text = "[outsiders.sector-rub]\nrub_N_m = 2e-3\n[outsiders.grinding-bearing]\nseed = 7\n";
    let stand = Stand::parse(text).unwrap();
    assert_eq!(stand.outsiders.sector_rub, Some(SectorRub { rub_N_m: 2e-3, ..SectorRub::default() }));
    assert_eq!(stand.outsiders.grinding_bearing, Some(GrindingBearing { seed: 7, ..GrindingBearing::default() }));
    assert_eq!(stand.outsiders.slipping_clutch, None);
    assert_eq!(Stand::parse(&toml::to_string(&stand).unwrap()).unwrap(), stand);
    assert!(!toml::to_string(&Stand::default()).unwrap().contains("outsiders"));
    for (text, expected) in [
        ("[outsiders.sector-rubb]\n", "sector-rubb"),
        ("[outsiders.sector-rub]\nrub = 1.0\n", "`rub`"),
        ("[outsiders.sector-rub]\nwidth_rad = 7.0\n", "outsiders.sector-rub.width_rad = 7"),
        ("[outsiders.sector-rub]\nrub_N_m = -1.0\n", "outsiders.sector-rub.rub_N_m"),
        ("[outsiders.hunting-supply]\nhunting = 1.0\n", "outsiders.hunting-supply.hunting"),
        ("[outsiders.slipping-clutch]\nclutch_N_m = 0.0\n", "outsiders.slipping-clutch.clutch_N_m"),
        ("[outsiders.slipping-clutch]\nmotor_inertia_share = nan\n", "outsiders.slipping-clutch.motor_inertia_share"),
        ("[outsiders.grinding-bearing]\ngrinding_s = 0.0\n", "outsiders.grinding-bearing.grinding_s"),
        ("[outsiders.slipping-clutch]\n[effects.compliance]\n", "effects.compliance"),
        ("[outsiders.ball-defect]\nball_width = 0.0\n", "outsiders.ball-defect.ball_width"),
        ("[outsiders.bad-contact]\nbad_for_s = 0.0\n", "outsiders.bad-contact.bad_for_s"),
        ("[outsiders.fluid-rotor]\nfluid_kg_m2 = 0.0\n", "outsiders.fluid-rotor.fluid_kg_m2"),
        ("[outsiders.wandering-load]\nwander_N_m = -1.0\n", "outsiders.wandering-load.wander_N_m"),
        ("[outsiders.sagging-converter]\nsag_s = 0.0\n", "outsiders.sagging-converter.sag_s"),
        ("[outsiders.sticky-rate-sensor]\nsticks_rad_s = nan\n", "outsiders.sticky-rate-sensor.sticks_rad_s"),
        ("[outsiders.bad-lines]\nwidth_rad = 7.0\n", "outsiders.bad-lines.width_rad"),
    ] {
        let error = Stand::parse(text).unwrap_err().to_string();
        assert!(error.contains(expected), "{text}: {error}");
    }
    let two = Stand {
        outsiders: slips(1e-3, 0.3),
        effects: [("backlash".to_owned(), std::collections::BTreeMap::new())].into_iter().collect(),
        ..Stand::default()
    };
    assert_eq!(Plant::new(&two, 0.0).err(), Some(StandError::TwoCouplings("backlash".to_owned())));
}

#[test]
fn each_parameter_changes_the_output() {
    let rub = SectorRub { rub_N_m_s: 1e-4, ..SectorRub::default() };
    let hunting = HuntingSupply::default();
    let grinding = GrindingBearing::default();
    let none = Outsiders::default();
    let (ball, contact, fluid) = (BallDefect::default(), BadContact::default(), FluidRotor::default());
    let (load, converter, lines) = (WanderingLoad::default(), SaggingConverter::default(), BadLines::default());
    let ball_of = |b| Outsiders { ball_defect: Some(b), ..none };
    let contact_of = |c| Outsiders { bad_contact: Some(c), ..none };
    let fluid_of = |f| Outsiders { fluid_rotor: Some(f), ..none };
    let load_of = |l| Outsiders { wandering_load: Some(l), ..none };
    let sag_of = |c| Outsiders { sagging_converter: Some(c), ..none };
    let sticky_of = |sticks_rad_s| Outsiders { sticky_rate_sensor: Some(StickyRateSensor { sticks_rad_s }), ..none };
    let lines_of = |l| Outsiders { bad_lines: Some(l), ..none };
    let changed: [(&str, Outsiders, Outsiders); 30] = [
        ("rub_N_m", rubs(rub), rubs(SectorRub { rub_N_m: 1e-3, ..rub })),
        ("rub_N_m_s", rubs(rub), rubs(SectorRub { rub_N_m_s: 2e-4, ..rub })),
        ("from_rad", rubs(rub), rubs(SectorRub { from_rad: 0.5, ..rub })),
        ("width_rad", rubs(rub), rubs(SectorRub { width_rad: 0.3, ..rub })),
        ("hunting", hunts(hunting), hunts(HuntingSupply { hunting: 0.1, ..hunting })),
        ("hunting_Hz", hunts(hunting), hunts(HuntingSupply { hunting_Hz: 2.0, ..hunting })),
        ("hunting_phase_rad", hunts(hunting), hunts(HuntingSupply { hunting_phase_rad: 1.0, ..hunting })),
        ("clutch_N_m", slips(1e-3, 0.3), slips(2e-3, 0.3)),
        ("motor_inertia_share", slips(1e-3, 0.3), slips(1e-3, 0.5)),
        ("grinding_N_m", grinds(grinding), grinds(GrindingBearing { grinding_N_m: 2e-3, ..grinding })),
        ("grinding_s", grinds(grinding), grinds(GrindingBearing { grinding_s: 0.1, ..grinding })),
        ("seed", grinds(grinding), grinds(GrindingBearing { seed: 2, ..grinding })),
        ("ball_N_m", ball_of(ball), ball_of(BallDefect { ball_N_m: 2e-3, ..ball })),
        ("ball_per_turn", ball_of(ball), ball_of(BallDefect { ball_per_turn: 3.6, ..ball })),
        ("ball_width", ball_of(ball), ball_of(BallDefect { ball_width: 0.2, ..ball })),
        ("ball_modulation", ball_of(ball), ball_of(BallDefect { ball_modulation: 0.1, ..ball })),
        ("contact_ohm", contact_of(contact), contact_of(BadContact { contact_ohm: 4.0, ..contact })),
        ("good_for_s", contact_of(contact), contact_of(BadContact { good_for_s: 0.2, ..contact })),
        ("bad_for_s", contact_of(contact), contact_of(BadContact { bad_for_s: 0.05, ..contact })),
        ("seed of the contact", contact_of(contact), contact_of(BadContact { seed: 2, ..contact })),
        ("fluid_kg_m2", fluid_of(fluid), fluid_of(FluidRotor { fluid_kg_m2: 5e-5, ..fluid })),
        ("fluid_N_m_s", fluid_of(fluid), fluid_of(FluidRotor { fluid_N_m_s: 1e-3, ..fluid })),
        ("wander_N_m", load_of(load), load_of(WanderingLoad { wander_N_m: 2e-4, ..load })),
        ("seed of the load", load_of(load), load_of(WanderingLoad { seed: 2, ..load })),
        ("sag_per_V", sag_of(converter), sag_of(SaggingConverter { sag_per_V: 0.1, ..converter })),
        ("sag_s", sag_of(converter), sag_of(SaggingConverter { sag_s: 2.0, ..converter })),
        ("sticks_rad_s", sticky_of(0.1), sticky_of(0.2)),
        ("lines_rad", lines_of(lines), lines_of(BadLines { lines_rad: 0.01, ..lines })),
        ("from_rad of the lines", lines_of(lines), lines_of(BadLines { from_rad: 2.0, ..lines })),
        ("width_rad of the lines", lines_of(lines), lines_of(BadLines { width_rad: 0.2, ..lines })),
    ];
    for (name, one, other) in changed {
        assert!(record(one, 10) != record(other, 10), "{name}");
    }
}
