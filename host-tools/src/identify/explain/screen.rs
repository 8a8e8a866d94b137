//! The score test: how much would the misfit fall if this effect were let in?
//!
//! At the fitted model every trial has a sensitivity; what of it the model's own parameters and initial states could imitate is projected
//! out, and the rest is held against the residual: gain = gᵀ S⁻¹ g, the fall of χ² that a linear model promises. Trials that are absent at
//! their values go through the record together, thirty derivatives at a time. A trial whose zero is singular runs alone at its finite
//! values, and what one step from there promises is compared with the model without it.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::ground::Ground;
use super::trial::Trial;
use crate::identify::fit::build;
use crate::identify::fit::normal_equations::{MAX_UNKNOWNS, linearize};
use crate::identify::fit::parameters::Parameters;
use crate::identify::fit::simulate::System;
use crate::identify::fit::solve::Iterate;
use drive_model::ParameterKind;

/// What the score test says of a trial.
#[derive(Debug, Clone)]
pub struct Score {
    /// Fall of χ² that it promises; 0 where its best amplitude would be unphysical.
    pub gain: f64,
    /// Free parameters that it was given.
    pub free: usize,
    /// The step of the model's own free coordinates that goes with it.
    pub step: Vec<f64>,
    /// Its parameters after the step.
    pub values: Vec<f64>,
    /// Part of its sensitivity that the model's own parameters cannot imitate, 0 to 1.
    pub apart: f64,
    /// Its best amplitude would be negative where physics has none.
    pub negative: bool,
}

/// Below this part the effect cannot be told from the model's own parameters.
pub const ALIKE: f64 = 1e-6;

/// Part of the excerpt's misfit that a costly trial may leave, by one step, to be worth a fit.
const PROMISING: f64 = 0.9;

