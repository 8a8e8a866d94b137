//! A model in prediction-error form as a free run (output error), fitted from the parameters of its prediction-error form.

use crate::identify::explain::Context;
use crate::identify::explain::fitted_model::FittedModel;
use crate::identify::fit::{self, FitError, PreparedLog, build, initial_state_kinds, starting_states};
use crate::identify::predict::PredictionFit;
use crate::identify::predict::fit::Prediction;
use crate::model::Model;

/// A model on the way, fitted.
#[derive(Clone)]
pub struct Stage {
    /// The model.
    pub model: Model,
    /// Its fit.
    pub prediction: PredictionFit,
}

/// A stage as a free run: fitted from the parameters of its prediction-error form.
pub fn free_run<'a>(context: Context<'a>, stage: &Stage, data: &PreparedLog<'a>) -> Result<FittedModel<'a>, FitError> {
    let data = PreparedLog { predictor: None, ..data.clone() };
    let (system, mut parameters) = build::system(&stage.model, data.temp_C.is_some());
    for p in &mut parameters.list {
        if let Some(fitted) = stage.prediction.parameters.list.iter().find(|q| q.name == p.name) {
            p.value = fitted.value;
        }
    }
    let kinds = initial_state_kinds(&system.rig::<f64>(&parameters, data.driven), &data);
    let states = starting_states(&kinds, &data, &parameters, &system);
    let noise = Prediction::new(&system, &data).series_noise();
    let fit = fit::refit(&system, &parameters, &data, &states, &noise)?;
    Ok(FittedModel::new(context, &stage.model, system, parameters, fit, data))
}
