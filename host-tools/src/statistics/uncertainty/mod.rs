//! Uncertainty of a measurement, as the GUM has it (JCGM 100:2008): standard uncertainties of type A and B with their sensitivities, combined by
//! root sum of squares, effective degrees of freedom by Welch and Satterthwaite, expanded by Student's t.
//!
//! In: what contributes to a quantity ([`Part`]). Out: a [`Quantity`] with u, ν, k and U, in its unit, told in JSON or words. Contributions are taken
//! as independent of each other; what is correlated is one contribution.

mod sum;

use super::distributions::{normal_quantile, student_quantile};
use crate::report::finite;
use serde_json::{Value, json};

/// Probability that an expanded interval is to hold.
pub const CONFIDENCE: f64 = 0.95;

/// How a contribution was evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// By the scatter of what was measured.
    A,
    /// By other knowledge: a data sheet, a certificate, experience.
    B,
}

/// One line of a budget.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Where it comes from, in a word: `clock`, `tilt`.
    pub of: String,
    /// Type A or B.
    pub kind: Kind,
    /// Standard uncertainty of what contributes, in `unit`.
    pub u: f64,
    /// Its unit.
    pub unit: String,
    /// Change of the quantity per change of that, absolute.
    pub sensitivity: f64,
    /// Degrees of freedom; infinite where it is taken as known.
    pub dof: f64,
    /// It lies anywhere within ± √3 u with the same probability, and nowhere else; otherwise it is normal.
    pub is_rectangular: bool,
    /// How it was come by.
    pub says: String,
}

impl Part {
    /// Scatter that was measured, in the quantity's own unit.
    pub fn measured(of: &str, u: f64, dof: f64, says: impl Into<String>) -> Self {
        Self { of: of.into(), kind: Kind::A, u, unit: String::new(), sensitivity: 1.0, dof, is_rectangular: false, says: says.into() }
    }

    /// Knowledge from elsewhere: a standard uncertainty `u` in `unit`, and what it does to the quantity.
    pub fn known(of: &str, u: f64, unit: &str, sensitivity: f64, says: impl Into<String>) -> Self {
        Self {
            of: of.into(),
            kind: Kind::B,
            u,
            unit: unit.into(),
            sensitivity: sensitivity.abs(),
            dof: f64::INFINITY,
            is_rectangular: false,
            says: says.into(),
        }
    }

    /// Knowledge of bounds alone: anywhere within ± `half_width` (GUM 4.3.7).
    pub fn within(of: &str, half_width: f64, unit: &str, sensitivity: f64, says: impl Into<String>) -> Self {
        Self { is_rectangular: true, ..Self::known(of, rectangular(half_width), unit, sensitivity, says) }
    }

    /// What it makes of the quantity's uncertainty, in the quantity's unit.
    pub fn contribution(&self) -> f64 {
        self.u * self.sensitivity
    }
}

/// The standard uncertainty of something that lies anywhere within ± `half_width` (GUM 4.3.7).
pub fn rectangular(half_width: f64) -> f64 {
    half_width / 3_f64.sqrt()
}

/// A measured quantity with its budget.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Name, which is also its key in JSON: `scale`, `bias_rad_s`.
    pub name: String,
    /// Unit; `1` for a ratio.
    pub unit: String,
    /// The best estimate.
    pub value: f64,
    /// What its uncertainty is made of.
    pub parts: Vec<Part>,
    /// What a person should know of it; empty where there is nothing.
    pub says: String,
}

impl Quantity {
    /// A quantity with its contributions.
    pub fn new(name: &str, unit: &str, value: f64, parts: Vec<Part>) -> Self {
        Self { name: name.into(), unit: unit.into(), value, parts, says: String::new() }
    }

    /// The same with words.
    pub fn saying(self, says: impl Into<String>) -> Self {
        Self { says: says.into(), ..self }
    }

