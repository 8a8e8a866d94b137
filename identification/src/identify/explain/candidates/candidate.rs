//! One candidate: an effect fitted together with the model, and the residuals of this fit.

use std::ops::Range;

use drive_model::ParameterKind;

use super::score::Score;
use crate::identify::explain::answer::reasons::Refusal;
use crate::identify::explain::answer::{ChannelError, Estimate};
use crate::identify::explain::criteria::worst;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::descent::Goal;
use crate::identify::explain::fitted::likelihood::{WhitenedSums, Whitener};
use crate::identify::explain::fitted::trial::Trial;
use crate::identify::fit::InitialStates;
use crate::identify::fit::Parameters;
use crate::identify::fit::solve::Iterate;
use crate::identify::fit::system::System;
use crate::model::Model;

/// A trial, fitted with the model.
pub struct FittedCandidate {
    /// The trial.
    pub trial: Trial,
    /// The model with it.
    pub system: System,
    /// Initial states.
    pub states: InitialStates,
    /// All parameters, the trial's own last.
    pub parameters: Parameters,
    /// Positions of its own parameters.
    pub own: Range<usize>,
    /// Standard errors of all parameters.
    pub sigmas: Vec<f64>,
    /// Residuals by channel.
    pub residuals: Vec<Vec<f64>>,
    /// χ².
    pub chi2: f64,
    /// χ²/n of the worst channel.
    pub chi2_per_n: f64,
    /// χ²/n of each channel on the held-out rows.
    pub heldout_chi2_per_n: Vec<f64>,
    /// Number of parameters that it adds, scanned ones included.
    pub extra_parameters: usize,
    /// Gain, 2 ln of the likelihood ratio on whitened residuals.
    pub gain: f64,
    /// BIC on whitened residuals with it minus that without it.
    pub delta_bic: f64,
    /// Logarithm of the familywise probability of such a gain by chance.
    pub ln_p: f64,
    /// Why it cannot be the explanation.
    pub refused: Option<Refusal>,
}

/// Fits a trial from the best point that its score predicts. The fit stops as soon as it is clear whether its χ² falls below `rival`, the
/// χ² of a rival.
pub fn fit_trial(base: &FittedModel, trial: &Trial, score: &Score, rival: f64) -> Option<FittedCandidate> {
    if base.data.budget.is_exhausted() {
        return None;
    }
    let criteria = &base.context.criteria.screening;
    let data = base.data_for(trial);
    let (system, parameters, own) = base.with(trial, &trial.fitted);
    let states = base.initial_states_for(&system, &parameters, &data);
    let chi2 = |iterate: &Iterate| iterate.normal_equations(&base.weights).cost;
    let minimize = |begin: Iterate| base.minimize_from(&system, &data, begin, Goal::Compare(rival));
    let begin = |fraction: f64, move_base: bool| {
        let mut parameters = parameters.clone();
        for (p, value) in parameters.list[own.clone()].iter_mut().zip(values_after(trial, score, fraction)) {
            p.value = value;
        }
        if move_base {
            let step: Vec<f64> = score.step.iter().map(|s| fraction * s).collect();
            let moved = base.fit.parameters.moved(&step);
            parameters.list[..moved.list.len()].clone_from_slice(&moved.list);
        }
        Iterate::new(&system, &parameters, &data, &states)
    };
    // A full step may block the rotor, where the derivatives vanish: the largest fraction that decreases χ² is taken.
    let fractions: &[f64] = if trial.absent { &criteria.step_fractions } else { &[1.0, 0.0] };
    let mut from = (fractions[0], begin(fractions[0], true));
    for &fraction in &fractions[1..] {
        if chi2(&from.1) < base.fit.chi2 {
            break;
        }
        let shorter = begin(fraction, true);
        if chi2(&shorter) < chi2(&from.1) || !chi2(&from.1).is_finite() {
            from = (fraction, shorter);
        }
    }
    let (fraction, from) = from;
    // First with the predicted step of the model's own parameters; if χ² falls too little, again from their present values.
    let mut end = minimize(from);
    let decrease = base.fit.chi2 - chi2(&end);
    if fraction > 0.0 && (decrease.is_nan() || decrease <= criteria.min_kept_prediction * score.chi2_decrease) {
        let other = minimize(begin(fraction, false));
        if chi2(&other) < chi2(&end) || !chi2(&end).is_finite() {
            end = other;
        }
    }
    FittedCandidate::at(base, trial.clone(), system, own, end)
}

/// Values of a trial after a fraction of the step that its score predicts. An absent effect grows from zero; another begins at either end.
fn values_after(trial: &Trial, score: &Score, fraction: f64) -> Vec<f64> {
    if !trial.absent {
        return if fraction > 0.0 { score.values.clone() } else { trial.values.clone() };
    }
    let grows = |k: usize| trial.screened[k] && matches!(trial.card.parameters[k].kind, ParameterKind::NonNegative | ParameterKind::Signed);
    score.values.iter().enumerate().map(|(k, value)| if grows(k) { fraction * value } else { *value }).collect()
}

