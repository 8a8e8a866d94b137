//! The search, with the conventions of recording judged by the model that it found.
//!
//! A convention that no note states is chosen on the given model. While an effect is missing there, a wrong convention may imitate part of
//! it. The model at the end of the search decides: where it fits better by other conventions, or where it leaves more than noise although
//! one was assumed, the search begins again by those. The result with the lower BIC is kept.

use super::forward::search;
use super::path::{Search, bic_difference};
use super::unfinished::SearchState;
use crate::identify::explain::answer::reasons::Progress;
use crate::identify::explain::criteria::MisfitClass;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::fit::FitError;
use crate::identify::recording_conventions::{Recording, gain};
use crate::model::Model;
use crate::recording::Convention;
use crate::recording::PreparedLog;

/// Searches from `given`, the `model` fitted as `recording` says, and from the stages of a `state` where there is one. `data`: the logs,
/// with no convention assumed.
///
/// # Errors
/// A model with an added effect cannot be simulated.
pub fn search_as_recorded<'a>(
    model: &Model,
    given: FittedModel<'a>,
    mut recording: Recording,
    data: PreparedLog<'a>,
    state: Option<&SearchState>,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<(Search<'a>, Recording), FitError> {
    let context = given.context;
    let budget = data.budget.clone();
    let mut kept = search(given, state, progress)?;
    if budget.checkpoint() {
        return Ok((kept, recording));
    }
    let mut tried = vec![recording.conventions.clone()];
    if let Some((given, other)) = convention_instead(&kept, &recording, &data) {
        let found = search(given, None, progress)?;
        if is_as_likely_with_fewer_effects(&found, &kept) && !budget.checkpoint() {
            tried.push(other.conventions.clone());
            (kept, recording) = (found, other);
        }
    }
    while let Some(conventions) = other_conventions(&kept, &recording.conventions, &data)?
        && !tried.contains(&conventions)
        && !budget.checkpoint()
    {
        let (given, other) = FittedModel::fit(context, model, data.clone(), Some(&conventions))?;
        tried.push(conventions);
        let found = search(given, None, progress)?;
        if !has_lower_bic(&found, &kept) || budget.checkpoint() {
            break;
        }
        (kept, recording) = (found, other);
    }
    Ok((kept, recording))
}

/// The conventions to search by instead of the `assumed` ones; `None` where the model at the end of the search supports these.
fn other_conventions(found: &Search, assumed: &[Convention], data: &PreparedLog) -> Result<Option<Vec<Convention>>, FitError> {
    let last = found.models.last();
    let (leaves_more, is_assumed) = (last.misfit() > MisfitClass::Invisible, !assumed.is_empty());
    if !found.added.is_empty() && (leaves_more || is_assumed) {
        let best = last.best_conventions(data)?;
        if best != assumed {
            return Ok(Some(best));
        }
    }
    Ok((leaves_more && is_assumed).then(Vec::new))
}

/// The given model by one further convention, where by it the first few of the found effects, or none, are as likely as all of them without
/// it.
fn convention_instead<'a>(found: &Search<'a>, recording: &Recording, data: &PreparedLog<'a>) -> Option<(FittedModel<'a>, Recording)> {
    let (last, earlier) = found.models.all().split_last()?;
    let given = earlier.first()?;
    let limit = given.context.criteria.evidence.min_bic_difference;
    let best_for = |stage: &FittedModel<'a>| {
        let others = Convention::ALL.into_iter().filter(|other| !recording.conventions.contains(other) && !data.budget.is_exhausted());
        let fitted = others.filter_map(|convention| Some((bic_difference(&stage.recorded_by(convention)?.0, last), convention)));
        fitted.filter(|(bic, _)| *bic > -limit).max_by(|one, other| one.0.total_cmp(&other.0))
    };
    let (_, convention) = earlier.iter().find_map(best_for)?;
    let (model, note) = given.recorded_by(convention)?;
    let mut other = recording.clone();
    other.assume(convention, note);
    Some((model, other))
}

/// True if `found` needs fewer effects than `kept` and its last model is as likely, on residuals that the noise of either whitens.
fn is_as_likely_with_fewer_effects(found: &Search, kept: &Search) -> bool {
    let (new, old) = (found.models.last(), kept.models.last());
    let limit = new.context.criteria.evidence.min_bic_difference;
    found.added.len() < kept.added.len() && (bic_difference(old, new) < limit || bic_difference(new, old) > -limit)
}

/// True if the last model of `found` has a lower BIC than the last of `kept`, on the same logs.
fn has_lower_bic(found: &Search, kept: &Search) -> bool {
    let (new, old) = (found.models.last(), kept.models.last());
    let values: usize = old.fit.channels.iter().map(|c| c.rows).sum();
    let more_parameters = new.free_parameters() as f64 - old.free_parameters() as f64;
    gain(&old.fit, &new.fit) > more_parameters * (values.max(1) as f64).ln()
}
