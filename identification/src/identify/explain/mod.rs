//! Which physical effect is missing from a model, and how strong is the evidence?
//!
//! In: logs and a model. Out: an [`Explanation`]: the search from the given model to one that leaves only noise, the evidence for every
//! effect of the catalogue, and the verdict. It holds data only; `report::explanation` words it. The stages, each a folder that imports
//! from those before it:
//!
//! * [`answer`]: the result as data, with its reasons and remarks;
//! * [`fitted`]: the logs as one, and a model fitted to them;
//! * [`candidates`]: every effect of the catalogue beside a fitted model;
//! * [`search`]: adds effects and removes what is no longer needed, until only noise is left or nothing helps;
//! * [`verdict`]: cause, or unknown structure;
//! * [`next`]: what the logs would have shown, and what to measure next.
//!
//! All thresholds are in [`Criteria`].

pub mod answer;
mod candidates;
mod context;
pub mod criteria;
mod error;
pub(crate) mod fitted;
mod next;
mod search;
mod verdict;

use std::time::Instant;

pub use answer::coverage::Coverage;
pub use answer::experiment::{NextExperiment, Purpose, Repeated, Separation};
pub use answer::reasons::{NotVisible, Progress, Refusal, Remark};
pub use answer::{Candidate, ChannelError, DetectionLimit, Estimate, Explanation, OpenPart, Shape, ShapeForm, Stage, Unfinished, Verdict};
pub use criteria::Criteria;
pub use error::ExplainError;
pub use fitted::join_logs::{JoinError, join};
pub use search::unfinished::{SearchState, StateError};

use crate::budget::Budget;
use crate::deadline::Deadline;
use crate::identify::defects::defects;
use crate::log::Log;
use crate::model::Model;
use crate::recording::{Preparation, prepare};
use context::Context;
use fitted::given::Given;
use verdict::outcome::Outcome;

/// How an explanation is made, beside its logs and its model.
#[derive(Debug, Default)]
pub struct Options<'a> {
    /// The thresholds, and the limit of effort.
    pub criteria: Criteria,
    /// A limit of time, with which the answer depends on the machine.
    pub deadline: Deadline,
    /// The state of a search that was not finished, to go on from.
    pub state: Option<&'a SearchState>,
}

/// Explains what `model` lacks on these logs together, by the default criteria.
///
/// # Errors
/// [`ExplainError`].
pub fn explain(logs: Vec<Log>, model: &Model, progress: &(dyn Fn(&Progress) + Sync)) -> Result<Explanation, ExplainError> {
    explain_with(Options::default(), logs, model, progress)
}

/// Explains what `model` lacks on these logs together.
///
/// # Errors
/// [`ExplainError`].
pub fn explain_with(
    Options { criteria, deadline, state }: Options,
    logs: Vec<Log>,
    model: &Model,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<Explanation, ExplainError> {
    let begin = Instant::now();
    let paths = logs.iter().map(|l| l.path().display().to_string()).collect();
    let (log, log_rows) = join(plausible(logs, model)?, &criteria.joining)?;
    state.map_or(Ok(()), |state| state.check(&log, model))?;
    let context = Context { log: &log, log_rows: &log_rows, criteria: &criteria };
    let limit = criteria.search.max_passes.map(|passes| passes.saturating_mul(log.len() as u64));
    let budget = Budget::new(limit, deadline);
    let fit_given = |hold_out, conventions| {
        progress(&Progress::FittingGiven);
        Given::fit(context, model, &budget, hold_out, conventions)
    };

    let given = fit_given(state.is_none_or(|state| state.hold_out), state.map(|state| state.conventions.as_slice()))?;
    if let Some(defect) = given.wrong_unit() {
        drop(given);
        return Err(ExplainError::BadLog { log: Box::new(log), findings: vec![defect] });
    }
    let (notes, shifted) = (given.notes.clone(), given.shifted_constants());
    let mut outcome = Outcome::of(given, state, progress)?;
    if let Some(departure) = outcome.departure() {
        outcome = Outcome::of(fit_given(false, None)?, None, progress)?;
        outcome.search.remarks.insert(0, Remark::NothingHeldOut(departure));
    }
    outcome.conclude();

    let coverage = Coverage::of(&log, &criteria.coverage);
    let next = next::experiment_after(&outcome, &coverage);
    let detection_limits = next::detection::limits_after(&outcome);
    let remaining = if outcome.leaves_more() { outcome.search.models.last().misfits() } else { Vec::new() };
    let Outcome { search, verdict, unexplained, unfinished, recorded } = outcome;
    let (missing, stages, misfits) = (search.names(0), search.stages(), search.models.given().misfits());
    let preparation = Preparation::of(&search.models.given().data);
    let (given, explained, model) =
        (search.models.given().fit.clone(), search.models.last().fit.clone(), search.models.last().model.clone());
    let preparation_remarks = notes.into_iter().chain(recorded).map(Remark::Preparation);
    let remarks = preparation_remarks.chain(shifted.into_iter().map(Remark::ShiftedConstant)).chain(search.remarks).collect();
    let effort_passes = budget.spent() as f64 / log.len().max(1) as f64;
    Ok(Explanation {
        verdict,
        given,
        missing,
        stages,
        candidates: search.candidates,
        misfits,
        remaining,
        unexplained,
        unfinished,
        next,
        model,
        explained,
        logs: paths,
        coverage,
        detection_limits,
        log,
        preparation,
        remarks,
        effort_passes,
        criteria,
        seconds: begin.elapsed().as_secs_f64(),
    })
}

/// The logs with even times.
///
/// # Errors
/// A log lacks what the model needs, or is not a plausible record of a drive.
fn plausible(mut logs: Vec<Log>, model: &Model) -> Result<Vec<Log>, ExplainError> {
    logs.iter_mut().for_each(Log::even_out_times);
    for (k, log) in logs.iter().enumerate() {
        prepare::check(log, model)?;
        let findings = defects(log, model);
        if !findings.is_empty() {
            return Err(ExplainError::BadLog { log: Box::new(logs.swap_remove(k)), findings });
        }
    }
    Ok(logs)
}
