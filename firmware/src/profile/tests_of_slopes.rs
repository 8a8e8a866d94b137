//! Slopes, plateaus and whole turns: bounds, limits and areas, for all valid parameters.

use core::f64::consts::TAU;

use super::slope::{Slope, SlopeLimits};
use super::*;
use crate::board::Hardware;
use crate::speed_loop::{ONE, Segment};
use proptest::prelude::*;

const KINDS: [ProfileKind; 4] = [ProfileKind::Trapezoid, ProfileKind::SCurve, ProfileKind::Alternating, ProfileKind::Abba];

fn config(kind: ProfileKind, amplitude: f64, acceleration: f64, jerk: f64) -> ProfileConfig {
    ProfileConfig { acceleration, jerk, ..ProfileConfig::new(kind, amplitude, 0) }
}

fn values(config: &ProfileConfig, count: usize) -> Vec<f64> {
    let mut profile = Profile::new(config).unwrap();
    (0..count).map(|_| profile.next_value()).collect()
}

/// The greatest first and second difference, per second and per second².
fn differences(x: &[f64]) -> (f64, f64) {
    let first = x.windows(2).map(|x| (x[1] - x[0]).abs() * 1e3).fold(0.0, f64::max);
    let second = x.windows(3).map(|x| (x[2] - 2.0 * x[1] + x[0]).abs() * 1e6).fold(0.0, f64::max);
    (first, second)
}

proptest! {
    #[test]
    fn plateaus_stay_within_their_bounds_and_limits(
        which in 0..4_usize, amplitude in -40.0..40.0_f64, offset in -5.0..5.0_f64,
        acceleration in 0.5..500.0_f64, jerk in 1.0..1e5_f64, dwell_s in 1e-3..0.5_f64, cycles in 0..4_u32,
    ) {
        let kind = KINDS[which];
        let config = ProfileConfig { offset, dwell_s, cycles, ..config(kind, amplitude, acceleration, jerk) };
        let x = values(&config, 8_000);
        prop_assert_eq!(x[0], offset);
        prop_assert!(x.iter().all(|x| (x - offset).abs() <= amplitude.abs() * (1.0 + 1e-12)));
        let (first, second) = differences(&x);
        // Rounding of a value of 40 to 2⁻⁵³, times 1e3 and 1e6; a slope may end 1e-12 s early.
        prop_assert!(first <= acceleration * (1.0 + 2e-9) + 1e-10, "{} of {}", first, acceleration);
        let jerk = if kind == ProfileKind::Trapezoid { f64::INFINITY } else { jerk };
        prop_assert!(second <= jerk + 1e-7, "{} of {}", second, jerk);
    }

    #[test]
    fn a_slope_is_as_fast_as_its_limits_allow(rise in 0.01..100.0_f64, acceleration in 0.5..500.0_f64, jerk in 1.0..1e5_f64) {
        let limits = config(ProfileKind::SCurve, 1.0, acceleration, jerk);
        let slope = Slope::new(-0.25 * rise, 0.75 * rise, &SlopeLimits::rounded(&limits));
        // Of the shortest rise from rest to rest: no acceleration limit 2 √(Δ/j), no jerk limit Δ/a; both together their sum where a is
        // reached.
        let reached = rise * jerk >= acceleration * acceleration;
        let shortest = if reached { rise / acceleration + acceleration / jerk } else { 2.0 * (rise / jerk).sqrt() };
        prop_assert!((slope.length_s / shortest - 1.0).abs() < 1e-12);
        prop_assert_eq!((slope.level(0.0), slope.level(slope.length_s)), (-0.25 * rise, 0.75 * rise));
        prop_assert!((slope.level(0.5 * slope.length_s) - 0.25 * rise).abs() < 1e-12 * rise, "the middle of the rise in the middle");
    }

    #[test]
    fn the_area_of_a_slope_is_the_integral_of_its_levels(to in -50.0..50.0_f64, acceleration in 0.5..500.0_f64, jerk in 1.0..1e5_f64) {
        let slope = Slope::new(0.0, to, &SlopeLimits::rounded(&config(ProfileKind::SCurve, 1.0, acceleration, jerk)));
        let end_s = 1.3 * slope.length_s;
        let step_s = end_s / 4000.0;
        let mut sum = 0.0;
        for n in 0..4000 {
            let [a, m, b] = [0.0, 0.5, 1.0].map(|part| slope.level((f64::from(n) + part) * step_s));
            sum += (a + 4.0 * m + b) / 6.0 * step_s;
            // Simpson's rule is exact within a segment and off by at most j h³ at a corner.
            let off = (slope.area(f64::from(n + 1) * step_s) - sum).abs();
            prop_assert!(off <= 1e-9 + 6.0 * jerk * step_s * step_s * step_s, "{} at {}", off, n);
        }
    }

    #[test]
    fn turns_are_whole_and_keep_every_limit(
        rate in prop_oneof![0.2..1.0_f64, 1.0..35.0], back in any::<bool>(), acceleration in 1.0..500.0_f64, jerk in 1.0..1e5_f64, turns in 1..20_u32,
    ) {
        let amplitude = if back { -rate } else { rate };
        let config = ProfileConfig { turns, ..config(ProfileKind::Turns, amplitude, acceleration, jerk) };
        let Ok(mut profile) = Profile::new(&config) else {
            // The rate is too high for the turns: the error has the greatest rate, which is accepted.
            let error = Profile::new(&config).unwrap_err();
            let ConfigError::OutOfRange("amplitude", _, _, greatest) = error else { panic!("{error}") };
            prop_assert!(greatest < rate);
            let held = ProfileConfig { amplitude: greatest, ..config };
            prop_assert!(Profile::new(&held).is_ok());
            return Ok(());
        };
        let mut x = vec![profile.next_value()];
        while x.len() < 3 || x[x.len() - 1] != 0.0 || x.len() < 100 {
            x.push(profile.next_value());
        }
        prop_assert!((0..1000).all(|_| profile.next_value() == 0.0), "it is over");
        let angle_rad = x.iter().sum::<f64>() * 1e-3;
        prop_assert!((angle_rad.abs() - f64::from(turns) * TAU).abs() < 1e-7, "{} turns", angle_rad / TAU);
        prop_assert!(x.iter().all(|x| x.abs() <= rate * (1.0 + 1e-9) && x * amplitude >= -1e-9));
        let (first, second) = differences(&x);
        // Areas of up to 126 rad to 2⁻⁵³, times 1e3 for the rate, 1e6 and 1e9 for its differences.
        prop_assert!(first <= acceleration + 1e-6, "{} of {}", first, acceleration);
        prop_assert!(second <= jerk + 1e-3, "{} of {}", second, jerk);
    }
}

