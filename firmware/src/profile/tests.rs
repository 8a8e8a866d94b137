//! Levels, spectra and bounds of the profiles.

use super::*;

fn values(config: &ProfileConfig, count: usize) -> Vec<f64> {
    let mut profile = Profile::new(config).unwrap();
    (0..count).map(|_| profile.next_value()).collect()
}

#[test]
fn profiles_stay_within_bounds_and_repeat_for_equal_seeds() {
    for kind in ProfileKind::ALL {
        for seed in 0..20 {
            // Turns start and end at rest and have no offset.
            let offset = if kind == ProfileKind::Turns { 0.0 } else { 0.5 };
            let config = ProfileConfig { offset, ..ProfileConfig::new(kind, 3.0, seed) };
            let x = values(&config, 25_000);
            // The sine of micromath exceeds 1 by up to 1e-3.
            assert!(x.iter().all(|x| (x - offset).abs() <= 3.0 * 1.001), "{kind} {seed}");
            assert_eq!(x, values(&config, 25_000));
        }
    }
}

#[test]
fn random_profiles_differ_by_seed() {
    for kind in [ProfileKind::MultiStep, ProfileKind::Prbs] {
        let [a, b] = [1, 2].map(|seed| values(&ProfileConfig::new(kind, 1.0, seed), 10_000));
        assert_ne!(a, b, "{kind}");
    }
}

#[test]
fn multi_step_has_both_signs_and_the_mean_dwell() {
    for seed in 0..50 {
        let x = values(&ProfileConfig::new(ProfileKind::MultiStep, 2.0, seed), 30_000);
        assert!(x.iter().any(|x| *x > 0.4) && x.iter().any(|x| *x < -0.4) && x.contains(&0.0), "{seed}");
        let mut dwell = 1;
        for pair in x.windows(2) {
            if pair[0] == pair[1] {
                dwell += 1;
            } else {
                assert!((499..=1501).contains(&dwell), "{dwell}");
                dwell = 1;
            }
        }
    }
}

#[test]
fn prbs_has_the_period_and_balance_of_its_register() {
    let config = ProfileConfig { bit_s: 0.002, ..ProfileConfig::new(ProfileKind::Prbs, 1.0, 9) };
    let x = values(&config, 4 * 1023);
    let (first, second) = x.split_at(2 * 1023);
    assert_eq!(first, second);
    assert_eq!(first.iter().sum::<f64>(), 2.0, "512 ones, 511 zeros, 2 ms each");
}

#[test]
fn staircase_visits_every_level_in_both_directions() {
    let config = ProfileConfig { levels: 2, dwell_s: 0.01, ..ProfileConfig::new(ProfileKind::Staircase, 4.0, 0) };
    let x: Vec<f64> = values(&config, 100).into_iter().step_by(10).collect();
    assert_eq!(x, [0.0, 2.0, 4.0, 2.0, 0.0, -2.0, -4.0, -2.0, 0.0, 2.0]);
}

/// Amplitude of the line at `hz` over `x`, sampled at 1 kHz.
fn line(x: &[f64], hz: f64) -> f64 {
    let turn = core::f64::consts::TAU * hz / 1e3;
    let sum = |f: fn(f64) -> f64| x.iter().enumerate().map(|(n, x)| x * f(turn * n as f64)).sum::<f64>();
    2.0 / x.len() as f64 * sum(f64::cos).hypot(sum(f64::sin))
}

