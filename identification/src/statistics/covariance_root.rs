//! The factor of a covariance matrix, by which correlated values become independent ones of variance 1.

use nalgebra::{Cholesky, DMatrix, Dyn};

/// The lower triangular factor L of a covariance matrix L Lᵀ.
#[derive(Debug, Clone, PartialEq)]
pub struct CovarianceRoot {
    root: DMatrix<f64>,
}

impl CovarianceRoot {
    /// The factor; `None` where the matrix is not positive definite.
    pub fn of(covariance: DMatrix<f64>) -> Option<Self> {
        Cholesky::<f64, Dyn>::new(covariance).map(|factor| CovarianceRoot { root: factor.l() })
    }

    /// The factor of a sum of matrices of one size, each with its weight.
    pub fn of_sum(parts: &[(&DMatrix<f64>, f64)]) -> Option<Self> {
        let (first, weight) = parts.first()?;
        let mut sum = *first * *weight;
        for (part, weight) in &parts[1..] {
            sum.zip_apply(*part, |sum, value| *sum += weight * value);
        }
        Self::of(sum)
    }

    /// L⁻¹ times the columns.
    pub fn whiten(&self, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        self.root.solve_lower_triangular(columns)
    }

    /// Logarithm of the determinant of the covariance.
    pub fn ln_determinant(&self) -> f64 {
        2.0 * self.root.diagonal().iter().map(|d| d.ln()).sum::<f64>()
    }

    /// Variance of value `i`.
    pub fn variance(&self, i: usize) -> f64 {
        self.root.row(i).norm_squared()
    }
}

/// Removes from all other columns what the columns `fitted` explain (Gram and Schmidt).
pub fn remove_fitted(columns: &mut DMatrix<f64>, fitted: std::ops::Range<usize>) {
    for k in fitted.clone() {
        let unit = columns.column(k).normalize();
        for j in (0..columns.ncols()).filter(|j| *j > k || !fitted.contains(j)) {
            let part = unit.dot(&columns.column(j));
            columns.column_mut(j).axpy(-part, &unit, 1.0);
        }
    }
}
