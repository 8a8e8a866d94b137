//! A model fitted to the prepared logs: the base to which effects are added.

use std::borrow::Cow;
use std::ops::Range;

use drive_model::ParameterKind;

use super::descent::{Goal, StopRule, max_noise_chi2, near_best};
use super::likelihood::{WhitenedSums, Whitener};
use super::stiffness::limit_stiffness;
use super::trial::Trial;
use crate::identify::explain::answer::reasons::Remark;
use crate::identify::explain::context::Context;
use crate::identify::explain::criteria::{MisfitClass, worst};
use crate::identify::fit::parameters::{Parameter, Parameters};
use crate::identify::fit::solve::{self, Iterate};
use crate::identify::fit::starting_point::{WINDOW_S, fit_windows, short_windows};
use crate::identify::fit::system::System;
use crate::identify::fit::{self, ChannelFit, FitError, FitResult, InitialStates, Problem, build, initial_state_kinds, starting_states};
use crate::identify::recording_conventions::{Recording, fit_as_recorded, fit_by, gain, min_gain};
use crate::identify::residual::{self, Misfit};
use crate::log::VoltageSource;
use crate::model::{Input, Model};
use crate::recording::Convention;
use crate::recording::PreparedLog;
use crate::recording::convention::apply;
use crate::recording::prepare::{PreparationNote, connected_while_coasting};

/// Temperature coefficient of the resistance of copper, 1/K (IEC 60034-1, at 20 to 25 °C).
const COPPER_PER_K: f64 = 0.0039;

/// A fitted model and the data it was fitted to.
pub struct FittedModel<'a> {
    /// Logs and criteria.
    pub context: Context<'a>,
    /// The model, with the fitted values.
    pub model: Model,
    /// The logs as the model uses them.
    pub data: PreparedLog<'a>,
    /// The model as a system.
    pub system: System,
    /// Parameters from which its fit began.
    pub start: Parameters,
    /// The fit.
    pub fit: FitResult,
    /// 1/noise² of each channel.
    pub weights: Vec<f64>,
}

impl<'a> FittedModel<'a> {
    /// Fits `model` to the data by the given conventions of recording, or, where none are given, by those that fit it best.
    ///
    /// # Errors
    /// The model cannot be simulated along these data.
    pub fn fit(
        context: Context<'a>,
        model: &Model,
        data: PreparedLog<'a>,
        conventions: Option<&[Convention]>,
    ) -> Result<(Self, Recording), FitError> {
        let (system, parameters) = build::system(model, data.temp_C.is_some());
        let once = |data: &PreparedLog, near: Option<&FitResult>| match near {
            Some(near) => fit::refit_from(&system, data, near),
            None => fit::fit(&system, &parameters, data),
        };
        let (fit, data, recording) = match conventions {
            Some(conventions) => fit_by(conventions, context.log, data, &once)?,
            None => fit_as_recorded(context.log, data, &once)?,
        };
        Ok((FittedModel::new(context, model, system, parameters, fit, data), recording))
    }

    /// The conventions of recording by which this model fits best. `data`: the logs, with none assumed.
    ///
    /// # Errors
    /// The model cannot be simulated along these data.
    pub fn best_conventions(&self, data: &PreparedLog<'a>) -> Result<Vec<Convention>, FitError> {
        let data = data.clone().with_rate_from_encoder(self.data.rate_from_encoder);
        let once = |data: &PreparedLog, near: Option<&FitResult>| fit::refit_from(&self.system, data, near.unwrap_or(&self.fit));
        fit_as_recorded(self.context.log, data, &once).map(|(_, _, recording)| recording.conventions)
    }

    /// This model, fitted to its data by one further convention, with the note on it; `None` where a note contradicts it or it cannot be
    /// simulated.
    pub fn recorded_by(&self, convention: Convention) -> Option<(Self, PreparationNote)> {
        let (data, note) = apply(convention, self.context.log, &self.data)?;
        let fit = fit::refit_from(&self.system, &data, &self.fit).ok()?;
        Some((FittedModel::new(self.context, &self.model, self.system.clone(), self.start.clone(), fit, data), note))
    }

    /// Fits a small change of this model, from this model's values.
    ///
    /// # Errors
    /// The model cannot be simulated along these data.
    pub fn refit(&self, model: &Model, data: PreparedLog<'a>) -> Result<Self, FitError> {
        let (system, parameters, states) = self.changed(model, &data);
        let fit = fit::refit(&system, &parameters, &data, &states, &self.noise())?;
        Ok(FittedModel::new(self.context, model, system, parameters, fit, data))
    }

