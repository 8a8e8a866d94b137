//! The calibrated output of a device as a function of its input, with the uncertainty along the curve.
//!
//! Input: coefficients of a polynomial y(x) = Σ aₖ xᵏ, and contributions whose effect on y is a polynomial in x. Output: y ± U at an input,
//! and the input ± U that belongs to an output. The coefficients are correlated: their joint contribution has one polynomial per
//! independent factor of the fit, so that U(y) along the curve is right where the uncertainties of scale and bias alone would be too large
//! or too small. Limits: within the full scale.

use super::{Basis, Contribution};
use identification::statistics::uncertainty::{self, Evaluation, TemperatureRange};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A contribution along the curve.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveContribution {
    /// The influence; its sensitivity is 1.
    pub influence: Contribution,
    /// Effect of one standard uncertainty on the output, as polynomials in the input; their values add by root sum of squares.
    pub polynomials: Vec<Vec<f64>>,
}

/// The function with its contributions.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseFunction {
    /// Greatest magnitude of the input at which it holds.
    pub full_scale: f64,
    /// Coefficients a₀, a₁ … in the unit of the output per power of the input.
    pub coefficients: Vec<f64>,
    /// Temperature of the device under test.
    pub temperature: Option<TemperatureRange>,
    /// The contributions.
    pub contributions: Vec<CurveContribution>,
}

/// Value of a polynomial.
fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

impl ResponseFunction {
    /// A function without contributions.
    pub fn new(full_scale: f64, coefficients: Vec<f64>, temperature: Option<TemperatureRange>) -> Self {
        Self { full_scale, coefficients, temperature, contributions: Vec::new() }
    }

    /// Adds the contribution of a fit: for each coefficient its components along the independent factors.
    pub fn add_fit(&mut self, source: &str, dof: f64, basis: &Basis, components: Vec<Vec<f64>>) {
        let factors = components.first().map_or(0, Vec::len);
        let polynomials = (0..factors).map(|f| components.iter().map(|c| c[f]).collect()).collect();
        self.contributions.push(CurveContribution { influence: Contribution::type_a(source, 1.0, dof, basis.clone()), polynomials });
    }

    /// Adds an influence; `polynomial` is the change of the output per change of the influence.
    pub fn add(&mut self, influence: &Contribution, polynomial: &[f64]) {
        let polynomials = vec![polynomial.iter().map(|c| c * influence.u).collect()];
        self.contributions.push(CurveContribution { influence: Contribution { sensitivity: 1.0, ..influence.clone() }, polynomials });
    }
}

/// A contribution along the curve, as a record stores it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StoredCurveContribution {
    /// Name of the influence.
    #[serde(rename = "of")]
    pub source: String,
    /// Type A or B.
    #[serde(rename = "type")]
    pub evaluation: Evaluation,
    /// Distribution.
    pub distribution: uncertainty::Distribution,
    /// Degrees of freedom; `None`: taken as known.
    pub dof: Option<f64>,
    /// Effect of one standard uncertainty on the output, as polynomials in the input.
    pub polynomials: Vec<Vec<f64>>,
    /// How it was evaluated.
    #[serde(default, rename = "says")]
    pub basis: String,
}

/// The function, as a record stores it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StoredFunction {
    /// Unit of the input.
    pub input_unit: String,
    /// Unit of the output.
    pub output_unit: String,
    /// Greatest magnitude of the input at which it holds.
    pub full_scale: f64,
    /// Coefficients of the powers of the input.
    pub coefficients: Vec<f64>,
    /// Temperature of the device under test.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<TemperatureRange>,
    /// The contributions.
    pub contributions: Vec<StoredCurveContribution>,
}

/// A value of the function with its budget.
pub type Evaluated = uncertainty::Quantity<String, String>;

/// Why a function has no value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EvaluateError {
    /// Beyond the calibrated range.
    #[error("{value} {unit} is beyond the calibrated range of ± {limit} {unit}")]
    Range {
        /// The input.
        value: f64,
        /// Unit of the input.
        unit: String,
        /// Greatest magnitude.
        limit: f64,
    },
}

