//! Levenberg–Marquardt minimisation of the output error.

use super::initial_states::InitialStates;
use super::normal_equations::{Linearization, NormalEquations, Step, linearize, linearize_below};
use super::parameters::Parameters;
use super::problem::Problem;
use super::system::System;
use crate::recording::prepared_log::PreparedLog;

/// Most steps of one minimisation.
const MAX_STEPS: usize = 100;
/// Predicted decrease of χ² below which the minimisation ends; it corresponds to 1/30 of a standard error.
pub const MIN_CHI2_DECREASE: f64 = 1e-3;
/// Damping without significant influence on a step.
const NEGLIGIBLE_DAMPING: f64 = 1e-3;
/// χ²/n above which the model is considered wrong: after [`STALLED_STEPS`] steps with less than one row's part of χ² the minimisation ends.
const WRONG_MODEL_CHI2_PER_N: f64 = 2.0;
const STALLED_STEPS: usize = 12;
/// Damping at which the minimisation gives up.
const MAX_DAMPING: f64 = 1e12;

/// An iterate of the minimisation.
pub struct Iterate {
    /// Parameters.
    pub parameters: Parameters,
    /// Initial states.
    pub initial_states: InitialStates,
    /// The model linearised there.
    pub linearization: Linearization,
    /// Number of steps so far.
    pub steps: usize,
    /// The last minimisation reached its stopping criterion.
    pub converged: bool,
}

impl Iterate {
    /// The first iterate.
    pub fn new(system: &System, parameters: &Parameters, data: &PreparedLog, initial_states: &InitialStates) -> Self {
        let linearization = linearize(system, parameters, data, initial_states);
        Iterate { parameters: parameters.clone(), initial_states: initial_states.clone(), linearization, steps: 0, converged: false }
    }

    /// The normal equations with 1/σ² of each channel as `weights`.
    pub fn normal_equations(&self, weights: &[f64]) -> NormalEquations {
        self.linearization.weighted(&self.initial_states, weights)
    }
}

/// Minimises χ² from `iterate` until the predicted decrease is below `tolerance(χ²)`, or until the budget of the data is exhausted.
pub fn minimize(problem: Problem, iterate: Iterate, tolerance: impl FnMut(f64) -> f64) -> Iterate {
    minimize_within(problem, iterate, MAX_STEPS, tolerance)
}

/// Minimises χ² as [`minimize`], in at most `max_steps` steps.
pub fn minimize_within(problem: Problem, mut iterate: Iterate, max_steps: usize, mut tolerance: impl FnMut(f64) -> f64) -> Iterate {
    let Problem { data, weights, .. } = problem;
    let mut equations = iterate.normal_equations(weights);
    let mut converged = false;
    let mut steps = 0;
    let mut damping = 1e-3;
    let values = (data.len() * data.channels.len()) as f64;
    let mut cost_before = equations.cost;
    while steps < max_steps && !data.budget.is_exhausted() {
        if steps > 0 && steps.is_multiple_of(STALLED_STEPS) {
            let chi2_per_n = equations.cost / values;
            if chi2_per_n > WRONG_MODEL_CHI2_PER_N && cost_before - equations.cost < chi2_per_n {
                converged = true;
                break;
            }
            cost_before = equations.cost;
        }
        steps += 1;
        let mut held = Vec::new();
        let step = step_within_limits(&iterate.parameters, &equations, damping, &mut held);
        let Some(step) = step else {
            damping = (damping * 10.0_f64).max(1e-6);
            if damping > MAX_DAMPING {
                break;
            }
            continue;
        };
        let min_decrease = tolerance(equations.cost);
        // The predicted decrease of a damped step is always small; that of an undamped step measures the distance to the minimum.
        let undamped_is_small = || equations.step(NEGLIGIBLE_DAMPING, &held).is_none_or(|step| step.predicted_decrease < min_decrease);
        let is_small = step.predicted_decrease < min_decrease && (damping <= NEGLIGIBLE_DAMPING || undamped_is_small());
        let released = if is_small { step_off_limits(&iterate.parameters, &equations, damping, &held) } else { None };
        let step = match released {
            Some(released) if released.predicted_decrease >= min_decrease => released,
            _ if is_small => {
                converged = true;
                break;
            }
            _ => step,
        };
        let parameters = iterate.parameters.moved(&step.parameters);
        let initial_states = iterate.initial_states.moved(&step.states);
        let linearization = linearize_below(problem, &parameters, &initial_states, equations.cost);
        let trial = linearization.weighted(&initial_states, weights);
        let decrease = equations.cost - trial.cost;
        if trial.cost.is_finite() && decrease > 0.0 {
            damping = if decrease > 0.5 * step.predicted_decrease { damping * 0.1 } else { damping };
            if damping < 1e-9 {
                damping = 1e-9;
            }
            iterate.parameters = parameters;
            iterate.initial_states = initial_states;
            iterate.linearization = linearization;
            equations = trial;
            if decrease < min_decrease && damping < 1e-2 {
                converged = true;
                break;
            }
        } else {
            damping *= 8.0;
            // χ² has small discontinuities where the number of integration steps changes; a smaller predicted decrease is not attainable.
            if damping > MAX_DAMPING || (step.predicted_decrease < 1e-2 && damping > 1.0) {
                converged = step.predicted_decrease < 1.0;
                break;
            }
        }
    }
    iterate.steps += steps;
    iterate.converged = converged;
    iterate
}

/// A step that does not leave the limits at once: parameters at a limit that it would move outwards are `held`, so that they do not block
/// the others. Holding one may turn the step of another outwards, hence the loop.
fn step_within_limits(parameters: &Parameters, equations: &NormalEquations, damping: f64, held: &mut Vec<usize>) -> Option<Step> {
    loop {
        let step = equations.step(damping, held)?;
        let outward: Vec<usize> = parameters.at_limits(&step.parameters).into_iter().filter(|k| !held.contains(k)).collect();
        if outward.is_empty() {
            return Some(step);
        }
        held.extend(outward);
    }
}

/// At a minimum over the other parameters: a step that frees those `held` parameters along which χ² decreases inwards (the sign of the
/// Karush–Kuhn–Tucker multiplier); `None` where there are none.
fn step_off_limits(parameters: &Parameters, equations: &NormalEquations, damping: f64, held: &[usize]) -> Option<Step> {
    if held.is_empty() {
        return None;
    }
    let (_, descent) = equations.profiled();
    let mut outward: Vec<usize> = parameters.at_limits(descent.as_slice()).into_iter().filter(|k| held.contains(k)).collect();
    if outward.len() == held.len() { None } else { step_within_limits(parameters, equations, damping, &mut outward) }
}
