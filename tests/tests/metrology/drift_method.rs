//! The method of alternating pulses with the tools' formulas: vectors of docs/theory.md §3.2 and §3.3, and the effect of noise.
#![allow(clippy::unwrap_used)]

use hal_sim::gyro::{Campaign, DEG_H, Pattern, Site};
use hal_sim::peripherals::Noise;
use stand_analysis::drift::integral::{Integral, reference_rad_s, residual_rad_s};
use stand_analysis::drift::latitude::EarthRate;
use stand_analysis::drift::{platform, separation};
use stand_tests::drift::{cases, errors, monte_carlo, separated};

const T: f64 = 5.0;
const W: f64 = 0.1 * std::f64::consts::PI / 180.0;
const OMEGA: f64 = 3.0 * DEG_H;
const GAIN: f64 = 50.0;
const START: f64 = 0.02 / GAIN;

/// A cycle with this number of samples per pulse.
fn cycle(samples: usize, theta: impl Fn(f64) -> f64) -> Integral {
    let angles: Vec<f64> = (0..=2 * samples).map(|k| theta(k as f64 * T / samples as f64)).collect();
    Integral::of(&angles, T).unwrap()
}

fn triangle(t: f64) -> f64 {
    W * if t < T { t.max(0.0) } else { 2.0 * T - t }
}

fn deg_h(rad_s: f64) -> f64 {
    rad_s / DEG_H
}

#[test]
fn symmetric_pulses_satisfy_13_and_sawtooth_pulses_12() {
    let of = |theta: &dyn Fn(f64) -> f64| cycle(50_000, |t| START + theta(t) + OMEGA * t);
    let rectangular = of(&triangle);
    // U_int = K_k (first − second), τ = 1 s.
    assert!((rectangular.switched_rad_s * GAIN + 1.818_051_304e-2).abs() < 1e-10, "{}", rectangular.switched_rad_s * GAIN);
    assert!((deg_h(rectangular.drift_rad_s()) - 3.0).abs() < 1e-6);
    let half = |t: f64| if t < T / 2.0 { W * t * t / T } else { W * (T / 2.0 - (T - t).powi(2) / T) };
    let triangular = of(&|t| if t <= T { half(t) } else { half(T) - half(t - T) });
    assert!((triangular.switched_rad_s * GAIN + 1.818_051_304e-2).abs() < 1e-10);
    assert!((deg_h(triangular.drift_rad_s()) - 3.0).abs() < 1e-6);
    let ramp = |t: f64| W * t * t / (2.0 * T);
    let sawtooth = of(&|t| if t <= T { ramp(t) } else { ramp(T) - ramp(t - T) });
    assert!((sawtooth.switched_rad_s * GAIN + 0.381_790_773_9).abs() < 1e-8);
    assert!((deg_h(sawtooth.drift_rad_s()) - 63.0).abs() < 1e-6);
    // (12): ∫ (T − 2t) w dt of a sawtooth is −W T²/6.
    assert!((deg_h(sawtooth.drift_with_reference_rad_s(-W * T * T / 6.0)) - 3.0).abs() < 1e-6);
    let reversed = of(&|t| if t <= T { ramp(t) } else { ramp(2.0 * T - t) });
    assert!((deg_h(reversed.drift_rad_s()) - 3.0).abs() < 1e-6);
}

