//! A model fitted in prediction-error form, with what screening and comparison need of it.

use crate::identify::explain::Context;
use crate::identify::explain::fitted_model::FittedModel;
use crate::identify::fit::{self, Iterate, Parameters, PreparedLog, System};
use crate::identify::predict::PredictionFit;
use crate::identify::predict::adjoint::{self, Gradient};
use crate::identify::predict::fit::Prediction;
use crate::identify::predict::row_model::row_model;
use crate::model::{Channel, Model};

/// A model, its fit, and the data followed by its filter.
pub struct PredictedModel<'a> {
    /// The model at the fit; its residuals are the innovations.
    pub fitted: FittedModel<'a>,
    /// The fit.
    pub prediction: PredictionFit,
}

impl<'a> PredictedModel<'a> {
    /// The model at a fit.
    pub fn new(context: Context<'a>, model: &Model, system: System, start: Parameters, data: &PreparedLog<'a>, prediction: PredictionFit) -> Self {
        let data = Prediction::new(&system, data).following(&prediction.predictor);
        let noise: Vec<f64> = prediction.predictor.innovation_variances.iter().map(|s| s.sqrt()).collect();
        let iterate = Iterate::new(&system, &prediction.parameters, &data, &prediction.initial_states);
        let fit = fit::evaluate(&system, &data, iterate, &noise);
        PredictedModel { fitted: FittedModel::new(context, model, system, start, fit, data), prediction }
    }

    /// Gradient of the likelihood by torque and readings; `None` for a model that is not finite.
    pub fn gradient(&self) -> Option<Gradient> {
        let fitted = &self.fitted;
        let model = row_model(&fitted.system, &fitted.fit.parameters, &fitted.data)?;
        let residuals = fitted.residuals();
        let rate = fitted.data.channels.iter().position(|c| c.channel == Channel::Rate);
        // A rotor that the model holds reads exactly zero.
        let rests = |row: usize| rate.is_some_and(|c| fitted.data.channels[c].measured[row] == residuals[c][row]);
        Some(adjoint::gradient(&model, &self.prediction.predictor, &fitted.data, &residuals, rests))
    }

    /// Number of fitted innovations.
    pub fn samples(&self) -> f64 {
        let data = &self.fitted.data;
        let fitted = |residual: &[f64]| residual.iter().enumerate().filter(|(row, r)| r.is_finite() && !data.held_out(*row)).count();
        self.fitted.fit.channels.iter().map(|c| fitted(&c.residual) as f64).sum()
    }

    /// Bayesian information criterion: −2 ln L + k ln n (Schwarz, Ann. Stat. 6 (1978) 461), up to a constant of the log.
    pub fn bic(&self) -> f64 {
        let parameters = self.fitted.free_parameters() + self.prediction.noise.extra_parameters();
        self.prediction.minus_2_ln_likelihood + parameters as f64 * self.samples().ln()
    }
}
