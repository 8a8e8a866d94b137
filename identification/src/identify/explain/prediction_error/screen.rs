//! Screening: every effect that the logs could show, scored by one linearised pass beside a model.

use super::model::PredictedModel;
use super::starts;
use crate::identify::explain::score::{Score, score_trials};
use crate::identify::explain::trial::{Invisible, Trial};
use crate::identify::explain::trials;

/// A trial with its score.
#[derive(Debug, Clone)]
pub struct Screened {
    /// The trial.
    pub trial: Trial,
    /// Its score at the filter of the model.
    pub score: Score,
    /// Predicted change of BIC, with the choice among all that was tried.
    pub delta_bic: f64,
}

/// All trials beside a model, the best first, and the effects that the logs cannot show.
#[derive(Default)]
pub struct Screening {
    /// The trials.
    pub trials: Vec<Screened>,
    /// The effects that the logs cannot show.
    pub invisible: Vec<Invisible>,
    /// Number of effects among the trials.
    effects: usize,
    /// Number of distinguishable periods, and of rows, among which a start was chosen.
    periods: usize,
    rows: usize,
}

impl Screening {
    /// Screens everything that can be added to a model.
    pub fn of(base: &PredictedModel) -> Self {
        let starts = base.gradient().map(|gradient| starts::search(base, &gradient)).unwrap_or_default();
        let (list, invisible) = trials::list(&base.fitted, &starts);
        let scores = score_trials(&base.fitted, &list);
        let mut ids: Vec<&str> = list.iter().map(|t| t.card.id).collect();
        ids.sort_unstable();
        ids.dedup();
        let mut screening = Screening {
            trials: Vec::new(),
            invisible,
            effects: ids.len().max(1),
            periods: starts.periods.tested,
            rows: base.fitted.data.len(),
        };
        let (n, chi2) = (base.samples(), base.fitted.fit.chi2);
        let trials = list.into_iter().zip(scores).map(|(trial, score)| {
            // The variance of the innovations falls with the sum of squares: −2 ln L changes by n ln(χ²/χ²₀).
            let part = (score.chi2_decrease / chi2).clamp(0.0, MAX_PART);
            let delta_bic = n * (-part).ln_1p() + screening.penalty(&trial, n);
            Screened { trial, score, delta_bic }
        });
        screening.trials = trials.collect();
        screening.trials.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
        screening
    }

    /// Increase of BIC by an effect before any gain: its parameters, and the choice among all effects and orders that were tried (the prior probability
    /// of each is one in so many).
    pub fn penalty(&self, trial: &Trial, samples: f64) -> f64 {
        let free = trial.fitted.iter().filter(|f| **f).count() as f64;
        let chosen = match trial.card.screening {
            drive_model::Screening::Harmonics(_) => ORDERS,
            drive_model::Screening::Periodicities(_) => self.periods as f64,
            drive_model::Screening::AngleJumps(_) => self.rows as f64,
            _ => 1.0,
        };
        free * samples.ln() + 2.0 * (self.effects as f64).ln() + 2.0 * chosen.max(1.0).ln()
    }

    /// The best trials for a refit: up to `count` effects, the best first, and a second start of an effect where it promises nearly as much.
    pub fn best(&self, count: usize) -> Vec<&Screened> {
        let mut chosen: Vec<&Screened> = Vec::new();
        let mut effects: Vec<&str> = Vec::new();
        for s in self.trials.iter().filter(|s| s.delta_bic < 0.0) {
            let id = s.trial.card.id;
            let starts = chosen.iter().filter(|c| c.trial.card.id == id).count();
            let first = starts == 0 && effects.len() < count;
            let best_of_effect = chosen.iter().find(|c| c.trial.card.id == id).map_or(0.0, |c| c.delta_bic);
            let second = starts > 0 && starts < MAX_STARTS && s.delta_bic < SECOND_START_FRACTION * best_of_effect;
            if first {
                effects.push(id);
            }
            if first || second {
                chosen.push(s);
            }
        }
        chosen
    }
}

/// Whole orders among which a start is chosen.
const ORDERS: f64 = 40.0;
/// Largest part of χ² by which a linearised step may predict that it falls.
const MAX_PART: f64 = 1.0 - 1e-9;
/// Starts of one effect that are refitted at most.
const MAX_STARTS: usize = 2;
/// Fraction of the best predicted gain of an effect from which on another start is refitted, too.
const SECOND_START_FRACTION: f64 = 0.6;
