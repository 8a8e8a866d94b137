//! Quantiles and tail probabilities of the distributions that the analyses use. All return NaN for degrees of freedom that are not
//! positive.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};
use statrs::function::beta::{beta_reg, ln_beta};
use statrs::function::gamma::ln_gamma;

/// Quantile of the standard normal distribution.
pub fn normal_quantile(probability: f64) -> f64 {
    Normal::standard().inverse_cdf(probability)
}

/// Quantile of Student's t distribution.
pub fn student_quantile(probability: f64, degrees_of_freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, degrees_of_freedom).map_or(f64::NAN, |t| t.inverse_cdf(probability))
}

/// P(z > x) of the standard normal distribution.
pub fn normal_tail(x: f64) -> f64 {
    Normal::standard().sf(x)
}

/// P(t > x) of Student's t distribution.
pub fn student_tail(x: f64, degrees_of_freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, degrees_of_freedom).map_or(f64::NAN, |t| t.sf(x))
}

/// Quantile of the χ² distribution.
pub fn chi_squared_quantile(probability: f64, degrees_of_freedom: f64) -> f64 {
    ChiSquared::new(degrees_of_freedom).map_or(f64::NAN, |chi| chi.inverse_cdf(probability))
}

/// P(χ² > x).
pub fn chi_squared_tail(x: f64, degrees_of_freedom: f64) -> f64 {
    ChiSquared::new(degrees_of_freedom).map_or(f64::NAN, |chi| chi.sf(x))
}

/// ln P(χ² > x), also where the probability underflows; 0 for x ≤ 0 or no degree of freedom.
pub fn ln_chi_squared_tail(x: f64, degrees_of_freedom: f64) -> f64 {
    if x <= 0.0 || degrees_of_freedom <= 0.0 {
        return 0.0;
    }
    let direct = chi_squared_tail(x, degrees_of_freedom);
    if direct > 1e-280 {
        return direct.ln();
    }
    // Leading term of the tail of the incomplete gamma function (NIST DLMF 8.11.2).
    let half = 0.5 * degrees_of_freedom;
    -0.5 * x + (half - 1.0) * (0.5 * x).ln() - ln_gamma(half)
}

/// log₁₀ P(F > f) for k and ν degrees of freedom, also where the probability underflows; 0 for f ≤ 0 or not finite.
///
/// The regularised incomplete beta function I_x(ν/2, k/2), x = ν/(ν + k f), by its power series where it is small (NIST DLMF 8.17.8).
pub fn log10_f_tail(f: f64, k: f64, nu: f64) -> f64 {
    if !f.is_finite() || f <= 0.0 {
        return 0.0;
    }
    let (a, b) = (0.5 * nu, 0.5 * k);
    let x = nu / (nu + k * f);
    let direct = beta_reg(a, b, x.clamp(0.0, 1.0));
    if direct > 1e-200 {
        return direct.log10();
    }
    let (mut term, mut series) = (1.0, 1.0);
    for j in 0..10_000 {
        let j = f64::from(j);
        term *= x * (a + b + j) / (a + 1.0 + j);
        series += term;
        if term < 1e-12 * series {
            break;
        }
    }
    let ln = a * x.ln() + b * (-x).ln_1p() - a.ln() - ln_beta(a, b) + f64::ln(series);
    ln / std::f64::consts::LN_10
}

/// Interval of fractions that contains the outcome of `n` independent trials of this probability with at least this coverage; the tails are
/// equal.
pub fn binomial_interval(n: u64, probability: f64, coverage: f64) -> (f64, f64) {
    let (trials, tail) = (n as f64, 0.5 * (1.0 - coverage));
    let ln_probability = |k: u64| {
        let k = k as f64;
        ln_gamma(trials + 1.0) - ln_gamma(k + 1.0) - ln_gamma(trials - k + 1.0)
            + k * probability.ln()
            + (trials - k) * (-probability).ln_1p()
    };
    // Counts from one end until their probability exceeds the tail.
    let first_beyond = |count_at: fn(u64, u64) -> u64| {
        let mut sum = 0.0;
        let is_beyond = |k: &u64| {
            sum += ln_probability(*k).exp();
            sum > tail
        };
        (0..=n).map(|step| count_at(step, n)).find(is_beyond).unwrap_or(0)
    };
    let low = first_beyond(|step, _| step);
    let high = first_beyond(|step, n| n - step);
    (low as f64 / trials.max(1.0), high as f64 / trials.max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables: z(0.975) = 1.959964, t(0.975; 10) = 2.228139, χ²(0.95; 3) = 7.814728, F(0.99; 4, 10) = 5.994339.
    #[test]
    fn tabulated_quantiles() {
        assert!((normal_quantile(0.975) - 1.959_964).abs() < 1e-6);
        assert!((student_quantile(0.975, 10.0) - 2.228_139).abs() < 1e-6);
        assert!((chi_squared_quantile(0.95, 3.0) - 7.814_728).abs() < 1e-5);
        assert!((chi_squared_tail(7.814_728, 3.0) - 0.05).abs() < 1e-7);
        assert!((log10_f_tail(5.994_339, 4.0, 10.0) + 2.0).abs() < 1e-6);
        assert!(student_quantile(0.9, 0.0).is_nan() && chi_squared_tail(1.0, 0.0).is_nan());
    }

    /// 20 trials of probability 0.95: P(16 or fewer) = 0.0159, P(15 or fewer) = 0.0026; all 20 have 0.358.
    #[test]
    fn binomial_interval_of_few_trials() {
        assert_eq!(binomial_interval(20, 0.95, 0.99), (0.8, 1.0));
        let (low, high) = binomial_interval(1000, 0.95, 0.99);
        assert!((low - 0.932).abs() < 2e-3 && (high - 0.967).abs() < 2e-3, "{low} {high}");
    }

    /// For two degrees of freedom P(χ² > x) = exp(−x/2) exactly.
    #[test]
    fn ln_tail_of_chi_squared_continues_below_underflow() {
        assert!((ln_chi_squared_tail(100.0, 2.0) + 50.0).abs() < 1e-9);
        assert!((ln_chi_squared_tail(4000.0, 2.0) + 2000.0).abs() < 1e-9);
        assert_eq!((ln_chi_squared_tail(-1.0, 2.0), ln_chi_squared_tail(1.0, 0.0)), (0.0, 0.0));
    }

    /// For k = 2: P(F > f) = (1 + 2 f/ν)^(−ν/2) exactly.
    #[test]
    fn log10_tail_of_f_continues_below_underflow() {
        for f in [3.0_f64, 5e3] {
            let exact = -100.0 * (1.0 + f / 100.0).log10();
            assert!((log10_f_tail(f, 2.0, 200.0) / exact - 1.0).abs() < 1e-9, "{f}");
        }
    }
}
