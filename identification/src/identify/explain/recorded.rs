//! The search, with the conventions of recording judged by the model that it found.
//!
//! A convention that no note states is chosen on the given model. While an effect is missing there, a wrong convention may imitate part of it. The model at
//! the end of the search decides: where it fits better by other conventions, or where it leaves more than noise although one was assumed, the search begins
//! again by those. The result with the lower BIC is kept.

use super::criteria::MisfitClass;
use super::fitted_model::FittedModel;
use super::reasons::Progress;
use super::search::search;
use super::search_path::Search;
use crate::identify::fit::{FitError, PreparedLog};
use crate::identify::recording_conventions::{Convention, Recording, gain};
use crate::model::Model;

/// Searches from `given`, the `model` fitted as `recording` says. `data`: the logs, with no convention assumed.
///
/// # Errors
/// A model with an added effect cannot be simulated.
pub fn search_as_recorded<'a>(
    model: &Model,
    given: FittedModel<'a>,
    mut recording: Recording,
    data: PreparedLog<'a>,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<(Search<'a>, Recording), FitError> {
    let context = given.context;
    let mut kept = search(given, progress)?;
    let mut tried = vec![recording.conventions.clone()];
    while let Some(conventions) = other_conventions(&kept, &recording.conventions, &data)?
        && !tried.contains(&conventions)
        && !data.deadline.has_passed()
    {
        let (given, other) = FittedModel::fit(context, model, data.clone(), Some(&conventions))?;
        tried.push(conventions);
        let found = search(given, progress)?;
        if !has_lower_bic(&found, &kept) || data.deadline.has_passed() {
            break;
        }
        (kept, recording) = (found, other);
    }
    Ok((kept, recording))
}

/// The conventions to search by instead of the `assumed` ones; `None` where the model at the end of the search supports these.
fn other_conventions(found: &Search, assumed: &[Convention], data: &PreparedLog) -> Result<Option<Vec<Convention>>, FitError> {
    let Some(last) = found.models.last() else { return Ok(None) };
    let (leaves_more, is_assumed) = (last.misfit() > MisfitClass::Invisible, !assumed.is_empty());
    if !found.added.is_empty() && (leaves_more || is_assumed) {
        let best = last.best_conventions(data)?;
        if best != assumed {
            return Ok(Some(best));
        }
    }
    Ok((leaves_more && is_assumed).then(Vec::new))
}

/// True if the last model of `found` has a lower BIC than the last of `kept`, on the same logs.
fn has_lower_bic(found: &Search, kept: &Search) -> bool {
    let (Some(new), Some(old)) = (found.models.last(), kept.models.last()) else { return false };
    let values: usize = old.fit.channels.iter().map(|c| c.rows).sum();
    let more_parameters = new.free_parameters() as f64 - old.free_parameters() as f64;
    gain(&old.fit, &new.fit) > more_parameters * (values.max(1) as f64).ln()
}
