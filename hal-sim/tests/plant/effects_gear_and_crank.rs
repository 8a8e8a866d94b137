//! Gears and cranks against closed forms, in both integrators: load-dependent friction, ripple of any order, inertia that varies with the
//! angle.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{BOTH, Bench, Drive, Kind, ROW_S, Setup, THEORY, close, close_rel};

#[test]
fn load_dependent_friction_takes_its_share_driving_and_braking() {
    let (j, c, mu, torque) = (1e-4, 1e-3, 0.25, 8e-3);
    for kind in BOTH {
        let effects: &[(&str, &[f64])] = &[("coulomb", &[c]), ("gear-friction", &[mu])];
        let mut driving = Bench::new(kind, &Setup::by_torque(j, effects)).spin(5.0);
        driving.hold(torque, 0.1);
        close_rel(driving.omega(), 5.0 + (torque * (1.0 - mu) - c) / j * 0.1, 1e-9, &format!("{kind:?} driving"));
        let mut braking = Bench::new(kind, &Setup::by_torque(j, effects)).spin(50.0);
        braking.hold(-torque, 0.1);
        close_rel(braking.omega(), 50.0 - (torque * (1.0 + mu) + c) / j * 0.1, 1e-9, &format!("{kind:?} braking"));
    }
}

#[test]
fn load_dependent_friction_holds_up_to_the_torque_that_overcomes_it() {
    let (c, mu) = (1e-3, 0.5);
    for kind in BOTH {
        let setup = Setup::by_torque(1e-4, &[("coulomb", &[c]), ("gear-friction", &[mu])]);
        let mut held = Bench::new(kind, &setup);
        held.hold(1.999 * c, 0.5);
        assert_eq!(held.omega(), 0.0, "{kind:?}");
        let mut free = Bench::new(kind, &setup);
        free.hold(2.2 * c, 0.5);
        close_rel(free.omega(), 0.1 * c / 1e-4 * 0.5, 1e-9, &format!("{kind:?}"));
    }
}

#[test]
fn a_geared_motor_settles_where_its_reduced_torque_balances_the_friction() {
    let (b, c, mu, u) = (2e-5, 1e-3, 0.2, 3.0);
    let Drive { motor_constant: k, resistance: r, .. } = THEORY;
    let exact = (k * (1.0 - mu) * u / r - c) / (b + k * k * (1.0 - mu) / r);
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_voltage(THEORY, &[("viscous", &[b]), ("coulomb", &[c]), ("gear-friction", &[mu])]));
        // 1/τ = 1.6/s: e^-48 after 30 s.
        bench.hold(u, 30.0);
        close_rel(bench.omega(), exact, 1e-9, &format!("{kind:?}"));
    }
}

/// A crank in free rotation keeps ½ J(θ) ω².
#[test]
fn free_rotor_with_varying_inertia_keeps_its_kinetic_energy() {
    let (j, a, n, phase, start) = (1e-4, 0.4, 2.0, 0.7, 12.0);
    let inertia = |theta: f64| 1.0 + a * (n * theta + phase).cos();
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("inertia-variation", &[a, n, phase])])).spin(start);
        for _ in 0..100 {
            bench.hold(0.0, 0.0107);
            let exact = start * (inertia(0.0) / inertia(bench.theta())).sqrt();
            // Rig: the midpoint rule errs by (n ω h)²/24 of the variation and drifts within 1 s; plant: (n ω h)⁴.
            close_rel(bench.omega(), exact, if kind == Kind::Rig { 4e-5 } else { 1e-9 }, &format!("{kind:?} at {}", bench.theta()));
        }
    }
}

#[test]
fn constant_torque_on_a_varying_inertia_becomes_kinetic_energy() {
    let (j, a, n, phase, torque) = (1e-4, 0.3, 1.0, 2.0, 2e-3);
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("inertia-variation", &[a, n, phase])]));
        for _ in 0..40 {
            bench.hold(torque, 0.02);
            let theta = bench.theta();
            let exact = (2.0 * torque * theta / (j * (1.0 + a * (n * theta + phase).cos()))).sqrt();
            close_rel(bench.omega(), exact, if kind == Kind::Rig { 3e-5 } else { 1e-8 }, &format!("{kind:?} at {theta}"));
        }
    }
}