#[test]
fn a_dwell_excludes_the_slopes_and_the_last_cycle_ends_at_zero() {
    let config = ProfileConfig { dwell_s: 0.3, cycles: 2, ..config(ProfileKind::Abba, 2.0, 20.0, 400.0) };
    let x = values(&config, 4_000);
    // A step of 2 at 20 per s with corners of 50 ms takes 150 ms, a step of 4 takes 250 ms. The ends of a slope are close to the level.
    let levels: Vec<(f64, usize)> = x.chunk_by(|a, b| a == b).filter(|run| run.len() > 1).map(|run| (run[0], run.len())).collect();
    let short: Vec<f64> = levels.iter().map(|(level, _)| *level).collect();
    assert_eq!(short, [2.0, -2.0, 2.0, -2.0, 2.0, 0.0]);
    let lengths: Vec<usize> = levels.iter().map(|(_, ms)| *ms).collect();
    assert_eq!(lengths[..5], [301, 601, 601, 601, 301], "A, BB, A and A, BB, A; with the sample that ends it");
    assert!(x[3_701..].iter().all(|x| *x == 0.0));
}

#[test]
fn a_trapezoid_has_one_sign_and_alternating_both() {
    let signs = |kind| {
        let config = ProfileConfig { dwell_s: 0.1, cycles: 3, ..config(kind, 1.0, 20.0, 1e4) };
        let x = values(&config, 4_000);
        x.chunk_by(|a, b| a == b).filter(|run| run.len() > 90).map(|run| run[0]).collect::<Vec<f64>>()
    };
    let one_side = [1.0, 0.0, 1.0, 0.0, 1.0, 0.0];
    assert_eq!(signs(ProfileKind::Trapezoid), one_side);
    assert_eq!(signs(ProfileKind::SCurve), one_side);
    assert_eq!(signs(ProfileKind::Alternating), [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 0.0]);
}

#[test]
fn ten_turns_have_exactly_the_commanded_rate() {
    let rate = 100_f64.to_radians();
    let x = values(&ProfileConfig::new(ProfileKind::Turns, rate, 0), 40_000);
    let plateau = x.iter().filter(|x| **x == rate).count();
    // 36 s at the rate without slopes; each slope takes 2 √(1.745 / 400) = 0.1321 s at half the rate on average.
    assert!((35_866..=35_868).contains(&plateau), "{plateau}");
}

#[test]
fn the_command_of_ten_turns_is_exact_to_a_hundredth_of_a_count() {
    let hardware = Hardware::default();
    for rate in [0.5, 3.3, -12.0] {
        let mut profile = Profile::new(&ProfileConfig::new(ProfileKind::Turns, rate, 0)).unwrap();
        let (mut position, mut value) = (0_i64, profile.next_value());
        for ms in 0..140_000 {
            let following = profile.next_value();
            let segment = Segment::rate(&hardware, ms * 10, 10, value, following);
            // The ramp's exact trapezoid over each tick.
            position += (0..10).map(|n| segment.at(ms * 10 + n) + segment.slope / 2).sum::<i64>();
            value = following;
        }
        let counts = position as f64 / ONE;
        assert!((counts.abs() - 10.0 * hardware.counts_per_turn).abs() < 0.01, "{rate}: {counts}");
    }
}
