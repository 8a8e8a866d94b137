//! Screening: all effects that can be tried on these logs, scored, and the choice of those that are refitted.

use super::harmonics::periods::{Periods, search_periods};
use super::harmonics::search_orders;
use super::jumps::search_jumps;
use super::score::{Score, score_trials};
use super::trials::{self, Starts};
use crate::identify::explain::criteria::{Criteria, MisfitClass};
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::trial::{Invisible, Trial};
use crate::statistics::distributions::ln_chi_squared_tail;

/// Jumps of the angle that are tried at most.
pub const MAX_JUMPS: usize = 4;

/// All trials beside a model, scored.
pub struct Screening {
    /// The trials.
    pub trials: Vec<Trial>,
    /// Their scores.
    pub scores: Vec<Score>,
    /// Effects that the logs cannot show.
    pub invisible: Vec<Invisible>,
    /// Indices of the trials by score, highest first.
    pub order: Vec<usize>,
    /// Number of tests that one adding step makes.
    pub tests: usize,
    /// Score of one degree of freedom that is significant in so many tests.
    pub critical_score: f64,
}

/// An effect that was screened and not refitted.
pub struct ScreenedOnly {
    /// Its best trial.
    pub trial: Trial,
    /// The score of this trial.
    pub score: Score,
    /// Logarithm of the familywise probability of such a score by chance.
    pub ln_p: f64,
}

impl Screening {
    /// Screens everything that can be added to a model.
    pub fn of(base: &FittedModel) -> Self {
        let criteria = base.context.criteria;
        let starts = Starts { orders: search_orders(base), periods: search_periods(base), jumps_s: search_jumps(base, MAX_JUMPS) };
        let (mut trials, invisible) = trials::list(base, &starts);
        if base.misfit() == MisfitClass::Noise {
            // A shaft that is visible leaves more than noise.
            trials.retain(|t| !t.is_expensive());
        }
        let scores = score_trials(base, &trials);
        let mut order: Vec<usize> = (0..trials.len()).collect();
        order.sort_by(|a, b| scores[*b].chi2_decrease.total_cmp(&scores[*a].chi2_decrease));
        let tests = number_of_tests(&trials, &starts.periods, base, criteria);
        Screening { trials, scores, invisible, order, tests, critical_score: critical_gain(tests, 1, criteria.evidence.max_familywise_p) }
    }

    /// The trials that are refitted: expensive ones or the others. Expensive trials are scored on an excerpt, so that the two kinds of
    /// scores are not comparable.
    pub fn best(&self, expensive: bool, criteria: &Criteria) -> Vec<usize> {
        let (Screening { trials, scores, .. }, c) = (self, &criteria.screening);
        let mut chosen: Vec<usize> = Vec::new();
        // Their effects: several structures or starts of one effect take one place.
        let mut effects: Vec<&str> = Vec::new();
        let mut best = 0.0;
        for &k in self.order.iter().filter(|&&k| trials[k].is_expensive() == expensive) {
            let score = scores[k].chi2_decrease;
            best = f64::max(best, score);
            let same_structure =
                |other: &&usize| trials[**other].card.id == trials[k].card.id && trials[**other].screened == trials[k].screened;
            let rough = !trials[k].absent || trials[k].screened != trials[k].fitted;
            let fraction = if rough { c.min_rough_score_fraction } else { c.min_score_fraction };
            let starts = 1 + usize::from(expensive || score > c.second_start_fraction * best);
            let few = chosen.iter().filter(same_structure).count() < starts;
            let high = score > fraction * best || chosen.len() < c.min_refitted;
            let is_new = !effects.contains(&trials[k].card.id);
            if score > self.critical_score && high && few && (!is_new || effects.len() < c.max_refitted) {
                chosen.push(k);
                effects.extend(is_new.then_some(trials[k].card.id));
            }
        }
        chosen
    }

    /// The trials that are fitted to short windows.
    pub fn best_for_windows(&self, criteria: &Criteria) -> Vec<usize> {
        let c = &criteria.screening;
        let mut chosen: Vec<usize> = Vec::new();
        let significant = |k: usize| self.scores[k].chi2_decrease > self.critical_score;
        for &k in self.order.iter().filter(|&&k| significant(k)) {
            let of_effect = chosen.iter().filter(|&&other| self.trials[other].card.id == self.trials[k].card.id).count();
            if chosen.len() < c.max_window_trials && of_effect < c.max_window_trials_per_effect {
                chosen.push(k);
            }
        }
        chosen
    }

