//! Uncertainty budgets of the GUM (JCGM 100:2008): standard uncertainties of type A and B with sensitivity coefficients, combined by root
//! sum of squares; effective degrees of freedom by Welch and Satterthwaite; expanded uncertainty by Student's t.
//!
//! Input: the [`Contribution`]s to a quantity, taken as independent of each other; correlated influences form one contribution. Output: a
//! [`Quantity`] with u, ν, k and U in its unit, and as an [`Estimate`] without the budget. The caller supplies the types of the
//! explanations: `B` for how a contribution was evaluated, `M` for what a quantity means. Two quantities of one calibration are correlated
//! by the influences that they have in common ([`covariance`], GUM 5.2 and F.1.2.3).

mod covariance;
mod estimate;
mod mixed;

pub use covariance::{CovarianceMatrix, Loadings, covariance};
pub use estimate::{Estimate, Uncertainty};

use super::distributions::{chi_squared_quantile, normal_quantile, student_quantile};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Coverage probability of expanded uncertainties.
pub const COVERAGE_PROBABILITY: f64 = 0.95;
/// Part of the variance below which rectangular contributions do not change the coverage factor.
const MIN_BOUNDED_FRACTION: f64 = 1e-3;
/// Degrees of freedom from which Student's t is replaced by the normal distribution: the quantiles agree to 1e-4.
const NORMAL_DOF: f64 = 1e4;

/// How a standard uncertainty was evaluated (GUM 2.3.2, 2.3.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Evaluation {
    /// By statistics of repeated observations.
    A,
    /// By other knowledge: data sheet, certificate, experience.
    B,
}

/// Distribution of an influence quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Distribution {
    /// Normal.
    Normal,
    /// Uniform within ± √3 u.
    Rectangular,
}

/// One line of an uncertainty budget.
#[derive(Debug, Clone, PartialEq)]
pub struct Contribution<B> {
    /// Name of the influence quantity: `clock`, `tilt`.
    pub source: String,
    /// Type A or B.
    pub evaluation: Evaluation,
    /// Standard uncertainty of the influence quantity, in `unit`.
    pub u: f64,
    /// Unit of the influence quantity; empty for the unit of the result.
    pub unit: String,
    /// Sensitivity coefficient with its sign: change of the result per change of the influence quantity. An influence that is common to two
    /// results is correlated by the signs of both coefficients.
    pub sensitivity: f64,
    /// Degrees of freedom; infinite where the standard uncertainty is taken as known.
    pub dof: f64,
    /// Distribution of the influence quantity.
    pub distribution: Distribution,
    /// Independent factors of a type A contribution that other quantities share: the coefficients of one fit.
    pub loadings: Option<Loadings>,
    /// How `u` was evaluated.
    pub basis: B,
}

impl<B> Contribution<B> {
    /// Type A: observed scatter, in the unit of the result.
    pub fn type_a(source: &str, u: f64, dof: f64, basis: B) -> Self {
        Self {
            source: source.into(),
            evaluation: Evaluation::A,
            u,
            unit: String::new(),
            sensitivity: 1.0,
            dof,
            distribution: Distribution::Normal,
            loadings: None,
            basis,
        }
    }

    /// Type B: standard uncertainty `u` in `unit`, normally distributed and taken as known.
    pub fn type_b(source: &str, u: f64, unit: &str, sensitivity: f64, basis: B) -> Self {
        Self {
            source: source.into(),
            evaluation: Evaluation::B,
            u,
            unit: unit.into(),
            sensitivity,
            dof: f64::INFINITY,
            distribution: Distribution::Normal,
            loadings: None,
            basis,
        }
    }

    /// Type B: bounds ± `half_width` with a uniform distribution between them (GUM 4.3.7).
    pub fn rectangular(source: &str, half_width: f64, unit: &str, sensitivity: f64, basis: B) -> Self {
        Self { distribution: Distribution::Rectangular, ..Self::type_b(source, rectangular_u(half_width), unit, sensitivity, basis) }
    }

    /// Contribution to the standard uncertainty of the result, |c| u, in the unit of the result.
    pub fn contribution(&self) -> f64 {
        self.signed_contribution().abs()
    }

