//! Which physical effect is missing from a model, and how strong is the evidence?
//!
//! In: logs and a model. Out: an [`Explanation`]: the search from the given model to one that leaves only noise, the evidence for every effect
//! of the catalogue, and the verdict. It holds data only; `report::explanation` words it. The stages:
//!
//! * [`join_logs`]: several logs as one, prepared once;
//! * [`fitted_model`]: fit of the given model;
//! * [`screen`] ([`trial`], [`visibility`], [`harmonics`], [`jumps`], [`score`]): every effect of the catalogue, scored by its sensitivity;
//! * [`refit`] ([`candidate`], [`descent`]): the best few, fitted;
//! * [`compare`] ([`likelihood`], [`refusal`]): evidence on whitened residuals;
//! * [`search`] ([`stop`], [`eliminate`]): add or stop, remove what is no longer needed;
//! * [`recorded`]: the search again, where its last model contradicts how the log was assumed to be recorded;
//! * [`unfinished`]: what is open where the budget ends the search, and the state to continue from;
//! * [`verdict`] ([`unknown_structure`], [`piecewise_linear`], [`symbolic`]): cause, or unknown structure;
//! * [`detection`]: what the logs would have shown, where nothing is missing;
//! * [`next_experiment`] ([`design`]): what to measure next.
//!
//! All thresholds are in [`Criteria`].

mod adequacy;
pub mod answer;
mod candidate;
mod compare;
pub mod coverage;
pub mod criteria;
mod descent;
mod design;
mod detection;
mod eliminate;
mod experiment;
mod fitted_model;
mod harmonics;
pub mod join_logs;
mod jumps;
pub mod likelihood;
mod motion;
pub mod next_experiment;
mod open_course;
mod piecewise_linear;
pub mod reasons;
mod recorded;
mod refit;
mod refusal;
mod score;
mod screen;
mod search;
mod search_path;
mod stiffness;
mod stop;
mod symbolic;
#[cfg(test)]
pub(crate) mod test_rotor;
mod trial;
mod trials;
pub mod unfinished;
mod unknown_structure;
mod verdict;
mod visibility;

use std::ops::Range;
use std::time::Instant;

pub use answer::{Candidate, ChannelError, Estimate, Explanation, Shape, ShapeForm, Stage, Verdict};
pub use criteria::Criteria;
pub use detection::DetectionLimit;
pub use experiment::{NextExperiment, Purpose, Repeated, Separation};
pub use join_logs::JoinError;
pub use reasons::{NotVisible, Progress, Refusal, Remark};

use crate::budget::Budget;
use crate::deadline::Deadline;
use crate::identify::constants;
use crate::identify::defects::defects;
use crate::identify::fit::held_out::{Departure, departure};
use crate::identify::fit::prepare::{self, PreparationNote, PrepareError};
use crate::identify::fit::{FitError, Preparation, PreparedLog};
use crate::identify::predict::refined;
use crate::identify::recording_conventions::{Convention, Recording};
use crate::identify::residual;
use crate::log::Log;
use crate::log::plausible::Defect;
use crate::model::Model;
use coverage::Coverage;
use fitted_model::FittedModel;
use recorded::search_as_recorded;
use search_path::Search;
use unfinished::{SearchState, StateError, Unfinished};

/// Why there is no explanation.
#[derive(Debug, thiserror::Error)]
pub enum ExplainError {
    /// A log lacks what the model needs.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The model cannot be simulated along the logs.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// A log is not a plausible record of a drive (verdict `bad-log`).
    #[error("{}: {}", .log.path().display(), .findings.iter().map(|d| d.code().name()).collect::<Vec<_>>().join(", "))]
    BadLog {
        /// The log.
        log: Box<Log>,
        /// What is wrong with it.
        findings: Vec<Defect>,
    },
    /// The logs cannot be fitted together.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// A search cannot be continued from its state.
    #[error(transparent)]
    State(#[from] StateError),
}

/// What all stages share.
#[derive(Clone, Copy)]
pub(crate) struct Context<'a> {
    /// All logs as one.
    log: &'a Log,
    /// Rows of each log in it.
    log_rows: &'a [Range<usize>],
    /// The thresholds.
    criteria: &'a Criteria,
}

