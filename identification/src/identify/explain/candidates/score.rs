//! Score of a trial: how much χ² would fall if the effect were added.
//!
//! At the fitted model each trial has a sensitivity. The part that the model's own parameters and initial states can imitate is projected
//! out; the rest is correlated with the residual: Δχ² = gᵀ S⁻¹ g, the decrease that the linear model predicts (score test: Rao, Proc. Camb.
//! Phil. Soc. 44 (1948) 50). Trials that are absent at their values are simulated together, up to [`MAX_UNKNOWNS`] derivatives at a time.
//! A trial with finite values (its zero is singular) is simulated alone; the prediction of one step from there is compared with the model
//! without it.

use std::ops::Range;

use drive_model::ParameterKind;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::trial::Trial;
use crate::identify::fit::build;
use crate::identify::fit::normal_equations::{MAX_UNKNOWNS, linearize};
use crate::identify::fit::parameters::Parameters;
use crate::identify::fit::solve::Iterate;
use crate::identify::fit::system::System;

/// Score of a trial.
#[derive(Debug, Clone)]
pub struct Score {
    /// Predicted decrease of χ²; 0 where the best amplitude would be unphysical.
    pub chi2_decrease: f64,
    /// Number of free parameters of the trial.
    pub free: usize,
    /// Step of the model's own free coordinates that goes with it.
    pub step: Vec<f64>,
    /// The trial's parameters after the step.
    pub values: Vec<f64>,
    /// Fraction of its sensitivity that the model's own parameters cannot imitate, 0 to 1.
    pub identifiable_fraction: f64,
    /// The best amplitude would be negative where this is unphysical.
    pub negative: bool,
}

impl Score {
    /// A trial that decreases nothing, in a model with `base` free coordinates.
    pub fn zero(trial: &Trial, base: usize) -> Self {
        let free = trial.screened.iter().filter(|f| **f).count();
        Score { chi2_decrease: 0.0, free, step: vec![0.0; base], values: trial.values.clone(), identifiable_fraction: 0.0, negative: false }
    }
}

/// Relative increase of the diagonal of the information matrix, so that its factorisation exists.
const RIDGE: f64 = 1e-12;
/// Damping of the one step from a finite trial.
const FINITE_DAMPING: f64 = 1e-3;

/// Scores of all trials, in their order.
pub fn score_trials(base: &FittedModel, trials: &[Trial]) -> Vec<Score> {
    let scored: Vec<(usize, Score)> = batches(base, trials)
        .par_iter()
        .flat_map_iter(|batch| {
            let first = &trials[batch[0]];
            let list = if base.data.budget.is_exhausted() {
                Vec::new()
            } else if first.absent {
                score_absent(base, trials, batch)
            } else {
                vec![score_finite(base, first)]
            };
            batch.iter().copied().zip(list)
        })
        .collect();
    let mut ordered: Vec<Option<Score>> = vec![None; trials.len()];
    for (k, score) in scored {
        ordered[k] = Some(score);
    }
    let own = base.free_parameters();
    ordered.into_iter().zip(trials).map(|(score, trial)| score.unwrap_or_else(|| Score::zero(trial, own))).collect()
}

/// Trials that are simulated together: absent trials on the same data, as many as there is place for; each of the others alone.
pub fn batches(base: &FittedModel, trials: &[Trial]) -> Vec<Vec<usize>> {
    // The winding of the fitted model may have become slow enough to have a state.
    let states = base.initial_states_for(&base.system, &base.fit.parameters, &base.data).kinds.len();
    let taken = base.free_parameters() + states;
    let free_lanes = MAX_UNKNOWNS.saturating_sub(taken);
    // A trial for which no place is left has no score. One state of its own may be added to it.
    let has_place = |trial: &Trial| taken + trial.screened.iter().filter(|f| **f).count() < MAX_UNKNOWNS;
    let mut batches: Vec<Vec<usize>> = Vec::new();
    for derived in [false, true] {
        let mut batch: Vec<usize> = Vec::new();
        let mut lanes = 0;
        for (k, trial) in trials.iter().enumerate().filter(|(_, t)| t.absent && base.rate_from_encoder(t) == derived && has_place(t)) {
            let more = trial.screened.iter().filter(|f| **f).count();
            if trial.adds_thermal_state(&base.data) || more > free_lanes {
                batches.push(vec![k]);
                continue;
            }
            if lanes + more > free_lanes {
                batches.push(std::mem::take(&mut batch));
                lanes = 0;
            }
            batch.push(k);
            lanes += more;
        }
        if !batch.is_empty() {
            batches.push(batch);
        }
    }
    batches.extend(trials.iter().enumerate().filter(|(_, t)| !t.absent && has_place(t)).map(|(k, _)| vec![k]));
    batches
}

/// Trials that are absent at their values: one simulation for the whole batch.
fn score_absent(base: &FittedModel, trials: &[Trial], batch: &[usize]) -> Vec<Score> {
    let own = base.free_parameters();
    let data = base.data_for(&trials[batch[0]]);
    let mut system = base.system.clone();
    let mut parameters = base.fit.parameters.clone();
    let ranges: Vec<_> = batch
        .iter()
        .map(|&k| build::append(&mut system, &mut parameters, trials[k].card, &trials[k].values, &trials[k].screened))
        .collect();
    let states = base.initial_states_for(&system, &parameters, &data);
    let equations = linearize(&system, &parameters, &data, &states).weighted(&states, &base.weights);
    let (information, gradient) = equations.profiled();
    if !gradient.iter().chain(information.iter()).all(|x| x.is_finite()) {
        return batch.iter().map(|&k| Score::zero(&trials[k], own)).collect();
    }
    let free = parameters.free();
    let projection = Projection {
        information: &information,
        gradient: &gradient,
        own: (0..own).collect(),
        parameters: &parameters,
        min_fraction: base.context.criteria.screening.min_identifiable_fraction,
    };
    batch
        .iter()
        .zip(&ranges)
        .map(|(&k, range)| {
            let lanes: Vec<usize> = (0..free.len()).filter(|&lane| range.contains(&free[lane])).collect();
            projection.score(&lanes, range.clone(), &trials[k])
        })
        .collect()
}

