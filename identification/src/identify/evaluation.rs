//! A model evaluated on a log: compared as it is, or with its parameters fitted, with the statistics of the residuals.

use std::time::Instant;

use super::constants;
use super::fit::{
    self, FitError, FitResult, Unidentifiable,
    held_out::{Departure, departure},
};
use super::predict::refined;
use super::recording_conventions::fit_as_recorded;
use super::repetition::{Repetition, repetition};
use super::residual::{self, Misfit};
use crate::budget::Budget;
use crate::deadline::Deadline;
use crate::identify::defects::defects;
use crate::log::plausible::{Defect, ShiftedConstant};
use crate::log::{Log, RateSource};
use crate::model::{Channel, Model};
use crate::recording::prepare::{PreparationNote, PrepareError};
use crate::recording::{self, PreparedLog};

/// Treatment of the model's parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterTreatment {
    /// Parameters keep their values; only the initial states are fitted.
    Kept,
    /// Parameters are fitted; blocks of rows are held out for validation.
    Fitted,
    /// Parameters are fitted to every row.
    FittedToAllRows,
}

/// A remark on an evaluation.
#[derive(Debug, Clone, PartialEq)]
pub enum EvaluationRemark {
    /// A note on the preparation of the log.
    Preparation(PreparationNote),
    /// The log does not state the source of the rate; this source gives the lower χ².
    AssumedRateSource {
        /// The rate is derived from the encoder; otherwise it is from a separate sensor.
        from_encoder: bool,
    },
    /// A fit shifts a physical constant by a decade or more.
    ShiftedConstant(ShiftedConstant),
    /// Only noise is left in the fitted rows, and far more in held-out rows.
    HeldOutDeparts(Departure),
    /// The parameters are those of largest likelihood of the prediction errors: the noise of the angle may return in the input.
    ByPredictionErrors,
    /// Of a standard error, the larger part is by the voltage within the rows, for which a random walk is assumed.
    RestsOnCourse,
    /// A fitted model leaves more than noise: the standard errors do not contain what is missing.
    MoreThanNoise {
        /// rms of the worst channel over its noise.
        ratio: f64,
    },
    /// The input repeats itself.
    Repetition(Repetition),
}

/// Result of an evaluation.
pub enum Evaluation<'a> {
    /// The log is not a plausible record of a drive; nothing was computed.
    ImplausibleLog(Vec<Defect>),
    /// The model was simulated on the log.
    Evaluated(Box<Evaluated<'a>>),
}

/// A model evaluated on a log.
pub struct Evaluated<'a> {
    /// The log in the form that the model needs.
    pub data: PreparedLog<'a>,
    /// Parameters, initial states and residual statistics.
    pub result: FitResult,
    /// Systematic residuals, most significant first.
    pub misfits: Vec<Misfit>,
    /// Remarks on how the evaluation was done.
    pub remarks: Vec<EvaluationRemark>,
    /// Computing time, s.
    pub seconds: f64,
}

/// Why an evaluation failed.
#[derive(Debug, thiserror::Error)]
pub enum EvaluationError {
    /// The log lacks what the model needs.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The fit failed.
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// Evaluates `model` on `log`. A fit that has not converged by the `deadline` ends with its best values so far.
///
/// # Errors
/// The log lacks a column that the model needs, or the fit failed.
pub fn evaluate<'a>(
    log: &'a Log,
    model: &Model,
    treatment: ParameterTreatment,
    deadline: Deadline,
) -> Result<Evaluation<'a>, EvaluationError> {
    let begin = Instant::now();
    let (data, notes) = recording::prepare(log, model, treatment != ParameterTreatment::FittedToAllRows)?;
    let data = data.spending(Budget::new(None, deadline));
    let mut remarks: Vec<EvaluationRemark> = notes.into_iter().map(EvaluationRemark::Preparation).collect();
    let findings = defects(log, model);
    if !findings.is_empty() {
        return Ok(Evaluation::ImplausibleLog(findings));
    }
    let (mut result, data) = with_best_rate_source(model, data, log, treatment, &mut remarks)?;
    if treatment != ParameterTreatment::Kept {
        let (system, _) = fit::build::system(model, data.temp_C.is_some());
        let (found, by_prediction_errors) = refined(&system, log, &data, result);
        result = found;
        remarks.extend(by_prediction_errors.then_some(EvaluationRemark::ByPredictionErrors));
        remarks.extend(result.rests_on_course.then_some(EvaluationRemark::RestsOnCourse));
    }
    let undetermined = undetermined_own_parameters(model, &result);
    result.unidentifiable.extend(undetermined);
    // A comparison keeps the constants: where it describes a channel badly, a fit shows whether they contradict the log.
    let fitted = match treatment {
        ParameterTreatment::Kept if constants::may_have_wrong_unit(&result) => {
            let (system, parameters) = fit::build::system(model, data.temp_C.is_some());
            fit::fit(&system, &parameters.within_physical_ranges(), &data).ok()
        }
        ParameterTreatment::Kept => None,
        ParameterTreatment::Fitted | ParameterTreatment::FittedToAllRows => Some(result.clone()),
    };
    // Values on the way to the minimum prove nothing about units.
    let judged = !deadline.has_passed();
    let by_comparison = (judged && treatment == ParameterTreatment::Kept).then(|| constants::columns_in_thousandths(model, &data, &result));
    let by_fit = || fitted.as_ref().filter(|_| judged).and_then(|fitted| constants::columns_in_thousandths_by_fit(model, &data, fitted));
    let defect = by_comparison.flatten().or_else(by_fit);
    if let Some(defect) = defect {
        return Ok(Evaluation::ImplausibleLog(vec![defect]));
    }
    remarks.extend(fitted.iter().flat_map(|fitted| constants::shifted(model, fitted)).map(EvaluationRemark::ShiftedConstant));
    if treatment != ParameterTreatment::Kept && !result.leaves_noise_only() {
        let ratio = result.worst_chi2_per_n().sqrt();
        remarks.push(EvaluationRemark::MoreThanNoise { ratio });
    }
    if result.leaves_noise_only() {
        remarks.extend(departure(&data, &result.channels).map(EvaluationRemark::HeldOutDeparts));
    }
    remarks.extend(repetition(&data).map(EvaluationRemark::Repetition));
    let misfits = residual::misfits(log, &data, &result);
    let seconds = begin.elapsed().as_secs_f64();
    Ok(Evaluation::Evaluated(Box::new(Evaluated { data, result, misfits, remarks, seconds })))
}

