//! A candidate: an extension of a model, fitted together with it.

use std::ops::Range;

use drive_model::ParameterKind;

use super::colour;
use super::free_form::{self, ScoredForm};
use super::model::PredictedModel;
use super::recorded::Recorded;
use super::screen::Screened;
use crate::identify::explain::jumps::is_less_than_a_count;
use crate::identify::explain::piecewise_linear::PiecewiseLinear;
use crate::identify::explain::reasons::Refusal;
use crate::identify::explain::refusal::unphysical;
use crate::identify::explain::trial::Trial;
use crate::identify::fit::{Iterate, Parameter, Parameters, PreparedLog, System};
use crate::identify::predict::PredictionFit;
use crate::identify::predict::fit::{NoiseModel, Prediction};
use crate::identify::recording_conventions::min_gain;

/// What a model is extended by.
#[derive(Debug, Clone)]
pub enum Extension<'a> {
    /// An effect of the catalogue.
    Effect(Trial),
    /// A free form.
    FreeForm(PiecewiseLinear),
    /// Coloured noise of sensors.
    Colour,
    /// A convention by which the log may have been recorded.
    Recorded(Box<Recorded<'a>>),
}

/// An extension, fitted with a model.
pub struct Candidate<'a> {
    /// The extension.
    pub extension: Extension<'a>,
    /// The model with it.
    pub system: System,
    /// Positions of its own parameters.
    pub own: Range<usize>,
    /// The fit.
    pub prediction: PredictionFit,
    /// Standard errors of all parameters; empty where it was only compared at the random torque of the model.
    pub sigmas: Vec<f64>,
    /// Fall of −2 ln L.
    pub gain: f64,
    /// Increase of BIC by its parameters, and by the choice among all that was tried.
    pub penalty: f64,
    /// BIC with it minus BIC without it.
    pub delta_bic: f64,
    /// Why it cannot be the explanation, whatever its gain.
    pub refused: Option<Refusal>,
}

/// Steps at the random torque of the model to which an effect is added.
const FIRST_STEPS: usize = 12;
/// Part of χ² below whose predicted decrease the first comparison ends.
const MIN_CHI2_PART: f64 = 5e-4;
/// Fractions of the predicted step that are tried, the largest first, until the likelihood rises.
const STEP_FRACTIONS: [f64; 4] = [1.0, 0.3, 0.1, 0.03];

impl<'a> Candidate<'a> {
    /// An effect fitted at the random torque of the model to which it is added.
    pub fn effect(base: &PredictedModel<'a>, screened: &Screened, penalty: f64) -> Option<Self> {
        let fitted = &base.fitted;
        let trial = &screened.trial;
        if is_less_than_a_count(fitted, trial.card, screened.score.values[0]) {
            return None;
        }
        let (system, parameters, own) = fitted.with(trial, &trial.fitted);
        let data = fitted.data_for(trial);
        let prediction = Prediction::new(&system, &data);
        let states = fitted.initial_states_for(&system, &parameters, &data);
        let begin = |fraction: f64, moves_base: bool| {
            let mut parameters = parameters.clone();
            for (k, (p, value)) in parameters.list[own.clone()].iter_mut().zip(&screened.score.values).enumerate() {
                let grows = trial.screened[k] && matches!(p.kind, ParameterKind::NonNegative | ParameterKind::Signed);
                p.value = match (trial.absent, fraction > 0.0) {
                    (true, _) if grows => fraction * value,
                    (true, _) | (false, true) => *value,
                    (false, false) => trial.values[k],
                };
            }
            if moves_base {
                let step: Vec<f64> = screened.score.step.iter().map(|s| fraction * s).collect();
                let moved = fitted.fit.parameters.moved(&step);
                parameters.list[..moved.list.len()].clone_from_slice(&moved.list);
            }
            prediction.at(&parameters, Some(states.clone()), base.prediction.noise.clone())
        };
        let cost = |p: &Option<PredictionFit>| p.as_ref().map_or(f64::INFINITY, |p| p.minus_2_ln_likelihood);
        let fractions: &[f64] = if trial.absent { &STEP_FRACTIONS } else { &[1.0, 0.0] };
        let mut best: Option<PredictionFit> = None;
        for &fraction in fractions {
            for moves_base in [true, false] {
                let point = begin(fraction, moves_base);
                if cost(&point) < cost(&best) {
                    best = point;
                }
            }
            if cost(&best) < base.prediction.minus_2_ln_likelihood {
                break;
            }
        }
        let extension = Extension::Effect(trial.clone());
        if trial.is_expensive() {
            // A random torque on the motor moves the platform through the shaft only: the density of a rigid rotor is not its density.
            return Some(Candidate::new(base, extension, system.clone(), own, best?, penalty));
        }
        // Below the given model half a per mille of the sum of squares does not decide between effects.
        let given = fitted.fit.chi2;
        let end = prediction.descend_to(best?, FIRST_STEPS, |chi2| if chi2 < given { MIN_CHI2_PART * chi2 } else { 0.0 })?;
        Some(Candidate::new(base, extension, system.clone(), own, end, penalty))
    }

