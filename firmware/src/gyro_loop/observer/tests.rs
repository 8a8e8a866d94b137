//! The observer's arithmetic against docs/theory.md §1.6, and the refusals of bad parameters.

use super::*;
use crate::config::ConfigError;

#[allow(clippy::excessive_precision)]
#[path = "vectors.rs"]
mod vectors;
use vectors::{GAIN_5, GAIN_6, GAIN_7, GAMMA_5, GAMMA_6, GAMMA_7, PHI_5, PHI_6, PHI_7};

const MOMENT_N_M: f64 = 1e-5;

/// The plant of §1.6 (alpha = 1 mrad at first, a constant moment) and an observer that starts at zero: their states after `steps`.
fn run<T: Real, const N: usize>(design: &Design<T, N>, steps: usize) -> ([f64; 6], [f64; N]) {
    let mut plant = [1e-3, 0.0, 0.0, 0.0, 0.0, 0.0];
    let mut observer = Observer::at(T::ZERO);
    for _ in 0..steps {
        observer.step(design, T::from_f64(plant[0]), T::ZERO);
        let before = plant;
        for (k, next) in plant.iter_mut().enumerate() {
            *next = (0..6).map(|j| PHI_6[k][j] * before[j]).sum::<f64>() + GAMMA_6[k] * MOMENT_N_M;
        }
    }
    (plant, observer.estimate().map(Real::to_f64))
}

fn near(value: f64, expected: f64, relative: f64, least: f64) {
    assert!((value - expected).abs() <= relative * expected.abs() + least, "{value:e} is not {expected:e}");
}

/// Table of docs/theory.md §1.6; tolerance in double precision 1e-5, at n = 500, where the errors cross zero, 1e-3.
#[test]
fn discrete_observers_match_the_test_vectors() {
    let fixed = Design::<f64, 6>::new(&PHI_6, &GAMMA_6, &GAIN_6).unwrap();
    let astatic = Design::<f64, 7>::new(&PHI_7, &GAMMA_7, &GAIN_7).unwrap();
    for (steps, plant, of_fixed, of_astatic, moment, tolerance) in [
        (300, [1.00293634e-3, -2.73637593e-5], [-8.481336e-5, -7.962803e-3], [6.491505e-5, 9.828458e-3], -7.919037e-3, 1e-5),
        (500, [1.00588462e-3, 5.09418627e-5], [9.700624e-8, 1.476126e-5], [2.425026e-7, 3.204966e-5], -7.695208e-6, 1e-3),
        (2000, [1.09404074e-3, 1.21501095e-4], [1.890740e-7, 2.246645e-5], [0.0, 0.0], 1e-5, 1e-5),
    ] {
        let (x, static_hat) = run(&fixed, steps);
        let (_, astatic_hat) = run(&astatic, steps);
        for k in 0..2 {
            near(x[k], plant[k], 1e-8, 0.0);
            near(x[k] - static_hat[k], of_fixed[k], tolerance, 0.0);
            // Rounding is left of 0: 300 times as much in the rate, by the gain.
            near(x[k] - astatic_hat[k], of_astatic[k], tolerance, [1e-15, 3e-13][k]);
        }
        near(astatic_hat[6], moment, tolerance, 0.0);
    }
}

/// The statement of docs/observers.md on single precision.
#[test]
fn single_precision_suffices_for_the_rate_observer_only() {
    let (x, single) = run(&Design::<f32, 7>::new(&PHI_7, &GAMMA_7, &GAIN_7).unwrap(), 2000);
    let (_, double) = run(&Design::<f64, 7>::new(&PHI_7, &GAMMA_7, &GAIN_7).unwrap(), 2000);
    let off = |hat: &[f64; 7]| ((hat[6] / MOMENT_N_M - 1.0).abs(), (x[1] - hat[1]).abs());
    let (off_single, off_double) = (off(&single), off(&double));
    assert!(
        off_single.0 > 1e-3 && off_single.0 < 2e-2,
        "0.7 % in docs/theory.md §1.6, depending on the sequence of the sums: {off_single:?}"
    );
    assert!(off_double.0 < 1e-8 && off_double.1 < 1e-12, "{off_double:?}");

    // A slow oscillation of 1 mrad and a constant moment.
    let design = Design::<f32, 5>::new(&PHI_5, &GAMMA_5, &GAIN_5).unwrap();
    let mut plant = [1e-3, 0.0, 0.0, 0.0, MOMENT_N_M];
    let mut observer = Observer::at(1e-3_f32);
    let (mut rate, mut off) = (0.0_f64, 0.0_f64);
    for step in 0..4000 {
        observer.step(&design, plant[0] as f32, 0.0);
        let before = plant;
        for (k, next) in plant.iter_mut().enumerate() {
            *next = (0..5).map(|j| PHI_5[k][j] * before[j]).sum();
        }
        if step > 1000 {
            rate = rate.max(plant[1].abs());
            off = off.max((plant[1] - f64::from(observer.estimate()[1])).abs());
        }
    }
    assert!(off < 1e-2 * rate, "{off:e} of {rate:e}");
}

