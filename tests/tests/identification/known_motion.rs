//! A sensor of rate or angle against a known motion: the angle of a rate table is the input, the sensor the output.

use identification::identify::explain::{Explanation, Verdict, explain};
use identification::log::{Column, Log};
use identification::model::Model;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stand_tests::sensor;

const ROWS: usize = 30_000;
const DT_S: f64 = 1e-3;
/// Count of the table's encoder, rad.
const COUNT_RAD: f64 = std::f64::consts::TAU / 65_536.0;

/// Rate and angle of the table at a time.
fn motion(t: f64) -> (f64, f64) {
    let tau = std::f64::consts::TAU;
    let rate = 1.0 + 3.0 * (tau * 0.2 * t).sin() + 2.0 * (tau * 1.3 * t).cos();
    let angle = t + 3.0 / (tau * 0.2) * (1.0 - (tau * 0.2 * t).cos()) + 2.0 / (tau * 1.3) * (tau * 1.3 * t).sin();
    (rate, angle)
}

/// What is said about a sensor that reads `sensor(t)` and noise of 2 mrad/s.
fn answer(sensor: impl Fn(f64) -> f64) -> Explanation {
    answer_beside(sensor, |theta| theta)
}

/// The same beside an encoder of the table with an error of its own.
fn answer_beside(sensor: impl Fn(f64) -> f64, reading: impl Fn(f64) -> f64) -> Explanation {
    let mut draw = Xoshiro256PlusPlus::seed_from_u64(42);
    let mut even = || (draw.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let mut noise = || 2e-3 * ((0..12).map(|_| even()).sum::<f64>() - 6.0);
    let t_s: Vec<f64> = (0..ROWS).map(|k| k as f64 * DT_S).collect();
    let theta_rad = t_s.iter().map(|t| (reading(motion(*t).1) / COUNT_RAD).floor() * COUNT_RAD).collect();
    let omega_rad_s = t_s.iter().map(|t| sensor(*t) + noise()).collect();
    let columns = [("t_s", t_s), ("theta_rad", theta_rad), ("omega_rad_s", omega_rad_s)];
    let columns = columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    let log = Log::new("table.csv", columns, vec![("omega_rad_s".to_owned(), "gyro".to_owned())]).expect("a log");
    let model = Model::parse("[drive]\ninput = \"theta_rad\"\noutputs = [\"omega_rad_s\"]\neffects = []\n", "the sensor").expect("a model");
    explain(vec![log], &model, &|_| {}).expect("an explanation")
}

/// What is said about a resolver that reads `shaft(t)` beside the encoder of the table.
fn answer_of_angle(shaft: impl Fn(f64) -> f64) -> Explanation {
    let mut draw = Xoshiro256PlusPlus::seed_from_u64(7);
    let mut even = || (draw.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let mut noise = || 2e-4 * ((0..12).map(|_| even()).sum::<f64>() - 6.0);
    let t_s: Vec<f64> = (0..ROWS).map(|k| k as f64 * DT_S).collect();
    let theta_rad = t_s.iter().map(|t| (motion(*t).1 / COUNT_RAD).floor() * COUNT_RAD).collect();
    // The zero of the resolver is another one.
    let theta_sensor_rad = t_s.iter().map(|t| 0.4 + shaft(*t) + noise()).collect();
    let columns = [("t_s", t_s), ("theta_rad", theta_rad), ("theta_sensor_rad", theta_sensor_rad)];
    let columns = columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    let log = Log::new("table.csv", columns, vec![]).expect("a log");
    let text = "[drive]\ninput = \"theta_rad\"\noutputs = [\"theta_sensor_rad\"]\neffects = []\n";
    explain(vec![log], &Model::parse(text, "the resolver").expect("a model"), &|_| {}).expect("an explanation")
}

#[test]
fn errors_of_a_resolver_are_found() {
    let perfect = answer_of_angle(|t| motion(t).1);
    assert_eq!((perfect.verdict, perfect.missing.as_slice()), (Verdict::Adequate, &[][..]));

    // Two harmonics: off the axis, and unequal windings.
    let harmonics = answer_of_angle(|t| {
        let theta = motion(t).1;
        theta + 5e-3 * (theta + 0.7).sin() + 3e-3 * (2.0 * theta + 1.9).sin()
    });
    let named = ["encoder-eccentricity".to_owned(), "encoder-eccentricity#2".to_owned()];
    assert_eq!((harmonics.verdict, harmonics.missing.as_slice()), (Verdict::EffectFound, &named[..]));
    for (order, amplitude_rad, phase_rad) in [(1.0, 5e-3, 0.7), (2.0, 3e-3, 1.9)] {
        let value = |name: &str, instance: &str| harmonics.model.value(&format!("{name}{instance}")).unwrap_or(f64::NAN);
        let instance = ["", "#2"].into_iter().find(|instance| value("eccentricity_order", instance) == order).expect("the order");
        let (amplitude, phase) = (value("eccentricity_rad", instance), value("eccentricity_phase_rad", instance));
        assert!((amplitude - amplitude_rad).abs() < 2e-4 && (phase - phase_rad).abs() < 0.05, "order {order}: {amplitude} {phase}");
    }

    let late = answer_of_angle(|t| motion(t - 4e-3).1);
    assert_eq!((late.verdict, late.missing.as_slice()), (Verdict::EffectFound, &["time-skew".to_owned()][..]));
    assert!((late.model.value("skew_s").unwrap_or(f64::NAN) - 4e-3).abs() < 1e-4);

    // A wrong number of counts per turn.
    let scaled = answer_of_angle(|t| 1.002 * motion(t).1);
    assert_eq!((scaled.verdict, scaled.missing.as_slice()), (Verdict::EffectFound, &["rate-scale".to_owned()][..]));
    assert!((scaled.model.value("rate_scale").unwrap_or(f64::NAN) - 2e-3).abs() < 2e-5);

    // A tracking converter of 30 ms: beyond the corner of its frequency response the output is attenuated, not only late.
    let (tau_s, mut state) = (0.03, None);
    let behind: Vec<f64> = (0..ROWS * 10)
        .map(|k| {
            let input = motion(k as f64 * DT_S / 10.0).1;
            let output = state.map_or(input - tau_s * motion(0.0).0, |last: f64| input + (last - input) * (-DT_S / 10.0 / tau_s).exp());
            state = Some(output);
            output
        })
        .collect();
    let slow = answer_of_angle(|t| behind[(t / DT_S * 10.0).round() as usize]);
    assert_eq!((slow.verdict, slow.missing.as_slice()), (Verdict::EffectFound, &["sensor-lag".to_owned()][..]));
    assert!((slow.model.value("lag_s").unwrap_or(f64::NAN) - tau_s).abs() < 1e-4, "{:?}", slow.model.value("lag_s"));

    // A slope that varies with the angle, as that of a potentiometer, is not in the catalogue: its mean is named, and that something is
    // left.
    let bent = answer_of_angle(|t| motion(t).1 + 2e-4 * motion(t).1.powi(2));
    assert_eq!((bent.verdict, bent.missing.as_slice()), (Verdict::PartlyExplained, &["rate-scale".to_owned()][..]));
}

#[test]
fn perfect_sensor_lacks_nothing() {
    let e = answer(|t| motion(t).0);
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::Adequate, &[][..]));
}