    /// A free form fitted at the random torque of the model to which it is added.
    pub fn free_form(base: &PredictedModel<'a>, form: &ScoredForm, penalty: f64) -> Option<Self> {
        let fitted = &base.fitted;
        let (mut system, mut parameters) = (fitted.system.clone(), fitted.fit.parameters.clone());
        let own = free_form::append(&mut system, &mut parameters, &form.law);
        let states = fitted.initial_states_for(&system, &parameters, &fitted.data);
        let prediction = Prediction::new(&system, &fitted.data);
        let begin = |fraction: f64| {
            let mut parameters = parameters.clone();
            let step: Vec<f64> = form.step.iter().map(|s| fraction * s).collect();
            let moved = fitted.fit.parameters.moved(&step);
            parameters.list[..moved.list.len()].clone_from_slice(&moved.list);
            for (k, height) in own.clone().zip(&form.heights) {
                parameters.list[k].value = fraction * height;
            }
            prediction.at(&parameters, Some(states.clone()), base.prediction.noise.clone())
        };
        let points = STEP_FRACTIONS.iter().chain(&[0.0]).filter_map(|f| begin(*f));
        let best = points.min_by(|a, b| a.minus_2_ln_likelihood.total_cmp(&b.minus_2_ln_likelihood))?;
        let end = prediction.descend_to(best, FIRST_STEPS, |chi2| MIN_CHI2_PART * chi2)?;
        Some(Candidate::new(base, Extension::FreeForm(form.law.clone()), system.clone(), own, end, penalty))
    }

    /// Coloured noise of some channels.
    pub fn colour(base: &PredictedModel<'a>, channels: &[usize], penalty: f64) -> Option<Self> {
        let end = colour::with_colour(base, channels)?;
        let n = end.parameters.list.len();
        let mut found = Candidate::new(base, Extension::Colour, base.fitted.system.clone(), n..n, end, penalty);
        found.sigmas = found.standard_errors(base);
        Some(found)
    }

    /// A convention of the recording.
    pub fn recorded(base: &PredictedModel<'a>, recorded: Recorded<'a>) -> Self {
        let n = recorded.prediction.parameters.list.len();
        let (system, end, penalty) = (base.fitted.system.clone(), recorded.prediction.clone(), min_gain(base.samples()));
        Candidate::new(base, Extension::Recorded(Box::new(recorded)), system, n..n, end, penalty)
    }

    fn new(
        base: &PredictedModel<'a>,
        extension: Extension<'a>,
        system: System,
        own: Range<usize>,
        prediction: PredictionFit,
        penalty: f64,
    ) -> Self {
        let gain = base.prediction.minus_2_ln_likelihood - prediction.minus_2_ln_likelihood;
        Candidate { extension, system, own, prediction, sigmas: Vec::new(), gain, penalty, delta_bic: penalty - gain, refused: None }
    }

