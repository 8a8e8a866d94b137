//! Comparison of the refitted candidates: evidence for each, the best one, and those that the logs cannot distinguish from it.

use drive_model::{Card, cards};
use rayon::prelude::*;

use super::candidate::{FittedCandidate, channel_errors};
use super::doubt::Doubt;
use super::open_course::gain_beside_course;
use super::refit::screen_and_refit;
use super::refusal::refusal;
use super::screen::ScreenedOnly;
use crate::identify::explain::answer::Candidate;
use crate::identify::explain::answer::reasons::Refusal;
use crate::identify::explain::criteria::EvidenceCriteria;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::likelihood::{WhitenedSums, Whitener, delta_bic};
use crate::identify::explain::fitted::trial::{Invisible, Trial};
use crate::statistics::Extremes;
use crate::statistics::distributions::ln_chi_squared_tail;

/// One adding step: all effects that were tried in addition to a model.
pub struct AddingStep<'c> {
    /// Refitted candidates by BIC, the best first; one for each effect.
    pub candidates: Vec<FittedCandidate>,
    /// Number of tests that it made.
    pub tests: usize,
    /// Number of independent samples of the gains.
    effective_samples: f64,
    screened: Vec<ScreenedOnly>,
    invisible: Vec<Invisible>,
    criteria: &'c EvidenceCriteria,
    min_identifiable_fraction: f64,
}

/// Screens all effects in addition to a model, refits the best trials and compares them.
pub fn adding_step<'c>(base: &FittedModel<'c>) -> AddingStep<'c> {
    let (screening, fitted) = screen_and_refit(base);
    let (candidates, effective_samples) = compare(base, fitted, screening.tests);
    AddingStep {
        effective_samples,
        tests: screening.tests,
        screened: screening.only_screened(candidates.iter().map(|f| &f.trial)),
        candidates,
        invisible: screening.invisible,
        criteria: &base.context.criteria.evidence,
        min_identifiable_fraction: base.context.criteria.screening.min_identifiable_fraction,
    }
}

/// Evidence for each candidate against the model without it, on residuals whitened by the filter of the best candidate; and the number of
/// independent samples.
fn compare(base: &FittedModel, mut fitted: Vec<FittedCandidate>, tests: usize) -> (Vec<FittedCandidate>, f64) {
    let Some(best) = fitted.iter().min_by(|a, b| a.chi2.total_cmp(&b.chi2)) else { return (fitted, 0.0) };
    let residuals: Vec<&[f64]> = best.residuals.iter().map(Vec::as_slice).collect();
    let whitener = Whitener::of(&base.data_for(&best.trial), &residuals, &base.context.criteria.whitening);
    let without = base.whitened_sums(&whitener);
    let all: Vec<WhitenedSums> = fitted.par_iter().map(|f| f.whitened_sums(base, &whitener)).collect();
    for (f, with) in fitted.iter_mut().zip(all) {
        let gain = without.gain(&with);
        f.gain = gain;
        f.delta_bic = delta_bic(gain, f.extra_parameters as f64, without.effective_samples());
        f.ln_p = familywise_ln_p(gain, f.extra_parameters, tests);
        f.refused = refusal(base, f, &without, &with);
    }
    fitted.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic).then(position(a.trial.card).cmp(&position(b.trial.card))));
    let mut seen: Vec<&str> = Vec::new();
    fitted.retain(|f| {
        let new = !seen.contains(&f.trial.card.id);
        seen.push(f.trial.card.id);
        new
    });
    (fitted, without.effective_samples())
}

/// Logarithm of the probability of such a gain by chance in one of so many tests.
pub fn familywise_ln_p(gain: f64, parameters: usize, tests: usize) -> f64 {
    (ln_chi_squared_tail(gain, parameters as f64) + (tests as f64).ln()).min(0.0)
}

/// Position in the catalogue, by which one of several effects is named that the logs cannot distinguish.
pub fn position(card: &Card) -> usize {
    cards().iter().position(|c| c.id == card.id).unwrap_or(usize::MAX)
}

/// Indices of candidates with these ΔBIC and positions in the catalogue, the best first; of those within `indistinguishable` of the best
/// one the first in the catalogue.
fn in_order_of_preference(candidates: Vec<(f64, usize)>, indistinguishable: f64) -> Vec<usize> {
    let mut left: Vec<(usize, (f64, usize))> = candidates.into_iter().enumerate().collect();
    let mut order = Vec::new();
    while !left.is_empty() {
        let limit = left.iter().map(|(_, (bic, _))| *bic).min_or_infinity() + indistinguishable;
        let alike = left.iter().enumerate().filter(|(_, (_, (bic, _)))| *bic <= limit);
        let Some((k, _)) = alike.min_by_key(|(_, (_, (_, position)))| *position) else { break };
        order.push(left.remove(k).0);
    }
    order
}