#[test]
fn errors_of_imperfect_pulses_and_integrators_match_the_table() {
    let rate = |theta: &dyn Fn(f64) -> f64| deg_h(cycle(5_000, |t| START + theta(t) + OMEGA * t).drift_rad_s()) - 3.0;
    assert!((rate(&|t| triangle(t) - if t > T { 1e-4 * W * (t - T) } else { 0.0 }) + 0.018).abs() < 1e-6);
    // A lag of 1 ms. With −w the error is opposite to w lag²/T², below the resolution of the table's 1 ms grid.
    assert!((rate(&|t| triangle(t - 1e-3)) - 0.143_978).abs() < 1e-6);
    assert!((rate(&|t| -triangle(t - 1e-3)) + 0.143_978).abs() < 1e-6);

    // A second pulse longer by 1e-3, a leaking integrator, an offset behind the switch: sums of the same samples with other weights.
    let angle = |t: f64| START + triangle(t) + OMEGA * t;
    let integral = |from: f64, to: f64, weight: &dyn Fn(f64) -> f64| {
        let n = 100_000;
        let dt = (to - from) / f64::from(n);
        (0..n).map(|k| from + (f64::from(k) + 0.5) * dt).map(|t| weight(t) * dt).sum::<f64>()
    };
    let longer = T * (1.0 + 1e-3);
    let switched = integral(0.0, T, &angle) - integral(T, T + longer, &|t| START + W * T - W * (t - T) + OMEGA * t);
    assert!((deg_h(-switched / (T * T)) - 3.0 - 0.022_322_684).abs() < 1e-6, "{}", deg_h(-switched / (T * T)) - 3.0);
    let leaking = |theta: &dyn Fn(f64) -> f64| {
        let leak = |t: f64| (-(2.0 * T - t) / 1000.0).exp() * theta(t);
        -deg_h(integral(0.0, T, &leak) - integral(T, 2.0 * T, &leak)) / (T * T)
    };
    let leaks = |sign: f64| leaking(&move |t| sign * triangle(t) + OMEGA * t) - 3.0;
    assert!((leaks(1.0) - 0.596_990).abs() < 1e-3 && (leaks(-1.0) + 0.597_027).abs() < 1e-3);
    assert!((leaking(&|_| 1e-3) - 0.205_236).abs() < 1e-3);
    let offset = -deg_h(2.0 * T * 1e-4 / GAIN) / (T * T);
    assert!((offset + 0.165_012).abs() < 1e-6, "{offset}");

    // Sums without the trapezoid's half-weighted ends are off by ± w dt/T.
    for (sign, off) in [(1.0, 3.072), (-1.0, 2.928)] {
        let at = |k: u32| START + sign * triangle(f64::from(k) * 1e-3) + OMEGA * f64::from(k) * 1e-3;
        let plain = -1e-3 * ((0..5_000).map(at).sum::<f64>() - (5_000..10_000).map(at).sum::<f64>()) / (T * T);
        assert!((deg_h(plain) - off).abs() < 1e-6, "{}", deg_h(plain));
        let middle = |k: u32| START + sign * triangle((f64::from(k) + 0.5) * 1e-3) + OMEGA * (f64::from(k) + 0.5) * 1e-3;
        let mid = -1e-3 * ((0..5_000).map(middle).sum::<f64>() - (5_000..10_000).map(middle).sum::<f64>()) / (T * T);
        assert!((deg_h(mid) - 3.0).abs() < 1e-6);
    }
}

#[test]
fn current_corrects_unequal_pulses_and_both_polarities_give_the_torquer_rate() {
    let at = |k: i64| match k - 3 {
        ..0 => 0.0,
        0..5_000 => 1.0,
        _ => -1.001,
    };
    let currents: Vec<f64> = (0..10_000).map(|k| W * at(k)).collect();
    let mut angle = START;
    let mut angles = vec![angle];
    angles.extend(currents.iter().map(|w| {
        angle += (w + OMEGA) * 1e-3;
        angle
    }));
    let raw = deg_h(Integral::of(&angles, T).unwrap().drift_rad_s());
    let residual = deg_h(residual_rad_s(&currents));
    assert!((raw - 3.252_021_5).abs() < 1e-6);
    assert!((raw - residual - 3.0).abs() < 1e-6);
    assert!((raw - 1.01 * residual - 2.997_479_8).abs() < 1e-6);
    let of = |sign: f64| cycle(5_000, |t| START + sign * triangle(t) + OMEGA * t);
    assert!((reference_rad_s(&of(1.0), &of(-1.0)).to_degrees() - 0.1).abs() < 1e-9);
}

