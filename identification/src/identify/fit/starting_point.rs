//! Starting point of a fit whose parameters are far from the solution.
//!
//! Along a whole log a model with wrong parameters may not move at all: friction holds the rotor, and no derivative gives a direction. Over
//! a quarter of a second from measured initial states the model cannot deviate far. The parameters are therefore first fitted to short
//! windows across the log, each with its own initial states (multiple shooting without continuity constraints). The minimisation along the
//! whole log starts there if the cost is lower than at the given parameters.

use drive_model::ParameterKind;
use rayon::prelude::*;

use super::initial_states::{InitialStateKind, starting_states};
use super::parameters::{Parameter, Parameters};
use super::problem::Problem;
use super::solve::{self, Iterate};
use crate::model::Input;
use crate::recording::prepared_log::PreparedLog;

/// Length of a window, s.
pub const WINDOW_S: f64 = 0.25;
/// Least rows of a window.
const MIN_WINDOW_ROWS: usize = 60;
/// Most windows.
const MAX_WINDOWS: usize = 40;
/// Least windows.
const MIN_WINDOWS: usize = 4;
/// Relative decrease of χ² at which a preliminary fit ends.
const COARSE_TOLERANCE: f64 = 1e-2;
/// χ² per row below which the result of the windows is accepted without comparison with the given parameters.
const MAX_ACCEPTED_CHI2_PER_ROW: f64 = 30.0;
/// Event times that are tried.
const EVENT_TIMES: usize = 16;
/// Multiples of a clearance that are tried besides its given value.
const CLEARANCE_FACTORS: [f64; 3] = [0.33, 2.0, 3.0];
/// Shifts of the dry friction, in standard errors, from which a minimisation is repeated.
const FRICTION_SHIFTS: [f64; 4] = [4.0, -4.0, 12.0, -12.0];

/// The iterate from which the minimisation along the whole log starts.
pub fn starting_iterate(problem: Problem, parameters: &Parameters, kinds: &[InitialStateKind]) -> Iterate {
    let iterate = by_windows(problem, parameters, kinds);
    best_local_minimum(problem, iterate)
}

/// The better of the given parameters and those fitted to short windows.
fn by_windows(problem: Problem, parameters: &Parameters, kinds: &[InitialStateKind]) -> Iterate {
    let Problem { system, data, weights } = problem;
    let at = |parameters: &Parameters| {
        let states = starting_states(kinds, data, parameters, system);
        Iterate::new(system, parameters, data, &states)
    };
    if data.driven == Input::Motion || parameters.free().is_empty() {
        return at(parameters);
    }
    let Some(windows) = short_windows(data, WINDOW_S) else { return at(parameters) };
    let fitted = at(&fit_windows(Problem { data: &windows, ..problem }, parameters, kinds).parameters);
    let cost = |iterate: &Iterate| iterate.normal_equations(weights).cost;
    if cost(&fitted) < MAX_ACCEPTED_CHI2_PER_ROW * data.len() as f64 {
        return fitted;
    }
    let given = at(parameters);
    // An infinite or undefined cost is never the lower one.
    if cost(&fitted) < cost(&given) || !cost(&given).is_finite() { fitted } else { given }
}

/// Fits the parameters to short windows (the data of `problem`), from the given values.
pub fn fit_windows(problem: Problem, parameters: &Parameters, kinds: &[InitialStateKind]) -> Iterate {
    let states = starting_states(kinds, problem.data, parameters, problem.system);
    let start = Iterate::new(problem.system, parameters, problem.data, &states);
    solve::minimize(problem, start, |cost| COARSE_TOLERANCE * cost)
}

