//! Forward search: the best effect is added, then the next, until only noise is left or nothing helps.
//!
//! In each step every effect is screened, the best are refitted and compared. An effect is added if its gain is significant over everything
//! that was tried, if it improves BIC, if held-out rows and every single log agree, and if its parameters are physical. After each addition
//! [`super::eliminate`] removes what is no longer needed, at the end also what would not be added to the others. [`super::stop`] ends a search that makes no progress; what was only added in
//! place of something else is removed. A search that comes back to effects that it had, because of two each is unnecessary beside the other, ends
//! there: its next steps would be the same.

use super::adequacy::input_between_samples;
use super::compare::adding_step;
use super::eliminate::{eliminate, eliminate_at_end, without_if_zero};
use super::fitted_model::FittedModel;
use super::reasons::Progress;
use super::search_path::{Added, Search};
use super::stop::{last_effects_are_insignificant, stage_before_stand_ins, too_much_left};
use crate::identify::fit::FitError;

/// Adds effects to the `given` model as long as the evidence supports it.
///
/// # Errors
/// A model with an added effect cannot be simulated.
pub fn search<'a>(given: FittedModel<'a>, progress: &(dyn Fn(&Progress) + Sync)) -> Result<Search<'a>, FitError> {
    let criteria = given.context.criteria;
    let mut search = Search { models: vec![given], added: Vec::new(), candidates: Vec::new(), remarks: Vec::new(), tests: 0, doubt: None };
    let mut restarts = 0;
    let mut visited = Vec::new();
    while search.added.len() < criteria.search.max_added {
        let Some(base) = search.models.last() else { break };
        if input_between_samples(base).is_some() {
            // An effect that fits better now may imitate the unknown input.
            break;
        }
        progress(&Progress::Trying { added: search.added.last().map(|a| a.name.clone()) });
        let deadline = base.data.deadline;
        let mut step = adding_step(base);
        let choice = if deadline.has_passed() { None } else { step.choice_beside_open_course(base) };
        if search.added.is_empty() {
            search.candidates = step.answer(base);
            search.tests = step.tests;
        }
        // After the deadline not all candidates were compared: the best of those that were may be the wrong cause.
        let Some(chosen) = choice else { break };
        let candidate = &step.candidates[chosen];
        let (model, name) = candidate.added_to(&base.model);
        let next = base.refit(&model, base.data_for(&candidate.trial).into_owned())?;
        if restarts < criteria.search.max_restarts
            && let Some(better) = without_if_zero(&next, &name)?
        {
            // The added effect only led the fit to a better minimum of the model without it.
            restarts += 1;
            if let Some(last) = search.models.last_mut() {
                *last = better;
            }
            continue;
        }
        let rivals = step.rivals_of(chosen, criteria.screening.max_rivals);
        if search.added.is_empty() {
            search.doubt = Some(step.doubt(chosen));
        }
        search.added.push(Added { name, rivals });
        search.models.push(next);
        if search.added.len() > 1 {
            eliminate(&mut search)?;
        }
        let structure = search.models.last().map(|last| last.model.structure());
        if visited.contains(&structure) {
            break;
        }
        visited.push(structure);
        let misfits = search.chi2_per_n();
        if last_effects_are_insignificant(criteria, &misfits) {
            search.keep(search.added.len() - criteria.search.max_insignificant_in_a_row);
            break;
        }
        if too_much_left(criteria, &misfits) {
            break;
        }
    }
    // No later effect has shown that the last one is unnecessary.
    if let (Some(last), Some(added)) = (search.models.last(), search.added.last())
        && let Some(less) = without_if_zero(last, &added.name)?
    {
        search.truncate(search.added.len() - 1);
        if let Some(last) = search.models.last_mut() {
            *last = less;
        }
    }
    eliminate_at_end(&mut search)?;
    if let Some(kept) = stage_before_stand_ins(criteria, &search.chi2_per_n()) {
        search.keep(kept);
    }
    Ok(search)
}
