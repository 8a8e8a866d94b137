//! Effects that depend on the time against closed forms, in both integrators: a torque at a fixed frequency, friction that drifts.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{BOTH, Bench, Kind, Setup, close, close_rel};
use std::f64::consts::TAU;

#[test]
fn timed_torque_integrates_to_a_cosine() {
    let (j, a, f, phase, start) = (1e-4, 1e-3, 3.3, 0.6, 30.0);
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("timed-torque", &[a, f, phase])])).spin(start);
        for n in 1..=50 {
            bench.hold(0.0, 0.017);
            let w = TAU * f;
            let exact = start + a / (j * w) * (phase.cos() - (w * f64::from(n) * 0.017 + phase).cos());
            // Rig: (ω h)²/24 = 2e-5 of 0.5 rad/s.
            close(bench.omega(), exact, if kind == Kind::Rig { 2e-5 } else { 1e-9 }, &format!("{kind:?} after {n}"));
        }
    }
}

#[test]
fn drifting_coulomb_torque_integrates_to_an_exponential() {
    let (j, c, a, tau, start) = (1e-4, 1e-3, 0.8, 0.7, 60.0);
    for kind in BOTH {
        let setup = Setup::by_torque(j, &[("coulomb", &[c]), ("friction-drift", &[a, 0.0, tau])]);
        let mut bench = Bench::new(kind, &setup).spin(start);
        bench.hold(0.0, 1.5);
        let exact = start - c / j * (1.5 + a * tau * (1.0 - (-1.5 / tau).exp()));
        // Rig: (h/τ)²/24 of the drift.
        close_rel(bench.omega(), exact, if kind == Kind::Rig { 1e-7 } else { 1e-10 }, &format!("{kind:?}"));
    }
}

#[test]
fn drifting_viscosity_integrates_to_a_double_exponential() {
    let (j, b, d, tau, start) = (1e-4, 2e-4, -0.6, 0.5, 40.0);
    for kind in BOTH {
        let setup = Setup::by_torque(j, &[("viscous", &[b]), ("friction-drift", &[0.0, d, tau])]);
        let mut bench = Bench::new(kind, &setup).spin(start);
        bench.hold(0.0, 1.2);
        let exact = start * (-b / j * (1.2 + d * tau * (1.0 - (-1.2 / tau).exp()))).exp();
        // Rig: (b h/J)²/6 per unit of b t/J.
        close_rel(bench.omega(), exact, if kind == Kind::Rig { 3e-6 } else { 1e-10 }, &format!("{kind:?}"));
    }
}

/// Friction does not drive, whatever a fit proposes for its excess.
#[test]
fn friction_never_falls_below_zero() {
    for kind in BOTH {
        let setup = Setup::by_torque(1e-4, &[("coulomb", &[1e-3]), ("viscous", &[1e-4]), ("friction-drift", &[-1.0, -1.0, 1e6])]);
        let mut bench = Bench::new(kind, &setup).spin(10.0);
        bench.hold(0.0, 1.0);
        // Of the friction a millionth is left after a second.
        close(bench.omega(), 10.0, 2e-5, &format!("{kind:?}"));
    }
}

/// In a log whose time does not begin at zero the laws count from its first row.
#[test]
fn time_counts_from_the_first_row_of_the_log() {
    let effects = [
        ("coulomb".to_owned(), vec![1e-3]),
        ("friction-drift".to_owned(), vec![0.9, 0.0, 0.3]),
        ("timed-torque".to_owned(), vec![1e-3, 2.0, 0.3]),
    ];
    let drive = common::Drive { inertia: 1e-4, motor_constant: 0.02, resistance: 2.0 };
    let at = |begin_s: f64| {
        let rig = common::rig(drive, drive_rig::Input::Torque, &effects);
        let mut state = drive_rig::DriveState::turning(30.0, 0.0);
        for n in 0..1000 {
            let row = drive_rig::RowInput { start_s: begin_s, ..common::span(begin_s + f64::from(n) * 1e-3, 1e-3, 0.0, None) };
            rig.advance(&mut state, &row);
        }
        state.omega
    };
    close(at(1.6e6), at(0.0), 1e-6, "rate");
}
