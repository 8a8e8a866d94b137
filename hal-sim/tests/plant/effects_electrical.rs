//! Effects of bridge and winding: each against a closed form, in the rig and in the plant.
//!
//! Mostly with an inertia so large that the rate is constant: only the winding responds.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{BOTH, Bench, Drive, Kind, ROW_S, Setup, close, close_rel};
use drive_rig::{DriveState, Input};

/// A rotor at a practically constant rate.
const FLYWHEEL: Drive = Drive { inertia: 1e9, motor_constant: 0.02, resistance: 2.0 };

#[test]
fn the_current_and_its_row_means_follow_the_exponential_of_the_winding() {
    for kind in BOTH {
        for l in [2e-4, 2e-3, 2e-2] {
            let tau = l / 2.0;
            let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[("inductance", &[l])]));
            for n in 0..50 {
                let from = f64::from(n) * ROW_S;
                let mean = bench.hold(3.0, ROW_S);
                let exact = 1.5 * (1.0 - tau / ROW_S * ((-from / tau).exp() - (-(from + ROW_S) / tau).exp()));
                // Rig: exact. Plant: steps of half the time constant, (1/2)⁵/120 = 3e-4 in each, in the first of five rows.
                close(mean, exact, if kind == Kind::Rig { 1e-12 } else { 2e-4 }, &format!("{kind:?} L {l} row {n}"));
                if kind == Kind::Rig {
                    close(bench.state().current, 1.5 * (1.0 - (-(from + ROW_S) / tau).exp()), 1e-12, "at the instant");
                }
            }
        }
    }
}

#[test]
fn below_the_drop_no_current_flows_and_above_it_the_drop_is_subtracted() {
    for kind in BOTH {
        for id in ["brush-drop", "dead-time"] {
            for sign in [1.0, -1.0] {
                let current = |u: f64| Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[(id, &[0.25])])).hold(sign * u, ROW_S);
                for u in [0.0, 0.1, 0.249, 0.25] {
                    assert_eq!(current(u), 0.0, "{kind:?} {id} at {u}");
                }
                for u in [0.2501, 0.5, 6.0] {
                    close(current(u), sign * (u - 0.25) / 2.0, 1e-12, &format!("{kind:?} {id} at {u}"));
                }
            }
        }
        // Both at once add up.
        let both: &[(&str, &[f64])] = &[("brush-drop", &[0.25]), ("dead-time", &[0.1])];
        close(Bench::new(kind, &Setup::by_voltage(FLYWHEEL, both)).hold(1.0, ROW_S), 0.65 / 2.0, 1e-12, "both");
    }
}

#[test]
fn a_back_emf_below_the_drop_does_not_brake() {
    for kind in BOTH {
        let drive = Drive { inertia: 1e-4, ..FLYWHEEL };
        let mut bench = Bench::new(kind, &Setup::by_voltage(drive, &[("brush-drop", &[0.3])])).spin(14.9);
        bench.hold(0.0, 1.0);
        assert_eq!(bench.omega(), 14.9, "{kind:?}: 0.298 V");
        let mut bench = Bench::new(kind, &Setup::by_voltage(drive, &[("brush-drop", &[0.3])])).spin(30.0);
        bench.hold(0.0, 1.0);
        // K²/RJ = 2/s towards 15 rad/s: midpoint (2e-3)²/6.
        close(bench.omega(), 15.0 + 15.0 * (-2.0_f64).exp(), 1e-5, &format!("{kind:?} above"));
    }
}

#[test]
fn a_current_below_the_drop_reaches_zero_in_finite_time_and_stays_zero() {
    let (l, v) = (2e-3, 0.3);
    let tau = l / 2.0;
    for kind in BOTH {
        for sign in [1.0, -1.0] {
            let setup = Setup::by_voltage(FLYWHEEL, &[("inductance", &[l]), ("brush-drop", &[v])]);
            let mut bench = Bench::new(kind, &setup);
            bench.hold(sign * 1.3, 0.05); // 0.5 A
            // i = (i0 + V/R) e^(−t/τ) − V/R until zero: its charge is i0 τ − V/R t0.
            let dead_s = tau * (1.0 + 0.5 * 2.0 / v).ln();
            let charge = 0.5 * tau - v / 2.0 * dead_s;
            let mean = bench.hold(0.0, 5.0 * ROW_S);
            // The plant: Runge-Kutta steps of a tenth of τ, (1/10)⁵/120 of 5e-4 A s in each of a dozen.
            close(mean * 5.0 * ROW_S, sign * charge, if kind == Kind::Rig { 1e-15 } else { 1e-9 }, &format!("{kind:?}"));
            assert_eq!(bench.hold(sign * 0.29, ROW_S), 0.0, "{kind:?} stays zero below the drop");
            assert_eq!(bench.hold(-sign * 0.29, ROW_S), 0.0, "{kind:?} in the other direction");
        }
    }
}

