//! Judgement of answers: normalised error of values, limit of their uncertainty, Brier score of probabilities.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::Serialize;

/// Normalised error up to which a value agrees with the reference (ISO/IEC 17043:2023, annex B: |E_n| ≤ 1).
pub const MAX_GOOD_ERROR: f64 = 1.0;
/// Normalised error up to which the measurement is to be repeated and its deviation explained; beyond, the value is wrong.
pub const MAX_REPEATED_ERROR: f64 = 1.5;
/// Greatest uncertainty as a multiple of that of the reference procedure on the same logs: otherwise a huge U would agree with everything.
pub const MAX_UNCERTAINTY_RATIO: f64 = 2.0;
/// Greatest error as a multiple of the student's own U: otherwise a tiny U would be without consequence, because U_ref in the denominator
/// of E_n stays. The true value is exact, so that the error tests the stated U: beyond 2 U are 6e-5 of Gaussian errors with k = 2, and no
/// error of a rectangle. With E_n ≤ 1 this concerns only U < U_ref/√3, so that a better evaluation than the reference procedure may state
/// its smaller U.
pub const MAX_ERROR_RATIO: f64 = 2.0;

/// Judgement of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Mark {
    /// Agrees with the reference, with an uncertainty within its limit.
    Good,
    /// Deviates by more than the uncertainties explain: repeat the measurement and explain the deviation.
    Repeat,
    /// Wrong value, or an uncertainty that is far too small.
    Wrong,
    /// The uncertainty is above its limit, whatever the value.
    UncertaintyTooLarge,
    /// The uncertainty does not cover the error, although the value is near the reference.
    UncertaintyTooSmall,
    /// Agrees with a reference on a real stand, whose own uncertainty is too great to test so small a U.
    UncertaintyNotTested,
    /// No value, or no uncertainty.
    NotFilledIn,
}

impl Mark {
    /// The value meets the numerical criteria.
    pub fn agrees(self) -> bool {
        matches!(self, Mark::Good | Mark::UncertaintyNotTested)
    }
}

/// A judged value.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JudgedQuantity {
    /// Name of the quantity, with its unit.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// The student's value.
    pub value: f64,
    /// The student's expanded uncertainty.
    #[serde(rename = "U")]
    pub expanded_u: f64,
    /// True value of the simulated device, or value of the teacher's reference.
    pub reference: f64,
    /// Expanded uncertainty of the teacher's reference; 0 for a simulated device, whose true value is exact.
    #[serde(rename = "U_X")]
    pub true_value_u: f64,
    /// Expanded uncertainty of the reference procedure on the same logs.
    #[serde(rename = "U_ref")]
    pub reference_u: f64,
    /// |x − X|/√(U² + U_ref²); on a real stand |x − X|/√(U² + U_X²).
    pub normalized_error: f64,
    /// Greatest permitted U.
    #[serde(rename = "U_limit")]
    pub u_limit: f64,
    /// |x − X|/U.
    pub error_ratio: f64,
    /// The judgement.
    pub mark: Mark,
}

/// Normalised error |x − X|/√(U² + U_ref²) of a value x ± U from a reference X ± U_ref, all in one unit.
pub fn normalized_error(value: f64, expanded_u: f64, reference: f64, reference_u: f64) -> f64 {
    (value - reference).abs() / expanded_u.hypot(reference_u)
}

/// The mark of a value `value` ± `expanded_u` beside the true value `reference` and the uncertainty of the reference procedure.
pub fn mark((value, expanded_u): (f64, f64), (reference, reference_u): (f64, f64)) -> Mark {
    let error = normalized_error(value, expanded_u, reference, reference_u);
    if error.is_nan() || expanded_u.is_nan() {
        Mark::NotFilledIn
    } else if expanded_u > MAX_UNCERTAINTY_RATIO * reference_u {
        Mark::UncertaintyTooLarge
    } else if error > MAX_REPEATED_ERROR {
        Mark::Wrong
    } else if error > MAX_GOOD_ERROR {
        Mark::Repeat
    } else if (value - reference).abs() > MAX_ERROR_RATIO * expanded_u {
        Mark::UncertaintyTooSmall
    } else {
        Mark::Good
    }
}