/// The given model, fitted.
struct Given<'a> {
    base: FittedModel<'a>,
    recording: Recording,
    /// The logs, with no convention of recording assumed.
    data: PreparedLog<'a>,
}

impl<'a> Given<'a> {
    fn of(context: Context<'a>, model: &Model, data: PreparedLog<'a>, conventions: Option<&[Convention]>) -> Result<Self, FitError> {
        let (base, recording) = FittedModel::fit(context, model, data.clone(), conventions)?;
        Ok(Given { base, recording, data })
    }

    fn explain(self, model: &Model, state: Option<&SearchState>, progress: &(dyn Fn(&Progress) + Sync)) -> Result<Outcome<'a>, FitError> {
        let Given { base, recording, data } = self;
        let hold_out = data.held_out.is_some();
        let (mut search, recording) = search_as_recorded(model, base, recording, data, state, progress)?;
        progress(&Progress::ExaminingRemainder);
        let (verdict, unexplained, unfinished) = match verdict::verdict(&mut search) {
            Ok((verdict, unexplained)) => (verdict, unexplained, None),
            Err(open) => {
                let state = search.state(model, &recording.conventions, hold_out);
                (Verdict::NotFinished, Vec::new(), Some(Unfinished { open, state }))
            }
        };
        Ok(Outcome { search, verdict, unexplained, unfinished, recorded: recording.notes })
    }
}

/// What a search found.
struct Outcome<'a> {
    search: Search<'a>,
    verdict: Verdict,
    /// The shape of what no effect explains.
    unexplained: Vec<Shape>,
    /// What the budget left open.
    unfinished: Option<Unfinished>,
    /// How the log was recorded, as far as its notes do not state it.
    recorded: Vec<PreparationNote>,
}