    /// Fits a small change of this model. The fit runs to convergence only if its χ² comes near `rival`, the χ² of a rival.
    ///
    /// # Errors
    /// The model cannot be simulated along these data.
    pub fn refit_against(&self, model: &Model, rival: f64) -> Result<Self, FitError> {
        let data = self.data.clone();
        let (system, parameters, states) = self.changed(model, &data);
        let iterate = self.minimize(&system, &parameters, &data, &states, Goal::Compare(rival));
        let chi2 = iterate.normal_equations(&self.weights).cost;
        let fit = if chi2.is_finite() && chi2 >= near_best(&self.context.criteria.descent, rival, &data) {
            fit::evaluate(&system, &data, iterate, &self.noise())
        } else {
            fit::refit(&system, &iterate.parameters, &data, &iterate.initial_states, &self.noise())?
        };
        Ok(FittedModel::new(self.context, model, system, parameters, fit, data))
    }

    /// System, parameters and initial states of a small change of this model.
    fn changed(&self, model: &Model, data: &PreparedLog) -> (System, Parameters, InitialStates) {
        let (system, mut parameters) = build::system(model, data.temp_C.is_some());
        limit_stiffness(model, data.dt_s, &self.context.criteria.trials, &mut parameters);
        let states = self.initial_states_for(&system, &parameters, data);
        (system, parameters, states)
    }

    /// The model fitted to short windows, from the parameters at which its fit began; `None` where there are too few windows. Within a
    /// short window a missing effect shifts the parameters only a little.
    pub fn in_windows(&self) -> Option<Self> {
        let data = if self.data.driven == Input::Motion { None } else { short_windows(&self.data, WINDOW_S) }?;
        let iterate =
            fit_windows(Problem { system: &self.system, data: &data, weights: &self.weights }, &self.start, &self.fit.initial_states.kinds);
        self.evaluated(iterate, data)
    }

    /// The model at the parameters from which its fit began; `None` where it does not stay finite.
    pub fn at_start(&self) -> Option<Self> {
        let states = starting_states(&self.fit.initial_states.kinds, &self.data, &self.start, &self.system);
        self.evaluated(Iterate::new(&self.system, &self.start, &self.data, &states), self.data.clone())
    }

    /// The model at an iterate; `None` where it does not stay finite there.
    fn evaluated(&self, iterate: Iterate, data: PreparedLog<'a>) -> Option<Self> {
        let fit = fit::evaluate(&self.system, &data, iterate, &self.noise());
        let finite = fit.chi2.is_finite();
        finite.then(|| FittedModel::new(self.context, &self.model, self.system.clone(), self.start.clone(), fit, data))
    }

    /// Parameters found in short windows, fitted to longer and longer windows. Along a whole log an oscillation diverges from parameters
    /// that are slightly off.
    pub fn fit_longer_windows(&self, system: &System, parameters: &Parameters, data: &PreparedLog) -> Parameters {
        let mut parameters = parameters.clone();
        let kinds = initial_state_kinds(&system.rig::<f64>(&parameters, data.driven), data);
        for &window_s in &self.context.criteria.descent.window_lengths_s {
            let Some(data) = short_windows(data, window_s) else { continue };
            let iterate = fit_windows(Problem { system, data: &data, weights: &self.weights }, &parameters, &kinds);
            if iterate.normal_equations(&self.weights).cost.is_finite() {
                parameters = iterate.parameters;
            }
        }
        parameters
    }

    pub fn new(context: Context<'a>, model: &Model, system: System, start: Parameters, fit: FitResult, data: PreparedLog<'a>) -> Self {
        let noise: Vec<f64> = fit.channels.iter().map(|c| c.noise).collect();
        let mut fitted = FittedModel { context, model: model.clone(), data, system, start, weights: fit::weights(&noise), fit };
        fitted.set_model_values();
        fitted
    }

    /// The same model by another fit of its parameters.
    pub fn replace_fit(&mut self, fit: FitResult) {
        self.fit = fit;
        self.set_model_values();
    }

    /// A fit may leave a physical range, which the model file does not accept: then the file keeps its value and the fit has the other.
    fn set_model_values(&mut self) {
        for p in &self.fit.parameters.list {
            let _ = self.model.set(&p.name, p.value);
        }
    }

    pub fn noise(&self) -> Vec<f64> {
        self.fit.channels.iter().map(|c| c.noise).collect()
    }

    /// χ²/n of the worst channel: 1 where only noise is left.
    pub fn chi2_per_n(&self) -> f64 {
        self.fit.worst_chi2_per_n()
    }

    /// Class of what the model leaves.
    pub fn misfit(&self) -> MisfitClass {
        self.context.criteria.noise.misfit(self.chi2_per_n())
    }

    /// The correlations of its residual, largest share first.
    pub fn misfits(&self) -> Vec<Misfit> {
        residual::misfits(self.context.log, &self.data, &self.fit)
    }