/// Distance from zero, in standard errors, that is not significant.
const MAX_ZERO_SIGMAS: f64 = 2.0;

/// Parameters of the user's own effects that are zero within two standard errors, where one standard error exceeds the start value: the log
/// does not even determine their magnitude. A parameter of the catalogue has a kind that tells how it is judged.
fn undetermined_own_parameters(model: &Model, result: &FitResult) -> Vec<Unidentifiable> {
    let own = model.parameters().iter().filter(|given| given.info.is_none() && given.value != 0.0);
    own.filter(|given| {
        let estimates = result.parameters.list.iter().zip(&result.sigmas);
        let mut same = estimates.filter(|(p, _)| p.name == given.name);
        let unknown = result.unidentifiable.iter().all(|u| u.parameter != given.name);
        unknown && same.any(|(p, sigma)| *sigma > given.value.abs() && p.value.abs() < MAX_ZERO_SIGMAS * sigma)
    })
    .map(|given| Unidentifiable { parameter: given.name.clone(), partner: None })
    .collect()
}

/// Evaluates the model. Where the log does not state the source of the rate and the model has an eccentric encoder, both sources (rate
/// sensor, encoder) are tried and the one with the lower χ² is kept.
fn with_best_rate_source<'a>(
    model: &Model,
    data: PreparedLog<'a>,
    log: &'a Log,
    treatment: ParameterTreatment,
    remarks: &mut Vec<EvaluationRemark>,
) -> Result<(FitResult, PreparedLog<'a>), FitError> {
    let (system, parameters) = fit::build::system(model, data.temp_C.is_some());
    let parameters = parameters.within_physical_ranges();
    let once = |data: &PreparedLog, near: Option<&FitResult>| match (treatment, near) {
        (ParameterTreatment::Kept, _) => fit::compare(&system, &parameters, data),
        (ParameterTreatment::Fitted | ParameterTreatment::FittedToAllRows, None) => fit::fit(&system, &parameters, data),
        (ParameterTreatment::Fitted | ParameterTreatment::FittedToAllRows, Some(near)) => fit::refit_from(&system, data, near),
    };
    let depends_on_source = model.effects().iter().any(|e| e.card.uses_rate_source);
    let has_rate = data.channels.iter().any(|c| c.channel == Channel::Rate);
    let source_unknown = log.provenance(Channel::Rate.column()).source == RateSource::Unknown;
    let (from_sensor, data, recording) = fit_as_recorded(log, data, &once)?;
    remarks.extend(recording.notes.into_iter().map(EvaluationRemark::Preparation));
    if !(depends_on_source && has_rate && source_unknown) {
        return Ok((from_sensor, data));
    }
    let by_encoder = data.clone().with_rate_from_encoder(true);
    let from_encoder = once(&by_encoder, None)?;
    if from_encoder.chi2 < from_sensor.chi2 {
        remarks.push(EvaluationRemark::AssumedRateSource { from_encoder: true });
        Ok((from_encoder, by_encoder))
    } else {
        remarks.push(EvaluationRemark::AssumedRateSource { from_encoder: false });
        Ok((from_sensor, data.with_rate_from_encoder(false)))
    }
}
