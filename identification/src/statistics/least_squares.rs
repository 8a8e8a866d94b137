//! Ordinary least squares with the covariance estimated from the residuals.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Smallest ratio of the singular values of the scaled columns. Below it, less than seven digits of the coefficients would be significant.
const MIN_SINGULAR_VALUE_RATIO: f64 = 1e-9;

/// Solution of a least-squares problem.
#[derive(Debug, Clone, PartialEq)]
pub struct LeastSquares {
    /// One coefficient per column.
    pub coefficients: Vec<f64>,
    /// Measured minus fitted value of each row.
    pub residuals: Vec<f64>,
    /// Standard deviation of the residuals, √(Σ residual²/dof).
    pub residual_sd: f64,
    /// Degrees of freedom: rows minus coefficients.
    pub dof: f64,
    /// Covariance of the coefficients.
    covariance: DMatrix<f64>,
}

impl LeastSquares {
    /// Standard uncertainty of coefficient `k`.
    pub fn sigma(&self, k: usize) -> f64 {
        self.covariance[(k, k)].max(0.0).sqrt()
    }

    /// Components of a function of the coefficients with this gradient along independent factors of variance 1: gradientᵀ L with covariance
    /// L Lᵀ. The root of the sum of squares is [`Self::sigma_of`].
    pub fn factors_of(&self, gradient: &[f64]) -> Vec<f64> {
        let m = self.coefficients.len();
        // The covariance is symmetric and positive semidefinite: L = V √λ.
        let scale: Vec<f64> = (0..m).map(|k| self.sigma(k).max(f64::MIN_POSITIVE)).collect();
        let correlation = DMatrix::from_fn(m, m, |i, j| self.covariance[(i, j)] / (scale[i] * scale[j]));
        let eigen = correlation.symmetric_eigen();
        (0..m)
            .map(|factor| {
                let root = eigen.eigenvalues[factor].max(0.0).sqrt();
                (0..m).map(|k| gradient.get(k).copied().unwrap_or(0.0) * scale[k] * eigen.eigenvectors[(k, factor)] * root).sum()
            })
            .collect()
    }

    /// Standard uncertainty of a function of the coefficients with this gradient, to first order. Missing components of the gradient are
    /// zero.
    pub fn sigma_of(&self, gradient: &[f64]) -> f64 {
        let component = |k: usize| gradient.get(k).copied().unwrap_or(0.0);
        let m = self.coefficients.len();
        let mut variance = 0.0;
        for i in 0..m {
            for j in 0..m {
                variance += component(i) * self.covariance[(i, j)] * component(j);
            }
        }
        variance.max(0.0).sqrt()
    }
}

/// Least squares by the normal equations, for a design whose columns have similar norms: the solution and χ². `None` where the equations
/// are singular.
pub fn normal_solution(design: &DMatrix<f64>, right: &DVector<f64>) -> Option<(DVector<f64>, f64)> {
    let solution = Cholesky::new(design.tr_mul(design))?.solve(&design.tr_mul(right));
    let chi2 = (right - design * &solution).norm_squared();
    Some((solution, chi2))
}

/// Fits `y` (n values) by the m columns of `rows` (n × m). `None` for n ≤ m, and for linearly dependent columns.
pub fn least_squares(rows: &[Vec<f64>], y: &[f64]) -> Option<LeastSquares> {
    let (n, m) = (rows.len(), rows.first()?.len());
    if n != y.len() || n <= m || m == 0 {
        return None;
    }
    // Columns are scaled to unit norm: their units differ by many orders of magnitude.
    let scale: Vec<f64> = (0..m).map(|j| rows.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt()).collect();
    if scale.iter().any(|s| !s.is_finite() || *s <= 0.0) {
        return None;
    }
    let a = DMatrix::from_fn(n, m, |i, j| rows[i][j] / scale[j]);
    let b = DVector::from_column_slice(y);
    let svd = a.clone().svd(true, true);
    let (largest, smallest) = (svd.singular_values.max(), svd.singular_values.min());
    if smallest.is_nan() || smallest <= MIN_SINGULAR_VALUE_RATIO * largest {
        return None;
    }
    let x = svd.solve(&b, 0.0).ok()?;
    let residual = &b - &a * &x;
    let dof = (n - m) as f64;
    let variance = residual.norm_squared() / dof;
    let v_t = svd.v_t?;
    let covariance = DMatrix::from_fn(m, m, |i, j| {
        let sum: f64 = (0..m).map(|k| v_t[(k, i)] * v_t[(k, j)] / svd.singular_values[k].powi(2)).sum();
        sum * variance / (scale[i] * scale[j])
    });
    Some(LeastSquares {
        coefficients: (0..m).map(|j| x[j] / scale[j]).collect(),
        residuals: residual.iter().copied().collect(),
        residual_sd: variance.sqrt(),
        dof,
        covariance,
    })
}