#[test]
fn multisine_has_twenty_equal_lines_and_reaches_its_amplitude() {
    let x = values(&ProfileConfig::new(ProfileKind::Multisine, 1.0, 0), 20_000);
    let lines: Vec<f64> = (1..=420).map(|n| line(&x, 0.05 * f64::from(n))).collect();
    let greatest = lines.iter().copied().fold(0.0, f64::max);
    let strong: Vec<f64> = lines.iter().copied().filter(|a| *a > 0.5 * greatest).collect();
    assert_eq!(strong.len(), 20, "{strong:?}");
    assert!(strong.iter().all(|a| (a / greatest - 1.0).abs() < 5e-3));
    assert!(lines.iter().filter(|a| **a < 0.5 * greatest).all(|a| *a < 5e-3 * greatest));
    assert!(lines[0] > 0.5 * greatest && lines[399] > 0.5 * greatest, "from 0.05 to 20 Hz");
    let peak = x.iter().copied().map(f64::abs).fold(0.0, f64::max);
    assert!((0.999..=1.001).contains(&peak), "{peak}");
    // The crest factor is √40 = 6.3 if all peaks coincide.
    let rms = (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
    assert!(peak / rms < 3.3, "{}", peak / rms);
}

#[test]
fn a_logarithmic_chirp_rises_by_a_constant_factor_and_repeats() {
    let config = ProfileConfig { from_Hz: 0.5, to_Hz: 8.0, sweep_s: 20.0, ..ProfileConfig::new(ProfileKind::Chirp, 1.0, 0) };
    let x = values(&config, 40_000);
    let ups: Vec<usize> = (1..x.len()).filter(|n| x[n - 1] < 0.0 && x[*n] >= 0.0).collect();
    // Factor 16 in 20 s. Two zero crossings give the frequency at their middle.
    for pair in ups.windows(2).filter(|p| p[1] < 19_900) {
        let seconds = (pair[0] + pair[1]) as f64 / 2e3;
        let expected = 0.5 * 16_f64.powf(seconds / 20.0);
        let hz = 1e3 / (pair[1] - pair[0]) as f64;
        assert!((hz / expected - 1.0).abs() < 0.03, "at {seconds} s: {hz} {expected}");
    }
    let first_up = ups.iter().find(|n| **n > 20_300).unwrap();
    assert!(*first_up > 20_500, "slow again");
}

#[test]
fn a_linear_chirp_rises_at_a_constant_rate_and_repeats() {
    let config = ProfileConfig { from_Hz: 1.0, to_Hz: 9.0, sweep_s: 20.0, ..ProfileConfig::new(ProfileKind::ChirpLinear, 1.0, 0) };
    let x = values(&config, 40_000);
    let ups: Vec<usize> = (1..x.len()).filter(|n| x[n - 1] < 0.0 && x[*n] >= 0.0).collect();
    for pair in ups.windows(2).filter(|p| p[1] < 19_900) {
        let seconds = (pair[0] + pair[1]) as f64 / 2e3;
        let hz = 1e3 / (pair[1] - pair[0]) as f64;
        // A crossing is known to a millisecond.
        assert!((hz / (1.0 + 0.4 * seconds) - 1.0).abs() < 1.2e-3 * hz + 1e-3, "at {seconds} s: {hz}");
    }
    let of_the_first = ups.iter().filter(|n| **n < 20_000).count() as f64;
    assert!((of_the_first - 100.0).abs() <= 1.0, "the mean frequency is the middle: {of_the_first}");
    assert!(*ups.iter().find(|n| **n > 20_200).unwrap() > 20_700, "slow again");
}

#[test]
fn a_sine_has_no_harmonics() {
    let config = ProfileConfig { frequency_Hz: 2.0, ..ProfileConfig::new(ProfileKind::Sine, 3.0, 0) };
    let x = values(&config, 10_000);
    assert!((line(&x, 2.0) - 3.0).abs() < 1e-6);
    for harmonic in 2..20 {
        assert!(line(&x, 2.0 * f64::from(harmonic)) < 1e-6, "{harmonic}");
    }
    let hours = {
        let mut profile = Profile::new(&config).unwrap();
        (0..3_600_000).for_each(|_| _ = profile.next_value());
        profile.next_value()
    };
    assert!(hours.abs() < 1e-6, "after an hour the phase is still right: {hours}");
}

#[test]
fn names_parse_and_an_unknown_name_lists_all() {
    for kind in ProfileKind::ALL {
        assert_eq!(kind.name().parse(), Ok(kind));
    }
    assert_eq!("sweep".parse(), Ok(ProfileKind::Chirp), "its name of old");
    let error = "square".parse::<ProfileKind>().unwrap_err().to_string();
    assert!(error.contains("multi-step") && error.contains("chirp"), "{error}");
}

#[test]
fn an_invalid_parameter_is_named() {
    type Spoil = fn(&mut ProfileConfig);
    let cases: [(&str, ProfileKind, Spoil); 19] = [
        ("amplitude", ProfileKind::Constant, |c| c.amplitude = f64::NAN),
        ("offset", ProfileKind::Constant, |c| c.offset = f64::INFINITY),
        ("dwell_s", ProfileKind::MultiStep, |c| c.dwell_s = 0.0),
        ("levels", ProfileKind::Staircase, |c| c.levels = 0),
        ("bit_s", ProfileKind::Prbs, |c| c.bit_s = -1.0),
        ("from_Hz", ProfileKind::Multisine, |c| c.from_Hz = 0.0),
        ("to_Hz", ProfileKind::Chirp, |c| c.to_Hz = 0.01),
        ("to_Hz", ProfileKind::ChirpLinear, |c| c.to_Hz = 251.0),
        ("sweep_s", ProfileKind::ChirpLinear, |c| c.sweep_s = f64::NAN),
        ("frequency_Hz", ProfileKind::Sine, |c| c.frequency_Hz = 0.0),
        ("acceleration", ProfileKind::Trapezoid, |c| c.acceleration = 0.0),
        ("acceleration", ProfileKind::Alternating, |c| c.acceleration = -1.0),
        ("jerk", ProfileKind::SCurve, |c| c.jerk = f64::INFINITY),
        ("dwell_s", ProfileKind::Abba, |c| c.dwell_s = -1.0),
        ("cycles", ProfileKind::Abba, |c| c.cycles = 2_000_000),
        ("turns", ProfileKind::Turns, |c| c.turns = 0),
        ("amplitude", ProfileKind::Turns, |c| c.amplitude = 1e-9),
        ("amplitude", ProfileKind::Turns, |c| c.amplitude = 200.0), // not reached within ten turns
        ("offset", ProfileKind::Turns, |c| c.offset = 1.0),
    ];
    for (name, kind, spoil) in cases {
        let mut config = ProfileConfig::new(kind, 1.0, 0);
        spoil(&mut config);
        let error = Profile::new(&config).unwrap_err();
        assert_eq!(error.parameter(), name);
        assert!(error.to_string().contains(name), "{error}");
    }
}

#[test]
fn turns_are_possible_in_rate_mode_only() {
    let config = ProfileConfig::new(ProfileKind::Turns, 1.0, 0);
    assert!(Profile::for_mode(&config, Mode::Rate).is_ok());
    assert_eq!(Profile::for_mode(&config, Mode::Voltage).unwrap_err().parameter(), "profile");
}

#[test]
fn the_table_has_every_parameter() {
    for kind in ProfileKind::ALL {
        for name in kind.parameters() {
            assert!(Parameter::of_name(name).is_some(), "{kind}: {name}");
        }
    }
    for parameter in &PARAMETERS {
        assert!(ProfileKind::ALL.iter().any(|kind| kind.parameters().contains(&parameter.name)), "{}: nobody's", parameter.name);
        let mut config = ProfileConfig::new(ProfileKind::Constant, 1.0, 0);
        parameter.set(&mut config, 7.0).unwrap();
        assert_eq!((parameter.read)(&config), 7.0, "{}", parameter.name);
        let others = PARAMETERS.iter().filter(|p| (p.read)(&config) == 7.0).count();
        assert_eq!(others, 1, "{} and no other", parameter.name);
        assert_eq!(parameter.set(&mut config, f64::NAN).unwrap_err().parameter(), parameter.name);
    }
    let mut config = ProfileConfig::new(ProfileKind::Turns, 1.0, 0);
    for (name, bad) in [("turns", 2.5), ("levels", -1.0), ("cycles", 1e10), ("seed", 1e17)] {
        assert_eq!(Parameter::of_name(name).unwrap().set(&mut config, bad).unwrap_err().parameter(), name);
    }
}
