//! A voltage that moves within a row: the rig with the course of the voltage, against the rig on a hundred rows of constant voltage.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{ROW_S, THEORY, span};
use drive_rig::{DriveState, Input, Rig, RowInput};

const PARTS: u32 = 100;

/// Largest errors of rate (rad/s), angle (rad) and mean current (A) over ten rows, relative to those without the moment.
fn errors_with_the_course(effects: &[(&str, &[f64])]) -> [f64; 3] {
    let list: Vec<(String, Vec<f64>)> = effects.iter().map(|(id, p)| ((*id).to_owned(), p.to_vec())).collect();
    let rig: Rig<f64> = common::rig(THEORY, Input::Voltage, &list);
    let error_of = |with_course: bool| {
        let (mut fine, mut coarse) = (DriveState::turning(20.0, 0.3), DriveState::turning(20.0, 0.3));
        let mut worst = [0.0_f64; 3];
        for n in 0..10 {
            let (middle, slope) = (3.0 + 0.4 * (f64::from(n) * 1.7).sin(), 0.8 * (f64::from(n) * 2.3).cos());
            let (second, third) = (0.3 * (f64::from(n) * 1.1).sin(), 0.2 * (f64::from(n) * 0.7).cos());
            let begin_s = f64::from(n) * ROW_S;
            let mut mean = 0.0;
            for k in 0..PARTS {
                // Legendre polynomials at the middle of the part.
                let x = (2.0 * f64::from(k) + 1.0) / f64::from(PARTS) - 1.0;
                let volt = middle + slope * x + second * 0.5 * (3.0 * x * x - 1.0) + third * 0.5 * (5.0 * x * x - 3.0) * x;
                let part = span(begin_s + f64::from(k) * ROW_S / f64::from(PARTS), ROW_S / f64::from(PARTS), volt, Some(25.0));
                mean += rig.advance(&mut fine, &part) / f64::from(PARTS);
            }
            let row = RowInput {
                voltage_course_V: if with_course { [slope, second, third] } else { [0.0; 3] },
                ..span(begin_s, ROW_S, middle, Some(25.0))
            };
            let current = rig.advance(&mut coarse, &row);
            let errors = [coarse.omega - fine.omega, coarse.theta - fine.theta, current - mean];
            worst = std::array::from_fn(|k| worst[k].max(errors[k].abs()));
        }
        worst
    };
    let (with, without) = (error_of(true), error_of(false));
    std::array::from_fn(|k| with[k] / without[k])
}

#[test]
fn course_removes_nearly_all_of_the_error_with_an_inductive_winding() {
    for inductance_H in [0.5e-4, 2.38e-4, 2e-3] {
        let errors = errors_with_the_course(&[("inductance", &[inductance_H]), ("viscous", &[2e-5]), ("coulomb", &[9e-4])]);
        assert!(errors[0] < 0.05 && errors[2] < 0.02, "{inductance_H} H: {errors:?}");
    }
}

#[test]
fn course_moves_the_steps_of_a_rig_with_a_shaft() {
    let errors = errors_with_the_course(&[("inductance", &[2.38e-4]), ("compliance", &[0.3, 5.0, 1e-5])]);
    assert!(errors[0] < 0.5 && errors[2] < 0.1, "{errors:?}");
}