/// Repeats the minimisation from shifted values of the dry friction and returns the best iterate.
///
/// Whether the rotor sticks for an interval or not is a discrete outcome: χ² has a step there, without a derivative, at which a
/// minimisation may end. The other parameters are shifted with the friction according to the covariance.
pub fn escape_local_minimum(problem: Problem, iterate: Iterate) -> Iterate {
    let Problem { system, data, weights } = problem;
    let free = iterate.parameters.free();
    let Some(friction) = free.iter().position(|&k| iterate.parameters.list[k].is_dry_friction) else { return iterate };
    let Some(covariance) = iterate.normal_equations(weights).reduced().0.try_inverse() else { return iterate };
    let sigma = covariance[(friction, friction)].sqrt();
    if !(sigma > 0.0 && sigma.is_finite()) {
        return iterate;
    }
    let from_shift = |shift: f64| {
        let step: Vec<f64> = (0..free.len()).map(|k| shift * covariance[(k, friction)] / sigma).collect();
        let start = Iterate::new(system, &iterate.parameters.moved(&step), data, &iterate.initial_states);
        solve::minimize(problem, start, |_| solve::MIN_CHI2_DECREASE)
    };
    let others: Vec<Iterate> = FRICTION_SHIFTS.par_iter().map(|&shift| from_shift(shift)).collect();
    let mut best = iterate;
    for other in others {
        if other.normal_equations(weights).cost < best.normal_equations(weights).cost - 1.0 {
            let steps = best.steps;
            best = other;
            best.steps += steps;
        }
    }
    best
}

/// The best of minimisations from several values of a parameter over which χ² has several minima.
fn best_local_minimum(problem: Problem, iterate: Iterate) -> Iterate {
    let Problem { system, data, weights } = problem;
    let trials = iterate.parameters.free().into_iter().find_map(|k| {
        let values = start_values(&iterate.parameters.list[k], data);
        (!values.is_empty()).then_some((k, values))
    });
    let Some((k, values)) = trials else { return iterate };
    let (parameters, initial_states) = (iterate.parameters.clone(), iterate.initial_states.clone());
    let minimize = |start: Iterate| solve::minimize(problem, start, |cost| COARSE_TOLERANCE * cost);
    let from_value = |value: f64| {
        let mut parameters = parameters.clone();
        parameters.list[k].value = value;
        minimize(Iterate::new(system, &parameters, data, &initial_states))
    };
    let others: Vec<Iterate> = values.par_iter().map(|&value| from_value(value)).collect();
    let mut best = minimize(iterate);
    for other in others {
        if other.normal_equations(weights).cost < best.normal_equations(weights).cost {
            best = other;
        }
    }
    best
}

/// Values of a parameter to start from besides the given one: event times across the log, other clearances.
fn start_values(parameter: &Parameter, data: &PreparedLog) -> Vec<f64> {
    if parameter.kind == ParameterKind::EventTime {
        let (from_s, to_s) = data.time_range_s();
        return (0..EVENT_TIMES).map(|k| from_s + (to_s - from_s) * (k as f64 + 0.5) / EVENT_TIMES as f64).collect();
    }
    if parameter.is_clearance {
        return CLEARANCE_FACTORS.map(|factor| factor * parameter.value).to_vec();
    }
    Vec::new()
}

/// The data cut into segments of `window_s` across the rows that are not held out; `None` if there are too few.
pub fn short_windows<'a>(data: &PreparedLog<'a>, window_s: f64) -> Option<PreparedLog<'a>> {
    let rows = ((window_s / data.dt_s) as usize).max(MIN_WINDOW_ROWS);
    let mut segments = Vec::new();
    for segment in &data.segments {
        let mut from = segment.start;
        while from + rows <= segment.end {
            if !data.held_out(from) && !data.held_out(from + rows - 1) {
                segments.push(from..from + rows);
            }
            from += rows;
        }
    }
    let every = segments.len().div_ceil(MAX_WINDOWS).max(1);
    let segments: Vec<_> = segments.into_iter().step_by(every).collect();
    (segments.len() >= MIN_WINDOWS).then(|| data.of_segments(segments))
}
