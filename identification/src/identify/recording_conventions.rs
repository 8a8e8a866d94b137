//! How a log was recorded, as far as its notes do not state it: found by the fit of a model.
//!
//! A value may be taken at the time of its row or be the mean over the row; a rate may be the difference of an angle over the last row. A
//! wrong assumption leaves a residual that looks like missing physics. Each convention that no note states is tried where the model leaves
//! more than noise, and kept where the likelihood of the residuals rises clearly. Outliers are found first; see [`super::fit::outliers`].

use serde::{Deserialize, Serialize};

use super::fit::prepare::PreparationNote;
use super::fit::voltage::{self, InputTiming, Known, VoltageCourse};
use super::fit::{FitError, FitResult, PreparedLog, outliers};
use crate::log::Log;
use crate::model::{Channel, Input};

/// Least gain, 2 ln of the likelihood ratio, for a convention that differs from that of the project, per compared value: the rms falls by 1
/// %.
const MIN_GAIN_PER_VALUE: f64 = 0.02;
/// The same at least, whatever the number of values.
pub const MIN_GAIN: f64 = 20.0;

/// Least gain for a convention that differs from that of the project, in so many compared values.
pub fn min_gain(values: f64) -> f64 {
    (MIN_GAIN_PER_VALUE * values).max(MIN_GAIN)
}

/// A convention that differs from that of the project.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Convention {
    /// The input holds values at t.
    InputAtT,
    /// The input holds the values of the row before.
    InputOfRowBefore,
    /// The input holds means over the row, within which it moves.
    InputMoves,
    /// The current is its value at t.
    CurrentAtT,
    /// The rate is the mean over the last row, as differences of counts give it.
    RateOverLastRow,
}

impl Convention {
    /// All of them, in the order in which they are tried.
    pub const ALL: [Convention; 5] =
        [Convention::InputAtT, Convention::InputOfRowBefore, Convention::InputMoves, Convention::CurrentAtT, Convention::RateOverLastRow];
}

/// A fit of the data, by the first argument; from the result of another fit, where there is one.
pub type FitData<'f> = dyn Fn(&PreparedLog, Option<&FitResult>) -> Result<FitResult, FitError> + 'f;

/// How a log was recorded, beside what its notes state.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    /// The conventions that are assumed.
    pub conventions: Vec<Convention>,
    /// Notes on these, in their order, then on outliers.
    pub notes: Vec<PreparationNote>,
}

impl Recording {
    /// Adds a convention. Values of the row before take the place of values at t.
    pub fn assume(&mut self, convention: Convention, note: PreparationNote) {
        if convention == Convention::InputOfRowBefore
            && let Some(at) = self.conventions.iter().position(|c| *c == Convention::InputAtT)
        {
            self.conventions.remove(at);
            self.notes.remove(at);
        }
        self.conventions.push(convention);
        self.notes.push(note);
    }
}

/// Fits the data, with outliers excluded and the conventions that no note states tried. `data` is changed accordingly.
///
/// # Errors
/// The model cannot be simulated along the data.
pub fn fit_as_recorded(log: &Log, data: &mut PreparedLog, fit: &FitData) -> Result<(FitResult, Recording), FitError> {
    let mut recording = Recording::default();
    let mut result = fit(data, None)?;
    result = without_outliers(data, result, fit)?;
    for convention in Convention::ALL {
        if result.leaves_noise_only() || data.budget.is_exhausted() {
            break;
        }
        let mut other = data.clone();
        let Some(note) = apply(convention, log, &mut other) else { continue };
        let Ok(trial) = fit(&other, Some(&result)) else { continue };
        let values: usize = result.channels.iter().map(|c| c.rows).sum();
        if gain(&result, &trial) > min_gain(values as f64) {
            *data = other;
            result = without_outliers(data, trial, fit)?;
            recording.assume(convention, note);
        }
    }
    recording.notes.extend(outlier_notes(data));
    Ok((result, recording))
}

/// Fits the data by the given conventions, with outliers excluded. `data` is changed accordingly.
///
/// # Errors
/// The model cannot be simulated along the data.
pub fn fit_by(conventions: &[Convention], log: &Log, data: &mut PreparedLog, fit: &FitData) -> Result<(FitResult, Recording), FitError> {
    let mut notes: Vec<PreparationNote> = conventions.iter().filter_map(|convention| apply(*convention, log, data)).collect();
    let result = fit(data, None)?;
    let result = without_outliers(data, result, fit)?;
    notes.extend(outlier_notes(data));
    Ok((result, Recording { conventions: conventions.to_vec(), notes }))
}