    /// Gain that an effect needs beside this model: where only noise is left, a small one may be an error of the simulation; infinite where
    /// all residuals are within the resolution of readings at rest.
    pub fn min_gain(&self) -> f64 {
        let evidence = &self.context.criteria.evidence;
        match self.misfit() {
            _ if self.chi2_per_n() < evidence.min_chi2_per_n => f64::INFINITY,
            MisfitClass::Noise | MisfitClass::Invisible => evidence.min_gain_at_noise,
            _ => 0.0,
        }
    }

    /// χ²/n of the worst channel relative to the noise that `other` found, on the fitted and on the held-out rows. The residual of a wrong
    /// model overestimates the noise.
    pub fn chi2_per_n_by_noise_of(&self, other: &FittedModel) -> (f64, f64) {
        let squares = |rms: fn(&ChannelFit) -> f64| {
            let noise = other.fit.channels.iter().map(|c| c.noise);
            worst(self.fit.channels.iter().zip(noise).map(|(c, noise)| (rms(c) / noise).powi(2)))
        };
        (squares(|c| c.rms), squares(|c| c.heldout_rms.unwrap_or(c.rms)))
    }

    /// χ²/n of each channel on the held-out rows.
    pub fn heldout_chi2_per_n(&self) -> Vec<f64> {
        self.fit.channels.iter().map(|c| (c.heldout_rms.unwrap_or(c.rms) / c.noise).powi(2)).collect()
    }

    /// Residuals by channel.
    pub fn residuals(&self) -> Vec<&[f64]> {
        self.fit.channels.iter().map(|c| c.residual.as_slice()).collect()
    }

    /// A remark on the parameters that were not fitted; `None` where all were.
    pub fn not_free(&self) -> Option<Remark> {
        let parameters = &self.fit.parameters;
        let names = |of: &mut dyn Iterator<Item = &Parameter>| of.map(|p| p.name.clone()).collect::<Vec<_>>();
        let fixed = names(&mut parameters.list.iter().filter(|p| p.fixed && p.kind != ParameterKind::HarmonicOrder));
        let at_bounds = names(&mut parameters.at_bounds().into_iter().map(|k| &parameters.list[k]));
        (!fixed.is_empty() || !at_bounds.is_empty()).then_some(Remark::NotFree { fixed, at_bounds })
    }

    /// A remark that the winding's temperature has no scale in this log: where it is not measured, only α/C and C R_th are determined, and
    /// α is that for an assumed R_th.
    pub fn temperature_scale(&self) -> Option<Remark> {
        let value = |name: &str, fixed: bool| self.fit.parameters.list.iter().find(|p| p.name == name && p.fixed == fixed).map(|p| p.value);
        let (per_K, J_K, K_W) = (value("resistance_per_K", false)?, value("thermal_J_K", false)?, value("thermal_K_W", true)?);
        (self.data.temp_C.is_none() && per_K > 0.0).then(|| Remark::TemperatureScale {
            assumed_K_W: K_W,
            copper_K_W: K_W * per_K / COPPER_PER_K,
            copper_J_K: J_K * COPPER_PER_K / per_K,
        })
    }

    /// A remark that this model with a bridge that coasts in the off time of its PWM fits better than `last` does with one that brakes;
    /// `None` where a note states the bridge, or the log has no supply. Coasting changes the torque as much as a missing effect can, so
    /// that the log cannot decide it alone: it is asked for, not assumed.
    pub fn may_coast(&self, last: &FittedModel) -> Option<Remark> {
        let log = self.context.log;
        let is_command = self.data.driven == Input::Voltage && log.voltage() != VoltageSource::Terminals;
        if !is_command || self.data.connected.is_some() || self.data.budget.is_exhausted() {
            return None;
        }
        let data = self.data.connected_during(connected_while_coasting(log)?);
        let coasting = fit::refit_from(&self.system, &data, &self.fit).ok()?;
        let gain = gain(&last.fit, &coasting);
        let values = coasting.channels.iter().map(|c| c.rows).sum::<usize>();
        (gain > min_gain(values as f64)).then(|| Remark::MayCoast { decrease: (0.5 * gain / values as f64).exp() })
    }

    /// Number of free parameters.
    pub fn free_parameters(&self) -> usize {
        self.fit.parameters.free().len()
    }

    /// The whitener of its residuals.
    pub fn whitener(&self) -> Whitener {
        Whitener::of(&self.data, &self.residuals(), &self.context.criteria.whitening)
    }

    /// Its residuals by channel at the unknowns that are best for the whitened ones; `None` where these are not determined.
    pub fn residuals_at_best(&self, whitener: &Whitener) -> Option<Vec<Vec<f64>>> {
        whitener.residuals_at_best(&self.system, &self.fit.parameters, &self.fit.initial_states, &self.data, self.context.log_rows)
    }