#[test]
fn bad_parameters_are_refused_by_name() {
    let with = |gain: [f64; 7]| Design::<f64, 7>::new(&PHI_7, &GAMMA_7, &gain).map(drop).map_err(|wrong| wrong.parameter());
    assert_eq!(with(GAIN_7), Ok(()));
    assert_eq!(with([0.0; 7]), Err("gain"), "the disturbance alone keeps a pole at 1");
    assert_eq!(with(GAIN_7.map(|gain| -gain)), Err("gain"));
    let mut other = GAIN_7;
    other[6] = -other[6];
    assert_eq!(with(other), Err("gain"), "an integral channel of the wrong sign");
    other[6] = f64::NAN;
    assert_eq!(with(other), Err("gain"));
    other[6] = 1e300;
    assert_eq!(Design::<f32, 7>::new(&PHI_7, &GAMMA_7, &other).map(drop), Err(ConfigError::NonFinite("gain")));
    let mut phi = PHI_7;
    phi[3][2] = f64::INFINITY;
    assert_eq!(Design::<f64, 7>::new(&phi, &GAMMA_7, &GAIN_7).map(drop), Err(ConfigError::NonFinite("phi")));
}

#[test]
fn stability_depends_on_the_poles_alone() {
    // A chain of seven equal poles, whose transients grow by orders of magnitude first.
    let chain = |pole: f64| {
        let mut phi = [[0.0; 7]; 7];
        for k in 0..7 {
            phi[k][k] = pole;
            if k > 0 {
                phi[k - 1][k] = 100.0;
            }
        }
        Design::<f64, 7>::new(&phi, &[0.0; 7], &[0.0; 7]).is_ok()
    };
    assert_eq!([0.0, 0.5, 0.95, 0.999, -0.999, 0.999_99].map(chain), [true; 6]);
    assert_eq!([1.0, -1.0, 1.001, 1e6].map(chain), [false; 4]);
}

#[test]
fn an_observer_that_starts_at_the_measured_angle_does_not_peak() {
    let design = Design::<f64, 7>::new(&PHI_7, &GAMMA_7, &GAIN_7).unwrap();
    let peak = |first: f64| {
        let mut observer = Observer::at(first);
        // A gyroscope at rest, 1e-2 rad from the sensor's zero.
        (0..500).fold(0.0_f64, |most, _| {
            observer.step(&design, 1e-2, 0.0);
            most.max(observer.estimate()[1].abs())
        })
    };
    // docs/theory.md §1.5: 19 rad/s from zero.
    assert!(peak(0.0) > 10.0 && peak(1e-2) < 0.1, "{} {}", peak(0.0), peak(1e-2));
}

#[test]
fn regulator_applies_its_gains_and_its_limit() {
    let regulator = |feed_forward: f64| Regulator::<f64, 7>::new(&[1e-2, 6.5e-2, 0.0, 0.0, 0.0, 0.0, feed_forward], 1e-3).unwrap();
    let estimate = [1e-3, 2e-3, 9.0, 9.0, 9.0, 9.0, 4e-5];
    near(regulator(0.0).moment(&estimate), -1.4e-4, 1e-12, 0.0);
    near(regulator(1.0).moment(&estimate), -1.8e-4, 1e-12, 0.0);
    assert_eq!(regulator(0.0).moment(&[1.0; 7]), -1e-3);
    assert_eq!(regulator(0.0).moment(&[f64::NAN; 7]), 0.0);
    assert!(Regulator::<f64, 7>::new(&[f64::NAN; 7], 1.0).is_err() && Regulator::<f64, 7>::new(&[0.0; 7], 0.0).is_err());
}

