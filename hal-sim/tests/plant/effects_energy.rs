//! Friction never adds energy: an undriven rotor only slows down, in the rig and in the plant.
//!
//! Over drawn parameters, rates and steps; the drive is open (no torque), for the brush drop shorted (0 V).
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{BOTH, Bench, Draw, Drive, Kind, Setup};

/// Runs 400 rows and asserts that the energy never rises by more than `slack` of its initial value.
fn never_rises(kind: Kind, setup: &Setup, omega: f64, row_s: f64, slack: f64, energy: impl Fn(&Bench) -> f64) {
    let mut bench = Bench::new(kind, setup).spin(omega);
    bench.tick_s = bench.tick_s.min(row_s);
    let first = energy(&bench);
    let mut before = first;
    for n in 0..400 {
        bench.hold(0.0, row_s);
        let now = energy(&bench);
        assert!(
            now.is_finite() && now <= before + slack * first,
            "{kind:?} row {n} of {row_s} s from {omega} rad/s: {before} {now} {setup:?}"
        );
        before = now;
    }
}

fn kinetic(setup: &Setup) -> impl Fn(&Bench) -> f64 + use<> {
    let inertia = setup.drive.inertia;
    move |bench| 0.5 * inertia * bench.omega().powi(2)
}

fn energy_of(kind: Kind, setup: &Setup) -> Box<dyn Fn(&Bench) -> f64> {
    if kind == Kind::Plant { Box::new(|bench: &Bench| bench.plant().mechanical_energy_J()) } else { Box::new(kinetic(setup)) }
}

#[test]
fn friction_never_adds_energy() {
    let mut draw = Draw(11);
    for _ in 0..60 {
        let b = draw.log(1e-7, 1e-3);
        let c = draw.log(1e-6, 1e-2);
        let (s, v) = (draw.log(1e-6, 1e-2), draw.log(0.1, 10.0));
        let q = draw.log(1e-8, 1e-5);
        // Only as far as the sum opposes either direction: |d| ≤ c, |e| ≤ b.
        let (d, e) = (draw.even(-1.0, 1.0) * c, draw.even(-1.0, 1.0) * b);
        let lists: [&[(&str, &[f64])]; 5] = [
            &[("viscous", &[b])],
            &[("coulomb", &[c])],
            &[("coulomb", &[c]), ("stribeck", &[s, v])],
            &[("quadratic-drag", &[q])],
            &[("viscous", &[b]), ("coulomb", &[c]), ("asymmetric-friction", &[d, e])],
        ];
        let (inertia, omega, row_s) = (draw.log(5e-5, 1e-3), draw.signed_log(0.01, 50.0), draw.log(1e-4, 5e-3));
        for list in lists {
            for kind in BOTH {
                let setup = Setup::by_torque(inertia, list);
                // Rounding of a rate near rest, in the plant's regula falsi 1e-12 rad/s.
                never_rises(kind, &setup, omega, row_s, 1e-15, energy_of(kind, &setup));
            }
        }
    }
}

#[test]
fn a_rotor_that_friction_stopped_never_moves_again() {
    let mut draw = Draw(12);
    for _ in 0..100 {
        let list: &[(&str, &[f64])] =
            &[("viscous", &[draw.log(1e-6, 1e-3)]), ("coulomb", &[draw.log(1e-3, 1e-2)]), ("stribeck", &[1e-3, 1.0])];
        for kind in BOTH {
            let mut bench = Bench::new(kind, &Setup::by_torque(2.5e-4, list)).spin(draw.signed_log(0.01, 1.0));
            bench.hold(0.0, 0.3);
            let theta = bench.theta();
            bench.hold(0.0, 0.3);
            assert_eq!((bench.omega(), bench.theta()), (0.0, theta), "{kind:?}");
        }
    }
}

#[test]
fn a_bristle_returns_no_more_energy_than_it_stored() {
    let mut draw = Draw(13);
    for _ in 0..60 {
        let (c, sigma) = (draw.log(1e-4, 5e-3), draw.log(1e-2, 2.0));
        let (inertia, omega) = (draw.log(1e-4, 1e-3), draw.signed_log(0.01, 20.0));
        let setup = Setup::by_torque(inertia, &[("coulomb", &[c]), ("presliding", &[sigma])]);
        for kind in BOTH {
            let with_bristle = move |bench: &Bench| match kind {
                Kind::Rig => 0.5 * inertia * bench.omega().powi(2) + 0.5 * sigma * bench.state().bristle.powi(2),
                Kind::Plant => bench.plant().mechanical_energy_J(),
            };
            // The rig's midpoint rule increases an oscillation on the bristle by (w h)⁴/4 ≤ 2.5e-5 of its energy a step where Dahl's loss
            // is less.
            let slack = if kind == Kind::Rig { 2.5e-5 } else { 1e-12 };
            never_rises(kind, &setup, omega, 1e-3, slack, with_bristle);
        }
    }
}

#[test]
fn brushes_never_add_energy() {
    let mut draw = Draw(14);
    for _ in 0..60 {
        let list: &[(&str, &[f64])] = &[("brush-drop", &[draw.log(0.01, 1.0)])];
        let drive = Drive { inertia: draw.log(1e-4, 1e-3), motor_constant: draw.log(0.01, 0.05), resistance: draw.log(1.0, 10.0) };
        let setup = Setup::by_voltage(drive, list);
        for kind in BOTH {
            never_rises(kind, &setup, draw.signed_log(0.1, 60.0), draw.log(1e-4, 5e-3), 1e-15, energy_of(kind, &setup));
        }
    }
}

#[test]
fn a_shaft_with_play_never_adds_energy() {
    let mut draw = Draw(15);
    for _ in 0..20 {
        let (k, c, gap) = (draw.log(0.3, 8.0), draw.log(1e-4, 3e-2), draw.log(1e-3, 0.06));
        for list in [
            &[("coulomb", &[2e-3][..]), ("compliance", &[k, c, 0.3][..])],
            &[("coulomb", &[2e-3][..]), ("backlash", &[gap, k, c, 0.3][..])],
        ] {
            let setup = Setup::by_torque(2.5e-4, list);
            let energy = |bench: &Bench| bench.plant().mechanical_energy_J();
            // A contact that ends while the damper still pulls stores nothing; Runge-Kutta error, 0.1⁶/72 a step.
            never_rises(Kind::Plant, &setup, draw.signed_log(0.1, 20.0), 1e-3, 1e-8, energy);
        }
    }
}
