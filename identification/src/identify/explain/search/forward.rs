//! Forward search: the best effect is added, then the next, until only noise is left or nothing helps.
//!
//! In each step every effect is screened, the best are refitted and compared. An effect is added if its gain is significant over everything
//! that was tried, if it improves BIC, if held-out rows and every single log agree, and if its parameters are physical. After each addition
//! [`eliminate`] removes what is no longer needed, at the end also what would not be added to the others. [`termination`] ends a search
//! that makes no progress; what was only added in place of something else is removed. A search that comes back to effects that it had,
//! because of two each is unnecessary beside the other, ends there: its next steps would be the same.

use super::eliminate::{eliminate, eliminate_at_end, without_if_zero};
use super::path::{Added, Search};
use super::termination::{Termination, last_effects_are_insignificant, stage_before_stand_ins, too_much_left};
use super::unfinished::SearchState;
use crate::identify::explain::answer::reasons::Progress;
use crate::identify::explain::candidates::compare::adding_step;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::adequacy::input_between_samples;
use crate::identify::fit::FitError;

/// Adds effects to the `given` model as long as the evidence supports it; from the stages of a `state`, where there is one.
///
/// # Errors
/// A model with an added effect cannot be simulated.
pub fn search<'a>(
    given: FittedModel<'a>,
    state: Option<&SearchState>,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<Search<'a>, FitError> {
    let mut search = Search::new(given);
    if let Some(state) = state {
        restore(&mut search, state, progress)?;
    }
    if state.is_none_or(|state| !state.is_complete) {
        search.termination = add_effects(&mut search, progress)?;
    }
    if !search.termination.is_by_budget() {
        remove_unnecessary(&mut search)?;
    }
    Ok(search)
}

/// Fits the stages of a state again. The given model is screened again, for the answer.
fn restore(search: &mut Search, state: &SearchState, progress: &(dyn Fn(&Progress) + Sync)) -> Result<(), FitError> {
    search.restarts = state.restarts;
    for stage in &state.stages {
        let base = search.models.last();
        // The models of a state were checked when it was read.
        let Ok(model) = stage.model() else { break };
        if search.added.is_empty() {
            progress(&Progress::Trying { added: None });
            let step = adding_step(base);
            let chosen = step.candidates.iter().position(|c| c.added_to(&base.model).1 == stage.effect);
            search.candidates = step.answer(base);
            search.tests = step.tests;
            search.doubt = chosen.map(|chosen| step.doubt(chosen));
        }
        let data = base.data.clone().with_rate_from_encoder(stage.rate_from_encoder);
        let next = base.refit(&model, data)?;
        search.models.push(next);
        search.added.push(Added { name: stage.effect.clone(), rivals: stage.rivals.clone() });
    }
    Ok(())
}

fn add_effects(search: &mut Search, progress: &(dyn Fn(&Progress) + Sync)) -> Result<Termination, FitError> {
    let mut visited = Vec::new();
    loop {
        let base = search.models.last();
        let criteria = base.context.criteria;
        if search.added.len() >= criteria.search.max_added {
            return Ok(Termination::MostAdded);
        }
        if input_between_samples(base).is_some() {
            // An effect that fits better now may imitate the unknown input.
            return Ok(Termination::InputBetweenSamples);
        }
        progress(&Progress::Trying { added: search.added.last().map(|a| a.name.clone()) });
        let mut step = adding_step(base);
        let choice = if base.data.budget.checkpoint() { None } else { step.choice_beside_open_course(base) };
        if search.added.is_empty() {
            search.candidates = step.answer(base);
            search.tests = step.tests;
        }
        if base.data.budget.checkpoint() {
            // Not all candidates were compared: the best of those that were may be the wrong cause.
            return Ok(Termination::Budget);
        }
        let Some(chosen) = choice else { return Ok(Termination::NoEvidence) };
        let candidate = &step.candidates[chosen];
        let (model, name) = candidate.added_to(&base.model);
        let next = base.refit(&model, base.data_for(&candidate.trial).into_owned())?;
        if search.restarts < criteria.search.max_restarts
            && let Some(better) = without_if_zero(&next, &name)?
        {
            // The added effect only led the fit to a better minimum of the model without it.
            search.restarts += 1;
            *search.models.last_mut() = better;
            continue;
        }
        let rivals = step.rivals_of(chosen, criteria.screening.max_rivals);
        if search.added.is_empty() {
            search.doubt = Some(step.doubt(chosen));
        }
        search.added.push(Added { name, rivals });
        search.models.push(next);
        if search.added.len() > 1 {
            eliminate(search)?;
        }
        let structure = search.models.last().model.structure();
        if visited.contains(&structure) {
            return Ok(Termination::Repeated);
        }
        visited.push(structure);
        let misfits = search.chi2_per_n();
        if last_effects_are_insignificant(criteria, &misfits) {
            search.keep(search.added.len() - criteria.search.max_insignificant_in_a_row);
            return Ok(Termination::Insignificant);
        }
        if too_much_left(criteria, &misfits) {
            return Ok(Termination::TooMuchLeft);
        }
    }
}

/// Removes what a complete search has added in vain.
fn remove_unnecessary(search: &mut Search) -> Result<(), FitError> {
    // No later effect has shown that the last one is unnecessary.
    if let Some(added) = search.added.last()
        && let Some(less) = without_if_zero(search.models.last(), &added.name)?
    {
        search.truncate(search.added.len() - 1);
        *search.models.last_mut() = less;
    }
    eliminate_at_end(search)?;
    let criteria = search.models.given().context.criteria;
    if let Some(kept) = stage_before_stand_ins(criteria, &search.chi2_per_n()) {
        search.keep(kept);
    }
    Ok(())
}