    /// Its whitened sums of squares on each log.
    pub fn whitened_sums(&self, whitener: &Whitener) -> WhitenedSums {
        whitener.sums(&self.system, &self.fit.parameters, &self.fit.initial_states, &self.data, self.context.log_rows)
    }

    /// The rate channel is derived from the encoder, in the data as `trial` needs them.
    pub fn rate_from_encoder(&self, trial: &Trial) -> bool {
        trial.rate_from_encoder.unwrap_or(self.data.rate_from_encoder)
    }

    /// The data as `trial` needs them.
    pub fn data_for(&self, trial: &Trial) -> Cow<'_, PreparedLog<'a>> {
        match trial.rate_from_encoder {
            Some(derived) if derived != self.data.rate_from_encoder => Cow::Owned(self.data.clone().with_rate_from_encoder(derived)),
            _ => Cow::Borrowed(&self.data),
        }
    }

    /// Initial states for a system that may have more of them: this model's where a segment begins at the same row, otherwise from the
    /// first rows.
    pub fn initial_states_for(&self, system: &System, parameters: &Parameters, data: &PreparedLog) -> InitialStates {
        let kinds = initial_state_kinds(&system.rig::<f64>(parameters, data.driven), data);
        let mut states = starting_states(&kinds, data, parameters, system);
        for (values, rows) in states.values.iter_mut().zip(&data.segments) {
            let same = self.data.segments.iter().position(|own| own.start == rows.start);
            let Some(own) = same.map(|k| &self.fit.initial_states.values[k]) else { continue };
            for (value, kind) in values.iter_mut().zip(&kinds) {
                if let Some(k) = self.fit.initial_states.kinds.iter().position(|own| own == kind) {
                    *value = own[k];
                }
            }
        }
        states
    }

    /// The system with `trial` in it, all parameters, and the positions of the trial's own.
    pub fn with(&self, trial: &Trial, free: &[bool]) -> (System, Parameters, Range<usize>) {
        let mut system = self.system.clone();
        let mut parameters = self.fit.parameters.clone();
        let own = build::append(&mut system, &mut parameters, trial.card, &trial.values, free);
        for (k, range) in own.clone().zip(&trial.ranges) {
            parameters.list[k].range = *range;
        }
        (system, parameters, own)
    }

    /// Minimises χ² from the given parameters, with this model's weights.
    pub fn minimize(&self, system: &System, parameters: &Parameters, data: &PreparedLog, states: &InitialStates, goal: Goal) -> Iterate {
        self.minimize_from(system, data, Iterate::new(system, parameters, data, states), goal)
    }

    /// Minimises χ² from an iterate, with this model's weights.
    pub fn minimize_from(&self, system: &System, data: &PreparedLog, iterate: Iterate, goal: Goal) -> Iterate {
        let criteria = &self.context.criteria.descent;
        let excerpt = data.segments.iter().map(Range::len).sum::<usize>() < self.data.len();
        let max_steps = if excerpt { criteria.max_excerpt_steps } else { criteria.max_steps };
        let mut stop = StopRule::new(criteria, goal, max_noise_chi2(data), max_steps);
        solve::minimize_within(Problem { system, data, weights: &self.weights }, iterate, max_steps, |chi2| stop.min_decrease(chi2))
    }

    /// A few seconds of the data where the model fails most, or all of its short windows: enough to compare effects that are expensive to
    /// simulate.
    pub fn excerpt(&self) -> PreparedLog<'a> {
        let (data, criteria) = (&self.data, &self.context.criteria.descent);
        let rows = ((criteria.excerpt_s / data.dt_s) as usize).max(criteria.min_excerpt_rows);
        let in_all: usize = data.segments.iter().map(ExactSizeIterator::len).sum();
        if in_all <= criteria.max_excerpts_of_windows * rows && data.segments.iter().all(|segment| segment.len() * 2 <= rows) {
            return data.with_all_rows();
        }
        let mut best: Option<(f64, Range<usize>)> = None;
        for segment in &data.segments {
            let mut from = segment.start;
            while from < segment.end {
                let part = from..(from + rows).min(segment.end);
                let squares = |r: &Vec<f64>| r[part.clone()].iter().filter(|r| r.is_finite()).map(|r| r * r).sum::<f64>();
                let chi2: f64 = self.fit.channels.iter().zip(&self.weights).map(|(c, w)| w * squares(&c.residual)).sum();
                let long = part.len() * 2 > rows || best.is_none();
                if long && best.as_ref().is_none_or(|(most, _)| chi2 > *most) {
                    best = Some((chi2, part));
                }
                from += rows;
            }
        }
        let part = best.map_or(0..data.len(), |(_, part)| part);
        data.of_rows(part)
    }
}
