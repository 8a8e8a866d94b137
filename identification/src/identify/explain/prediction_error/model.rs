//! A model fitted in prediction-error form, with what screening and comparison need of it.

use crate::identify::explain::Context;
use crate::identify::explain::fitted_model::FittedModel;
use crate::identify::fit::{self, FitResult, Iterate, Parameters, PreparedLog, System, build};
use crate::identify::predict::PredictionFit;
use crate::identify::predict::adjoint::{self, Gradient};
use crate::identify::predict::fit::Prediction;
use crate::identify::predict::gain::stationary_filter;
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
    pub fn new(
        context: Context<'a>,
        model: &Model,
        system: System,
        start: Parameters,
        data: &PreparedLog<'a>,
        prediction: PredictionFit,
    ) -> Self {
        let data = Prediction::new(&system, data).following(&prediction.predictor);
        let noise: Vec<f64> = prediction.predictor.innovation_variances.iter().map(|s| s.sqrt()).collect();
        let iterate = Iterate::new(&system, &prediction.parameters, &data, &prediction.initial_states);
        let fit = fit::evaluate(&system, &data, iterate, &noise);
        PredictedModel { fitted: FittedModel::new(context, model, system, start, fit, data), prediction }
    }

    /// Fits a model: from its values, and from a fit of its free run where there is one. `None` where it cannot be fitted in prediction-error form.
    pub fn fit_from_far(context: Context<'a>, model: &Model, data: &PreparedLog<'a>, free_run: Option<&FitResult>) -> Option<Self> {
        let (system, parameters) = build::system(model, data.temp_C.is_some());
        let prediction = Prediction::new(&system, data);
        let from_far = prediction.fit_from_far(&parameters);
        let from_free_run = free_run.and_then(|fit| prediction.fit_from_far(&fit.parameters));
        let fits = [from_far, from_free_run].into_iter().flatten();
        let fit = fits.min_by(|a, b| a.minus_2_ln_likelihood.total_cmp(&b.minus_2_ln_likelihood))?;
        Some(PredictedModel::new(context, model, system, parameters, data, fit))
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

    /// Fall of −2 ln L if nothing were left of the random torque: Σ n ln(S/S₀), with the variance S of a channel's innovations and S₀ without random torque.
    pub fn random_torque_excess(&self) -> f64 {
        let (fitted, p) = (&self.fitted, &self.prediction);
        let prediction = Prediction::new(&fitted.system, &fitted.data);
        let without = || {
            let model = row_model(&fitted.system, &p.parameters, &fitted.data)?;
            stationary_filter(&model, prediction.smallest_density(&p.parameters)?, &p.noise.channels)
        };
        let Some(without) = without() else { return 0.0 };
        let variances = p.predictor.innovation_variances.iter().zip(&without.innovation_variances);
        let rows = (0..fitted.fit.channels.len()).map(|c| self.rows(c));
        variances.zip(rows).map(|((s, s0), n)| n * (s / s0).ln()).sum::<f64>().max(0.0)
    }

    /// A random torque makes the innovations clearly more likely than none: by more than the accuracy of the simulation.
    pub fn has_random_torque(&self) -> bool {
        self.random_torque_excess() > MIN_RANDOM_TORQUE_PART * self.samples()
    }

    /// Number of fitted innovations of a channel.
    fn rows(&self, channel: usize) -> f64 {
        let data = &self.fitted.data;
        let residual = &self.fitted.fit.channels[channel].residual;
        residual.iter().enumerate().filter(|(row, r)| r.is_finite() && !data.held_out(*row)).count() as f64
    }

    /// Number of fitted innovations.
    pub fn samples(&self) -> f64 {
        (0..self.fitted.fit.channels.len()).map(|c| self.rows(c)).sum()
    }
}

/// Part of the innovations' variance above which a random torque is more than the error of the simulation: 0.5 % of the rms.
const MIN_RANDOM_TORQUE_PART: f64 = 0.01;
