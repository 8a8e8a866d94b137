//! The models along a search, from the given model to the last.

use super::termination::Termination;
use super::unfinished::{SearchState, Settled, StageState};
use crate::identify::explain::answer::reasons::Remark;
use crate::identify::explain::answer::{Candidate, ChannelError, Estimate, Stage};
use crate::identify::explain::candidates::doubt::Doubt;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::likelihood::delta_bic;
use crate::identify::explain::fitted::trial::Trial;
use crate::identify::fit::channel_fit::spread;
use crate::model::Model;
use crate::recording::Convention;

/// The search from the given model to the last.
pub struct Search<'a> {
    /// The models on the way.
    pub models: Models<'a>,
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

/// The given model, fitted; then one model per added effect.
pub struct Models<'a>(Vec<FittedModel<'a>>);

impl<'a> Models<'a> {
    /// The given model.
    pub fn given(&self) -> &FittedModel<'a> {
        &self.0[0]
    }

    /// The model with all that was added.
    pub fn last(&self) -> &FittedModel<'a> {
        &self.0[self.0.len() - 1]
    }

    /// The same, to be replaced.
    pub fn last_mut(&mut self) -> &mut FittedModel<'a> {
        let last = self.0.len() - 1;
        &mut self.0[last]
    }

    /// All of them.
    pub fn all(&self) -> &[FittedModel<'a>] {
        &self.0
    }

    /// Adds the model with a further effect.
    pub fn push(&mut self, next: FittedModel<'a>) {
        self.0.push(next);
    }

    /// Keeps the given model and those of the first `count` added effects.
    pub fn keep(&mut self, count: usize) {
        self.0.truncate(count + 1);
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
            models: Models(vec![given]),
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
        let stages = self.added.iter().zip(self.models.all().iter().skip(1)).map(|(added, fitted)| StageState {
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
        SearchState::new(given, self.models.given().context.log, settled)
    }

    /// Names of the added effects from number `from` on.
    pub fn names(&self, from: usize) -> Vec<String> {
        self.added[from..].iter().map(|a| a.name.clone()).collect()
    }

    /// χ²/n of the stages, relative to the noise that the last one found.
    pub fn chi2_per_n(&self) -> Vec<f64> {
        let relative_to = |last: &FittedModel| self.models.all().iter().map(|m| m.chi2_per_n_by_noise_of(last).0).collect();
        relative_to(self.models.last())
    }

    /// Keeps the first `count` added effects; the later ones stand in for something else.
    pub fn keep(&mut self, count: usize) {
        self.remarks.push(Remark::StandInsRemoved { effects: self.names(count) });
        self.truncate(count);
    }

    /// Removes all added effects from number `count` on.
    pub fn truncate(&mut self, count: usize) {
        self.added.truncate(count);
        self.models.keep(count);
    }

    /// Remarks on the added effects that are a small part of what was measured.
    pub fn small_parts(&self) -> Vec<Remark> {
        let added = self.models.all().windows(2).zip(&self.added);
        let small = added.filter_map(|(models, added)| {
            let part = explained_part(&models[0], &models[1]);
            let is_small = part < models[1].context.criteria.verdict.small_part;
            is_small.then(|| Remark::SmallPart { effect: added.name.clone(), part })
        });
        small.collect()
    }

    /// The stages for the answer.
    pub fn stages(&self) -> Vec<Stage> {
        let last = self.models.last();
        let added = |k: usize| k.checked_sub(1).map(|k| self.added[k].name.clone());
        self.models.all().iter().enumerate().map(|(k, model)| stage(model, last, added(k))).collect()
    }
}

/// BIC of the `last` model minus that of the `first`, on residuals that the noise of the last one whitens. The data of the two may be
/// recorded by other conventions.
pub fn bic_difference(first: &FittedModel, last: &FittedModel) -> f64 {
    let whitener = last.whitener();
    let (before, after) = (first.whitened_sums(&whitener), last.whitened_sums(&whitener));
    let more = last.free_parameters() as f64 - first.free_parameters() as f64;
    delta_bic(before.gain(&after), more, before.effective_samples())
}

/// Rms by which the residual of `after` is smaller than that of `before`, over the standard deviation of the measured values, in the
/// channel where that is largest.
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
    use crate::identify::explain::fitted::test_rotor::with_fit;

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