    /// Change of the result by one standard uncertainty of the influence quantity, c u.
    pub fn signed_contribution(&self) -> f64 {
        self.u * self.sensitivity
    }

    /// The same influence on a result that is `factor` times this one.
    pub fn scaled(self, factor: f64) -> Self {
        let loadings = self.loadings.map(|l| l.scaled(factor));
        Self { sensitivity: self.sensitivity * factor, loadings, ..self }
    }

    /// Adds the factors that it shares with other quantities.
    pub fn with_loadings(self, loadings: Loadings) -> Self {
        Self { loadings: Some(loadings), ..self }
    }
}

/// Standard uncertainty of a uniform distribution within ± `half_width` (GUM 4.3.7).
pub fn rectangular_u(half_width: f64) -> f64 {
    half_width / 3_f64.sqrt()
}

/// A measured quantity with its uncertainty budget.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity<B, M> {
    /// Name, also its key in JSON: `scale`, `bias_rad_s`.
    pub name: String,
    /// Unit; `1` for a ratio.
    pub unit: String,
    /// Best estimate.
    pub value: f64,
    /// The uncertainty budget.
    pub contributions: Vec<Contribution<B>>,
    /// What the quantity means, and on which conditions it depends.
    pub meaning: Option<M>,
    /// Conditions at which the value holds.
    pub conditions: Conditions,
}

/// Conditions at which a value holds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Conditions {
    /// Temperature of the device under test, °C.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature: Option<TemperatureRange>,
    /// Wandering of the value between two measurements, which is not an error of this one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instability: Option<Instability>,
}

/// Temperature at which a value holds, with the range over which it was measured, °C.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TemperatureRange {
    /// Temperature of the value.
    #[serde(rename = "value_C")]
    pub at_C: f64,
    /// Smallest.
    #[serde(rename = "lowest_C")]
    pub low_C: f64,
    /// Greatest.
    #[serde(rename = "highest_C")]
    pub high_C: f64,
}

/// In-run instability of a value: its Allan deviation, in its unit, and the time over which the value is an average, s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Instability {
    /// Allan deviation.
    pub allan_deviation: f64,
    /// Averaging time of the value, s.
    pub averaged_s: f64,
}

impl<B, M> Quantity<B, M> {
    /// A quantity with its budget.
    pub fn new(name: &str, unit: &str, value: f64, contributions: Vec<Contribution<B>>) -> Self {
        Self { name: name.into(), unit: unit.into(), value, contributions, meaning: None, conditions: Conditions::default() }
    }

    /// Adds the meaning.
    pub fn meaning(self, meaning: M) -> Self {
        Self { meaning: Some(meaning), ..self }
    }

    /// Adds the conditions.
    pub fn conditions(self, conditions: Conditions) -> Self {
        Self { conditions, ..self }
    }

    /// Combined standard uncertainty u_c (GUM 5.1.2).
    pub fn combined_u(&self) -> f64 {
        self.contributions.iter().map(|c| c.contribution().powi(2)).sum::<f64>().sqrt()
    }

    /// Effective degrees of freedom (Welch–Satterthwaite, GUM G.4.1); infinite where no contribution has finite degrees of freedom.
    pub fn effective_dof(&self) -> f64 {
        welch_satterthwaite(self.contributions.iter())
    }

    /// Coverage factor for a coverage probability. The contributions that are not rectangular make a scaled Student distribution with their
    /// own effective degrees of freedom; with the rectangles the factor follows from the distribution of the sum (JCGM 101, 6.4.9.2 and
    /// 6.4.2). Without rectangles it is Student's t with ν truncated to an integer (GUM G.4.1); a single rectangle gives 1.65 for 95 %.
    pub fn coverage_factor(&self, probability: f64) -> f64 {
        let (rectangles, others): (Vec<_>, Vec<_>) = self.contributions.iter().partition(|c| c.distribution == Distribution::Rectangular);
        let half_widths: Vec<f64> = rectangles.iter().map(|c| c.contribution() * 3_f64.sqrt()).collect();
        let bounded: f64 = half_widths.iter().map(|a| a * a / 3.0).sum();
        let u = self.combined_u();
        if !u.is_finite() || bounded <= MIN_BOUNDED_FRACTION * u * u {
            return coverage_factor(self.effective_dof(), probability);
        }
        let dof = welch_satterthwaite(others.iter().copied());
        let scale = others.iter().map(|c| c.contribution().powi(2)).sum::<f64>().sqrt();
        mixed::half_width(&half_widths, scale, dof, probability) / u
    }

