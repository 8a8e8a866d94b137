//! How exactly the stand turns: a sample of docs/rate-accuracy.md, whose table `examples/rate_accuracy.rs` makes.
#![allow(clippy::unwrap_used)]

use std::sync::LazyLock;

use hal_sim::plant::Stand;
use rayon::prelude::*;
use stand_tests::rate_accuracy::{accuracy, cogging_stand, learnt, step};

/// With and without what the stand learnt of itself.
static STANDS: LazyLock<[(&str, Stand); 2]> = LazyLock::new(|| {
    let bare = cogging_stand();
    let learnt = learnt(&bare, 1);
    [("nothing learnt", bare), ("own calibration", learnt)]
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
fn what_was_learnt_makes_the_turn_even() {
    let [bare, learnt] = [0, 1].map(|k| accuracy(&STANDS[k].1, 90.0, 1).unwrap());
    println!("{bare:?} {learnt:?}");
    assert!(learnt.ten_degrees < 0.1 * bare.ten_degrees && learnt.one_degree < 0.1 * bare.one_degree, "{bare:?} {learnt:?}");
}
