//! Arithmetic of the students: line fits and coverage by the formulas that the instructions give.

use nalgebra::{DMatrix, DVector};

/// A least-squares fit: coefficients, their covariance, degrees of freedom.
pub struct Fit {
    pub found: Vec<f64>,
    pub covariance: DMatrix<f64>,
    pub dof: f64,
}

impl Fit {
    /// Of the rows of a design to the values, by the normal equations with columns of unit norm.
    pub fn of(rows: &[Vec<f64>], values: &[f64]) -> Self {
        let columns = rows[0].len();
        let mut design = DMatrix::from_fn(rows.len(), columns, |i, j| rows[i][j]);
        let scale: Vec<f64> = (0..columns).map(|j| design.column(j).norm()).collect();
        (0..columns).for_each(|j| design.column_mut(j).unscale_mut(scale[j]));
        let values = DVector::from_column_slice(values);
        let inverse = (design.transpose() * &design).try_inverse().unwrap();
        let found = &inverse * (design.transpose() * &values);
        let dof = (rows.len() - columns) as f64;
        let variance = (&values - &design * &found).norm_squared() / dof;
        Fit {
            found: (0..columns).map(|j| found[j] / scale[j]).collect(),
            covariance: DMatrix::from_fn(columns, columns, |i, j| variance * inverse[(i, j)] / (scale[i] * scale[j])),
            dof,
        }
    }

    /// Standard uncertainty of a coefficient.
    pub fn sigma(&self, k: usize) -> f64 {
        self.covariance[(k, k)].sqrt()
    }

    /// Standard uncertainty of a function of the coefficients with this gradient.
    pub fn sigma_of(&self, gradient: &[f64]) -> f64 {
        let gradient = DVector::from_column_slice(gradient);
        (gradient.transpose() * &self.covariance * &gradient)[(0, 0)].sqrt()
    }
}

/// Expanded uncertainty of rectangles with the half-widths `a` and a standard uncertainty `u` of type A: the formula in the theory of work
/// 1.
pub fn expanded(a: &[f64], u: f64) -> f64 {
    let mut a: Vec<f64> = a.iter().map(|a| a.abs()).collect();
    a.sort_by(|x, y| y.total_cmp(x));
    let rectangles = match a[..] {
        [] => 0.0,
        [one] => 1.65 * one / 3_f64.sqrt(),
        [first, second, ..] => first + second - (0.2 * first * second).sqrt(),
    };
    rectangles.hypot(2.0 * u)
}

pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation of the mean of independent values.
pub fn sigma_of_mean(values: &[f64]) -> f64 {
    let (n, mean) = (values.len() as f64, mean(values));
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt()
}