#[test]
fn vibration_is_weighted_by_sinc_squared() {
    for (om, expected) in [(0.5, 0.576_365_957), (std::f64::consts::TAU / T, 0.0), (3.0, 0.015_641_670)] {
        let found = cycle(50_000, |t| (om * (t - T)).sin() / om).drift_rad_s();
        assert!((found - expected).abs() < 1e-7, "{om}: {found}");
    }
}

#[test]
fn two_positions_of_one_axis_give_drifts_and_azimuth() {
    let EarthRate { horizontal_rad_s: horizontal, vertical_rad_s: vertical, .. } = EarthRate::at(70.0, 0.0).unwrap();
    assert!((deg_h(horizontal) - 5.144_348_5).abs() < 1e-6 && (deg_h(vertical) - 14.133_981_3).abs() < 1e-6);
    let (own, apparent) = (1.5 * DEG_H, -horizontal * 80_f64.to_radians().cos());
    let of = |omega: f64| cycle(5_000, |t| START + triangle(t) + omega * t);
    let (first, turned) = (of(own + apparent), of(own - apparent));
    assert!((first.switched_rad_s * GAIN + 3.676_664_912e-3).abs() < 1e-10);
    assert!((turned.switched_rad_s * GAIN + 1.450_384_813e-2).abs() < 1e-10);
    let (found_own, found_apparent) = separation::single(first.drift_rad_s(), turned.drift_rad_s());
    assert!((deg_h(found_own) - 1.5).abs() < 1e-6 && (deg_h(found_apparent) + 0.893_306_7).abs() < 1e-6);
    let azimuth = separation::azimuth_rad(found_apparent, horizontal).unwrap().to_degrees();
    assert!((azimuth - 80.0).abs() < 1e-6, "{azimuth}");
    assert_eq!(separation::azimuth_rad(1.01 * horizontal, horizontal), None, "faster than the Earth");
}

#[test]
fn correction_removes_the_errors_of_three_axes() {
    // w, pattern; raw drift x, z and azimuth; corrected drift x, z and azimuth.
    let table = [
        (0.05, Pattern::Together, [-0.015_388_5, 0.017_623_0, -1.167_52], [-0.013_982_7, 0.016_935_8, 0.009_87]),
        (0.05, Pattern::BothPolarities, [-0.001_372_5, 0.000_705_1, -1.168_18], [2.2e-5, 0.8e-5, 0.009_64]),
        (0.05, Pattern::OneAtATime, [-0.001_400_7, 0.000_690_2, -1.177_35], [-0.6e-5, -0.7e-5, 0.000_47]),
        (0.01, Pattern::Together, [-0.004_197_2, 0.004_080_9, -1.177_31], [-0.002_800_1, 0.003_385_9, 0.000_43]),
    ];
    for (w, pattern, raw, corrected) in table {
        let campaign = Campaign { rate_rad_s: f64::to_radians(w), pattern, ..Campaign::default() };
        let found = separated(&campaign, &mut Noise::new(1, 0, 0.0));
        for (found, expected) in found.iter().zip([raw, corrected]) {
            let (off, azimuth) = errors(&campaign, found);
            // The table's last digits.
            assert!((off[0] - expected[0]).abs() < 1e-6 && (off[2] - expected[1]).abs() < 1e-6, "{w} {pattern:?}: {off:?}");
            assert!((azimuth - expected[2]).abs() < 1e-5, "{w} {pattern:?}: {azimuth}");
        }
    }
}