impl Outcome<'_> {
    /// Held-out rows that the final model does not describe, although nothing is said to be missing.
    fn departure(&self) -> Option<Departure> {
        let last = self.search.models.last().filter(|_| matches!(self.verdict, Verdict::Adequate | Verdict::EffectFound))?;
        departure(&last.data, &last.fit.channels)
    }
}

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
    mut logs: Vec<Log>,
    model: &Model,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<Explanation, ExplainError> {
    let begin = Instant::now();
    logs.iter_mut().for_each(Log::even_out_times);
    for (k, log) in logs.iter().enumerate() {
        prepare::check(log, model)?;
        let findings = defects(log, model);
        if !findings.is_empty() {
            return Err(ExplainError::BadLog { log: Box::new(logs.swap_remove(k)), findings });
        }
    }
    let paths = logs.iter().map(|l| l.path().display().to_string()).collect();
    let (log, log_rows) = join_logs::join(logs, &criteria.joining)?;
    state.map_or(Ok(()), |state| state.check(&log, model))?;
    let context = Context { log: &log, log_rows: &log_rows, criteria: &criteria };
    let limit = criteria.search.max_passes.map(|passes| passes.saturating_mul(log.len() as u64));
    let budget = Budget::new(limit, deadline);
    let fitted = |hold_out: bool, conventions: Option<&[Convention]>| -> Result<_, ExplainError> {
        let (mut data, notes) = prepare::prepare(&log, model, hold_out)?;
        data.budget = budget.clone();
        // The evidence is that of increments, whose errors do not accumulate.
        data.absolute_angle = false;
        progress(&Progress::FittingGiven);
        Ok((Given::of(context, model, data, conventions)?, notes))
    };
    let (start, notes) = fitted(state.is_none_or(|state| state.hold_out), state.map(|state| state.conventions.as_slice()))?;
    let base = &start.base;
    // Values on the way to the minimum prove nothing about units.
    if !budget.checkpoint()
        && let Some(defect) = constants::columns_in_thousandths_by_fit(model, &base.data, &base.fit)
    {
        drop(start);
        return Err(ExplainError::BadLog { log: Box::new(log), findings: vec![defect] });
    }
    let shifted = constants::shifted(model, &base.fit);
    let (mut given_data, mut given) = (base.data.clone(), base.fit.clone());
    let mut outcome = start.explain(model, state, progress)?;
    if let Some(departure) = outcome.departure() {
        let (start, _) = fitted(false, None)?;
        (given_data, given) = (start.base.data.clone(), start.base.fit.clone());
        outcome = start.explain(model, None, progress)?;
        outcome.search.remarks.insert(0, Remark::NothingHeldOut(departure));
    }
    let Outcome { mut search, verdict, unexplained, unfinished, recorded } = outcome;
    // Between the minima of the free runs, before the last one is replaced.
    if verdict == Verdict::EffectFound {
        let small = search.small_parts();
        search.remarks.extend(small);
    }
    if matches!(verdict, Verdict::Adequate | Verdict::EffectFound)
        && let Some(last) = search.models.last_mut()
    {
        let (found, by_prediction_errors) = refined(&last.system, &log, &last.data, last.fit.clone());
        last.replace_fit(found);
        search.remarks.extend(by_prediction_errors.then_some(Remark::ByPredictionErrors));
        search.remarks.extend(last.fit.rests_on_course.then_some(Remark::RestsOnCourse));
    }
    if verdict != Verdict::UnknownStructure
        && let Some(last) = search.models.last()
    {
        search.remarks.extend(last.temperature_scale());
    }
    if matches!(verdict, Verdict::PartlyExplained | Verdict::UnknownStructure)
        && let (Some(first), Some(last)) = (search.models.first(), search.models.last())
    {
        search.remarks.extend(first.may_coast(last));
    }
    if let (Verdict::UnknownStructure, Some(last)) = (verdict, search.models.last()) {
        search.remarks.extend(last.not_free());
    }
    // As the log was recorded, which the search may have found.
    let (given_data, given) = search.models.first().map_or((given_data, given), |first| (first.data.clone(), first.fit.clone()));
    let (misfits, preparation) = (residual::misfits(&log, &given_data, &given), Preparation::of(&given_data));
    let remaining = match (verdict, search.models.last()) {
        (Verdict::PartlyExplained | Verdict::UnknownStructure, Some(last)) => residual::misfits(&log, &last.data, &last.fit),
        _ => Vec::new(),
    };
    let (missing, stages) = (search.names(0), search.stages());
    let detection_limits = match (verdict, search.models.last()) {
        (Verdict::Adequate, Some(last)) if search.tests > 0 => detection::detection_limits(last, search.tests),
        _ => Vec::new(),
    };
    let coverage = Coverage::of(&log, &criteria.coverage);
    let separations = match (&search.doubt, search.models.first()) {
        (Some(doubt), Some(first)) if !missing.is_empty() => design::separations(first, doubt),
        _ => Vec::new(),
    };
    let next = next_experiment::next_experiment(&search.candidates, &missing, verdict, (&coverage, &separations), &criteria, &log);
    let mut remarks: Vec<Remark> = notes.into_iter().chain(recorded).map(Remark::Preparation).collect();
    remarks.extend(shifted.into_iter().map(Remark::ShiftedConstant));
    remarks.append(&mut search.remarks);
    let rows = log.len().max(1);
    let mut models = search.models.into_iter();
    let (given, explained, model) = match (models.next(), models.next_back()) {
        (Some(first), Some(last)) => (first.fit, last.fit, last.model),
        (Some(only), None) => (only.fit.clone(), only.fit, only.model),
        (None, _) => (given.clone(), given, model.clone()),
    };
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
        effort_passes: budget.spent() as f64 / rows as f64,
        criteria,
        seconds: begin.elapsed().as_secs_f64(),
    })
}
