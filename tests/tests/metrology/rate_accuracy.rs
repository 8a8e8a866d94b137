//! Accuracy of the stand's rate: a sample of docs/rate-accuracy.md, whose table `examples/rate_accuracy.rs` prints.
#![allow(clippy::unwrap_used)]

use std::sync::LazyLock;

use hal_sim::plant::Stand;
use rayon::prelude::*;
use stand_tests::rate_accuracy::{accuracy, calibrated_stand, cogging_stand, step};

/// The stand without and with compensation from its own calibration.
static STANDS: LazyLock<[(&str, Stand); 2]> = LazyLock::new(|| {
    let bare = cogging_stand();
    let compensated = calibrated_stand(&bare, 1);
    [("no compensation", bare), ("own calibration", compensated)]
});

#[test]
fn ten_turns_are_within_1_ppm_of_the_crystal_and_each_turn_within_20_ppm() {
    STANDS.par_iter().for_each(|(name, stand)| {
        for rate_deg_s in [90.0, 360.0, 720.0] {
            let found = accuracy(stand, rate_deg_s, 1).unwrap();
            println!("{name}: {found:?}");
            assert!(found.mean.abs() <= 1e-6, "{name}: {found:?}");
            assert!(found.turn <= 20e-6, "{name}: {found:?}");
        }
    });
}

#[test]
fn a_step_of_100_deg_s_is_settled_in_0_3_s_with_less_than_5_percent_of_overshoot() {
    for (name, stand) in STANDS.iter() {
        let found = step(stand, 100.0, 1).unwrap();
        println!("{name}: {found:?}");
        assert!(found.settled_s <= 0.3 && found.overshoot < 0.05, "{name}: {found:?}");
    }
}

#[test]
fn compensation_makes_the_turn_uniform() {
    let [bare, compensated] = [0, 1].map(|k| accuracy(&STANDS[k].1, 90.0, 1).unwrap());
    println!("{bare:?} {compensated:?}");
    assert!(compensated.ten_degrees < 0.1 * bare.ten_degrees && compensated.one_degree < 0.1 * bare.one_degree, "{bare:?} {compensated:?}");
}