    /// The best trial of each effect that is not among the `refitted` trials.
    pub fn only_screened<'t>(&self, refitted: impl Iterator<Item = &'t Trial>) -> Vec<ScreenedOnly> {
        let mut known: Vec<&str> = refitted.map(|t| t.card.id).collect();
        let mut screened: Vec<ScreenedOnly> = Vec::new();
        for &k in &self.order {
            let (trial, score) = (&self.trials[k], &self.scores[k]);
            if !known.contains(&trial.card.id) {
                known.push(trial.card.id);
                let ln_p = (ln_chi_squared_tail(score.chi2_decrease, score.free as f64) + (self.tests as f64).ln()).min(0.0);
                screened.push(ScreenedOnly { trial: trial.clone(), score: score.clone(), ln_p });
            }
        }
        screened
    }
}

/// Number of tests of one adding step: every trial, twice every order that was scanned, every period, and every row at which the angle may
/// jump.
fn number_of_tests(trials: &[Trial], periods: &Periods, base: &FittedModel, criteria: &Criteria) -> usize {
    let jumps = trials.iter().any(|t| matches!(t.card.screening, drive_model::Screening::AngleJumps(_)));
    let scanned = trials.iter().any(|t| t.card.screening == drive_model::Screening::Harmonics(drive_model::HarmonicSource::Torque));
    trials.len()
        + if scanned { 2 * criteria.harmonics.max_order } else { 0 }
        + periods.tested
        + if jumps { base.data.len() / base.data.angle_lag() } else { 0 }
}

/// χ² of `free` degrees of freedom with the familywise probability `p` in so many tests, by bisection.
pub fn critical_gain(tests: usize, free: usize, p: f64) -> f64 {
    let ln_p = (p / tests.max(1) as f64).ln();
    let (mut low, mut high) = (0.0, 200.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if ln_chi_squared_tail(middle, free as f64) > ln_p { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trial of an absent effect of which the given parameters are free.
    fn trial(id: &str, free: &[bool]) -> Trial {
        let card = drive_model::card(id).expect("an effect of the catalogue");
        let (values, ranges) = card.parameters.iter().map(|p| (0.0, p.range)).unzip();
        Trial { card, values, ranges, screened: free.to_vec(), fitted: free.to_vec(), absent: true, rate_from_encoder: None }
    }

    /// Trials with their scores, the highest first.
    fn screening(trials: Vec<Trial>, scores: impl Iterator<Item = f64>) -> Screening {
        let scores = trials.iter().zip(scores).map(|(t, chi2_decrease)| Score { chi2_decrease, ..Score::zero(t, 0) }).collect();
        let order = (0..trials.len()).collect();
        Screening { trials, scores, invisible: Vec::new(), order, tests: 100, critical_score: 30.0 }
    }

    /// Three structures of one effect with the highest scores leave a place for each of seven others.
    #[test]
    fn places_are_for_effects_and_not_for_their_structures() {
        let bridge = [[true, true], [true, false], [false, true]].map(|free| trial("bridge-nonlinearity", &free));
        let others = ["coulomb", "load", "brush-drop", "dead-time", "rate-bias", "rate-scale", "current-offset", "sensor-lag"];
        let trials: Vec<Trial> = bridge.into_iter().chain(others.map(|id| trial(id, &[true]))).collect();
        let screening = screening(trials, (0..11).map(|k| 1000.0 - f64::from(k)));
        assert_eq!(screening.best(false, &Criteria::default()), (0..10).collect::<Vec<_>>());
    }

    /// An effect whose score is too low to be refitted leaves its place to one whose score is a rough prediction.
    #[test]
    fn effect_that_is_not_refitted_takes_no_place() {
        let exact = ["coulomb", "load", "brush-drop", "dead-time", "rate-bias", "rate-scale", "current-offset", "sensor-lag"];
        let mut trials: Vec<Trial> = exact.map(|id| trial(id, &[true])).into();
        trials.push(Trial { fitted: vec![true, false], ..trial("bridge-nonlinearity", &[true, true]) });
        let values = [1000.0, 999.0, 998.0, 997.0, 996.0, 995.0, 994.0, 200.0, 100.0];
        assert_eq!(screening(trials, values.into_iter()).best(false, &Criteria::default()), [0, 1, 2, 3, 4, 5, 6, 8]);
    }
}
