//! How a log was recorded: outliers, and conventions that no note states, by the likelihood of the innovations.
//!
//! The innovations of one row do not depend on an error that began long before. An outlier, or a voltage whose time is misunderstood, shows there also
//! beside a hidden effect. A convention that no note states competes with the effects.

use super::model::PredictedModel;
use crate::identify::explain::Context;
use crate::identify::fit::prepare::PreparationNote;
use crate::identify::fit::{FitResult, PreparedLog, outliers};
use crate::identify::predict::PredictionFit;
use crate::identify::predict::fit::Prediction;
use crate::identify::recording_conventions::{Convention, apply};
use crate::model::Model;

/// The given model fitted without outliers, and notes on these; `None` where it has no prediction-error form.
pub fn without_outliers<'a>(
    context: Context<'a>,
    model: &Model,
    data: &PreparedLog<'a>,
    free_run: Option<&FitResult>,
) -> Option<(PredictedModel<'a>, Vec<PreparationNote>)> {
    let mut best = PredictedModel::fit_from_far(context, model, data, free_run)?;
    let own = &best.fitted;
    let noise: Vec<f64> = own.fit.channels.iter().map(|c| c.noise).collect();
    let found = outliers::find(&own.data, &own.residuals(), &noise);
    if found.iter().any(|rows| !rows.is_empty()) {
        let mut data = PreparedLog { predictor: None, ..own.data.clone() };
        data.exclude(found);
        best = PredictedModel::fit_from_far(context, model, &data, Some(&own.fit))?;
    }
    let of = best.fitted.data.len();
    let notes = outliers::count(&best.fitted.data).into_iter().map(|(channel, rows)| PreparationNote::Outliers { channel, rows, of });
    let notes = notes.collect();
    Some((best, notes))
}

/// A convention that differs from that of the project, and that no note contradicts.
#[derive(Debug, Clone)]
pub struct Recorded<'a> {
    /// The data by it.
    pub data: PreparedLog<'a>,
    /// The note on it.
    pub note: PreparationNote,
    /// The model on these data, fitted.
    pub prediction: PredictionFit,
}

/// The conventions that no note states, each with the model fitted to the data by it.
pub fn conventions<'a>(base: &PredictedModel<'a>) -> Vec<Recorded<'a>> {
    let fitted = &base.fitted;
    let tried = Convention::ALL.into_iter().filter_map(|convention| {
        let mut data = PreparedLog { predictor: None, ..fitted.data.clone() };
        let note = apply(convention, fitted.context.log, &mut data)?;
        let prediction = Prediction::new(&fitted.system, &data);
        let p = &base.prediction;
        let begin = prediction.at(&p.parameters, Some(p.initial_states.clone()), p.noise.clone())?;
        let here = prediction.fit(prediction.descend(begin, 8)?)?;
        Some(Recorded { data, note, prediction: here })
    });
    tried.collect()
}