/// The mark of a value `value` ± `expanded_u` beside a reference X ± U_X; `procedure_u` is U_ref, the uncertainty of the reference
/// procedure on the same logs.
///
/// The error x − X has the expanded uncertainty √(U² + U_X²), so that E_n with this denominator is already the test of the stated U: four
/// standard uncertainties, the limit for an exact X ([`MAX_ERROR_RATIO`]), would be 2 √(U² + U_X²), which E_n ≤ 1 excludes. A limit of |x −
/// X| by U alone would be wrong, since the error of X is not the student's. What remains is what X cannot test: an error of 2 U has E_n ≤ 1
/// where 2 U ≤ √(U² + U_X²), that is U ≤ U_X/√3.
pub fn mark_on_real_stand((value, expanded_u): (f64, f64), (reference, reference_u): (f64, f64), procedure_u: f64) -> Mark {
    let error = normalized_error(value, expanded_u, reference, reference_u);
    if error.is_nan() || expanded_u.is_nan() {
        Mark::NotFilledIn
    } else if expanded_u > MAX_UNCERTAINTY_RATIO * procedure_u {
        Mark::UncertaintyTooLarge
    } else if error > MAX_REPEATED_ERROR {
        Mark::Wrong
    } else if error > MAX_GOOD_ERROR {
        Mark::Repeat
    } else if expanded_u < least_tested_u(reference_u) {
        Mark::UncertaintyNotTested
    } else {
        Mark::Good
    }
}

/// Smallest U that a reference with the expanded uncertainty `reference_u` tests: below, an error of [`MAX_ERROR_RATIO`] U has E_n ≤ 1.
pub fn least_tested_u(reference_u: f64) -> f64 {
    reference_u / (MAX_ERROR_RATIO * MAX_ERROR_RATIO - 1.0).sqrt()
}