/// χ² over the number of values.
pub fn chi2_per_value(base: &FittedModel, chi2: f64) -> f64 {
    chi2 / (base.data.len() * base.data.channels.len()) as f64
}

impl FittedCandidate {
    /// A trial at the end of its descent; `None` where the model cannot be simulated there.
    fn at(base: &FittedModel, trial: Trial, system: System, own: Range<usize>, end: Iterate) -> Option<Self> {
        let equations = end.normal_equations(&base.weights);
        if !equations.cost.is_finite() {
            return None;
        }
        let excess = chi2_per_value(base, equations.cost).max(1.0);
        let covariance = equations.profiled().0.try_inverse().map(|c| c * excess);
        let sigmas = covariance.map_or_else(|| vec![0.0; end.parameters.list.len()], |c| end.parameters.sigmas(&c));
        // An order, and the time of a jump.
        let is_scanned =
            |kind: ParameterKind, fitted: bool| kind == ParameterKind::HarmonicOrder || kind == ParameterKind::EventTime && !fitted;
        let scanned = trial.card.parameters.iter().zip(&trial.fitted).filter(|(p, fitted)| is_scanned(p.kind, **fitted)).count();
        let errors = channel_errors(base, &end.linearization.residuals);
        Some(FittedCandidate {
            extra_parameters: end.parameters.free().len() - base.free_parameters() + scanned,
            chi2_per_n: worst(errors.iter().map(|e| e.ratio().powi(2))),
            heldout_chi2_per_n: errors.iter().map(ChannelError::heldout_chi2_per_n).collect(),
            trial,
            own,
            sigmas,
            chi2: equations.cost,
            residuals: end.linearization.residuals,
            parameters: end.parameters,
            states: end.initial_states,
            system,
            gain: 0.0,
            delta_bic: 0.0,
            ln_p: 0.0,
            refused: None,
        })
    }

    /// The candidate fitted to the minimum.
    pub fn minimized(self, base: &FittedModel) -> Self {
        let data = base.data_for(&self.trial);
        let end = base.minimize(&self.system, &self.parameters, &data, &self.states, Goal::Minimum);
        let (trial, system, own) = (self.trial.clone(), self.system.clone(), self.own.clone());
        FittedCandidate::at(base, trial, system, own, end).unwrap_or(self)
    }

    /// A candidate that was fitted to short windows, fitted to the whole data of `base`.
    pub fn on_whole_data(self, base: &FittedModel, rival: f64) -> Option<Self> {
        let data = base.data_for(&self.trial);
        let parameters = base.fit_longer_windows(&self.system, &self.parameters, &data);
        let states = base.initial_states_for(&self.system, &parameters, &data);
        let end = base.minimize(&self.system, &parameters, &data, &states, Goal::Compare(rival));
        FittedCandidate::at(base, self.trial, self.system, self.own, end)
    }

    /// Whitened sums of squares of the model with it.
    pub fn whitened_sums(&self, base: &FittedModel, whitener: &Whitener) -> WhitenedSums {
        whitener.sums(&self.system, &self.parameters, &self.states, &base.data_for(&self.trial), base.context.log_rows)
    }

    /// Its own parameters.
    pub fn estimates(&self) -> Vec<Estimate> {
        let own = self.parameters.list[self.own.clone()].iter().zip(&self.sigmas[self.own.clone()]);
        own.zip(self.trial.card.parameters)
            .map(|((p, sigma), info)| Estimate { name: p.name.clone(), unit: info.unit, value: p.value, sigma: *sigma })
            .collect()
    }

    /// The model with it, and its name there.
    pub fn added_to(&self, model: &Model) -> (Model, String) {
        self.trial.added_to(model, &self.parameters, self.own.clone())
    }
}

/// Errors of the channels for these residuals, relative to the noise of `base`.
pub fn channel_errors(base: &FittedModel, residuals: &[Vec<f64>]) -> Vec<ChannelError> {
    let data = &base.data;
    base.fit
        .channels
        .iter()
        .zip(residuals)
        .map(|(f, residual)| {
            let rms = |held_out: bool| {
                let rows = residual.iter().enumerate().filter(|(k, r)| r.is_finite() && data.held_out(*k) == held_out);
                let (sum, n) = rows.fold((0.0, 0usize), |(s, n), (_, r)| (s + r * r, n + 1));
                (n > 0).then(|| (sum / n as f64).sqrt())
            };
            ChannelError { channel: f.channel, rms: rms(false).unwrap_or(f64::NAN), heldout_rms: rms(true), noise: f.noise }
        })
        .collect()
}
