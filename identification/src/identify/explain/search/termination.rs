//! Why a search ends, and the rules that end one whose effects still improve the fit, but remove too little of an error far above the
//! noise.
//!
//! All functions take the χ²/n of the worst channel of each stage, the given model first.

use crate::identify::explain::criteria::{Criteria, MisfitClass};

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Termination {
    /// No further effect has enough evidence.
    NoEvidence,
    /// As many effects as allowed were added.
    MostAdded,
    /// The input between its samples explains what is left.
    InputBetweenSamples,
    /// It came back to effects that it had.
    Repeated,
    /// The last effects removed hardly anything.
    Insignificant,
    /// Many effects leave much of the error.
    TooMuchLeft,
    /// The budget is exhausted.
    Budget,
}

impl Termination {
    /// Other effects might have been added.
    pub fn is_by_budget(self) -> bool {
        self == Termination::Budget
    }
}

/// Number of effects to keep, where all later ones together explain less than half of what was left, and the misfit is still dominant.
pub fn stage_before_stand_ins(criteria: &Criteria, chi2_per_n: &[f64]) -> Option<usize> {
    let (left, before) = chi2_per_n.split_last()?;
    let dominant = criteria.noise.misfit(*left) == MisfitClass::Dominant;
    before.iter().position(|m| dominant && criteria.remainder(*m, *left) >= criteria.verdict.max_remainder)
}

/// The last effects removed hardly any of what was left, far above the noise. Near the noise small effects count.
pub fn last_effects_are_insignificant(criteria: &Criteria, chi2_per_n: &[f64]) -> bool {
    let c = &criteria.search;
    let insignificant =
        |w: &[f64]| criteria.noise.misfit(w[1]) > MisfitClass::Small && w[1] - 1.0 > (1.0 - c.max_insignificant_fraction) * (w[0] - 1.0);
    let in_a_row = c.max_insignificant_in_a_row;
    chi2_per_n.len() > in_a_row && chi2_per_n.windows(2).rev().take(in_a_row).all(insignificant)
}

/// Many effects leave much of the error: the verdict will not name them as the cause, and one more effect will not change this.
pub fn too_much_left(criteria: &Criteria, chi2_per_n: &[f64]) -> bool {
    let (Some(given), Some(left)) = (chi2_per_n.first(), chi2_per_n.last()) else { return false };
    let remainder = criteria.remainder(*given, *left);
    criteria.noise.misfit(*left) == MisfitClass::Dominant
        && criteria.search.max_remainders.iter().any(|(effects, most)| chi2_per_n.len() > *effects && remainder >= *most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_effects_are_insignificant_only_far_above_the_noise() {
        let insignificant = |misfits: &[f64]| last_effects_are_insignificant(&Criteria::default(), misfits);
        assert!(insignificant(&[13.0, 12.9, 12.8]));
        assert!(!insignificant(&[13.0, 12.9]), "one may fail");
        assert!(!insignificant(&[13.0, 12.9, 9.0]), "the last one helped");
        assert!(!insignificant(&[13.0, 9.0, 8.9]), "the one before helped");
        assert!(!insignificant(&[1.30, 1.299, 1.298]), "near the noise");
    }

    #[test]
    fn last_effects_that_explain_less_than_half_far_above_the_noise_are_stand_ins() {
        let kept = |misfits: &[f64]| stage_before_stand_ins(&Criteria::default(), misfits);
        assert_eq!(kept(&[5480.0, 3557.0, 28.2, 27.9, 24.0]), None, "near enough");
        assert_eq!(kept(&[5_480_000.0, 3_557_000.0, 28_200.0, 27_900.0, 24_000.0, 18_000.0]), Some(2));
        assert_eq!(kept(&[2000.0, 1800.0]), Some(0));
        assert_eq!(kept(&[2000.0, 30.0]), None);
        assert_eq!(kept(&[2000.0]), None);
    }

    #[test]
    fn search_ends_where_many_effects_leave_most_of_the_error() {
        let ends = |misfits: &[f64]| too_much_left(&Criteria::default(), misfits);
        assert!(ends(&[2000.0, 1800.0, 1500.0, 1300.0, 1200.0]));
        assert!(!ends(&[2000.0, 1800.0, 1500.0, 1300.0, 900.0]), "more than half is explained");
        assert!(!ends(&[20.0, 18.0, 17.0, 16.0, 15.0]), "near the noise");
        assert!(!ends(&[2000.0, 1800.0, 1500.0, 1300.0]), "only three");
        assert!(ends(&[2000.0, 1000.0, 900.0, 600.0, 500.0, 400.0, 300.0]));
        assert!(!ends(&[2000.0, 1000.0, 900.0, 600.0, 500.0, 400.0, 150.0]));
    }
}
