//! Free forms: piecewise linear laws over a coordinate, the rivals of the named effects.
//!
//! A free form states only that a torque, a friction level or a voltage depends on a coordinate. Where it is more likely than every effect of the
//! catalogue, in spite of its many parameters, the structure has no name.

use std::ops::Range;
use std::sync::Arc;

use drive_model::Coordinate;

use super::model::PredictedModel;
use crate::identify::explain::motion::turns;
use crate::identify::explain::piecewise_linear::PiecewiseLinear;
use crate::identify::fit::normal_equations::MAX_UNKNOWNS;
use crate::identify::fit::{Iterate, Parameters, System, build};
use crate::model::{Channel, Input, SummingPoint};
use crate::statistics::Extremes;

/// Knots of a free form over angle or time.
const KNOTS: usize = 16;
/// Knots over rate or current.
const KNOTS_OF_MOTION: usize = 12;
/// Knots over temperature.
const KNOTS_OF_TEMPERATURE: usize = 6;
/// Turns from which on a function of the angle is tried.
const MIN_TURNS: f64 = 1.0;
/// Damping of the one step that predicts the gain.
const DAMPING: f64 = 1e-6;

/// A free form with its predicted gain.
pub struct ScoredForm {
    /// The law.
    pub law: PiecewiseLinear,
    /// Predicted fall of χ².
    pub chi2_decrease: f64,
    /// Heights of its knots after the predicted step.
    pub heights: Vec<f64>,
    /// The predicted step of the model's own coordinates.
    pub step: Vec<f64>,
}

/// All free forms beside a model, scored, the best first.
pub fn score_all(base: &PredictedModel) -> Vec<ScoredForm> {
    let mut list: Vec<ScoredForm> = laws(base).into_iter().filter_map(|law| score(base, law)).collect();
    list.sort_by(|a, b| b.chi2_decrease.total_cmp(&a.chi2_decrease));
    list
}

/// The model with a free form whose knots are at zero, and the positions of the knots among its parameters.
pub fn append(system: &mut System, parameters: &mut Parameters, law: &PiecewiseLinear) -> Range<usize> {
    build::append_linear(system, parameters, "free-form", Arc::new(law.clone()), law.count)
}

fn score(base: &PredictedModel, law: PiecewiseLinear) -> Option<ScoredForm> {
    let fitted = &base.fitted;
    let (mut system, mut parameters) = (fitted.system.clone(), fitted.fit.parameters.clone());
    let own = append(&mut system, &mut parameters, &law);
    let states = fitted.initial_states_for(&system, &parameters, &fitted.data);
    let equations = Iterate::new(&system, &parameters, &fitted.data, &states).normal_equations(&fitted.weights);
    let step = equations.step(DAMPING, &[])?;
    if !step.predicted_decrease.is_finite() {
        return None;
    }
    let moved = parameters.moved(&step.parameters);
    let heights = own.map(|k| moved.list[k].value).collect();
    Some(ScoredForm { law, chi2_decrease: step.predicted_decrease, heights, step: step.parameters[..fitted.free_parameters()].to_vec() })
}

/// The laws over the coordinates of these logs.
fn laws(base: &PredictedModel) -> Vec<PiecewiseLinear> {
    let fitted = &base.fitted;
    let data = &fitted.data;
    let places = MAX_UNKNOWNS.saturating_sub(fitted.free_parameters() + fitted.fit.initial_states.kinds.len() + 1);
    let mut list = Vec::new();
    let mut add = |coordinate, acts_on, range: (f64, f64), count: usize| {
        let count = count.min(places);
        if range.1 > range.0 && count >= MIN_KNOTS {
            list.push(PiecewiseLinear { coordinate, acts_on, range, count });
        }
    };
    if turns(data) >= MIN_TURNS {
        add(Coordinate::Theta, SummingPoint::Dry, (0.0, std::f64::consts::TAU), KNOTS);
        add(Coordinate::Theta, SummingPoint::Torque, (0.0, std::f64::consts::TAU), KNOTS);
    }
    let measured = |channel: Channel| data.channels.iter().find(|c| c.channel == channel).map(|c| c.measured.iter().copied().min_max());
    if let Some(range) = measured(Channel::Rate) {
        add(Coordinate::Omega, SummingPoint::Torque, range, KNOTS_OF_MOTION);
    }
    if data.driven == Input::Voltage
        && let Some(range) = measured(Channel::Current)
    {
        add(Coordinate::Current, SummingPoint::Torque, range, KNOTS_OF_MOTION);
        add(Coordinate::Current, SummingPoint::Voltage, range, KNOTS_OF_MOTION);
    }
    if let Some(t) = &data.temp_C {
        add(Coordinate::Temperature, SummingPoint::Torque, t.iter().copied().min_max(), KNOTS_OF_TEMPERATURE);
    }
    let time = (data.t_s[0], data.t_s[data.len() - 1]);
    add(Coordinate::Time, SummingPoint::Torque, time, KNOTS);
    if data.driven == Input::Voltage {
        add(Coordinate::Time, SummingPoint::Voltage, time, KNOTS);
    }
    list
}

/// Knots below which no function is tried.
const MIN_KNOTS: usize = 4;