fn outlier_notes<'d>(data: &'d PreparedLog) -> impl Iterator<Item = PreparationNote> + 'd {
    outliers::count(data).into_iter().map(|(channel, rows)| PreparationNote::Outliers { channel, rows, of: data.len() })
}

/// Excludes outliers and fits again, if there are any.
fn without_outliers(data: &mut PreparedLog, result: FitResult, fit: &FitData) -> Result<FitResult, FitError> {
    let residuals: Vec<&[f64]> = result.channels.iter().map(|c| c.residual.as_slice()).collect();
    let noise: Vec<f64> = result.channels.iter().map(|c| c.noise).collect();
    let found = outliers::find(data, &residuals, &noise);
    if found.iter().all(Vec::is_empty) {
        return Ok(result);
    }
    data.exclude(found);
    fit(data, Some(&result))
}

/// 2 ln of the likelihood ratio of the second result to the first, where the variance of each channel is unknown.
pub fn gain(before: &FitResult, after: &FitResult) -> f64 {
    let all = |c: &super::fit::ChannelFit| {
        let (sum, n) = c.residual.iter().filter(|r| r.is_finite()).fold((0.0, 0usize), |(s, n), r| (s + r * r, n + 1));
        (sum / n.max(1) as f64, n as f64)
    };
    before
        .channels
        .iter()
        .zip(&after.channels)
        .map(|(b, a)| {
            let ((b, n), (a, _)) = (all(b), all(a));
            if a > 0.0 && b > 0.0 { n * (b / a).ln() } else { 0.0 }
        })
        .sum()
}

/// The values of the input, where neither a note nor its course within the rows states when it had them.
fn input_of_unknown_timing<'l>(log: &'l Log, data: &PreparedLog) -> Option<&'l [f64]> {
    let column = data.driven.column();
    let course_is_known = data.voltage_course.as_ref().is_some_and(|course| course.known != Known::Values);
    if course_is_known || data.driven == Input::Motion || log.notes().states_timing(column) { None } else { log.column(column) }
}

/// Applies a convention that no note contradicts; `None` where it does not apply.
pub fn apply(convention: Convention, log: &Log, data: &mut PreparedLog) -> Option<PreparationNote> {
    match convention {
        Convention::InputAtT => {
            let is_open = data.input_timing == InputTiming::OverRow && !log.notes().voltage_is_held();
            let values = input_of_unknown_timing(log, data).filter(|_| is_open)?;
            data.input_timing = InputTiming::AtT;
            data.input = voltage::input(values, data.input_timing, &data.segments).into_owned().into();
            data.voltage_course = VoltageCourse::expected(log, values, data.driven, Known::Values, &data.segments);
            Some(PreparationNote::AssumedAtT { column: data.driven.column() })
        }
        Convention::InputOfRowBefore => {
            let values = input_of_unknown_timing(log, data).filter(|_| data.input_timing != InputTiming::OverRowBefore)?;
            data.input_timing = InputTiming::OverRowBefore;
            data.input = voltage::input(values, data.input_timing, &data.segments).into_owned().into();
            data.voltage_course = None;
            Some(PreparationNote::AssumedOfRowBefore { column: data.driven.column() })
        }
        Convention::InputMoves => {
            let is_known = data.input_timing == InputTiming::AtT || data.voltage_course.is_some() || log.notes().voltage_is_held();
            if is_known || data.driven != Input::Voltage {
                return None;
            }
            data.voltage_course = VoltageCourse::expected(log, &data.input, data.driven, Known::Means, &data.segments);
            Some(PreparationNote::AssumedToMove { column: data.driven.column() })
        }
        Convention::CurrentAtT => {
            let column = Channel::Current.column();
            let channel = data.channels.iter_mut().find(|c| c.channel == Channel::Current && !c.instant)?;
            if log.notes().has_provenance(column) {
                return None;
            }
            channel.instant = true;
            Some(PreparationNote::AssumedAtT { column })
        }
        Convention::RateOverLastRow => {
            let column = Channel::Rate.column();
            let dt_s = data.dt_s;
            let channel =
                data.channels.iter_mut().find(|c| c.channel == Channel::Rate && c.mean_before_s.is_none() && c.filter_hz.is_none())?;
            if log.notes().has_provenance(column) {
                return None;
            }
            channel.mean_before_s = Some(dt_s);
            Some(PreparationNote::AssumedOverLastRow { column, interval_s: dt_s })
        }
    }
}