/// Two terms add up; a stuck rotor with a varying inertia breaks away at its Coulomb torque.
#[test]
fn varying_inertias_add_up_and_do_not_change_the_breakaway() {
    for kind in BOTH {
        let effects: &[(&str, &[f64])] =
            &[("coulomb", &[1e-3]), ("inertia-variation", &[0.2, 1.0, 0.3]), ("inertia-variation#2", &[0.1, 2.0, 1.0])];
        let setup = Setup::by_torque(1e-4, effects).at(0.4);
        let mut held = Bench::new(kind, &setup);
        held.hold(0.999e-3, 0.1);
        assert_eq!(held.omega(), 0.0, "{kind:?}");
        let mut free = Bench::new(kind, &setup);
        free.hold(3e-3, 1e-3);
        let inertia = 1e-4 * (1.0 + 0.2 * (0.4 + 0.3_f64).cos() + 0.1 * (0.8 + 1.0_f64).cos());
        close_rel(free.omega(), 2e-3 / inertia * 1e-3, 1e-5, &format!("{kind:?}"));
    }
}

/// The inertia of a crank behind a shaft varies on the platform's side. Without friction and damping the energy is constant.
#[test]
fn crank_behind_a_shaft_conserves_energy_and_both_integrators_agree() {
    let effects: &[(&str, &[f64])] = &[("compliance", &[0.05, 0.0, 0.4]), ("inertia-variation", &[0.3, 2.0, 0.5])];
    let setup = Setup::by_torque(1e-4, effects);
    let (mut plant, mut rig) = (Bench::new(Kind::Plant, &setup).spin(15.0), Bench::new(Kind::Rig, &setup).spin(15.0));
    let before = plant.plant().mechanical_energy_J();
    for _ in 0..100 {
        plant.hold(0.0, 0.01);
        rig.hold(0.0, 0.01);
        close_rel(plant.plant().mechanical_energy_J(), before, 1e-6, "energy");
        close(rig.omega(), plant.omega(), 0.02, "rate");
    }
}

#[test]
fn ripple_of_any_order_is_a_potential_over_the_angle() {
    let (j, a, order, phase, start) = (1e-4, 2e-3, 3.37, 0.4, 20.0);
    let potential = |theta: f64| a / order * (order * theta + phase).cos();
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("gear-ripple", &[a, order, phase])])).spin(start);
        for _ in 0..100 {
            bench.hold(0.0, 0.0093);
            let exact = (start * start - 2.0 / j * (potential(bench.theta()) - potential(0.0))).sqrt();
            // Rig: (ρ ω h)²/24 = 2e-4 of a ripple of 0.6 rad/s.
            close(bench.omega(), exact, if kind == Kind::Rig { 3e-4 } else { 1e-8 }, &format!("{kind:?} at {}", bench.theta()));
        }
    }
}

/// Motion that is prescribed needs the same torque as a simulated one: see `drive-rig/src/demand.rs`.
#[test]
fn prescribed_motion_needs_the_torque_of_gear_and_crank() {
    let (j, mu, a, n, phase) = (1e-4, 0.2, 0.3, 2.0, 0.1);
    let list = [("gear-friction".to_owned(), vec![mu]), ("inertia-variation".to_owned(), vec![a, n, phase])];
    let rig = common::rig(Drive { inertia: j, motor_constant: 0.02, resistance: 2.0 }, drive_rig::Input::Torque, &list);
    let (theta, omega) = (0.8_f64, 10.0);
    for alpha in [300.0, -300.0] {
        let row = drive_rig::RowInput { theta: Some((theta, theta)), ..common::span(0.0, ROW_S, 0.0, None) };
        let free = j * (1.0 + a * (n * theta + phase).cos()) * alpha - 0.5 * j * a * n * (n * theta + phase).sin() * omega * omega;
        // While it drives, T (1 − μ) is left; while it brakes, T (1 + μ).
        let exact = if free > 0.0 { free / (1.0 - mu) } else { free / (1.0 + mu) };
        close_rel(rig.demand(&row, omega, alpha, 1.0, 0.0).torque, exact, 1e-12, "torque");
    }
}