#[test]
fn scale_and_bias_are_found() {
    let e = answer(|t| 1.01 * motion(t).0 + 4e-3);
    assert_eq!(e.verdict, Verdict::EffectFound, "{:?}", e.missing);
    let value = |name: &str| e.model.value(name).unwrap_or(f64::NAN);
    assert!((value("rate_scale") - 0.01).abs() < 5e-5, "{:?} {}", e.missing, value("rate_scale"));
    assert!((value("rate_bias_rad_s") - 4e-3).abs() < 1e-4, "{:?} {}", e.missing, value("rate_bias_rad_s"));
}

#[test]
fn delay_is_found() {
    let e = answer(|t| motion(t - 6e-3).0);
    assert_eq!(e.verdict, Verdict::EffectFound, "{:?}", e.missing);
    // A pure delay and a first-order lag differ at the second order of ω τ only.
    let found = e.model.value("skew_s").or(e.model.value("lag_s")).unwrap_or(f64::NAN);
    assert!((found - 6e-3).abs() < 1e-4, "{:?} {found}", e.missing);
}

#[test]
fn eccentricity_of_the_reference_is_named() {
    // The table's encoder reads θ + e sin(θ + φ); the sensor is perfect.
    let e = answer_beside(|t| motion(t).0, |theta| theta + 4e-3 * (theta + 0.7).sin());
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["encoder-eccentricity".to_owned()][..]));
    let value = |name: &str| e.model.value(name).unwrap_or(f64::NAN);
    assert!((value("eccentricity_rad") - 4e-3).abs() < 1e-4, "{}", value("eccentricity_rad"));
    assert!((value("eccentricity_phase_rad") - 0.7).abs() < 0.05, "{}", value("eccentricity_phase_rad"));
}

#[test]
fn errors_of_the_sensor_under_test_are_found_on_the_stands_own_logs() {
    // Seeds 1 to 8: scale, bias, cubic nonlinearity, lag, g-sensitivity, mounting, quadratic nonlinearity, none. With seed 49, a scale, the
    // search comes back to effects that it had.
    for seed in (1..=8).chain([49]) {
        let answer = sensor::answer(seed);
        let right = match answer.kind {
            sensor::Kind::None => answer.verdict == "adequate",
            sensor::Kind::Quadratic => answer.verdict == "unknown-structure",
            _ => answer.is_named(),
        };
        assert!(right, "{answer}");
    }
}