/// Normal equations of the model with a batch of trials, from which each trial is scored beside the model's own parameters.
struct Projection<'n> {
    information: &'n DMatrix<f64>,
    gradient: &'n DVector<f64>,
    /// Lanes of the model's own parameters.
    own: Vec<usize>,
    parameters: &'n Parameters,
    min_fraction: f64,
}

impl Projection<'_> {
    /// Score of the trial whose free coordinates are `lanes` and whose parameters are `range`.
    fn score(&self, lanes: &[usize], range: Range<usize>, trial: &Trial) -> Score {
        let (information, base) = (self.information, &self.own);
        let mut result = Score::zero(trial, base.len());
        result.free = lanes.len();
        let pick =
            |rows: &[usize], columns: &[usize]| DMatrix::from_fn(rows.len(), columns.len(), |i, j| information[(rows[i], columns[j])]);
        let mut own = pick(base, base);
        for k in 0..base.len() {
            own[(k, k)] += RIDGE * own[(k, k)] + f64::from(u8::from(own[(k, k)] <= 0.0));
        }
        let Some(own) = Cholesky::new(own) else { return result };
        let cross = pick(base, lanes);
        let imitated = own.solve(&cross);
        let whole = pick(lanes, lanes);
        let left = &whole - cross.transpose() * &imitated;
        let fraction = |k: usize| if whole[(k, k)] > 0.0 { left[(k, k)] / whole[(k, k)] } else { 0.0 };
        result.identifiable_fraction = (0..lanes.len()).map(fraction).fold(1.0, f64::min);
        if result.identifiable_fraction.is_nan() || result.identifiable_fraction <= self.min_fraction {
            return result;
        }
        let base_gradient = DVector::from_fn(base.len(), |k, _| self.gradient[base[k]]);
        let g = DVector::from_fn(lanes.len(), |k, _| self.gradient[lanes[k]]) - imitated.transpose() * &base_gradient;
        let Some(factor) = Cholesky::new(left) else { return result };
        let step = factor.solve(&g);
        result.chi2_decrease = g.dot(&step);
        let own_step = own.solve(&base_gradient) - &imitated * &step;
        result.step = own_step.iter().copied().collect();
        let mut full = vec![0.0; information.nrows()];
        for (lane, s) in lanes.iter().zip(step.iter()) {
            full[*lane] = *s;
        }
        // `moved` stops at a limit. A level beyond zero is unphysical.
        let free = self.parameters.free();
        let parameter = |lane: usize| &self.parameters.list[free[lane]];
        let falls_below_zero = |lane: usize, s: f64| parameter(lane).kind == ParameterKind::NonNegative && parameter(lane).value + s < 0.0;
        result.negative = !trial.card.polar && lanes.iter().zip(step.iter()).any(|(lane, s)| falls_below_zero(*lane, *s));
        let moved = self.parameters.moved(&full);
        result.values = range.map(|k| moved.list[k].value).collect();
        if result.negative {
            result.chi2_decrease = 0.0;
        }
        result
    }
}

/// A trial with finite values: χ² predicted after one step from there, against χ² predicted after one step without it. An expensive trial
/// is screened on an excerpt.
fn score_finite(base: &FittedModel, trial: &Trial) -> Score {
    let own_free = base.free_parameters();
    let mut result = Score::zero(trial, own_free);
    let excerpt;
    let whole;
    let data: &_ = if trial.is_expensive() {
        excerpt = base.excerpt();
        &excerpt
    } else {
        whole = base.data_for(trial);
        whole.as_ref()
    };
    let (system, parameters, own) = base.with(trial, &trial.screened);
    if parameters.free().len() + base.fit.initial_states.kinds.len() + 2 > MAX_UNKNOWNS {
        return result;
    }
    let predicted = |system: &System, parameters: &Parameters| {
        let states = base.initial_states_for(system, parameters, data);
        let equations = Iterate::new(system, parameters, data, &states).normal_equations(&base.weights);
        let step = equations.cost.is_finite().then(|| equations.step(FINITE_DAMPING, &[])).flatten()?;
        Some((equations.cost - step.predicted_decrease, step))
    };
    let without =
        if trial.is_expensive() { predicted(&base.system, &base.fit.parameters).map_or(f64::NAN, |(chi2, _)| chi2) } else { base.fit.chi2 };
    let Some((with, step)) = predicted(&system, &parameters) else { return result };
    result.identifiable_fraction = 1.0;
    // An expensive trial is refitted only where it leaves much less of the excerpt.
    let worth = !trial.is_expensive() || with < base.context.criteria.screening.max_expensive_remainder * without;
    result.chi2_decrease = if worth { (without - with).max(0.0) } else { 0.0 };
    let moved = parameters.moved(&step.parameters);
    result.values = own.map(|k| moved.list[k].value).collect();
    result.step = step.parameters[..own_free].to_vec();
    result
}