#[test]
fn simultaneous_pulses_couple_as_predicted() {
    let at = |pattern| {
        let campaign = Campaign { pattern, ..Campaign::default() };
        errors(&campaign, &separated(&campaign, &mut Noise::new(1, 0, 0.0))[0])
    };
    let (one, both) = (at(Pattern::Together).0, at(Pattern::BothPolarities).0);
    let up = -0.5 - Site::default().vertical_rad_s() / DEG_H;
    let w_t = 0.05_f64.to_radians() * 5.0;
    let expected = [w_t * (2.0 / 3.0 * 2.5 + up / 3.0), w_t * (2.0 / 3.0 * -1.5 - up / 3.0)];
    assert!((one[0] - both[0] - expected[0]).abs() < 1e-4 && (one[2] - both[2] - expected[1]).abs() < 1e-4, "{one:?} {both:?}");
    // A is wrong by ω_y T: docs/theory.md's −0.976, −1.219, −1.829′, to first order.
    for (pulse_s, expected) in [(4.0, -0.976), (5.0, -1.219), (7.5, -1.829)] {
        let campaign = Campaign { pulse_s, ..Campaign::default() };
        let (_, azimuth) = errors(&campaign, &separated(&campaign, &mut Noise::new(1, 0, 0.0))[0]);
        assert!((azimuth - expected).abs() < 0.06 * expected.abs(), "{pulse_s}: {azimuth}");
    }
}

#[test]
fn azimuth_without_noise_is_within_three_arcseconds() {
    for own in [[1.0, -0.5, 2.0], [-2.0, 2.0, 0.5], [0.5, 1.0, -1.5]] {
        let campaign = Campaign { own_rad_s: own.map(|rate| rate * DEG_H), ..Campaign::default() };
        assert!((8.0..=15.0).contains(&campaign.cycle_s()));
        let (off, azimuth) = errors(&campaign, &separated(&campaign, &mut Noise::new(1, 0, 0.0))[1]);
        assert!(azimuth.abs() <= 0.05, "{azimuth}′");
        assert!(off.iter().all(|off| off.abs() < 2e-4), "{off:?}");
    }
}

/// 200 random runs of each case, as in docs/theory.md; `cargo bench -p stand-tests --bench drift_monte_carlo` runs a thousand.
#[test]
fn errors_with_noise_match_the_table() {
    for (case, expected) in cases() {
        let found = monte_carlo(&case, 200, 1);
        for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
            // Independent random numbers: 15 % (docs/theory.md), and 200 draws know a mean |error| to 7.6 %.
            assert!((found / expected - 1.0).abs() < 0.2, "{}: figure {k} is {found}, not {expected}", case.name);
        }
    }
}

#[test]
fn platform_method_gives_bias_and_scale_with_ramps() {
    let (w, bias, scale) = (0.1, 0.002, 1.01);
    // Without ramps (docs/theory.md §3).
    let theta = |t: f64| if t < T { w * t } else { w * (2.0 * T - t) };
    let gyro = cycle(5_000, |t| scale * theta(t) + bias * t);
    let found = gyro.drift_rad_s();
    let by_sum = (gyro.sum_rad_s / (T * T) - 2.0 * found) / w;
    assert!((found - bias).abs() < 1e-9 && (by_sum - scale).abs() < 1e-9, "{found} {by_sum}");
    // With ramps of 50 ms, −I/T² alone has an error of 4 % of the bias.
    let rate = |t: f64| w * ((t / 0.05).min(1.0) - ((t - T) / 0.05).clamp(0.0, 2.0));
    let mut angle = 0.0;
    let mut thetas = vec![0.0];
    for k in 0..10_000 {
        angle += (rate(f64::from(k) * 1e-3) + rate(f64::from(k + 1) * 1e-3)) / 2.0 * 1e-3;
        thetas.push(angle);
    }
    let rates: Vec<f64> = (0..=10_000).map(|k| scale * rate(f64::from(k) * 1e-3) + bias).collect();
    let found = platform::cycle(0.0, &rates, &thetas, T).unwrap();
    assert!((found.bias_rad_s - bias).abs() < 1e-7 && (found.scale - scale).abs() < 1e-6, "{found:?}");
    assert!((found.uncorrected[0] - bias).abs() > 1e-4);
}
