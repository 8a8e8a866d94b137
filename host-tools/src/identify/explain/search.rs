//! Forward search: the best effect is added, then the next, until only noise is left or nothing helps.
//!
//! In each step every effect is screened, the best are refitted and compared. An effect is added if its gain is significant over everything
//! that was tried, if it improves BIC, if held-out rows and every single log agree, and if its parameters are physical. After each addition
//! [`super::eliminate`] removes what is no longer needed. [`super::stop`] ends a search that makes no progress; what was only added in
//! place of something else is removed.

use super::answer::{Candidate, ChannelError, Estimate, Stage};
use super::compare::adding_step;
use super::eliminate::{all_amplitudes_may_be_zero, eliminate, without};
use super::fitted_model::FittedModel;
use super::likelihood::delta_bic;
use super::reasons::{Progress, Remark};
use super::stop::{last_effects_are_insignificant, stage_before_stand_ins, too_much_left};
use super::trial::Trial;
use crate::identify::fit::FitError;

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
}

/// An added effect.
pub struct Added {
    /// Its name in the model.
    pub name: String,
    /// Trials that may take its place later.
    pub rivals: Vec<Trial>,
}

/// Adds effects to the `given` model as long as the evidence supports it.
///
/// # Errors
/// A model with an added effect cannot be simulated.
pub fn search<'a>(given: FittedModel<'a>, progress: &(dyn Fn(&Progress) + Sync)) -> Result<Search<'a>, FitError> {
    let criteria = given.context.criteria;
    let mut search = Search { models: vec![given], added: Vec::new(), candidates: Vec::new(), remarks: Vec::new() };
    let mut restarts = 0;
    while search.added.len() < criteria.search.max_added {
        let Some(base) = search.models.last() else { break };
        progress(&Progress::Trying { added: search.added.last().map(|a| a.name.clone()) });
        let step = adding_step(base);
        if search.added.is_empty() {
            search.candidates = step.answer(base);
        }
        let Some(chosen) = step.choice() else { break };
        let candidate = &step.candidates[chosen];
        let (model, name) = candidate.added_to(&base.model);
        let next = base.refit(&model, base.data_for(&candidate.trial).into_owned())?;
        if restarts < criteria.search.max_restarts
            && all_amplitudes_may_be_zero(&next, &name)
            && let Some(better) = without(&next, &name)?
        {
            // The added effect only led the fit to a better minimum of the model without it.
            restarts += 1;
            if let Some(last) = search.models.last_mut() {
                *last = better;
            }
            continue;
        }
        let rivals = step.rivals_of(chosen, criteria.screening.max_rivals);
        search.added.push(Added { name, rivals });
        search.models.push(next);
        if search.added.len() > 1 {
            eliminate(&mut search)?;
        }
        let misfits = search.chi2_per_n();
        if last_effects_are_insignificant(criteria, &misfits) {
            search.keep(search.added.len() - criteria.search.max_insignificant_in_a_row);
            break;
        }
        if too_much_left(criteria, &misfits) {
            break;
        }
    }
    if let Some(kept) = stage_before_stand_ins(criteria, &search.chi2_per_n()) {
        search.keep(kept);
    }
    Ok(search)
}

impl Search<'_> {
    /// Names of the added effects from number `from` on.
    pub fn names(&self, from: usize) -> Vec<String> {
        self.added[from..].iter().map(|a| a.name.clone()).collect()
    }

    /// χ²/n of the stages, relative to the noise that the last one found.
    fn chi2_per_n(&self) -> Vec<f64> {
        let relative_to = |last: &FittedModel| self.models.iter().map(|m| m.chi2_per_n_by_noise_of(last).0).collect();
        self.models.last().map_or_else(Vec::new, relative_to)
    }

    /// Keeps the first `count` added effects; the later ones stand in for something else.
    fn keep(&mut self, count: usize) {
        self.remarks.push(Remark::StandInsRemoved { effects: self.names(count) });
        self.truncate(count);
    }

    /// Removes all added effects from number `count` on.
    pub fn truncate(&mut self, count: usize) {
        self.added.truncate(count);
        self.models.truncate(count + 1);
    }

    /// The stages for the answer.
    pub fn stages(&self) -> Vec<Stage> {
        let Some(last) = self.models.last() else { return Vec::new() };
        let added = |k: usize| k.checked_sub(1).map(|k| self.added[k].name.clone());
        self.models.iter().enumerate().map(|(k, model)| stage(model, last, added(k))).collect()
    }
}

/// BIC on whitened residuals of the `last` model minus that of the `first`, which has fewer parameters.
pub fn bic_difference(first: &FittedModel, last: &FittedModel) -> f64 {
    let whitener = last.whitener();
    let (before, after) = (first.whitened_sums(&whitener), last.whitened_sums(&whitener));
    let more = last.free_parameters().saturating_sub(first.free_parameters());
    delta_bic(before.gain(&after), more, before.effective_samples())
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
    }
}
