//! Values with u, ν, k and U: one meaning of ± on all pages of metrology.
//!
//! ± is the expanded uncertainty U with a coverage probability of 95 %. Each table or text says so once ([`FOOTNOTE`]).

use schemars::JsonSchema;
use serde::Serialize;

use crate::units::Scale;
use crate::{plain, significant, with_sigma};
use identification::statistics::uncertainty::{COVERAGE_PROBABILITY, Estimate, Uncertainty};

/// Label of the ±, at the end of a text.
pub const FOOTNOTE: &str =
    "± U: expanded uncertainty, coverage probability 95 %; u = U/k is the standard uncertainty, ν its degrees of freedom.";

/// Degrees of freedom from which Student's distribution is shown as the normal one.
const MANY_DOF: f64 = 1e4;

/// Value ± U with the unit: `1.5036 ± 0.0066 °/h`.
pub fn with_expanded(estimate: &Estimate, scale: &Scale) -> String {
    let value = estimate.value * scale.factor;
    let number = match estimate.expanded() {
        Some(expanded) => with_sigma(value, expanded * scale.factor),
        None => significant(value, 5),
    };
    if scale.unit.is_empty() { number } else { format!("{number} {}", scale.unit) }
}

/// `(U, k = 2.78, ν = 4)`.
pub fn coverage(uncertainty: &Uncertainty) -> String {
    if uncertainty.dof < MANY_DOF {
        format!("(U, k = {}, ν = {})", plain(uncertainty.k, 3), uncertainty.dof.floor())
    } else {
        format!("(U, k = {})", plain(uncertainty.k, 3))
    }
}

/// Value ± U with unit and coverage factor; without uncertainty the value alone.
pub fn estimate(estimate: &Estimate, scale: &Scale) -> String {
    let shown = with_expanded(estimate, scale);
    estimate.uncertainty.map_or(shown.clone(), |uncertainty| format!("{shown} {}", coverage(&uncertainty)))
}

/// An estimate in JSON.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct EstimateJson {
    value: f64,
    sigma: Option<f64>,
    /// `null` for infinite degrees of freedom.
    dof: Option<f64>,
    k: Option<f64>,
    #[serde(rename = "U")]
    expanded: Option<f64>,
}

impl EstimateJson {
    /// The estimate times `factor`.
    pub fn new(estimate: &Estimate, factor: f64) -> Self {
        let Estimate { value, uncertainty } = estimate.scaled(factor);
        Self {
            value,
            sigma: uncertainty.map(|u| u.u),
            dof: uncertainty.map(|u| u.dof).filter(|dof| dof.is_finite()),
            k: uncertainty.map(|u| u.k),
            expanded: uncertainty.map(|u| u.expanded()),
        }
    }
}

/// A quantity by its name in a standard, in the units of the user.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct QuantityJson {
    /// Name in the standard.
    name: String,
    /// The standard and its clause or term.
    standard: &'static str,
    #[serde(flatten)]
    estimate: EstimateJson,
    unit: String,
    /// Coverage probability of U.
    coverage: f64,
}

impl QuantityJson {
    /// A quantity in SI units, shown in the unit of `scale`.
    pub fn new(name: impl Into<String>, standard: &'static str, estimate: &Estimate, scale: &Scale) -> Self {
        let unit = if scale.unit.is_empty() { "1".to_owned() } else { scale.unit.clone() };
        Self { name: name.into(), standard, estimate: EstimateJson::new(estimate, scale.factor), unit, coverage: COVERAGE_PROBABILITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn value_has_expanded_uncertainty_and_coverage_factor() {
        let found = Estimate { value: 0.015, uncertainty: Some(Uncertainty::student(1e-5, 4.0)) };
        let scale = Scale { factor: 100.0, unit: "°/h".to_owned() };
        assert_eq!(estimate(&found, &scale), "1.5000 ± 0.0028 °/h (U, k = 2.78, ν = 4)");
        let known = Estimate { value: 0.015, uncertainty: Some(Uncertainty::student(1e-5, f64::INFINITY)) };
        assert_eq!(estimate(&known, &scale), "1.5000 ± 0.0020 °/h (U, k = 1.96)");
        assert_eq!(estimate(&Estimate { uncertainty: None, ..found }, &scale), "1.5000 °/h");
        let json = serde_json::to_value(EstimateJson::new(&known, 1.0)).unwrap();
        assert!(json["dof"].is_null() && json["U"].as_f64().unwrap() > 1.95e-5, "{json}");
    }
}