/// Set R with r₁ = 1e-2 N m, r₂ = 6.5e-2 N m s is stable (docs/theory.md §1.5); with r₂ of the other sign it has a pole at +85 1/s.
#[test]
fn the_closed_loop_of_plant_and_regulator_is_checked() {
    let mut phi = [[0.0; 7]; 7];
    let mut gamma = [0.0; 7];
    for (to, from) in phi.iter_mut().zip(&PHI_6) {
        to[..6].copy_from_slice(from);
    }
    gamma[..6].copy_from_slice(&GAMMA_6);
    for (rate_gain, is_stable) in [(6.5e-2, true), (-6.5e-2, false)] {
        let mut check = Stability::of_loop(&phi, &gamma, &[1e-2, rate_gain, 0.0, 0.0, 0.0, 0.0, 1.0], 6);
        let result = loop {
            if let Some(result) = check.step() {
                break result;
            }
        };
        assert_eq!(result.is_ok(), is_stable, "{rate_gain}");
    }
}

/// An observer that shows half of the rate, 60° late: its inverse response restores the mean product.
#[test]
fn the_response_of_the_observer_is_corrected() {
    let (period_s, step_s) = (0.5, 1e-3);
    let omega_rad_s = core::f64::consts::TAU / period_s;
    let late = core::f64::consts::FRAC_PI_3;
    // 1/R = 2 exp(j 60°).
    let inverse = [2.0 * late.cos(), 2.0 * late.sin() / omega_rad_s];
    let mut vibration = Vibration::new(10.0 * period_s, step_s, 2.0, 0.5).unwrap();
    vibration = vibration.with_response([inverse[0], inverse[1], inverse[0], inverse[1]], step_s).unwrap();
    let mut last = VibrationCorrection::default();
    for n in 0..6000 {
        let phase = omega_rad_s * step_s * f64::from(n);
        last = vibration.update(Motion {
            alpha_rad: 0.0,
            alpha_rate_rad_s: 0.5e-2 * (phase + 1.0 - late).sin(),
            beta_rate_rad_s: 1e-2 * (phase - late).cos(),
            gamma_rad: 1e-3 * phase.sin(),
        });
    }
    let expected = 2.0 * 0.5e-5 * 1f64.cos() - 0.5 * 0.5 * 2e-5 * omega_rad_s;
    near(last.vibration_rad, expected, 1e-4, 0.0);
    assert!(vibration.with_response([f64::NAN; 4], step_s).is_err());
}

/// An oscillation with a known mean product, sin(ωt + ψ) times sin ωt, and a period that is not a whole number of steps.
#[test]
fn vibration_is_averaged_over_whole_periods() {
    let (period_s, step_s) = (0.040_37, 1e-3);
    let mut vibration = Vibration::new(10.0 * period_s, step_s, 2.0, 0.5).unwrap();
    let omega_rad_s = core::f64::consts::TAU / period_s;
    let mut last = VibrationCorrection::default();
    for n in 0..2000 {
        let phase = omega_rad_s * step_s * f64::from(n);
        let motion = Motion {
            alpha_rad: 3e-3 + 0.1 * phase.sin(),
            alpha_rate_rad_s: 1e-2 * (phase + 1.0).sin(),
            beta_rate_rad_s: 2e-2 * phase.cos(),
            gamma_rad: 1e-3 * phase.sin(),
        };
        last = vibration.update(motion);
    }
    // ⟨α′ sin γ⟩ = ½ 1e-5 cos 1; ⟨β′ γ′⟩ = ½ 2e-2 · 1e-3 ω.
    let expected = 2.0 * 0.5e-5 * 1f64.cos() - 0.5 * 0.5 * 2e-5 * omega_rad_s;
    assert_eq!(last.means, 4);
    // Error of 40 samples per period: (2π/40)²/12 of a product; and the truncated end of a period in the mean.
    near(last.vibration_rad, expected, 5e-3, 0.0);
    near(last.alpha_rad, 3e-3, 0.0, 2e-5);
    for (bad, name) in [
        (Vibration::new(1e-3, step_s, 1.0, 0.0), "vibration window_s"),
        (Vibration::new(1.0, 0.0, 1.0, 0.0), "vibration step_s"),
        (Vibration::new(1.0, step_s, f64::NAN, 0.0), "vibration rate_gain_s"),
    ] {
        assert_eq!(bad.map(drop).map_err(|wrong| wrong.parameter()), Err(name));
    }
}
