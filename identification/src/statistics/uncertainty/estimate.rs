//! A value with its uncertainty: u, ν, k and U.

use super::{COVERAGE_PROBABILITY, Quantity, coverage_factor};

/// Uncertainty of a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uncertainty {
    /// Standard uncertainty u.
    pub u: f64,
    /// Effective degrees of freedom ν; infinite where u is taken as known.
    pub dof: f64,
    /// Coverage factor k for [`COVERAGE_PROBABILITY`].
    pub k: f64,
}

impl Uncertainty {
    /// Standard uncertainty `u` with `dof` degrees of freedom; k by Student's t.
    pub fn student(u: f64, dof: f64) -> Self {
        Self { u, dof, k: coverage_factor(dof, COVERAGE_PROBABILITY) }
    }

    /// Expanded uncertainty U = k u.
    pub fn expanded(&self) -> f64 {
        self.k * self.u
    }

    /// With an independent contribution that is taken as known (Welch and Satterthwaite).
    pub fn with_known(self, u: f64) -> Self {
        let total = self.u.hypot(u);
        if total > 0.0 { Self::student(total, self.dof * (total / self.u).powi(4)) } else { self }
    }

    /// The uncertainty of the value multiplied by `factor`.
    pub fn scaled(self, factor: f64) -> Self {
        Self { u: self.u * factor.abs(), ..self }
    }
}

/// A value with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Uncertainty; `None` where the data do not determine it.
    pub uncertainty: Option<Uncertainty>,
}

impl Estimate {
    /// Standard uncertainty u.
    pub fn sigma(&self) -> Option<f64> {
        self.uncertainty.map(|uncertainty| uncertainty.u)
    }

    /// Expanded uncertainty U.
    pub fn expanded(&self) -> Option<f64> {
        self.uncertainty.map(|uncertainty| uncertainty.expanded())
    }

    /// The estimate multiplied by `factor`.
    pub fn scaled(self, factor: f64) -> Self {
        Self { value: self.value * factor, uncertainty: self.uncertainty.map(|uncertainty| uncertainty.scaled(factor)) }
    }

    /// The interval value ± U contains `truth`; `false` without uncertainty.
    pub fn covers(&self, truth: f64) -> bool {
        self.expanded().is_some_and(|expanded| (self.value - truth).abs() <= expanded)
    }
}

impl<B, M> Quantity<B, M> {
    /// Value, u, ν and k.
    pub fn estimate(&self) -> Estimate {
        let uncertainty = Uncertainty { u: self.combined_u(), dof: self.effective_dof(), k: self.coverage_factor(COVERAGE_PROBABILITY) };
        Estimate { value: self.value, uncertainty: Some(uncertainty) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// GUM G.4.1: ν_eff = u⁴/(u₁⁴/ν₁) = 3 (√2)⁴ = 12 for equal parts.
    #[test]
    fn a_known_contribution_increases_the_degrees_of_freedom() {
        let sum = Uncertainty::student(1.0, 3.0).with_known(1.0);
        assert!((sum.u - 2_f64.sqrt()).abs() < 1e-12 && (sum.dof - 12.0).abs() < 1e-9 && (sum.k - 2.179).abs() < 1e-3, "{sum:?}");
        let alone = Uncertainty::student(0.0, 3.0).with_known(1.0);
        assert!(alone.dof.is_infinite() && (alone.k - 1.96).abs() < 1e-3, "{alone:?}");
    }
}
