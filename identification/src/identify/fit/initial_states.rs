//! Initial states of the segments: unknowns of the fit besides the parameters.

use drive_model::effects::{coulomb, presliding};
use drive_rig::{DriveState, Rig};

use super::parameters::{DerivativeScalar, Parameters};
use super::system::System;
use crate::model::{Channel, Input};
use crate::recording::prepared_log::PreparedLog;

/// An initial state of a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InitialStateKind {
    /// Rate, rad/s.
    Rate,
    /// Angle, rad (only where the simulation follows the measurement).
    Angle,
    /// Current, A.
    Current,
    /// Twist of the shaft, rad.
    Twist,
    /// Deflection of the bristle, rad.
    Bristle,
    /// Winding temperature above 25 °C, K.
    Temperature,
}

/// Initial states of all segments, with a weak prior that bounds states without influence on the outputs.
#[derive(Debug, Clone)]
pub struct InitialStates {
    /// The states, the same for each segment.
    pub kinds: Vec<InitialStateKind>,
    /// Values, by segment and kind.
    pub values: Vec<Vec<f64>>,
    /// Means of the prior, by segment and kind.
    pub prior: Vec<Vec<f64>>,
    /// Standard deviation of the prior, by kind.
    pub prior_sigma: Vec<f64>,
}

/// Lower limit of the initial winding temperature above 25 °C, K.
const MIN_TEMPERATURE_RISE_K: f64 = -60.0;
/// Rows whose mean gives the initial rate.
const START_ROWS: usize = 5;

impl InitialStates {
    /// The states after a step, by segment and kind, within their physical limits.
    pub fn moved(&self, step: &[Vec<f64>]) -> InitialStates {
        let mut next = self.clone();
        for (values, step) in next.values.iter_mut().zip(step) {
            for ((value, step), kind) in values.iter_mut().zip(step).zip(&self.kinds) {
                *value += step;
                if *kind == InitialStateKind::Temperature {
                    *value = value.max(MIN_TEMPERATURE_RISE_K);
                }
            }
        }
        next
    }
}

/// The initial states of a model; none for a prescribed motion.
pub fn initial_state_kinds(rig: &Rig<f64>, data: &PreparedLog) -> Vec<InitialStateKind> {
    let mut list = Vec::new();
    if data.driven == Input::Motion {
        return list;
    }
    list.push(InitialStateKind::Rate);
    let compares_angle = data.angle_is_absolute() && data.channels.iter().any(|c| c.channel == Channel::Angle);
    if compares_angle || data.driven == Input::Setpoint {
        list.push(InitialStateKind::Angle);
    }
    let structure = rig.structure();
    if structure.inductance_H.is_some() && data.driven.is_voltage() {
        list.push(InitialStateKind::Current);
    }
    if structure.shaft.is_some() {
        list.push(InitialStateKind::Twist);
    }
    if structure.bristle_N_m_rad.is_some() {
        list.push(InitialStateKind::Bristle);
    }
    if structure.thermal.is_some() && data.temp_C.is_none() {
        list.push(InitialStateKind::Temperature);
    }
    list
}

/// Start values of the initial states from the first rows of each segment.
pub fn starting_states(kinds: &[InitialStateKind], data: &PreparedLog, parameters: &Parameters, system: &System) -> InitialStates {
    let channel = |channel: Channel| data.channels.iter().find(|c| c.channel == channel);
    let mut values = Vec::new();
    for rows in &data.segments {
        let count = rows.len().min(START_ROWS);
        let mean = |y: &[f64]| y[rows.start..rows.start + count].iter().sum::<f64>() / count as f64;
        let start = |kind: &InitialStateKind| match kind {
            InitialStateKind::Rate => match (channel(Channel::Rate), data.theta) {
                (Some(c), _) if c.magnitude => mean(c.measured) * mean(&data.input).signum(),
                (Some(c), _) => mean(c.measured),
                (None, Some(theta)) => {
                    let last = (rows.start + data.angle_lag()).min(rows.end - 1);
                    let length_s = data.t_s[last] - data.t_s[rows.start];
                    if length_s > 0.0 { (theta[last] - theta[rows.start]) / length_s } else { 0.0 }
                }
                _ => 0.0,
            },
            InitialStateKind::Angle => match data.theta {
                Some(theta) => theta[rows.start] + 0.5 * data.theta_quantum,
                // A servo that has settled.
                None if data.driven == Input::Setpoint => data.input[rows.start],
                None => 0.0,
            },
            InitialStateKind::Current => channel(Channel::Current).map_or(0.0, |c| c.measured[rows.start]),
            InitialStateKind::Twist | InitialStateKind::Bristle | InitialStateKind::Temperature => 0.0,
        };
        values.push(kinds.iter().map(start).collect::<Vec<f64>>());
    }
    let magnitude = |name: &str| parameters.list.iter().find(|p| p.name == name).map_or(1.0, |p| p.value.abs());
    let clearance = parameters.list.iter().find(|p| p.is_clearance).map_or(1.0, |p| p.value.abs());
    let resistance = system.resistance.map_or(1.0, |k| parameters.list[k].value);
    let prior_sigma = kinds
        .iter()
        .map(|kind| match kind {
            InitialStateKind::Rate => 1e4,
            InitialStateKind::Angle => 1.0,
            InitialStateKind::Current => 10.0 / resistance,
            InitialStateKind::Twist => 0.1 + clearance,
            InitialStateKind::Bristle => {
                (magnitude(coulomb::CARD.parameters[0].name) / magnitude(presliding::CARD.parameters[0].name)).max(1e-4)
            }
            InitialStateKind::Temperature => 30.0,
        })
        .collect();
    InitialStates { kinds: kinds.to_vec(), prior: values.clone(), values, prior_sigma }
}

/// State at the start of a segment. The derivatives by the initial states follow those by the `free` parameters.
pub(super) fn state<S: DerivativeScalar>(kinds: &[InitialStateKind], values: &[f64], free: usize, theta: f64) -> DriveState<S> {
    let mut state = DriveState::turning(S::zero(), S::from(theta));
    for (k, (kind, &value)) in kinds.iter().zip(values).enumerate() {
        let value = S::seeded(value, free + k, 1.0);
        match kind {
            InitialStateKind::Rate => {
                state.omega = value;
                state.motor_omega = value;
            }
            InitialStateKind::Angle => state.theta = value,
            InitialStateKind::Current => state.current = value,
            InitialStateKind::Twist => state.twist = value,
            InitialStateKind::Bristle => state.bristle = value,
            InitialStateKind::Temperature => state.heat_K = value,
        }
    }
    state
}
