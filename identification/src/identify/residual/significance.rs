//! Significance of a shape against noise with the spectrum of the remaining residual.
//!
//! The surrogates are all circular shifts of the remaining residual relative to the shapes: they have its spectrum, but no relation to the
//! shapes. Over all shifts the covariance of the projections Qᵀe is Σ_f S(f) Q̂(f) Q̂(f)ᴴ with the spectrum S of the remaining residual, so
//! that one transform gives all shifts. The projections of the residual itself are compared with this covariance as F(k, ν), where ν is the
//! number of independent spectral values that determine the covariance: few for a trend, thousands for a fast shape.

use nalgebra::{DMatrix, DVector};
use realfft::num_complex::Complex;

use crate::statistics::distributions::log10_f_tail;
use crate::statistics::fourier::transform;

/// Most lines on either side over which the spectrum is smoothed.
const MAX_SMOOTHING_LINES: usize = 12;
/// Least fraction of a column that is independent of the others, as a sum of squares.
const MIN_INDEPENDENT_FRACTION: f64 = 1e-3;

/// Inner product.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Eight partial sums: the additions of a single sum would wait for each other.
    let mut lanes = [0.0; 8];
    let (heads, tails) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = heads.remainder().iter().zip(tails.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in heads.zip(tails) {
        for (lane, (a, b)) in lanes.iter_mut().zip(a.iter().zip(b)) {
            *lane += a * b;
        }
    }
    rest + lanes.iter().sum::<f64>()
}

/// a − x b.
pub fn subtract_scaled(a: &mut [f64], x: f64, b: &[f64]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a -= x * b;
    }
}

/// Orthonormal basis of `columns`, orthogonal to `taken` (itself orthonormal).
pub fn orthonormal(taken: &[Vec<f64>], columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut list: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let before = dot(column, column);
        let mut own = column.clone();
        let mut after = before;
        // Repeated when little is left: rounding leaves parts of the other columns.
        for _ in 0..2 {
            for q in taken.iter().chain(&list) {
                let x = dot(&own, q);
                subtract_scaled(&mut own, x, q);
            }
            let left = dot(&own, &own);
            let enough = left > 0.01 * after;
            after = left;
            if enough {
                break;
            }
        }
        if before.is_finite() && after > MIN_INDEPENDENT_FRACTION * before && after > 0.0 {
            let scale = after.sqrt().recip();
            own.iter_mut().for_each(|v| *v *= scale);
            list.push(own);
        }
    }
    list
}

/// Result of a test.
#[derive(Debug, Clone, Copy)]
pub struct Significance {
    /// Decimal logarithm of the probability by chance.
    pub log10_p: f64,
    /// Expected sum of squares of the projections of noise.
    pub by_chance: f64,
}

/// Tests orthonormal `columns` (each several channels of `n` rows) on `y`.
pub fn test(columns: &[Vec<f64>], y: &[f64], n: usize) -> Significance {
    let none = Significance { log10_p: 0.0, by_chance: 0.0 };
    let k = columns.len();
    if k == 0 || n < 8 {
        return none;
    }
    let z: Vec<f64> = columns.iter().map(|q| dot(q, y)).collect();
    let mut rest = y.to_vec();
    for (q, z) in columns.iter().zip(&z) {
        subtract_scaled(&mut rest, *z, q);
    }
    let mut covariance = DMatrix::zeros(k, k);
    let (mut sum, mut squares) = (0.0, 0.0);
    for (c, part) in rest.chunks_exact(n).enumerate() {
        let spectrum = transform(part.to_vec());
        let raw: Vec<f64> = spectrum.iter().map(|s| s.norm_sqr() / n as f64).collect();
        let s = smooth(&raw);
        let q: Vec<Vec<Complex<f64>>> = columns.iter().map(|q| transform(q[c * n..(c + 1) * n].to_vec())).collect();
        let twice = |f: usize| if f == 0 || 2 * f == n { 1.0 } else { 2.0 } / n as f64;
        for a in 0..k {
            for b in 0..=a {
                let v: f64 = s.iter().enumerate().map(|(f, s)| twice(f) * s * (q[a][f] * q[b][f].conj()).re).sum();
                covariance[(a, b)] += v;
                if a != b {
                    covariance[(b, a)] += v;
                }
            }
        }
        let weight: Vec<f64> = (0..s.len()).map(|f| twice(f) * q.iter().map(|q| q[f].norm_sqr()).sum::<f64>()).collect();
        for (w, s) in smooth(&weight).iter().zip(&s) {
            sum += w * s;
            squares += (w * s).powi(2);
        }
    }
    let by_chance = covariance.trace();
    let freedom = (2.0 * sum * sum / squares.max(f64::MIN_POSITIVE) - k as f64).max(1.0);
    let z = DVector::from_vec(z);
    let Some(solved) = covariance.cholesky().map(|c| c.solve(&z)) else { return none };
    let f = z.dot(&solved) / k as f64;
    Significance { log10_p: log10_f_tail(f, k as f64, freedom), by_chance }
}

/// Running mean over neighbouring lines.
fn smooth(raw: &[f64]) -> Vec<f64> {
    let half = MAX_SMOOTHING_LINES.min(raw.len() / 16);
    let mut sums = vec![0.0];
    for v in raw {
        sums.push(sums[sums.len() - 1] + v);
    }
    (0..raw.len())
        .map(|k| {
            let (from, to) = (k.saturating_sub(half), (k + half + 1).min(raw.len()));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}