    /// Expanded uncertainty U for [`COVERAGE_PROBABILITY`].
    pub fn expanded_u(&self) -> f64 {
        self.coverage_factor(COVERAGE_PROBABILITY) * self.combined_u()
    }

    /// The interval value ± U contains `truth`.
    pub fn covers(&self, truth: f64) -> bool {
        (self.value - truth).abs() <= self.expanded_u()
    }

    /// The same quantity with other types for its texts.
    pub fn map_texts<C, N>(&self, basis: impl Fn(&B) -> C, meaning: impl Fn(&M) -> N) -> Quantity<C, N> {
        let contribution = |c: &Contribution<B>| Contribution {
            source: c.source.clone(),
            evaluation: c.evaluation,
            u: c.u,
            unit: c.unit.clone(),
            sensitivity: c.sensitivity,
            dof: c.dof,
            distribution: c.distribution,
            loadings: c.loadings.clone(),
            basis: basis(&c.basis),
        };
        Quantity {
            name: self.name.clone(),
            unit: self.unit.clone(),
            value: self.value,
            contributions: self.contributions.iter().map(contribution).collect(),
            meaning: self.meaning.as_ref().map(meaning),
            conditions: self.conditions,
        }
    }
}

/// Effective degrees of freedom of the root sum of squares; infinite where no contribution has finite degrees of freedom.
fn welch_satterthwaite<'c, B: 'c>(contributions: impl Iterator<Item = &'c Contribution<B>>) -> f64 {
    let (mut variance, mut sum) = (0.0, 0.0);
    for c in contributions {
        variance += c.contribution().powi(2);
        if c.dof.is_finite() {
            sum += c.contribution().powi(4) / c.dof.max(1e-9);
        }
    }
    if sum > 0.0 { variance * variance / sum } else { f64::INFINITY }
}

/// Coverage factor for `dof` degrees of freedom: Student's t.
pub fn coverage_factor(dof: f64, probability: f64) -> f64 {
    let quantile = 0.5 * (1.0 + probability);
    if dof.is_nan() || dof >= NORMAL_DOF {
        return normal_quantile(quantile);
    }
    student_quantile(quantile, dof.floor().max(1.0))
}