    /// Combined standard uncertainty u_c (GUM 5.1.2).
    pub fn sigma(&self) -> f64 {
        self.parts.iter().map(|p| p.contribution().powi(2)).sum::<f64>().sqrt()
    }

    /// Effective degrees of freedom (GUM G.4.1, Welch–Satterthwaite); infinite where nothing that is uncertain by itself contributes.
    pub fn dof(&self) -> f64 {
        let below: f64 = self.parts.iter().filter(|p| p.dof.is_finite()).map(|p| p.contribution().powi(4) / p.dof.max(1e-9)).sum();
        if below > 0.0 { self.sigma().powi(4) / below } else { f64::INFINITY }
    }

    /// Coverage factor for an interval that holds with this probability: Student's t with ν cut to a whole number (GUM G.4.1), unless bounds alone make
    /// much of it; then by the distribution of the sum (JCGM 101), which is narrower than a normal one.
    pub fn coverage_factor(&self, probability: f64) -> f64 {
        let student = coverage_factor(self.dof(), probability);
        let half_widths: Vec<f64> = self.parts.iter().filter(|p| p.is_rectangular).map(|p| p.contribution() * 3_f64.sqrt()).collect();
        let bounded: f64 = half_widths.iter().map(|a| a * a / 3.0).sum();
        let u = self.sigma();
        if bounded < 0.05 * u * u || self.dof() < 30.0 {
            return student;
        }
        sum::half_width(&half_widths, (u * u - bounded).max(0.0).sqrt(), probability) / u
    }

    /// Expanded uncertainty U for [`CONFIDENCE`].
    pub fn expanded(&self) -> f64 {
        self.coverage_factor(CONFIDENCE) * self.sigma()
    }

    /// The expanded interval holds this value.
    pub fn holds(&self, truth: f64) -> bool {
        (self.value - truth).abs() <= self.expanded()
    }

    /// A quantity back from its JSON; u, ν, k and U follow from the budget.
    ///
    /// # Errors
    /// What is missing, by its path.
    pub fn of_json(name: &str, q: &Value) -> Result<Self, String> {
        // What was no finite number is null there.
        let number = |of: &Value, key: &str| match of.get(key) {
            Some(Value::Null) => Ok(f64::NAN),
            found => found.and_then(Value::as_f64).ok_or_else(|| format!("{name}.{key} is no number")),
        };
        let word = |of: &Value, key: &str| of[key].as_str().unwrap_or_default().to_owned();
        let unit = q["unit"].as_str().ok_or_else(|| format!("{name}.unit is missing"))?;
        let parts = q["budget"].as_array().ok_or_else(|| format!("{name}.budget is missing"))?;
        let part = |p: &Value| -> Result<Part, String> {
            Ok(Part {
                of: word(p, "of"),
                kind: if p["type"] == "A" { Kind::A } else { Kind::B },
                u: number(p, "u")?,
                unit: word(p, "unit"),
                sensitivity: number(p, "sensitivity")?,
                dof: p["dof"].as_f64().unwrap_or(f64::INFINITY),
                is_rectangular: p["distribution"] == "rectangular",
                says: word(p, "says"),
            })
        };
        let parts = parts.iter().map(part).collect::<Result<_, _>>()?;
        Ok(Self { name: name.to_owned(), unit: unit.to_owned(), value: number(q, "value")?, parts, says: word(q, "says") })
    }

    /// `value`, `sigma`, `unit`, `dof`, `k`, `U`, and the budget.
    pub fn json(&self) -> Value {
        let parts: Vec<Value> = self
            .parts
            .iter()
            .map(|p| {
                json!({
                    "of": p.of, "type": if p.kind == Kind::A { "A" } else { "B" }, "u": finite(p.u),
                    "unit": if p.unit.is_empty() { &self.unit } else { &p.unit },
                    "sensitivity": finite(p.sensitivity), "distribution": if p.is_rectangular { "rectangular" } else { "normal" }, "dof": finite(p.dof), "contribution": finite(p.contribution()), "says": p.says,
                })
            })
            .collect();
        json!({
            "value": finite(self.value), "sigma": finite(self.sigma()), "unit": self.unit, "dof": finite(self.dof()),
            "k": finite(self.coverage_factor(CONFIDENCE)), "U": finite(self.expanded()), "coverage": CONFIDENCE, "budget": parts,
            "says": self.says,
        })
    }
}

