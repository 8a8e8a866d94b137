//! The models along a search, from the given model to the last.

use super::answer::{Candidate, ChannelError, Estimate, Stage};
use super::design::Doubt;
use super::fitted_model::FittedModel;
use super::likelihood::delta_bic;
use super::reasons::Remark;
use super::trial::Trial;
use super::unfinished::{SearchState, Settled, StageState};
use crate::identify::fit::channel_fit::spread;
use crate::identify::recording_conventions::Convention;
use crate::model::Model;

/// The search from the given model to the last.
pub struct Search<'a> {
    /// The given model, fitted; then one model per added effect.
    pub models: Vec<FittedModel<'a>>,
    /// The added effects.
    pub added: Vec<Added>,
    /// The candidates of the first step.
    pub candidates: Vec<Candidate>,
    /// Remarks for the user.
    pub remarks: Vec<Remark>,
    /// Number of tests of an adding step on whitened residuals; 0 before the first.
    pub tests: usize,
    /// The candidates of the first step that the logs do not distinguish from the added one.
    pub doubt: Option<Doubt>,
    /// Times that an added effect led to a better fit of the model without it.
    pub restarts: usize,
    /// Why it ended.
    pub termination: Termination,
}

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

/// An added effect.
pub struct Added {
    /// Its name in the model.
    pub name: String,
    /// Trials that may take its place later.
    pub rivals: Vec<Trial>,
}

impl<'a> Search<'a> {
    /// The search at its begin.
    pub fn new(given: FittedModel<'a>) -> Self {
        Search {
            models: vec![given],
            added: Vec::new(),
            candidates: Vec::new(),
            remarks: Vec::new(),
            tests: 0,
            doubt: None,
            restarts: 0,
            termination: Termination::MostAdded,
        }
    }

    /// What is settled, for another run to go on from: the search began with the `given` model.
    pub fn state(&self, given: &Model, conventions: &[Convention], hold_out: bool) -> SearchState {
        let stages = self.added.iter().zip(self.models.iter().skip(1)).map(|(added, fitted)| StageState {
            effect: added.name.clone(),
            rate_from_encoder: fitted.data.rate_from_encoder,
            model_file: fitted.model.to_toml(),
            rivals: added.rivals.clone(),
        });
        let settled = Settled {
            hold_out,
            is_complete: !self.termination.is_by_budget(),
            restarts: self.restarts,
            conventions: conventions.to_vec(),
            stages: stages.collect(),
        };
        SearchState::new(given, self.models.first().map(|first| first.context.log), settled)
    }

    /// Names of the added effects from number `from` on.
    pub fn names(&self, from: usize) -> Vec<String> {
        self.added[from..].iter().map(|a| a.name.clone()).collect()
    }

    /// χ²/n of the stages, relative to the noise that the last one found.
    pub fn chi2_per_n(&self) -> Vec<f64> {
        let relative_to = |last: &FittedModel| self.models.iter().map(|m| m.chi2_per_n_by_noise_of(last).0).collect();
        self.models.last().map_or_else(Vec::new, relative_to)
    }

    /// Keeps the first `count` added effects; the later ones stand in for something else.
    pub fn keep(&mut self, count: usize) {
        self.remarks.push(Remark::StandInsRemoved { effects: self.names(count) });
        self.truncate(count);
    }

    /// Removes all added effects from number `count` on.
    pub fn truncate(&mut self, count: usize) {
        self.added.truncate(count);
        self.models.truncate(count + 1);
    }

    /// Remarks on the added effects that are a small part of what was measured.
    pub fn small_parts(&self) -> Vec<Remark> {
        let added = self.models.windows(2).zip(&self.added);
        let small = added.filter_map(|(models, added)| {
            let part = explained_part(&models[0], &models[1]);
            let is_small = part < models[1].context.criteria.verdict.small_part;
            is_small.then(|| Remark::SmallPart { effect: added.name.clone(), part })
        });
        small.collect()
    }

    /// The stages for the answer.
    pub fn stages(&self) -> Vec<Stage> {
        let Some(last) = self.models.last() else { return Vec::new() };
        let added = |k: usize| k.checked_sub(1).map(|k| self.added[k].name.clone());
        self.models.iter().enumerate().map(|(k, model)| stage(model, last, added(k))).collect()
    }
}

/// BIC of the `last` model minus that of the `first`, on residuals that the noise of the last one whitens. The data of the two may be recorded by other conventions.
pub fn bic_difference(first: &FittedModel, last: &FittedModel) -> f64 {
    let whitener = last.whitener();
    let (before, after) = (first.whitened_sums(&whitener), last.whitened_sums(&whitener));
    let more = last.free_parameters() as f64 - first.free_parameters() as f64;
    delta_bic(before.gain(&after), more, before.effective_samples())
}

/// Rms by which the residual of `after` is smaller than that of `before`, over the standard deviation of the measured values, in the channel where that is
/// largest.
fn explained_part(before: &FittedModel, after: &FittedModel) -> f64 {
    let part = |index: usize| {
        let rms = |of: &FittedModel| of.fit.channels[index].rms;
        (rms(before).powi(2) - rms(after).powi(2)).max(0.0).sqrt() / spread(&after.data, index)
    };
    (0..after.fit.channels.len()).map(part).filter(|part| part.is_finite()).fold(0.0, f64::max)
}

/// A model as a stage of the answer, relative to the noise that the `last` one found.
fn stage(model: &FittedModel, last: &FittedModel, added: Option<String>) -> Stage {
    let fit = &model.fit;
    let unit = |name: &str| {
        let own = model.model.parameter(name).and_then(|p| p.info);
        own.map_or("", |info| info.unit)
    };
    let free = fit.parameters.list.iter().zip(&fit.sigmas).filter(|(p, _)| !p.fixed);
    Stage {
        effects: model.model.effect_names(),
        added,
        outputs: fit
            .channels
            .iter()
            .zip(&last.fit.channels)
            .map(|(f, last)| ChannelError { channel: f.channel, rms: f.rms, heldout_rms: f.heldout_rms, noise: last.noise })
            .collect(),
        parameters: free.map(|(p, sigma)| Estimate { name: p.name.clone(), unit: unit(&p.name), value: p.value, sigma: *sigma }).collect(),
        rests_on_course: fit.rests_on_course,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::explain::test_rotor::with_fit;

    /// Steps of 1 and 2 mN m; the hidden torque is 0.15 and 0.0003 of them, and the sensor is better than either.
    #[test]
    fn effect_below_a_thousandth_of_the_motion_is_called_small() {
        let error = |k: u32| 1e-4 * ((f64::from(k) * 12.989_8).sin() * 43_758.545_3).fract();
        for (hidden, part) in [(-3e-4, 0.05..0.5), (-6e-7, 1e-4..1e-3)] {
            with_fit((0..1200).map(|k| (hidden, error(k))), |given| {
                let mut model = given.model.clone();
                model.add("load").expect("an effect");
                let with_load = given.refit(&model, given.data.clone()).expect("a fit");
                assert!(part.contains(&explained_part(&given, &with_load)), "{}", explained_part(&given, &with_load));
                let added = vec![Added { name: "load".to_owned(), rivals: Vec::new() }];
                let mut search = Search { tests: 1000, ..Search::new(given) };
                search.models.push(with_load);
                search.added = added;
                assert_eq!(search.small_parts().len(), usize::from(hidden > -1e-6));
            });
        }
    }
}