    /// The data as the candidate needs them.
    fn data<'b>(&'b self, base: &'b PredictedModel<'a>) -> std::borrow::Cow<'b, PreparedLog<'a>> {
        match &self.extension {
            Extension::Effect(trial) => base.fitted.data_for(trial),
            Extension::Recorded(recorded) => std::borrow::Cow::Borrowed(&recorded.data),
            _ => std::borrow::Cow::Borrowed(&base.fitted.data),
        }
    }

    /// The candidate with its own random torque and noise. An expensive one is fitted to an excerpt first, and to the whole log only where it is better there.
    pub fn with_own_noise(self, base: &PredictedModel<'a>) -> Self {
        let end = if self.is_expensive() { self.fitted_by_excerpt(base) } else { self.fitted(base) };
        let Some(end) = end else { return self };
        let mut all = Candidate::new(base, self.extension, self.system, self.own, end, self.penalty);
        all.sigmas = all.standard_errors(base);
        if let Extension::Effect(trial) = &all.extension {
            all.refused = unphysical(&base.fitted, trial.card, &all.prediction.parameters, &all.sigmas, &all.own);
        }
        all
    }

    fn fitted(&self, base: &PredictedModel<'a>) -> Option<PredictionFit> {
        let data = self.data(base);
        let prediction = Prediction::new(&self.system, &data);
        let mut begin = self.prediction.clone();
        // What the model lacked may have been taken for more or for less noise.
        for (noise, first) in begin.noise.channels.iter_mut().zip(prediction.first_noise()) {
            if noise.coloured.is_none() {
                noise.white = first.white;
            }
        }
        let begin = prediction.at(&begin.parameters, Some(begin.initial_states), begin.noise);
        let ends = [begin, Some(self.prediction.clone())].into_iter().flatten().filter_map(|begin| prediction.fit(begin));
        ends.min_by(|a, b| a.minus_2_ln_likelihood.total_cmp(&b.minus_2_ln_likelihood))
    }

    fn fitted_by_excerpt(&self, base: &PredictedModel<'a>) -> Option<PredictionFit> {
        let excerpt = base.fitted.excerpt();
        let noise = |prediction: &Prediction| {
            let torque_density = prediction.largest_density(&self.prediction.parameters)?;
            Some(NoiseModel { torque_density, channels: prediction.first_noise() })
        };
        let short = Prediction::new(&self.system, &excerpt);
        let there = short.fit(short.at(&self.prediction.parameters, None, noise(&short)?)?)?;
        let without = Prediction::new(&base.fitted.system, &excerpt);
        let without = without.at(&base.prediction.parameters, None, base.prediction.noise.clone())?;
        if without.minus_2_ln_likelihood - there.minus_2_ln_likelihood < self.penalty {
            return None;
        }
        let data = self.data(base);
        let whole = Prediction::new(&self.system, &data);
        let begin = whole.at(&there.parameters, None, there.noise)?;
        let mut end = whole.lower(begin)?;
        whole.refine(&mut end);
        Some(end)
    }

    /// Its simulation takes many steps per row.
    pub fn is_expensive(&self) -> bool {
        matches!(&self.extension, Extension::Effect(trial) if trial.is_expensive())
    }

    fn standard_errors(&self, base: &PredictedModel<'a>) -> Vec<f64> {
        let data = Prediction::new(&self.system, &self.data(base)).following(&self.prediction.predictor);
        let weights: Vec<f64> = self.prediction.predictor.innovation_variances.iter().map(|s| 1.0 / s).collect();
        let p = &self.prediction;
        let equations = Iterate::new(&self.system, &p.parameters, &data, &p.initial_states).normal_equations(&weights);
        let covariance = equations.profiled().0.try_inverse();
        covariance.map_or_else(|| vec![0.0; p.parameters.list.len()], |c| p.parameters.sigmas(&c))
    }

    /// Its own parameters.
    pub fn own_parameters(&self) -> &[Parameter] {
        &self.prediction.parameters.list[self.own.clone()]
    }

    /// All parameters.
    pub fn parameters(&self) -> &Parameters {
        &self.prediction.parameters
    }
}