impl ResponseFunction {
    /// The function as a record stores it; `words` gives the text of a basis.
    pub fn stored(&self, words: impl Fn(&Basis) -> String) -> StoredFunction {
        let contribution = |c: &CurveContribution| StoredCurveContribution {
            source: c.influence.source.clone(),
            evaluation: c.influence.evaluation,
            distribution: c.influence.distribution,
            dof: c.influence.dof.is_finite().then_some(c.influence.dof),
            polynomials: c.polynomials.clone(),
            basis: words(&c.influence.basis),
        };
        StoredFunction {
            input_unit: "rad/s".into(),
            output_unit: "rad/s".into(),
            full_scale: self.full_scale,
            coefficients: self.coefficients.clone(),
            temperature: self.temperature,
            contributions: self.contributions.iter().map(contribution).collect(),
        }
    }
}

/// Tolerance of the calibrated range: setpoints are reached to this fraction.
const RANGE_TOLERANCE: f64 = 1e-3;

impl StoredFunction {
    fn check(&self, input: f64) -> Result<(), EvaluateError> {
        if input.abs() <= self.full_scale * (1.0 + RANGE_TOLERANCE) {
            Ok(())
        } else {
            Err(EvaluateError::Range { value: input, unit: self.input_unit.clone(), limit: self.full_scale })
        }
    }

    fn slope(&self, input: f64) -> f64 {
        let derivative: Vec<f64> = self.coefficients.iter().enumerate().skip(1).map(|(k, c)| k as f64 * c).collect();
        polynomial(&derivative, input)
    }

    fn budget(&self, input: f64, factor: f64) -> Vec<uncertainty::Contribution<String>> {
        let contribution = |c: &StoredCurveContribution| {
            let values: Vec<f64> = c.polynomials.iter().map(|p| polynomial(p, input)).collect();
            let u = values.iter().map(|v| v * v).sum::<f64>().sqrt();
            let sensitivity = match values.as_slice() {
                [one] => factor * one.signum(),
                _ => factor,
            };
            uncertainty::Contribution {
                evaluation: c.evaluation,
                dof: c.dof.unwrap_or(f64::INFINITY),
                distribution: c.distribution,
                ..uncertainty::Contribution::type_b(&c.source, u, &self.output_unit, sensitivity, c.basis.clone())
            }
        };
        self.contributions.iter().map(contribution).collect()
    }

    /// Output at an input.
    ///
    /// # Errors
    /// The input is beyond the calibrated range.
    pub fn output_at(&self, input: f64) -> Result<Evaluated, EvaluateError> {
        self.check(input)?;
        Ok(Evaluated::new("output", &self.output_unit, polynomial(&self.coefficients, input), self.budget(input, 1.0)))
    }

    /// Input that belongs to an output; the output itself is taken as exact, so that its noise is to be added.
    ///
    /// # Errors
    /// The input is beyond the calibrated range.
    pub fn input_of(&self, output: f64) -> Result<Evaluated, EvaluateError> {
        let first = |k: usize| self.coefficients.get(k).copied().unwrap_or(0.0);
        let mut input = (output - first(0)) / first(1);
        // Newton's method: three steps for a departure of some per cent from the straight line.
        for _ in 0..3 {
            input -= (polynomial(&self.coefficients, input) - output) / self.slope(input);
        }
        self.check(input)?;
        Ok(Evaluated::new("input", &self.input_unit, input, self.budget(input, -1.0 / self.slope(input))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// y = 0.01 + 2 x with u(bias) = 3e-3, u(scale) = 4e-3 and correlation −1: u(y) = |3e-3 − 4e-3 x| is 0 at x = 0.75.
    #[test]
    fn correlation_of_scale_and_bias_counts_along_the_curve() {
        let mut function = ResponseFunction::new(2.0, vec![0.01, 2.0], None);
        let basis = Basis::PlateausAboutCurve { count: 9 };
        function.add_fit("noise", 7.0, &basis, vec![vec![3e-3, 0.0], vec![-4e-3, 0.0]]);
        let stored = function.stored(|_| String::new());
        let u = |x: f64| stored.output_at(x).unwrap().combined_u();
        assert!((u(0.0) - 3e-3).abs() < 1e-12 && u(0.75) < 1e-12 && (u(-1.0) - 7e-3).abs() < 1e-12);
        let rate = stored.input_of(0.01 + 2.0 * 1.5).unwrap();
        assert!((rate.value - 1.5).abs() < 1e-12 && (rate.combined_u() - 1.5e-3).abs() < 1e-12);
        assert!(stored.output_at(2.1).unwrap_err().to_string().contains("beyond the calibrated range of ± 2 rad/s"));
    }
}