/// Brier score of the stated probabilities: Σ (p − o)² over the classes, o = 1 for a class that is present and 0 for others. A class
/// without a probability has p = 0. With exactly one present class this is the score of Brier (Monthly Weather Review 78 (1950) 1), from 0
/// to 2 where the probabilities sum to 1; each further present class adds a term, so that two hidden effects are scored by the same sum.
/// The score is proper: its expectation is least for the probabilities that one believes.
pub fn brier_score(probabilities: &BTreeMap<String, f64>, present: &BTreeSet<String>) -> f64 {
    let missed = present.iter().filter(|class| !probabilities.contains_key(*class)).count() as f64;
    let stated = probabilities.iter().map(|(class, p)| (p - f64::from(u8::from(present.contains(class)))).powi(2));
    missed + stated.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probabilities(list: &[(&str, f64)]) -> BTreeMap<String, f64> {
        list.iter().map(|(class, p)| ((*class).to_owned(), *p)).collect()
    }

    fn present(list: &[&str]) -> BTreeSet<String> {
        list.iter().map(|class| (*class).to_owned()).collect()
    }

    #[test]
    fn normalized_error_adds_both_uncertainties_in_quadrature() {
        assert!((normalized_error(10.0, 3.0, 5.0, 4.0) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn marks_change_at_one_and_one_and_a_half() {
        // U = 3 and U_ref = 4: the denominator is 5.
        let of_error = |error: f64| mark((10.0 + error, 3.0), (10.0, 4.0));
        assert_eq!([5.0, 5.01, 7.5, 7.51].map(of_error), [Mark::Good, Mark::Repeat, Mark::Repeat, Mark::Wrong]);
    }

    #[test]
    fn huge_uncertainty_does_not_win() {
        assert_eq!(mark((7.0, 100.0), (5.0, 0.1)), Mark::UncertaintyTooLarge);
        assert_eq!(mark((5.0, 0.2), (5.0, 0.1)), Mark::Good);
        assert_eq!(mark((5.0, 0.2001), (5.0, 0.1)), Mark::UncertaintyTooLarge);
    }

    #[test]
    fn tiny_uncertainty_does_not_win() {
        assert_eq!(mark((5.01, 1e-9), (5.0, 0.1)), Mark::UncertaintyTooSmall);
        assert_eq!(mark((5.01, 0.0051), (5.0, 0.1)), Mark::Good, "a small U that covers the error is a better evaluation");
        assert_eq!(mark((6.0, 1e-9), (5.0, 0.1)), Mark::Wrong);
    }

    /// From U_ref/√3 on, E_n ≤ 1 implies an error within 2 U.
    #[test]
    fn own_uncertainty_limits_the_error_only_below_the_reference() {
        let limit = 1.0 / 3_f64.sqrt();
        for (factor, expected) in [(1.001, Mark::Good), (0.99, Mark::UncertaintyTooSmall)] {
            let u = factor * limit;
            let error = 0.9999 * u.hypot(1.0);
            assert_eq!(mark((error, u), (0.0, 1.0)), expected, "{factor}");
        }
    }

    #[test]
    fn empty_answer_is_not_filled_in() {
        for given in [(f64::NAN, 0.1), (5.0, f64::NAN), (f64::NAN, f64::NAN)] {
            assert_eq!(mark(given, (5.0, 0.1)), Mark::NotFilledIn);
        }
    }

    /// U_X = 1, U_ref = 1.
    #[test]
    fn reference_with_an_uncertainty_bears_its_part_of_the_error() {
        let of = |value: f64, u: f64| mark_on_real_stand((value, u), (0.0, 1.0), 1.0);
        assert_eq!(of(1.4, 1.0), Mark::Good);
        assert_eq!(of(1.5, 1.0), Mark::Repeat);
        assert_eq!(of(2.2, 1.0), Mark::Wrong);
        assert_eq!(of(0.0, 2.1), Mark::UncertaintyTooLarge);
        assert_eq!(of(0.9, 1e-9), Mark::UncertaintyNotTested);
        assert_eq!(of(1.1, 1e-9), Mark::Repeat);
        assert_eq!(of(f64::NAN, 1.0), Mark::NotFilledIn);
        assert!(Mark::UncertaintyNotTested.agrees() && !Mark::Repeat.agrees());
    }

    /// At the smallest tested U an error of 2 U has E_n = 1.
    #[test]
    fn smallest_tested_uncertainty_is_where_an_error_of_two_u_is_the_limit() {
        let u = least_tested_u(0.3);
        assert!((normalized_error(MAX_ERROR_RATIO * u, u, 0.0, 0.3) - 1.0).abs() < 1e-12);
        assert_eq!(mark_on_real_stand((0.0, 1.001 * u), (0.0, 0.3), 1.0), Mark::Good);
        assert_eq!(mark_on_real_stand((0.0, 0.999 * u), (0.0, 0.3), 1.0), Mark::UncertaintyNotTested);
    }

    #[test]
    fn brier_score_of_one_class_is_that_of_1950() {
        let stated = probabilities(&[("cogging", 0.7), ("none", 0.3)]);
        assert!((brier_score(&stated, &present(&["cogging"])) - 0.18).abs() < 1e-12);
        assert!((brier_score(&stated, &present(&["none"])) - 0.98).abs() < 1e-12);
        assert!((brier_score(&probabilities(&[("none", 1.0)]), &present(&["load"])) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn both_of_two_effects_count() {
        let two = present(&["cogging", "load"]);
        assert_eq!(brier_score(&probabilities(&[("cogging", 1.0), ("load", 1.0)]), &two), 0.0);
        assert_eq!(brier_score(&probabilities(&[("cogging", 1.0)]), &two), 1.0);
    }

    /// A believed probability of 0.6 is best stated as 0.6.
    #[test]
    fn honest_probability_has_the_least_expected_score() {
        let expected = |p: f64| {
            let stated = probabilities(&[("load", p), ("none", 1.0 - p)]);
            0.6 * brier_score(&stated, &present(&["load"])) + 0.4 * brier_score(&stated, &present(&["none"]))
        };
        assert!([0.0, 0.4, 0.55, 0.65, 1.0].into_iter().all(|p| expected(p) > expected(0.6)));
    }
}
