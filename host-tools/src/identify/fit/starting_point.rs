//! The way to the neighbourhood of the solution, from a start that is far off.
//!
//! Along a whole log a model with wrong parameters may not even turn: friction holds it, and no derivative says which way to go. Over a
//! quarter of a second that begins at what was measured it cannot go far astray. So the parameters are first fitted to short windows
//! spread over the log, each with initial states of its own (multiple shooting without the continuity), and the descent along the whole
//! log begins from there, if that is the better place.

use drive_model::ParameterKind;
use rayon::prelude::*;

use super::parameters::{Parameter, Parameters};
use super::prepared_log::PreparedLog;
use super::simulate::{InitialStateKind, System};
use super::solve::{self, Iterate};
use super::starting_states;
use crate::model::Input;

/// Length of a window, s, and the least number of rows in it.
pub const WINDOW_S: f64 = 0.25;
const WINDOW_ROWS: usize = 60;
/// Windows at most and at least.
const WINDOWS: usize = 40;
const FEWEST_WINDOWS: usize = 4;
/// Relative fall of the cost at which the windows have said what they can.
const ROUGHLY: f64 = 1e-2;
/// Cost per row at which the place is good without comparing it with the given one.
const CLOSE: f64 = 30.0;
/// Moments that are tried, where the model has one.
const MOMENTS: usize = 16;

/// Where the descent along the whole log should begin.
pub fn begin(system: &System, parameters: &Parameters, record: &PreparedLog, kinds: &[InitialStateKind], weights: &[f64]) -> Iterate {
    let near = near(system, parameters, record, kinds, weights);
    in_the_best_valley(system, record, near, weights)
}

fn near(system: &System, parameters: &Parameters, record: &PreparedLog, kinds: &[InitialStateKind], weights: &[f64]) -> Iterate {
    let at = |parameters: &Parameters| {
        let starts = starting_states(kinds, record, parameters, system);
        Iterate::new(system, parameters, record, &starts)
    };
    if record.driven == Input::Motion || parameters.free().is_empty() {
        return at(parameters);
    }
    let Some(windows) = windows(record, WINDOW_S) else { return at(parameters) };
    let near = fit_windows(system, parameters, &windows, kinds, weights);
    let approached = at(&near.parameters);
    let cost = |place: &Iterate| place.normal_equations(weights).cost;
    if cost(&approached) < CLOSE * record.len() as f64 {
        return approached;
    }
    let given = at(parameters);
    // An infinite or undefined cost never wins.
    if cost(&approached) < cost(&given) || !cost(&given).is_finite() { approached } else { given }
}

/// The parameters fitted to `windows`, from the given ones.
pub fn fit_windows(
    system: &System,
    parameters: &Parameters,
    windows: &PreparedLog,
    kinds: &[InitialStateKind],
    weights: &[f64],
) -> Iterate {
    let starts = starting_states(kinds, windows, parameters, system);
    let begin = Iterate::new(system, parameters, windows, &starts);
    solve::minimize(system, windows, begin, weights, |cost| ROUGHLY * cost)
}

/// Shifts of the dry level, in standard errors, by which a descent is started anew.
const SHIFTS: [f64; 4] = [4.0, -4.0, 12.0, -12.0];

/// A better place beyond a step of the cost, if there is one near.
///
/// Whether the rotor sticks for a moment or not is a question of yes or no: there the cost has a step that no derivative shows, and a
/// descent may end before it. So the dry level is moved a few standard errors, everything else with it as the covariance says.
pub fn escape_local_minimum(system: &System, record: &PreparedLog, place: Iterate, weights: &[f64]) -> Iterate {
    let free = place.parameters.free();
    let dry = |k: usize| ["coulomb_N_m", "stribeck_N_m"].iter().any(|stem| place.parameters.list[k].name.starts_with(stem));
    let Some(lane) = free.iter().position(|&k| dry(k)) else { return place };
    let Some(covariance) = place.normal_equations(weights).reduced().0.try_inverse() else { return place };
    let sigma = covariance[(lane, lane)].sqrt();
    if !(sigma > 0.0 && sigma.is_finite()) {
        return place;
    }
    let shifted = |shift: f64| {
        let step: Vec<f64> = (0..free.len()).map(|k| shift * covariance[(k, lane)] / sigma).collect();
        let begin = Iterate::new(system, &place.parameters.moved(&step), record, &place.starts);
        solve::minimize(system, record, begin, weights, |_| solve::MIN_CHI2_DECREASE)
    };
    let tried: Vec<Iterate> = SHIFTS.par_iter().map(|&shift| shifted(shift)).collect();
    let mut best = place;
    for tried in tried {
        if tried.normal_equations(weights).cost < best.normal_equations(weights).cost - 1.0 {
            let steps = best.steps;
            best = tried;
            best.steps += steps;
        }
    }
    best
}

/// A parameter in which the cost has several valleys is first looked for on a grid.
fn in_the_best_valley(system: &System, record: &PreparedLog, place: Iterate, weights: &[f64]) -> Iterate {
    let trials = place.parameters.free().into_iter().find_map(|k| {
        let values = valleys(&place.parameters.list[k], record);
        (!values.is_empty()).then_some((k, values))
    });
    let Some((k, values)) = trials else { return place };
    let (parameters, starts) = (place.parameters.clone(), place.starts.clone());
    let from = |place: Iterate| solve::minimize(system, record, place, weights, |cost| ROUGHLY * cost);
    let valley = |value: f64| {
        let mut parameters = parameters.clone();
        parameters.list[k].value = value;
        from(Iterate::new(system, &parameters, record, &starts))
    };
    let tried: Vec<Iterate> = values.par_iter().map(|&value| valley(value)).collect();
    let mut best = from(place);
    for tried in tried {
        if tried.normal_equations(weights).cost < best.normal_equations(weights).cost {
            best = tried;
        }
    }
    best
}

/// Where a parameter should be tried besides its given value: moments over the whole record, a play of other widths.
fn valleys(parameter: &Parameter, record: &PreparedLog) -> Vec<f64> {
    if parameter.kind == ParameterKind::EventTime {
        let (from_s, to_s) = (record.t_s[0], record.t_s[record.len() - 1]);
        return (0..MOMENTS).map(|k| from_s + (to_s - from_s) * (k as f64 + 0.5) / MOMENTS as f64).collect();
    }
    if parameter.name == "gap_rad" {
        return [0.33, 2.0, 3.0].map(|factor| factor * parameter.value).to_vec();
    }
    Vec::new()
}

/// The same record, cut into segments of `window_s` spread over what is not held out; `None` where there are too few.
pub fn windows<'a>(record: &PreparedLog<'a>, window_s: f64) -> Option<PreparedLog<'a>> {
    let rows = ((window_s / record.dt_s) as usize).max(WINDOW_ROWS);
    let mut segments = Vec::new();
    for segment in &record.segments {
        let mut from = segment.start;
        while from + rows <= segment.end {
            if !record.held_out(from) && !record.held_out(from + rows - 1) {
                segments.push(from..from + rows);
            }
            from += rows;
        }
    }
    let every = segments.len().div_ceil(WINDOWS).max(1);
    let segments: Vec<_> = segments.into_iter().step_by(every).collect();
    (segments.len() >= FEWEST_WINDOWS).then(|| PreparedLog { segments, ..record.clone() })
}