/// Coverage factor of `dof` degrees of freedom: Student's t.
pub fn coverage_factor(dof: f64, probability: f64) -> f64 {
    let quantile = 0.5 * (1.0 + probability);
    // Beyond some ten thousand the two agree to 1e-4, and statrs' quantile takes for ever.
    if dof.is_nan() || dof >= 1e4 {
        return normal_quantile(quantile);
    }
    student_quantile(quantile, dof.floor().max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// JCGM 100:2008, H.1: an end gauge of 50 mm; lengths in nm.
    #[test]
    fn the_guide_s_end_gauge() {
        let part = |of: &str, u: f64, dof: f64| Part { dof, ..Part::measured(of, u, dof, "") };
        let gauge = Quantity::new(
            "length",
            "nm",
            50_000_838.0,
            vec![
                part("standard", 25.0, 18.0),
                part("difference", 9.7, 25.6),
                part("difference of expansion", 2.9, 50.0),
                part("difference of temperature", 16.6, 2.0),
            ],
        );
        // The guide: u_c = 32 nm (31.7 before rounding), ν_eff = 16.7 with u_c = 32, k = 2.92 for 99 % and 16, U = 93 nm.
        assert!((gauge.sigma() - 31.66).abs() < 0.05, "{}", gauge.sigma());
        assert_eq!(gauge.dof().floor(), 16.0, "{}", gauge.dof());
        assert!((gauge.coverage_factor(0.99) - 2.92).abs() < 0.005);
        assert!((gauge.coverage_factor(0.99) * gauge.sigma() - 93.0).abs() < 1.0);
    }

    #[test]
    fn without_degrees_of_freedom_it_is_the_normal_distribution() {
        let known = Quantity::new("x", "1", 0.0, vec![Part::known("tilt", 2.0, "rad", -0.5, "")]);
        assert_eq!((known.sigma(), known.dof()), (1.0, f64::INFINITY));
        assert!((known.expanded() - 1.959_964).abs() < 1e-5);
        assert_eq!(known.json()["dof"], Value::Null);
        assert!(known.holds(1.9) && !known.holds(2.0));
        assert_eq!(Quantity::of_json("x", &known.json()).unwrap().json(), known.json());
    }

    #[test]
    fn where_bounds_make_the_most_of_it_the_factor_is_theirs() {
        // EA-4/02, S9: one rectangle that dominates has k = 1.65 for 95 %.
        let mostly =
            Quantity::new("x", "1", 0.0, vec![Part::within("resolution", 1.0, "", 1.0, ""), Part::known("noise", 0.02, "", 1.0, "")]);
        assert!((mostly.coverage_factor(0.95) - 1.65).abs() < 0.01, "{}", mostly.coverage_factor(0.95));
        // Two equal ones make a triangle: 1 − (1 − x)² = 0.95 of its half-width.
        let two = Quantity::new("x", "1", 0.0, vec![Part::within("a", 1.0, "", 1.0, ""), Part::within("b", 1.0, "", 1.0, "")]);
        let exact = 2.0 * (1.0 - 0.05_f64.sqrt()) / (2.0 / 3.0_f64).sqrt();
        assert!((two.coverage_factor(0.95) - exact).abs() < 2e-3, "{} {exact}", two.coverage_factor(0.95));
    }

    #[test]
    fn a_rectangle_s_standard_uncertainty() {
        // GUM 4.3.7: half-width over √3.
        assert!((rectangular(0.5) - 0.288_675).abs() < 1e-6);
    }
}
