//! How a log was recorded, as far as its notes do not state it: found by the fit of a model.
//!
//! A value may be taken at the time of its row or be the mean over the row; a rate may be the difference of an angle over the last row. A
//! wrong assumption leaves a residual that looks like missing physics. Each convention that no note states is tried where the model leaves
//! more than noise, and kept where the likelihood of the residuals rises clearly. Outliers are found first; see [`super::fit::outliers`].

use super::fit::{FitError, FitResult, outliers};
use crate::log::Log;
use crate::recording::convention::apply;
use crate::recording::prepare::PreparationNote;
use crate::recording::{Convention, PreparedLog};

/// Least gain, 2 ln of the likelihood ratio, for a convention that differs from that of the project, per compared value: the rms falls by 1
/// %.
const MIN_GAIN_PER_VALUE: f64 = 0.02;
/// The same at least, whatever the number of values.
pub const MIN_GAIN: f64 = 20.0;

/// Least gain for a convention that differs from that of the project, in so many compared values.
pub fn min_gain(values: f64) -> f64 {
    (MIN_GAIN_PER_VALUE * values).max(MIN_GAIN)
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

/// Fits the data, with outliers excluded and the conventions that no note states tried. The result, the data accordingly, and what was
/// assumed.
///
/// # Errors
/// The model cannot be simulated along the data.
pub fn fit_as_recorded<'a>(
    log: &'a Log,
    data: PreparedLog<'a>,
    fit: &FitData,
) -> Result<(FitResult, PreparedLog<'a>, Recording), FitError> {
    let mut recording = Recording::default();
    let result = fit(&data, None)?;
    let (mut result, mut data) = without_outliers(data, result, fit)?;
    for convention in Convention::ALL {
        if result.leaves_noise_only() || data.budget.is_exhausted() {
            break;
        }
        let Some((other, note)) = apply(convention, log, &data) else { continue };
        let Ok(trial) = fit(&other, Some(&result)) else { continue };
        let values: usize = result.channels.iter().map(|c| c.rows).sum();
        if gain(&result, &trial) > min_gain(values as f64) {
            (result, data) = without_outliers(other, trial, fit)?;
            recording.assume(convention, note);
        }
    }
    recording.notes.extend(outlier_notes(&data));
    Ok((result, data, recording))
}

/// Fits the data by the given conventions, with outliers excluded. The result, the data accordingly, and what was assumed.
///
/// # Errors
/// The model cannot be simulated along the data.
pub fn fit_by<'a>(
    conventions: &[Convention],
    log: &'a Log,
    mut data: PreparedLog<'a>,
    fit: &FitData,
) -> Result<(FitResult, PreparedLog<'a>, Recording), FitError> {
    let mut notes = Vec::new();
    for convention in conventions {
        if let Some((by_convention, note)) = apply(*convention, log, &data) {
            data = by_convention;
            notes.push(note);
        }
    }
    let result = fit(&data, None)?;
    let (result, data) = without_outliers(data, result, fit)?;
    notes.extend(outlier_notes(&data));
    Ok((result, data, Recording { conventions: conventions.to_vec(), notes }))
}

fn outlier_notes<'d>(data: &'d PreparedLog) -> impl Iterator<Item = PreparationNote> + 'd {
    outliers::count(data).into_iter().map(|(channel, rows)| PreparationNote::Outliers { channel, rows, of: data.len() })
}

/// Excludes outliers and fits again, if there are any.
fn without_outliers<'a>(data: PreparedLog<'a>, result: FitResult, fit: &FitData) -> Result<(FitResult, PreparedLog<'a>), FitError> {
    let residuals: Vec<&[f64]> = result.channels.iter().map(|c| c.residual.as_slice()).collect();
    let noise: Vec<f64> = result.channels.iter().map(|c| c.noise).collect();
    let found = outliers::find(&data, &residuals, &noise);
    if found.iter().all(Vec::is_empty) {
        return Ok((result, data));
    }
    let data = data.without(found);
    let result = fit(&data, Some(&result))?;
    Ok((result, data))
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
