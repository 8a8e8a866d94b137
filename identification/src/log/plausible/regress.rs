//! Linear regression on a few columns with an intercept, robust against outliers (Huber weights, iteratively reweighted).

use nalgebra::{SMatrix, SVector};

use super::windows::{mean, sd};
use crate::statistics::robust::{MEDIAN_ABS_PER_SIGMA, median_abs};

/// Result of a regression.
pub(super) struct Regression<const K: usize> {
    /// Coefficient of each column.
    pub slope: [f64; K],
    /// Its standard error.
    pub sigma: [f64; K],
    /// Partial correlation of the column with y, in [−1, 1].
    pub partial: [f64; K],
    /// Fraction of the variance of y that the columns explain.
    pub explained: f64,
}

/// Regresses `y` on the columns `x`; `None` for too few rows or constant columns.
pub(super) fn regress<const K: usize>(x: [&[f64]; K], y: &[f64]) -> Option<Regression<K>> {
    let rows = y.len();
    if rows < 4 * (K + 1) {
        return None;
    }
    let y_scale = sd(y);
    let x_scale = x.map(sd);
    // The log has finite numbers only, but their squares may overflow.
    if y_scale * x_scale[0] == 0.0 || !(y_scale + x_scale.iter().sum::<f64>()).is_finite() {
        return None;
    }
    let mut weights = vec![1.0; rows];
    let mut last = None;
    for _ in 0..8 {
        let total: f64 = weights.iter().sum();
        let center = |v: &[f64]| v.iter().zip(&weights).map(|(v, w)| v * w).sum::<f64>() / total;
        let (y0, x0) = (center(y), x.map(center));
        // The small ridge keeps the equations solvable with a constant column.
        let scaled = |k: usize, row: usize| if x_scale[k] > 0.0 { (x[k][row] - x0[k]) / x_scale[k] } else { 0.0 };
        let mut normal = SMatrix::<f64, K, K>::identity() * (1e-9 * total);
        let mut right = SVector::<f64, K>::zeros();
        for row in 0..rows {
            let v = SVector::<f64, K>::from_fn(|k, _| scaled(k, row));
            normal += v * v.transpose() * weights[row];
            right += v * ((y[row] - y0) / y_scale * weights[row]);
        }
        let inverse = normal.try_inverse()?;
        let b = inverse * right;
        let residual = |row: usize| (y[row] - y0) / y_scale - (0..K).map(|k| b[k] * scaled(k, row)).sum::<f64>();
        let residuals: Vec<f64> = (0..rows).map(residual).collect();
        let squares: f64 = residuals.iter().zip(&weights).map(|(r, w)| r * r * w).sum();
        let variance = squares / (total - (K + 1) as f64).max(1.0);
        let y_squares: f64 = y.iter().zip(&weights).map(|(v, w)| ((v - y0) / y_scale).powi(2) * w).sum();
        let mut fit = Regression { slope: [0.0; K], sigma: [0.0; K], partial: [0.0; K], explained: 1.0 - squares / y_squares.max(1e-300) };
        for k in 0..K {
            let se = (variance * inverse[(k, k)]).sqrt();
            let t = if se > 0.0 { b[k] / se } else { b[k].signum() * 1e9 };
            fit.partial[k] = t / (t * t + total).sqrt();
            if x_scale[k] > 0.0 {
                fit.slope[k] = b[k] * y_scale / x_scale[k];
                fit.sigma[k] = se * y_scale / x_scale[k];
            }
        }
        last = Some(fit);
        let typical = median_abs(&residuals).unwrap_or(0.0) / MEDIAN_ABS_PER_SIGMA;
        // Huber's weights. The floor applies to noise-free logs, where most residuals vanish.
        let bound = 2.0 * typical.max(1e-9);
        weights = residuals.iter().map(|r| if r.abs() > bound { bound / r.abs() } else { 1.0 }).collect();
    }
    last
}

/// Slope of the regression through the origin: Σxy/Σx².
pub(super) fn ratio(x: &[f64], y: &[f64]) -> f64 {
    let xy: Vec<f64> = x.iter().zip(y).map(|(x, y)| x * y).collect();
    let xx: Vec<f64> = x.iter().map(|x| x * x).collect();
    mean(&xy) / mean(&xx)
}
