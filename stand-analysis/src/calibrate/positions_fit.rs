//! Least squares of positions whose errors are known in size: noise of each mean, and tilts, which act by the angle of each position.
//!
//! Input: one row of the design, one mean, the standard deviation of its noise and that of its tilt's effect per position. Output:
//! coefficients with two standard uncertainties each. Positions that scatter more than both explain (χ² beyond 95 %) have a variance of
//! their own besides, common to all, with which χ² is what is expected (Paule and Mandel, J. Res. NBS 87 (1982) 377).

use identification::statistics::distributions::chi_squared_tail;
use nalgebra::{DMatrix, DVector};

/// Probability of χ² below which the positions scatter more than noise and tilts.
const MIN_PROBABILITY: f64 = 0.05;
/// Bisections of the variance, relative to the largest squared residual.
const BISECTIONS: usize = 60;

/// Least variance of a position, relative to the mean of all, and least error of a mean, relative to the largest: so that the equations can
/// be solved where a position seems to have no error.
const MIN_VARIANCE_RATIO: f64 = 1e-6;
const MIN_RELATIVE_ERROR: f64 = 1e-12;

/// Standard deviations of one position's mean.
#[derive(Debug, Clone, Copy)]
pub(super) struct PositionErrors {
    /// Of its noise.
    pub noise: f64,
    /// Of the effect of its tilt.
    pub tilt: f64,
}

/// The fit.
pub(super) struct PositionsFit {
    /// One coefficient per column.
    pub coefficients: Vec<f64>,
    /// Standard uncertainties by the noise, and by a scatter of the positions.
    pub noise: Vec<f64>,
    /// Degrees of freedom of that noise.
    pub dof: f64,
    /// Standard uncertainties by the tilts.
    pub tilt: Vec<f64>,
}

/// Fits the positions; `noise_dof`: degrees of freedom of their noise. `None` where they do not determine the columns.
pub(super) fn fit(rows: &[Vec<f64>], means: &[f64], errors: &[PositionErrors], noise_dof: f64) -> Option<PositionsFit> {
    let free = rows.len().checked_sub(rows.first()?.len())? as f64;
    let known = Solved::of(rows, means, errors, 0.0)?;
    let scatters = free >= 1.0 && chi_squared_tail(known.chi2, free) < MIN_PROBABILITY;
    let (common, solved) = if scatters {
        let (mut low, mut high) = (0.0, known.residuals.norm_squared());
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if Solved::of(rows, means, errors, middle)?.chi2 > free { low = middle } else { high = middle }
        }
        (high, Solved::of(rows, means, errors, high)?)
    } else {
        (0.0, known)
    };
    let by = |variance: &dyn Fn(&PositionErrors) -> f64| -> Vec<f64> {
        let of = |k: usize| errors.iter().enumerate().map(|(row, e)| solved.gain[(k, row)].powi(2) * variance(e)).sum::<f64>().sqrt();
        (0..solved.coefficients.len()).map(of).collect()
    };
    Some(PositionsFit {
        noise: by(&|e| e.noise * e.noise + common),
        dof: if scatters { free } else { noise_dof },
        tilt: by(&|e| e.tilt * e.tilt),
        coefficients: solved.coefficients.iter().copied().collect(),
    })
}

/// Weighted least squares.
struct Solved {
    coefficients: DVector<f64>,
    residuals: DVector<f64>,
    chi2: f64,
    /// Change of each coefficient by each mean.
    gain: DMatrix<f64>,
}

impl Solved {
    fn of(rows: &[Vec<f64>], means: &[f64], errors: &[PositionErrors], common: f64) -> Option<Self> {
        let columns = rows.first()?.len();
        let design = DMatrix::from_fn(rows.len(), columns, |i, k| rows[i][k]);
        // Columns have units of their own: normalised.
        let sizes: Vec<f64> = design.column_iter().map(|column| column.norm()).collect();
        let scaled = DMatrix::from_fn(rows.len(), columns, |i, k| design[(i, k)] / sizes[k]);
        let variance = |e: &PositionErrors| e.noise * e.noise + e.tilt * e.tilt + common;
        let rounding = means.iter().fold(0.0, |most: f64, mean| most.max(mean.abs())) * MIN_RELATIVE_ERROR;
        let least = (MIN_VARIANCE_RATIO * errors.iter().map(variance).sum::<f64>() / errors.len() as f64).max(rounding * rounding);
        let weights = DVector::from_iterator(errors.len(), errors.iter().map(|e| 1.0 / variance(e).max(least)));
        let weighted = DMatrix::from_fn(rows.len(), columns, |i, k| weights[i] * scaled[(i, k)]);
        let mut gain = (scaled.transpose() * &weighted).cholesky()?.solve(&weighted.transpose());
        for (k, mut row) in gain.row_iter_mut().enumerate() {
            row /= sizes[k];
        }
        let measured = DVector::from_column_slice(means);
        let coefficients = &gain * &measured;
        let residuals = measured - design * &coefficients;
        let chi2 = residuals.iter().zip(&weights).map(|(residual, weight)| weight * residual * residual).sum();
        Some(Solved { coefficients, residuals, chi2, gain })
    }
}
