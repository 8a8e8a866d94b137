//! Covariance of overlapping Allan variances, equivalent degrees of freedom and χ² confidence intervals.
//!
//! Input: five noise coefficients, averaging factors, lengths of the segments. Output: covariances, degrees of freedom, intervals. NIST SP
//! 1065 (after Greenhall and Riley, 2004) treats one power law; this module treats their sum: for Gaussian differences z₁, z₂ of two
//! averaging factors, cov(⟨z₁²⟩, ⟨z₂²⟩) is the mean of 2 c² + 4 µ₁µ₂ c over all pairs of terms, with their covariance c at the lag of the
//! pair and the contribution µ of a ramp. For one power law this equals Greenhall's sum; it also gives the correlation of adjacent points.
//!
//! The unit of time is the row: τ₀ = 1.

use super::FLOOR;
use identification::statistics::distributions::{chi_squared_quantile, normal_quantile};

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
/// Number of lags per shorter averaging time at which the covariance is computed where it has kinks; it is nearly linear in between.
const LAGS_PER_AVERAGE: usize = 16;
/// Range of the lags, in half-lengths of both differences.
const LAG_RANGE: f64 = 1.5;
/// Part of the distance to the next kink over which the covariance is taken as linear.
const STEP_PER_DISTANCE: f64 = 0.125;

/// Covariance of the variances at two averaging factors for any sum of the processes: a quadratic form of Q², N², B², K² and, by R², a
/// linear one.
///
/// No pair of factors is negligible: under random walk alone variances at factors 1 : 64 correlate by 0.17, under quantisation alone by
/// 0.5. A matrix without them is not positive definite.
#[derive(Debug, Clone)]
pub struct Covariance {
    factors: [usize; 2],
    quadratic: [[f64; 4]; 4],
    linear: [f64; 4],
    terms: f64,
}

impl Covariance {
    /// `segments`: pairs of a segment length (in angles) and the number of segments with this length.
    pub fn new(one: usize, other: usize, segments: &[(usize, usize)]) -> Self {
        let (short, long) = (one.min(other), one.max(other));
        // Averages of more rows are computed as this many, up to the scale.
        let scaled = short.min(LAGS_PER_AVERAGE);
        let scale = short as f64 / scaled as f64;
        let ratio = long as f64 / short as f64;
        let (a, b) = (scaled as f64, scaled as f64 * ratio);
        let counted: Vec<[i128; 3]> = segments
            .iter()
            .filter(|(angles, _)| *angles > 2 * long)
            .map(|(angles, count)| [(angles - 2 * short) as i128, (angles - 2 * long) as i128, *count as i128])
            .collect();
        let below = |lag: i128| counted.iter().map(|[m1, m2, n]| n * pairs_below(*m1, *m2, lag)).sum::<i128>() as f64;
        let edge = |lag: f64| below((lag * scale).ceil() as i128);
        let smooth_powers = [scale, scale * scale, scale * scale * scale];
        let (mut quadratic, mut linear) = ([[0.0; 4]; 4], [0.0; 4]);
        for [from, to] in cells(a, b) {
            let pairs = edge(to) - edge(from);
            let lag = 0.5 * (from + to);
            // Covariance of the two differences per Q² (white angle noise: at this lag only), N², B², K².
            let mut parts = [0.0; 4];
            for (i, wi) in WEIGHTS.iter().enumerate() {
                for (j, wj) in WEIGHTS.iter().enumerate() {
                    let t = lag + j as f64 * b - i as f64 * a;
                    parts[1..].iter_mut().zip(generalised(t.abs())).for_each(|(sum, s)| *sum += wi * wj * s);
                    parts[0] += if t.abs() < 0.25 { wi * wj } else { 0.0 };
                }
            }
            parts[1..].iter_mut().zip(smooth_powers).for_each(|(s, power)| *s *= power);
            let exact = (lag * scale).round() as i128;
            let phase_pairs = if parts[0] == 0.0 { 0.0 } else { below(exact + 1) - below(exact) };
            for (i, one) in parts.iter().enumerate() {
                linear[i] += if i == 0 { phase_pairs } else { pairs } * one;
                for (j, other) in parts.iter().enumerate() {
                    quadratic[i][j] += 2.0 * if i * j == 0 { phase_pairs } else { pairs } * one * other;
                }
            }
        }
        let terms = |m: usize| segments.iter().map(|(angles, n)| angles.saturating_sub(2 * m) as f64 * *n as f64).sum::<f64>();
        Self { factors: [short, long], quadratic, linear, terms: terms(short) * terms(long) }
    }

    /// Covariance in the fourth power of the rate's unit.
    pub fn of(&self, squares: &Squares) -> f64 {
        let [m1, m2] = self.factors.map(|m| m as f64);
        // 4 µ₁ µ₂ with µ = R m².
        let mean = 4.0 * squares[4] * m1 * m1 * m2 * m2;
        let row = |i: usize| (0..4).map(|j| self.quadratic[i][j] * squares[j]).sum::<f64>() + mean * self.linear[i];
        let sum: f64 = (0..4).map(|i| squares[i] * row(i)).sum();
        sum / (4.0 * m1 * m1 * m2 * m2) / self.terms
    }

    /// Equivalent degrees of freedom if both factors are equal: 2 σ⁴/var(σ²), at least 1.
    pub fn degrees_of_freedom(&self, squares: &Squares) -> f64 {
        let variance = expected(squares, self.factors[0]);
        let degrees = 2.0 * variance * variance / self.of(squares);
        if degrees.is_finite() { degrees.max(1.0) } else { 1.0 }
    }
}

/// Cells of lags, each with one value of the covariance. At the ends and in the middle of the longer difference (of length 2 b), within the
/// shorter one (2 a), the covariance has kinks, and a cell is one lag; elsewhere cells grow with the distance from there.
fn cells(a: f64, b: f64) -> Vec<[f64; 2]> {
    let middle = (a - b).round();
    let reach = (LAG_RANGE * (a + b)).ceil();
    let kinks = [0.0, 1.0, 2.0].map(|j| [-j * b - 1.0, -j * b + 2.0 * a + 1.0]);
    let (mut found, mut from) = (Vec::new(), middle - reach - 0.5);
    while from < middle + reach + 0.5 {
        let distance = kinks.iter().map(|[low, high]| (low - from).max(from - high).max(0.0)).fold(f64::INFINITY, f64::min);
        let ahead = kinks.iter().map(|[low, _]| low - from).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
        let to = from + (STEP_PER_DISTANCE * distance).min(ahead).floor().max(1.0);
        found.push([from, to]);
        from = to;
    }
    found
}

/// Generalised covariance of the angle at distance t ≥ 0 for N², B², K² = 1. Its second differences are the covariances of the second
/// differences.
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