/// Standard uncertainty of an estimated standard deviation of normal values, in its unit. Its expanded uncertainty with Student's factor
/// reaches the upper end of the χ² interval, the farther one: σ ≤ s √(ν/χ²_ν(0.025)). GUM E.4.3, s/√(2ν), is symmetric, and its interval
/// about a value that is by chance too small ends below σ.
pub fn u_of_standard_deviation(deviation: f64, dof: f64) -> f64 {
    let upper = deviation * (dof / chi_squared_quantile(0.5 * (1.0 - COVERAGE_PROBABILITY), dof)).sqrt();
    (upper - deviation) / coverage_factor(dof, COVERAGE_PROBABILITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Plain = Quantity<(), ()>;

    /// JCGM 100:2008, H.1: an end gauge of 50 mm; lengths in nm.
    #[test]
    fn gum_example_h1_end_gauge() {
        let gauge = Plain::new(
            "length",
            "nm",
            50_000_838.0,
            vec![
                Contribution::type_a("standard", 25.0, 18.0, ()),
                Contribution::type_a("difference", 9.7, 25.6, ()),
                Contribution::type_a("difference of expansion", 2.9, 50.0, ()),
                Contribution::type_a("difference of temperature", 16.6, 2.0, ()),
            ],
        );
        // GUM: u_c = 32 nm (31.7 before rounding), ν_eff = 16.7 with u_c = 32, k = 2.92 for 99 % and ν = 16, U = 93 nm.
        assert!((gauge.combined_u() - 31.66).abs() < 0.05, "{}", gauge.combined_u());
        assert_eq!(gauge.effective_dof().floor(), 16.0, "{}", gauge.effective_dof());
        assert!((gauge.coverage_factor(0.99) - 2.92).abs() < 0.005);
        assert!((gauge.coverage_factor(0.99) * gauge.combined_u() - 93.0).abs() < 1.0);
    }

    /// Part of all samples of normal values whose standard deviation s ± k u(s) contains σ = 1: by quantiles of χ².
    #[test]
    fn standard_deviations_of_few_values_are_covered() {
        let covered = |dof: f64, u: &dyn Fn(f64) -> f64| {
            let k = coverage_factor(dof, COVERAGE_PROBABILITY);
            let deviations = (0..1000).map(|i| (chi_squared_quantile((f64::from(i) + 0.5) / 1000.0, dof) / dof).sqrt());
            deviations.filter(|s| (s - 1.0).abs() <= k * u(*s)).count() as f64 / 1000.0
        };
        for dof in [2.0, 5.0, 12.0, 50.0] {
            let part = covered(dof, &|s| u_of_standard_deviation(s, dof));
            assert!((0.95..=0.995).contains(&part), "{dof}: {part}");
        }
        assert!(covered(5.0, &|s| s / 10_f64.sqrt()) < 0.92, "the symmetric form of GUM E.4.3 covers less");
    }

    #[test]
    fn infinite_degrees_of_freedom_give_the_normal_factor() {
        let known = Plain::new("x", "1", 0.0, vec![Contribution::type_b("tilt", 2.0, "rad", -0.5, ())]);
        assert_eq!((known.combined_u(), known.effective_dof()), (1.0, f64::INFINITY));
        assert!((known.expanded_u() - 1.959_964).abs() < 1e-5);
        assert!(known.covers(1.9) && !known.covers(2.0));
    }

    #[test]
    fn dominating_rectangles_determine_the_coverage_factor() {
        // EA-4/02, S9: one dominating rectangle has k = 1.65 for 95 %.
        let contributions =
            vec![Contribution::rectangular("resolution", 1.0, "", 1.0, ()), Contribution::type_b("noise", 0.02, "", 1.0, ())];
        let dominated = Plain::new("x", "1", 0.0, contributions);
        assert!((dominated.coverage_factor(0.95) - 1.65).abs() < 0.01, "{}", dominated.coverage_factor(0.95));
        // Two equal rectangles make a triangle: 1 − (1 − x)² = 0.95 of its half-width.
        let rectangle = |source: &str| Contribution::rectangular(source, 1.0, "", 1.0, ());
        let two = Plain::new("x", "1", 0.0, vec![rectangle("a"), rectangle("b")]);
        let exact = 2.0 * (1.0 - 0.05_f64.sqrt()) / (2.0 / 3.0_f64).sqrt();
        assert!((two.coverage_factor(0.95) - exact).abs() < 2e-3, "{} {exact}", two.coverage_factor(0.95));
    }

    /// A rectangle beside a mean of four readings (ν = 3): by Monte Carlo of JCGM 101, 10⁷ draws, the 95 % half-width of a rectangle of
    /// half-width 1 plus 0.5 t₃ is 1.880 ± 0.001. The normal distribution in place of t₃ gives 1.451.
    #[test]
    fn degrees_of_freedom_beside_a_rectangle_count() {
        let contributions = vec![Contribution::rectangular("clock", 1.0, "", 1.0, ()), Contribution::type_a("noise", 0.5, 3.0, ())];
        let U = Plain::new("x", "1", 0.0, contributions).expanded_u();
        assert!((U - 1.880).abs() < 4e-3, "{U}");
    }

    #[test]
    fn sensitivities_keep_their_signs() {
        let clock = Contribution::type_b("clock", 2.0, "1", -0.5, ());
        assert_eq!((clock.sensitivity, clock.contribution(), clock.signed_contribution()), (-0.5, 1.0, -1.0));
        assert_eq!(clock.scaled(-2.0).sensitivity, 1.0);
    }

    #[test]
    fn standard_uncertainty_of_a_rectangle() {
        // GUM 4.3.7: half-width over √3.
        assert!((rectangular_u(0.5) - 0.288_675).abs() < 1e-6);
    }
}
