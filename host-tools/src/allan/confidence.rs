//! Covariance of overlapping Allan variances, equivalent degrees of freedom and χ² confidence intervals.
//!
//! Input: five noise coefficients, averaging factors, lengths of the segments. Output: covariances, degrees of freedom, intervals. NIST SP 1065 (after
//! Greenhall and Riley, 2004) treats one power law; this module treats their sum: for Gaussian differences z₁, z₂ of two averaging factors,
//! cov(⟨z₁²⟩, ⟨z₂²⟩) is the mean of 2 c² + 4 µ₁µ₂ c over all pairs of terms, with their covariance c at the lag of the pair and the contribution µ of a
//! ramp. For one power law this equals Greenhall's sum; it also gives the correlation of adjacent points.
//!
//! The unit of time is the row: τ₀ = 1.

use super::FLOOR;
use crate::statistics::distributions::{chi_squared_quantile, normal_quantile};

/// Q², N², B², K², R² with τ₀ = 1.
pub type Squares = [f64; 5];

/// Contribution of each process to the Allan variance at averaging factor m, per squared coefficient.
pub fn parts(factor: usize) -> [f64; 5] {
    let m = factor as f64;
    [3.0 / (m * m), 1.0 / m, FLOOR * FLOOR, m / 3.0, m * m / 2.0]
}

/// Expected Allan variance at averaging factor m.
pub fn expected(squares: &Squares, factor: usize) -> f64 {
    squares.iter().zip(parts(factor)).map(|(s, p)| s * p).sum()
}

/// Weights of the second difference.
const WEIGHTS: [f64; 3] = [1.0, -2.0, 1.0];
/// Number of lags per shorter averaging time at which the covariance is computed; it is nearly linear in between.
const LAGS_PER_AVERAGE: usize = 8;
/// Range of the lags, in half-lengths of both differences.
const LAG_RANGE: f64 = 1.5;

/// A lag that represents its neighbourhood.
#[derive(Debug, Clone, Copy)]
struct Lag {
    /// Number of pairs of terms.
    pairs: f64,
    /// Covariance of the two differences per N², B², K².
    smooth: [f64; 3],
    /// Covariance of white angle noise per Q², at this lag only, and its number of pairs.
    phase: f64,
    phase_pairs: f64,
}

/// Covariance of the variances at two averaging factors for any sum of the processes.
#[derive(Debug, Clone)]
pub struct Covariance {
    factors: [usize; 2],
    lags: Vec<Lag>,
    terms: f64,
}

impl Covariance {
    /// `segments`: pairs of a segment length (in angles) and the number of segments with this length.
    pub fn new(one: usize, other: usize, segments: &[(usize, usize)]) -> Self {
        let (short, long) = (one.min(other), one.max(other));
        // Averages of more than eight rows are computed as eight, up to the scale.
        let scaled = short.min(LAGS_PER_AVERAGE);
        let scale = short as f64 / scaled as f64;
        let ratio = long as f64 / short as f64;
        let (a, b) = (scaled as f64, scaled as f64 * ratio);
        let middle = (a - b).round() as i64;
        let reach = (LAG_RANGE * (a + b)).ceil() as i64;
        let counted: Vec<[i128; 3]> = segments
            .iter()
            .filter(|(angles, _)| *angles > 2 * long)
            .map(|(angles, count)| [(angles - 2 * short) as i128, (angles - 2 * long) as i128, *count as i128])
            .collect();
        let below = |lag: i128| counted.iter().map(|[m1, m2, n]| n * pairs_below(*m1, *m2, lag)).sum::<i128>() as f64;
        let edge = |lag: i64| below(((lag as f64 - 0.5) * scale).ceil() as i128);
        let smooth_powers = [scale, scale * scale, scale * scale * scale];
        let mut lags = Vec::with_capacity(2 * reach as usize + 1);
        let mut before = edge(middle - reach);
        for lag in middle - reach..=middle + reach {
            let after = edge(lag + 1);
            let pairs = std::mem::replace(&mut before, after);
            let (mut smooth, mut phase) = ([0.0; 3], 0.0);
            for (i, wi) in WEIGHTS.iter().enumerate() {
                for (j, wj) in WEIGHTS.iter().enumerate() {
                    let t = lag as f64 + j as f64 * b - i as f64 * a;
                    smooth.iter_mut().zip(generalised(t.abs())).for_each(|(sum, s)| *sum += wi * wj * s);
                    phase += if t.abs() < 0.25 { wi * wj } else { 0.0 };
                }
            }
            smooth.iter_mut().zip(smooth_powers).for_each(|(s, power)| *s *= power);
            let exact = (lag as f64 * scale).round() as i128;
            let phase_pairs = if phase == 0.0 { 0.0 } else { below(exact + 1) - below(exact) };
            lags.push(Lag { pairs: after - pairs, smooth, phase, phase_pairs });
        }
        let terms = |m: usize| segments.iter().map(|(angles, n)| angles.saturating_sub(2 * m) as f64 * *n as f64).sum::<f64>();
        Self { factors: [short, long], lags, terms: terms(short) * terms(long) }
    }