#[test]
fn a_reversed_current_has_the_drop_in_both_directions() {
    let (l, v) = (2e-3, 0.3);
    let tau = l / 2.0;
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[("inductance", &[l]), ("brush-drop", &[v])]));
        bench.hold(1.3, 0.05); // 0.5 A
        // To −1.3 V: first towards −(1.3 + V, with the drop in the direction of the voltage) then towards −(1.3 − V)/R.
        let first = (-1.3 - v) / 2.0;
        let zero_s = tau * ((0.5 - first) / -first).ln();
        let second = (-1.3 + v) / 2.0;
        let rest_s = 3.0 * ROW_S - zero_s;
        let charge = first * zero_s + 0.5 * tau + second * (rest_s + tau * (-rest_s / tau).exp_m1());
        let mean = bench.hold(-1.3, 3.0 * ROW_S);
        // The plant: as above.
        close(mean * 3.0 * ROW_S, charge, if kind == Kind::Rig { 1e-15 } else { 1e-9 }, &format!("{kind:?}"));
    }
}

#[test]
fn resistance_follows_the_measured_temperature() {
    for kind in BOTH {
        for temp_C in [25.0, 80.0, -5.0] {
            // Heat capacity and thermal resistance so large that the temperature of the plant is constant.
            let setup = Setup::by_voltage(FLYWHEEL, &[("resistance-temperature", &[0.004, 1e5, 1e3])]).warm(temp_C);
            let mean = Bench::new(kind, &setup).hold(3.0, ROW_S);
            close_rel(mean, 3.0 / (2.0 * (1.0 + 0.004 * (temp_C - 25.0))), 1e-8, &format!("{kind:?} {temp_C}"));
        }
    }
}

#[test]
fn the_winding_warms_with_its_time_constant_to_the_equilibrium_of_its_hot_resistance() {
    let (alpha, heat, r_th, u): (f64, f64, f64, f64) = (0.004, 0.2, 10.0, 3.0);
    for kind in BOTH {
        // Small first: u²/R = 5e-3 W warms by 0.05 K along 1 − e^(−t/2 s).
        let small = 0.1;
        let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[("resistance-temperature", &[alpha, heat, r_th])]));
        for n in 1..=8 {
            bench.hold(small, 0.5 - 1e-4);
            let mean = bench.hold(small, 1e-4);
            let warm_K = (small / mean / 2.0 - 1.0) / alpha;
            let exact = small * small / 2.0 * r_th * (1.0 - (-0.5 * f64::from(n) / (heat * r_th)).exp());
            // α T = 2e-4 of itself by the resistance that rises; Euler's ticks of 1e-4/2 s in the plant.
            close_rel(warm_K, exact, 4e-4, &format!("{kind:?} after {n} half seconds"));
        }
        // Large: T = K_W u²/(R (1 + α T)), that is α T² + T = K_W u²/R.
        let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[("resistance-temperature", &[alpha, heat, r_th])]));
        bench.hold(u, 40.0);
        bench.hold(u, ROW_S);
        let warm_K = (-1.0 + (1.0 + 4.0 * alpha * r_th * u * u / 2.0).sqrt()) / (2.0 * alpha);
        close_rel(bench.current, u / (2.0 * (1.0 + alpha * warm_K)), 1e-7, &format!("{kind:?} hot, by {warm_K} K"));
    }
}

#[test]
fn a_hot_winding_cools_to_ambient() {
    // The ambient temperature is 25 °C for the rig, and a setting of the stand for the plant.
    let mut bench = Bench::new(Kind::Rig, &Setup::by_voltage(FLYWHEEL, &[("resistance-temperature", &[0.004, 0.2, 10.0])]));
    *bench.state_mut() = DriveState { heat_K: 20.0, ..*bench.state() };
    bench.hold(0.0, 2.0);
    // Midpoint: (h/2 s)².
    close_rel(bench.state().heat_K, 20.0 * (-1.0_f64).exp(), 1e-6, "e-fold");
    let mut stand = common::stand_of(FLYWHEEL, &[]);
    stand.drive.ambient_C = 40.0;
    stand.drive.thermal_J_K = 0.1;
    let mut plant = hal_sim::plant::Plant::new(&stand, 0.0).unwrap();
    for _ in 0..100_000 {
        hal_sim::board::PlantPort::advance(&mut plant, 0.0, 1e-4);
    }
    close(hal_sim::board::PlantPort::temp_C(&plant), 40.0, 1e-9, "ambient 40 °C");
}