/// Weighted fit whose covariance is estimated from the sums over clusters of rows (Liang and Zeger 1986): it holds where the residuals of a
/// cluster are correlated and where their variances differ. Residuals are unweighted. `weights`: inverse variances; `clusters`: number of
/// the cluster of each row. The uncertainty of each coefficient is at least that of independent residuals with these weights. `None` as for
/// [`least_squares`], and for fewer clusters than columns plus two.
pub fn clustered_least_squares(rows: &[Vec<f64>], y: &[f64], weights: &[f64], clusters: &[usize]) -> Option<LeastSquares> {
    let m = rows.first()?.len();
    let root: Vec<f64> = weights.iter().map(|w| w.sqrt()).collect();
    let scaled: Vec<Vec<f64>> = rows.iter().zip(&root).map(|(row, r)| row.iter().map(|x| x * r).collect()).collect();
    let scaled_y: Vec<f64> = y.iter().zip(&root).map(|(y, r)| y * r).collect();
    let fit = least_squares(&scaled, &scaled_y)?;
    let mut sums: std::collections::BTreeMap<usize, DVector<f64>> = std::collections::BTreeMap::new();
    for ((row, residual), cluster) in scaled.iter().zip(&fit.residuals).zip(clusters) {
        *sums.entry(*cluster).or_insert_with(|| DVector::zeros(m)) += DVector::from_column_slice(row) * *residual;
    }
    let (n, groups) = (rows.len() as f64, sums.len() as f64);
    if groups < m as f64 + 2.0 {
        return None;
    }
    let meat = sums.values().fold(DMatrix::zeros(m, m), |meat, sum| meat + sum * sum.transpose());
    let variance = fit.residual_sd.powi(2).max(f64::MIN_POSITIVE);
    let bread = &fit.covariance / variance;
    let mut covariance = &bread * meat * &bread * (groups / (groups - 1.0) * (n - 1.0) / (n - m as f64));
    // At least as uncertain as independent residuals make it; the correlations stay.
    let widen: Vec<f64> = (0..m).map(|k| (fit.covariance[(k, k)] / covariance[(k, k)].max(f64::MIN_POSITIVE)).max(1.0).sqrt()).collect();
    for i in 0..m {
        for j in 0..m {
            covariance[(i, j)] *= widen[i] * widen[j];
        }
    }
    let residuals = fit.residuals.iter().zip(&root).map(|(r, root)| r / root).collect();
    Some(LeastSquares { covariance, residuals, dof: groups - m as f64, ..fit })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Certified values of NIST StRD, data set Norris (itl.nist.gov, linear regression, lower level of difficulty).
    #[test]
    fn norris_has_the_certified_values() {
        let data = [
            (0.2, 0.1),
            (337.4, 338.8),
            (118.2, 118.1),
            (884.6, 888.0),
            (10.1, 9.2),
            (226.5, 228.1),
            (666.3, 668.5),
            (996.3, 998.5),
            (448.6, 449.1),
            (777.0, 778.9),
            (558.2, 559.2),
            (0.4, 0.3),
            (0.6, 0.1),
            (775.5, 778.1),
            (666.9, 668.8),
            (338.0, 339.3),
            (447.5, 448.9),
            (11.6, 10.8),
            (556.0, 557.7),
            (228.1, 228.3),
            (995.8, 998.0),
            (887.6, 888.8),
            (120.2, 119.6),
            (0.3, 0.3),
            (0.3, 0.6),
            (556.8, 557.6),
            (339.1, 339.3),
            (887.2, 888.0),
            (999.0, 998.5),
            (779.0, 778.9),
            (11.1, 10.2),
            (118.3, 117.6),
            (229.2, 228.9),
            (669.1, 668.4),
            (448.9, 449.2),
            (0.5, 0.2),
        ];
        let rows: Vec<Vec<f64>> = data.iter().map(|(x, _)| vec![1.0, *x]).collect();
        let y: Vec<f64> = data.iter().map(|(_, y)| *y).collect();
        let fit = least_squares(&rows, &y).unwrap();
        for (k, (value, sigma)) in [(-0.262323073774029, 0.232818234301152), (1.00211681802045, 0.429796848199937e-3)].iter().enumerate() {
            assert!((fit.coefficients[k] / value - 1.0).abs() < 1e-10);
            assert!((fit.sigma(k) / sigma - 1.0).abs() < 1e-9);
        }
        assert!((fit.residual_sd / 0.884796396144373 - 1.0).abs() < 1e-10);
        assert!((fit.sigma_of(&[1.0]) / fit.sigma(0) - 1.0).abs() < 1e-12);
    }

    /// The mean of 40 clusters of 25 equal values is a mean of 40 values: its standard uncertainty is s/√40, not s/√1000.
    #[test]
    fn correlated_rows_of_a_cluster_count_once() {
        let of_cluster = |c: usize| ((c as f64 * 0.618_034).fract() - 0.5) * 12_f64.sqrt();
        let clusters: Vec<usize> = (0..1000).map(|k| k / 25).collect();
        let y: Vec<f64> = clusters.iter().map(|c| of_cluster(*c)).collect();
        let fit = clustered_least_squares(&vec![vec![1.0]; 1000], &y, &[4.0; 1000], &clusters).unwrap();
        assert!((fit.sigma(0) * 40_f64.sqrt() - 1.0).abs() < 0.03, "{}", fit.sigma(0));
        assert_eq!(fit.dof, 39.0);
        assert!((fit.factors_of(&[2.0])[0].abs() - 2.0 * fit.sigma(0)).abs() < 1e-12);
        assert_eq!(clustered_least_squares(&vec![vec![1.0]; 4], &y[..4], &[1.0; 4], &[0, 0, 1, 1]), None);
    }

    #[test]
    fn dependent_columns_give_no_fit() {
        let rows: Vec<Vec<f64>> = (0..5).map(|k| vec![1.0, f64::from(k), 2.0 * f64::from(k)]).collect();
        assert_eq!(least_squares(&rows, &[0.0; 5]), None);
        assert_eq!(least_squares(&[vec![1.0]], &[1.0]), None);
        assert_eq!(least_squares(&[], &[]), None);
    }
}