    /// Covariance in the fourth power of the rate's unit.
    pub fn of(&self, squares: &Squares) -> f64 {
        let [q, n, b, k, r] = *squares;
        let [m1, m2] = self.factors.map(|m| m as f64);
        // 4 µ₁ µ₂ with µ = R m².
        let mean = 4.0 * r * m1 * m1 * m2 * m2;
        let sum: f64 = (self.lags.iter())
            .map(|lag| {
                let smooth = n * lag.smooth[0] + b * lag.smooth[1] + k * lag.smooth[2];
                let phase = q * lag.phase;
                lag.pairs * smooth * (2.0 * smooth + mean) + lag.phase_pairs * phase * (2.0 * phase + 4.0 * smooth + mean)
            })
            .sum();
        sum / (4.0 * m1 * m1 * m2 * m2) / self.terms
    }

    /// Equivalent degrees of freedom if both factors are equal: 2 σ⁴/var(σ²), at least 1.
    pub fn degrees_of_freedom(&self, squares: &Squares) -> f64 {
        let variance = expected(squares, self.factors[0]);
        let degrees = 2.0 * variance * variance / self.of(squares);
        if degrees.is_finite() { degrees.max(1.0) } else { 1.0 }
    }
}

/// Generalised covariance of the angle at distance t ≥ 0 for N², B², K² = 1. Its second differences are the covariances of the second differences.
fn generalised(t: f64) -> [f64; 3] {
    let log = if t > 0.0 { t.ln() } else { 0.0 };
    [-0.5 * t, t * t * log / std::f64::consts::TAU, t * t * t / 12.0]
}

/// Number of pairs (i, j), 0 ≤ i < `one`, 0 ≤ j < `other`, with j − i < `lag`.
fn pairs_below(one: i128, other: i128, lag: i128) -> i128 {
    // Σ max(v, 0) over v < u.
    let sum = |u: i128| if u > 0 { u * (u - 1) / 2 } else { 0 };
    sum(one + lag) - sum(lag) - sum(one + lag - other) + sum(lag - other)
}

/// Degrees of freedom above which the Wilson–Hilferty approximation is used.
const MIN_WILSON_HILFERTY_DEGREES: f64 = 400.0;

/// Quantile of χ² divided by its degrees of freedom.
pub fn chi_squared_share(probability: f64, degrees: f64) -> f64 {
    if degrees > MIN_WILSON_HILFERTY_DEGREES {
        let part = 2.0 / (9.0 * degrees);
        return (1.0 - part + normal_quantile(probability) * part.sqrt()).powi(3);
    }
    chi_squared_quantile(probability, degrees) / degrees
}

/// Confidence interval of the deviation.
pub fn interval(deviation: f64, degrees: f64, confidence: f64) -> [f64; 2] {
    let tail = (1.0 - confidence) / 2.0;
    [1.0 - tail, tail].map(|p| deviation / chi_squared_share(p, degrees).sqrt())
}
