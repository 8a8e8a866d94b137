//! Levenberg and Marquardt's descent, by output error.

use super::normal_equations::{InitialStates, Linearization, NormalEquations, Step, linearize, linearize_below};
use super::parameters::Parameters;
use super::prepared_log::PreparedLog;
use super::simulate::{InitialStateKind, System};

/// Most steps of one descent.
const MOST_STEPS: usize = 100;
/// Promised fall of χ² below which nothing is left to gain: a thirtieth of a standard error.
pub const MIN_CHI2_DECREASE: f64 = 1e-3;
/// Damping that hardly shortens a step.
const FREE: f64 = 1e-3;
/// Where the model is wrong anyway (χ²/n above this), so many steps that win less than one row's share of χ² are the end.
const WRONG: f64 = 2.0;
const STALLED_STEPS: usize = 12;
/// Damping at which a descent gives up.
const MOST_DAMPING: f64 = 1e12;

/// A point of a descent.
pub struct Iterate {
    /// Parameters there.
    pub parameters: Parameters,
    /// Initial states there.
    pub starts: InitialStates,
    /// The model run there.
    pub linearization: Linearization,
    /// Steps that it took to come here.
    pub steps: usize,
    /// The descent ended because nothing was left to gain.
    pub converged: bool,
}

impl Iterate {
    /// Where a descent begins.
    pub fn new(system: &System, parameters: &Parameters, record: &PreparedLog, starts: &InitialStates) -> Self {
        let linearization = linearize(system, parameters, record, starts);
        Iterate { parameters: parameters.clone(), starts: starts.clone(), linearization, steps: 0, converged: false }
    }

    /// The normal equations here.
    pub fn normal_equations(&self, weights: &[f64]) -> NormalEquations {
        self.linearization.weighted(&self.starts, weights)
    }
}

/// Descends from `place` until no step promises more than `enough`, in χ²; the weights per channel are 1/σ².
pub fn minimize(system: &System, record: &PreparedLog, place: Iterate, weights: &[f64], enough: impl FnMut(f64) -> f64) -> Iterate {
    minimize_within(system, record, place, weights, MOST_STEPS, enough)
}

/// The same in at most so many steps.
pub fn minimize_within(
    system: &System,
    record: &PreparedLog,
    place: Iterate,
    weights: &[f64],
    most: usize,
    mut enough: impl FnMut(f64) -> f64,
) -> Iterate {
    let mut place = place;
    let mut linear = place.normal_equations(weights);
    let mut converged = false;
    let mut steps = 0;
    let mut damping = 1e-3;
    let values = (record.len() * record.channels.len()) as f64;
    let mut before = linear.cost;
    while steps < most {
        if steps > 0 && steps.is_multiple_of(STALLED_STEPS) {
            let share = linear.cost / values;
            if share > WRONG && before - linear.cost < share {
                converged = true;
                break;
            }
            before = linear.cost;
        }
        steps += 1;
        // A parameter at the end of what it can be does not hold up the others.
        let against = |step: &Step| place.parameters.against_a_limit(&step.parameters);
        let mut held = Vec::new();
        let step = linear.step(damping, &[]).and_then(|step| {
            held = against(&step);
            if held.is_empty() { Some(step) } else { linear.step(damping, &held) }
        });
        let Some(step) = step else {
            damping = (damping * 10.0_f64).max(1e-6);
            if damping > MOST_DAMPING {
                break;
            }
            continue;
        };
        let enough = enough(linear.cost);
        // A damped step promises little wherever it is; how far it still is tells the free one.
        if step.promised < enough && (damping <= FREE || linear.step(FREE, &held).is_none_or(|free| free.promised < enough)) {
            converged = true;
            break;
        }
        let next = place.parameters.moved(&step.parameters);
        let next_starts = moved(&place.starts, &step.states);
        let trial_pass = linearize_below(system, &next, record, &next_starts, weights, linear.cost);
        let trial = trial_pass.weighted(&next_starts, weights);
        let fell = linear.cost - trial.cost;
        if trial.cost.is_finite() && fell > 0.0 {
            damping = if fell > 0.5 * step.promised { damping * 0.1 } else { damping };
            if damping < 1e-9 {
                damping = 1e-9;
            }
            place.parameters = next;
            place.starts = next_starts;
            place.linearization = trial_pass;
            linear = trial;
            if fell < enough && damping < 1e-2 {
                converged = true;
                break;
            }
        } else {
            damping *= 8.0;
            // The cost has small steps of its own where the rig's step count changes; a promise below them cannot be kept.
            if damping > MOST_DAMPING || (step.promised < 1e-2 && damping > 1.0) {
                converged = step.promised < 1.0;
                break;
            }
        }
    }
    place.steps += steps;
    place.converged = converged;
    place
}

/// States after a step, within what they can be.
fn moved(starts: &InitialStates, step: &[Vec<f64>]) -> InitialStates {
    let mut next = starts.clone();
    for (values, step) in next.values.iter_mut().zip(step) {
        for ((value, step), kind) in values.iter_mut().zip(step).zip(&starts.kinds) {
            *value += step;
            if *kind == InitialStateKind::Heat {
                *value = value.max(-60.0);
            }
        }
    }
    next
}