/// Scores of all trials, in their order.
pub fn scores(ground: &Ground, trials: &[Trial]) -> Vec<Score> {
    let states = ground.held.starts.kinds.len();
    let base = ground.held.parameters.free().len();
    let room = MAX_UNKNOWNS.saturating_sub(base + states);
    // Batches of absent trials that share a record; the others alone.
    let mut batches: Vec<Vec<usize>> = Vec::new();
    for kind in [None, Some(false), Some(true)] {
        let mut batch: Vec<usize> = Vec::new();
        let mut lanes = 0;
        for (k, trial) in trials.iter().enumerate().filter(|(_, t)| t.absent && t.rate_from_encoder == kind) {
            let more = trial.screened.iter().filter(|f| **f).count();
            let heats = trial.card.id == "resistance-temperature" && ground.record.temp_C.is_none();
            if heats || more > room {
                batches.push(vec![k]);
                continue;
            }
            if lanes + more > room {
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
    batches.extend(trials.iter().enumerate().filter(|(_, t)| !t.absent).map(|(k, _)| vec![k]));
    let scored: Vec<(usize, Score)> = batches
        .par_iter()
        .flat_map_iter(|batch| {
            let first = &trials[batch[0]];
            let list: Vec<Score> = if first.absent { at_zero(ground, trials, batch) } else { vec![finite(ground, first)] };
            batch.iter().copied().zip(list)
        })
        .collect();
    let mut ordered: Vec<Option<Score>> = vec![None; trials.len()];
    for (k, score) in scored {
        ordered[k] = Some(score);
    }
    ordered.into_iter().zip(trials).map(|(s, t)| s.unwrap_or_else(|| nothing(t, base))).collect()
}

fn nothing(trial: &Trial, base: usize) -> Score {
    let free = trial.screened.iter().filter(|f| **f).count();
    Score { gain: 0.0, free, step: vec![0.0; base], values: trial.values.clone(), apart: 0.0, negative: false }
}

/// Trials that are absent at their values: one run for the whole batch.
fn at_zero(ground: &Ground, trials: &[Trial], batch: &[usize]) -> Vec<Score> {
    let base = ground.held.parameters.free().len();
    let record = ground.record_for(&trials[batch[0]]);
    let mut system = ground.system.clone();
    let mut parameters = ground.held.parameters.clone();
    let ranges: Vec<_> = batch
        .iter()
        .map(|&k| build::append(&mut system, &mut parameters, trials[k].card, &trials[k].values, &trials[k].screened))
        .collect();
    let starts = ground.starts_for(&system, &parameters, &record);
    let linear = linearize(&system, &parameters, &record, &starts).weighted(&starts, &ground.weights);
    let (information, gradient) = linear.profiled();
    if !gradient.iter().chain(information.iter()).all(|x| x.is_finite()) {
        return batch.iter().map(|&k| nothing(&trials[k], base)).collect();
    }
    let free = parameters.free();
    let own_base: Vec<usize> = (0..base).collect();
    batch
        .iter()
        .zip(&ranges)
        .map(|(&k, range)| {
            let lanes: Vec<usize> = (0..free.len()).filter(|&lane| range.contains(&free[lane])).collect();
            score(&information, &gradient, &own_base, &lanes, &parameters, range.clone(), &trials[k])
        })
        .collect()
}

/// The score of the lanes of one trial beside the model's own.
fn score(
    information: &DMatrix<f64>,
    gradient: &DVector<f64>,
    base: &[usize],
    lanes: &[usize],
    parameters: &Parameters,
    range: Range<usize>,
    trial: &Trial,
) -> Score {
    let mut result = nothing(trial, base.len());
    result.free = lanes.len();
    let pick = |rows: &[usize], columns: &[usize]| DMatrix::from_fn(rows.len(), columns.len(), |i, j| information[(rows[i], columns[j])]);
    let mut own = pick(base, base);
    for k in 0..base.len() {
        own[(k, k)] += 1e-12 * own[(k, k)] + f64::from(u8::from(own[(k, k)] <= 0.0));
    }
    let Some(own) = Cholesky::new(own) else { return result };
    let cross = pick(base, lanes);
    let imitated = own.solve(&cross);
    let whole = pick(lanes, lanes);
    let left = &whole - cross.transpose() * &imitated;
    result.apart = (0..lanes.len()).map(|k| if whole[(k, k)] > 0.0 { left[(k, k)] / whole[(k, k)] } else { 0.0 }).fold(1.0, f64::min);
    if result.apart.is_nan() || result.apart <= ALIKE {
        return result;
    }
    let base_gradient = DVector::from_fn(base.len(), |k, _| gradient[base[k]]);
    let g = DVector::from_fn(lanes.len(), |k, _| gradient[lanes[k]]) - imitated.transpose() * &base_gradient;
    let Some(factor) = Cholesky::new(left) else { return result };
    let step = factor.solve(&g);
    result.gain = g.dot(&step);
    let own_step = own.solve(&base_gradient) - &imitated * &step;
    result.step = own_step.iter().copied().collect();
    let mut full = vec![0.0; information.nrows()];
    for (lane, s) in lanes.iter().zip(step.iter()) {
        full[*lane] = *s;
    }
    // Past a limit `moved` would stop; what lies beyond zero for a level is unphysical.
    let free = parameters.free();
    result.negative = !trial.card.polar
        && lanes.iter().zip(step.iter()).any(|(lane, s)| {
            parameters.list[free[*lane]].kind == ParameterKind::NonNegative && parameters.list[free[*lane]].value + s < 0.0
        });
    result.values = range.map(|k| parameters.moved(&full).list[k].value).collect();
    if result.negative {
        result.gain = 0.0;
    }
    result
}

/// A trial with finite values: what one step from there promises, against what one step without it does. A costly one is judged by an
/// excerpt.
fn finite(ground: &Ground, trial: &Trial) -> Score {
    let base = ground.held.parameters.free().len();
    let mut result = nothing(trial, base);
    let record = if trial.is_costly() { ground.excerpt() } else { ground.record_for(trial) };
    let (system, parameters, own) = ground.with(trial, &trial.screened);
    if parameters.free().len() + ground.held.starts.kinds.len() + 2 > MAX_UNKNOWNS {
        return result;
    }
    let promised = |system: &System, parameters: &Parameters| {
        let starts = ground.starts_for(system, parameters, &record);
        let linear = Iterate::new(system, parameters, &record, &starts).normal_equations(&ground.weights);
        let step = linear.cost.is_finite().then(|| linear.step(1e-3, &[])).flatten()?;
        Some((linear.cost - step.promised, step))
    };
    let without = if trial.is_costly() {
        promised(&ground.system, &ground.held.parameters).map_or(f64::NAN, |(cost, _)| cost)
    } else {
        ground.held.chi2
    };
    let Some((with, step)) = promised(&system, &parameters) else { return result };
    result.apart = 1.0;
    // A costly one must promise more than a trifle: it would have to leave much less of the excerpt to be fitted at all.
    let worth = !trial.is_costly() || with < PROMISING * without;
    result.gain = if worth { (without - with).max(0.0) } else { 0.0 };
    let moved = parameters.moved(&step.parameters);
    result.values = own.map(|k| moved.list[k].value).collect();
    result.step = step.parameters[..base].to_vec();
    result
}