impl AddingStep<'_> {
    /// The candidate is significant, improves BIC enough and was not refused.
    fn is_accepted(&self, f: &FittedCandidate) -> bool {
        f.refused.is_none() && self.criteria.is_significant(f.ln_p, f.delta_bic)
    }

    fn leaves_far_less(&self, one: &FittedCandidate, other: &FittedCandidate) -> bool {
        self.criteria.leaves_far_less(&one.heldout_chi2_per_n, &other.heldout_chi2_per_n)
    }

    /// The best accepted candidate by BIC. Whitening gives slow errors a small weight: a candidate that leaves far less on the held-out
    /// rows goes first.
    fn best(&self) -> Option<&FittedCandidate> {
        let mut best = self.candidates.iter().find(|f| self.is_accepted(f))?;
        while let Some(better) = self.candidates.iter().find(|f| self.is_accepted(f) && self.leaves_far_less(f, best)) {
            best = better;
        }
        Some(best)
    }

    /// The logs cannot distinguish the candidate from the best.
    fn is_as_good_as(&self, f: &FittedCandidate, best: &FittedCandidate) -> bool {
        self.is_accepted(f) && f.delta_bic < best.delta_bic + self.criteria.min_bic_difference && !self.leaves_far_less(best, f)
    }

    /// Index of the candidate to add: of those as good as the best, the first in the catalogue. `None` where none is accepted.
    pub fn choice(&self) -> Option<usize> {
        let best = self.best()?;
        let alike = (0..self.candidates.len()).filter(|&k| self.is_as_good_as(&self.candidates[k], best));
        alike.min_by_key(|&k| position(self.candidates[k].trial.card))
    }

    /// As [`AddingStep::choice`]. A candidate whose gain is not significant beside the open course of the voltage ([`gain_beside_course`]),
    /// or too small where only noise is left, is refused, and the next one is chosen.
    pub fn choice_beside_open_course(&mut self, base: &FittedModel) -> Option<usize> {
        while let Some(chosen) = self.choice() {
            let f = &self.candidates[chosen];
            let gain = gain_beside_course(base, f, self.effective_samples);
            let ln_p = familywise_ln_p(gain, f.extra_parameters, self.tests);
            if gain >= base.min_gain() && self.criteria.is_significant(ln_p, f.delta_bic + f.gain - gain) {
                return Some(chosen);
            }
            self.candidates[chosen].refused = Some(Refusal::CourseOpen { gain: f.gain, gain_beside_course: gain });
        }
        None
    }

    /// The logs cannot distinguish two candidates, which are both as good as the best.
    fn are_alike(&self, one: &FittedCandidate, other: &FittedCandidate) -> bool {
        let as_good = |f: &FittedCandidate| self.best().is_some_and(|best| self.is_as_good_as(f, best));
        let near = (other.delta_bic - one.delta_bic).abs() < self.criteria.min_bic_difference;
        other.trial.card.id != one.trial.card.id && near && as_good(one) && as_good(other)
    }

    /// The chosen candidate and those that the logs do not distinguish from it.
    pub fn doubt(self, chosen: usize) -> Doubt {
        let alike = self.candidates.iter().filter(|f| self.are_alike(&self.candidates[chosen], f));
        let rivals: Vec<&str> = alike.map(|f| f.trial.card.id).collect();
        let mut candidates = self.candidates;
        let chosen = candidates.swap_remove(chosen);
        candidates.retain(|f| rivals.contains(&f.trial.card.id));
        Doubt { chosen, rivals: candidates }
    }

    /// The best `count` rivals of the chosen candidate, which may take its place later.
    pub fn rivals_of(&self, chosen: usize, count: usize) -> Vec<Trial> {
        let others = self.candidates.iter().enumerate().filter(|(k, f)| *k != chosen && f.refused.is_none());
        let others: Vec<&FittedCandidate> = others.map(|(_, f)| f).collect();
        let evidence: Vec<(f64, usize)> = others.iter().map(|f| (f.delta_bic, position(f.trial.card))).collect();
        let order = in_order_of_preference(evidence, self.criteria.min_bic_difference);
        order.into_iter().take(count).map(|k| others[k].trial.clone()).collect()
    }

    /// All candidates for the answer: refitted, only screened, not visible.
    pub fn answer(&self, base: &FittedModel) -> Vec<Candidate> {
        let name = |card: &Card| base.model.next_name(card.id);
        let ambiguous_with =
            |f: &FittedCandidate| self.candidates.iter().filter(|o| self.are_alike(f, o)).map(|o| name(o.trial.card)).collect();
        let refitted = |f: &FittedCandidate| Candidate {
            effect: name(f.trial.card),
            parameters: f.estimates(),
            refitted: true,
            outputs: channel_errors(base, &f.residuals),
            delta_bic: Some(f.delta_bic),
            p_value: f.ln_p.exp(),
            log10_p: f.ln_p / std::f64::consts::LN_10,
            ambiguous_with: ambiguous_with(f),
            refused: f.refused.clone(),
            not_visible: None,
        };
        let mut list: Vec<Candidate> = self.candidates.iter().map(refitted).collect();
        if let Some(chosen) = self.choice() {
            let chosen = list.remove(chosen);
            list.insert(0, chosen);
        }
        list.extend(self.screened.iter().map(|s| self.only_screened(s, name(s.trial.card))));
        list.extend(self.invisible.iter().map(|i| Candidate::invisible(name(i.card), i.reason)));
        list
    }

    fn only_screened(&self, screened: &ScreenedOnly, effect: String) -> Candidate {
        let ScreenedOnly { trial, score, ln_p } = screened;
        let refused = if score.negative {
            Some(Refusal::NegativeAmplitude { parameter: None })
        } else if score.identifiable_fraction <= self.min_identifiable_fraction {
            Some(Refusal::NotIdentifiable { identifiable_fraction: score.identifiable_fraction })
        } else {
            None
        };
        Candidate::screened(effect, trial.card, &score.values, *ln_p, refused)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_indistinguishable_rivals_the_first_in_the_catalogue_goes_first() {
        // The gear motor: brush drop was chosen; a nonlinear bridge is better than Coulomb friction by the rounding of a sum.
        let rivals = vec![(-3225.0, 20), (-2970.48, 30), (-2970.22, 2), (-2960.0, 1)];
        assert_eq!(in_order_of_preference(rivals, 6.0), [0, 2, 1, 3]);
        assert_eq!(in_order_of_preference(vec![(f64::NAN, 1), (-8.0, 2)], 6.0), [1], "a ΔBIC that is no number is no rival");
    }
}
