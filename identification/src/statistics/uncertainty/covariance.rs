//! Correlation between the quantities of one calibration by the influences that they have in common.
//!
//! Two contributions of type B with the same source, unit and standard uncertainty are the same influence quantity: their correlation is ±
//! 1 by the signs of the sensitivity coefficients. Contributions of type A from one fit have loadings: their components along independent
//! factors of variance 1. All other contributions are independent.

use super::{Contribution, Evaluation, Quantity};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Components of a contribution along the independent factors of one fit, in the unit of the result.
#[derive(Debug, Clone, PartialEq)]
pub struct Loadings {
    /// Name of the fit; only loadings of the same fit have the same factors.
    pub fit: &'static str,
    /// One component per factor; the root of the sum of squares is the standard uncertainty.
    pub components: Vec<f64>,
}

impl Loadings {
    pub(super) fn scaled(self, factor: f64) -> Self {
        Self { components: self.components.into_iter().map(|c| c * factor).collect(), ..self }
    }
}

/// Covariance of two contributions.
fn common<B>(a: &Contribution<B>, b: &Contribution<B>) -> f64 {
    match (&a.loadings, &b.loadings) {
        (Some(x), Some(y)) if x.fit == y.fit => x.components.iter().zip(&y.components).map(|(x, y)| x * y).sum(),
        (None, None) if a.evaluation == Evaluation::B && b.evaluation == Evaluation::B => {
            let is_same = a.source == b.source && a.unit == b.unit && a.u == b.u;
            if is_same { a.signed_contribution() * b.signed_contribution() } else { 0.0 }
        }
        _ => 0.0,
    }
}

/// Covariance of two quantities of one calibration.
pub fn covariance<B, M>(a: &Quantity<B, M>, b: &Quantity<B, M>) -> f64 {
    a.contributions.iter().flat_map(|x| b.contributions.iter().map(move |y| common(x, y))).sum()
}

/// Covariance matrix of the quantities of a calibration.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct CovarianceMatrix {
    /// Names of the quantities, in the order of rows and columns.
    pub quantities: Vec<String>,
    /// Covariances in the product of both units; `null` where one is not finite.
    pub matrix: Vec<Vec<Option<f64>>>,
}

impl CovarianceMatrix {
    /// The matrix of these quantities; variances are u².
    pub fn of<B, M>(quantities: &[Quantity<B, M>]) -> Self {
        let finite = |x: f64| x.is_finite().then_some(x);
        let element = |i: usize, j: usize| {
            finite(if i == j { quantities[i].combined_u().powi(2) } else { covariance(&quantities[i], &quantities[j]) })
        };
        let n = quantities.len();
        Self {
            quantities: quantities.iter().map(|q| q.name.clone()).collect(),
            matrix: (0..n).map(|i| (0..n).map(|j| element(i, j)).collect()).collect(),
        }
    }

    /// Correlation coefficient of two quantities; `None` without them.
    pub fn correlation(&self, a: &str, b: &str) -> Option<f64> {
        let place = |name: &str| self.quantities.iter().position(|q| q == name);
        let (i, j) = (place(a)?, place(b)?);
        let at = |i: usize, j: usize| self.matrix.get(i)?.get(j).copied().flatten();
        Some(at(i, j)? / (at(i, i)? * at(j, j)?).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Plain = Quantity<(), ()>;

    /// JCGM 100:2008, H.2: resistance and reactance from common readings have correlated results; here by two factors.
    #[test]
    fn common_influences_correlate_by_their_signs() {
        let clock = |c: f64| Contribution::rectangular("clock", 1e-4, "1", c, ());
        let of_fit = |components: [f64; 2]| {
            Contribution::type_a("noise", components[0].hypot(components[1]), 10.0, ())
                .with_loadings(Loadings { fit: "line", components: components.to_vec() })
        };
        let a = Plain::new("a", "1", 1.0, vec![clock(1.0), of_fit([3e-5, 4e-5])]);
        let b = Plain::new("b", "1", 2.0, vec![clock(-2.0), of_fit([4e-5, -3e-5])]);
        // The factors of the fit are orthogonal; only the clock remains: −2 (1e-4)²/3.
        assert!((covariance(&a, &b) + 2e-8 / 3.0).abs() < 1e-20);
        let own = Plain::new("c", "1", 1.0, vec![Contribution::type_a("noise", 1.0, 3.0, ())]);
        let matrix = CovarianceMatrix::of(&[a.clone(), b, own]);
        assert_eq!(matrix.correlation("a", "c"), Some(0.0));
        assert!((matrix.correlation("a", "a").unwrap_or(0.0) - 1.0).abs() < 1e-12);
        assert!(matrix.correlation("a", "b").is_some_and(|r| r < -0.5));
        assert_eq!(matrix.correlation("a", "none"), None);
    }
}