#[test]
fn supply_and_leads_drop_r_i() {
    for kind in BOTH {
        let mean = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[("supply-droop", &[0.5])])).hold(-4.0, ROW_S);
        close_rel(mean, -4.0 / 2.5, 1e-12, &format!("{kind:?}"));
        // With inductance: slower target, faster constant.
        let list: &[(&str, &[f64])] = &[("inductance", &[2e-2]), ("supply-droop", &[0.5])];
        let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, list));
        let mean = bench.hold(4.0, 0.01);
        let tau = 2e-2 / 2.5;
        close_rel(mean, 1.6 * (1.0 + tau / 0.01 * (-0.01_f64 / tau).exp_m1()), 1e-6, &format!("{kind:?} rising"));
    }
}

#[test]
fn a_measured_supply_scales_the_commanded_voltage() {
    let list = [("supply-droop".to_owned(), vec![0.5])];
    let rig = common::rig(FLYWHEEL, Input::Voltage, &list);
    let span = drive_rig::RowInput { supply_ratio: 0.9, ..common::span(0.0, ROW_S, 4.0, None) };
    let mean = rig.advance(&mut DriveState::turning(0.0, 0.0), &span);
    close_rel(mean, 0.9 * 4.0 / 2.5, 1e-12, "0.9 of the command");
}

#[test]
fn a_saturated_motor_has_its_steady_torque() {
    for kind in BOTH {
        for amps in [0.1, -0.8, 1.2, 4.0] {
            let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[("magnetic-saturation", &[1.2])]));
            bench.hold(2.0 * amps, 0.1);
            let torque = 0.02 / (1.0 + (amps / 1.2_f64).powi(2)) * amps;
            close_rel(bench.omega(), torque * 0.1 / 1e9, 1e-9, &format!("{kind:?} at {amps} A"));
        }
        // Turning: i = (u − K ω/(1 + (i/i_s)²))/R, solved by bisection.
        let (u, omega) = (2.0, 60.0);
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..80 {
            let i = 0.5 * (low + high);
            if u - 0.02 * omega / (1.0 + (i / 1.2_f64).powi(2)) > 2.0 * i { low = i } else { high = i }
        }
        for list in [&[("magnetic-saturation", &[1.2][..])][..], &[("magnetic-saturation", &[1.2][..]), ("inductance", &[1e-3][..])][..]] {
            let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, list)).spin(omega);
            bench.hold(u, 0.1);
            bench.hold(u, ROW_S);
            // Two fixed-point rounds in each step of the rig, from the last step's current.
            close_rel(bench.current, low, 1e-8, &format!("{kind:?} {} turning", list.len()));
        }
    }
}

#[test]
fn a_nonlinear_bridge_drives_the_current_by_its_polynomial() {
    let (a, b) = (-0.03, 0.004);
    for kind in BOTH {
        for u in [0.3, -2.0, 5.0] {
            let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[("bridge-nonlinearity", &[a, b])]));
            let exact = u * (1.0 + a * f64::abs(u) + b * u * u) / FLYWHEEL.resistance;
            close_rel(bench.hold(u, ROW_S), exact, 1e-12, &format!("{kind:?} {u} V"));
        }
    }
}

/// Within the dead zone the motor is short-circuited: its back-EMF brakes, unlike behind a voltage drop.
#[test]
fn within_a_dead_zone_the_motor_brakes_and_beyond_it_the_zone_is_subtracted() {
    let width = 0.25;
    let drive = Drive { inertia: 1e-3, ..FLYWHEEL };
    let rate_1_s = drive.motor_constant * drive.motor_constant / (drive.resistance * drive.inertia);
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_voltage(drive, &[("voltage-dead-zone", &[width])])).spin(20.0);
        bench.hold(-0.24, 2.0);
        close_rel(bench.omega(), 20.0 * (-rate_1_s * 2.0).exp(), 1e-7, &format!("{kind:?} brakes"));
        for (u, driving) in [(0.4, 0.15), (-3.0, -2.75)] {
            let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[("voltage-dead-zone", &[width])]));
            close_rel(bench.hold(u, ROW_S), driving / FLYWHEEL.resistance, 1e-12, &format!("{kind:?} {u} V"));
        }
    }
}
