use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use super::harmonics;
use super::significance::{orthonormal, test};
use crate::statistics::distributions::log10_f_tail;

/// Uniform between ±½.
fn uniform(rng: &mut Xoshiro256PlusPlus) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}

#[test]
fn tail_of_f_matches_closed_form_beyond_underflow() {
    // P(F(2, ν) > f) = (1 + 2 f/ν)^(−ν/2), in closed form.
    for (f, freedom) in [(1.0, 10.0), (9.0, 40.0), (50.0, 200.0), (3000.0, 900.0)] {
        let expected = -0.5 * freedom * f64::ln_1p(2.0 * f / freedom) / std::f64::consts::LN_10;
        let found = log10_f_tail(f, 2.0, freedom);
        assert!((found / expected - 1.0).abs() < 1e-9, "{f} {freedom}: {found} {expected}");
    }
    assert!(log10_f_tail(3000.0, 2.0, 900.0) < -300.0);
}

#[test]
fn false_alarm_rate_in_coloured_noise_is_as_stated() {
    // First-order noise with a time constant of 20 rows against a sine of 40 rows and a trend. A test for white noise would fail.
    let n = 2000;
    let wave: Vec<f64> = (0..n).map(|k| (k as f64 * std::f64::consts::TAU / 40.0).sin()).collect();
    let trend: Vec<f64> = (0..n).map(|k| k as f64 - 999.5).collect();
    for shape in [wave, trend] {
        let columns = orthonormal(&[], std::slice::from_ref(&shape));
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let alarms = (0..400)
            .filter(|_| {
                let mut state = 0.0;
                let y: Vec<f64> = (0..n)
                    .map(|_| {
                        state = 0.95 * state + uniform(&mut rng);
                        state
                    })
                    .collect();
                test(&columns, &y, n).log10_p < -2.0
            })
            .count();
        // Expected are 4 of 400 at p = 0.01; 12 have a probability of 1e-3.
        assert!(alarms < 12, "{alarms} of 400");
    }
}

#[test]
fn spectrum_gives_harmonic_order_and_amplitude() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let theta: Vec<f64> = (0..20_000).map(|k| 0.0137 * f64::from(k)).collect();
    let y: Vec<f64> = theta.iter().map(|x| 0.3 * (29.0 * x + 1.0).sin() + uniform(&mut rng)).collect();
    let s = harmonics::spectrum(&theta, &y, |_| 1.0, harmonics::resolvable_order(13.7, 0.001));
    let peaks = harmonics::peaks(&s, 1);
    assert_eq!(peaks[0].0, 29);
    // Noise of 0.29/√n × √2 = 3e-3 on sine and cosine.
    assert!((s.amplitude[28] - 0.3).abs() < 0.012, "{}", s.amplitude[28]);
    let above = s.amplitude.iter().zip(&s.level).filter(|(a, l)| a > l).count();
    assert_eq!(above, 1, "no other order is significant");
}
