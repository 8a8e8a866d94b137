//! Design of the next experiment: which run separates two fitted candidates best?
//!
//! The chosen candidate is simulated along each run that the stand can make, and its rival is linearised there. The rival's parameters may
//! move, as far as the present logs allow (their information matrix is the prior). The weighted square of what the rival cannot follow is
//! the expected gain, twice the logarithm of the likelihood ratio: the increase of ΔBIC that this run would bring (T-optimal design:
//! Atkinson, Fedorov, Biometrika 62 (1975) 57).
//!
//! Voltage runs are played as they are. Runs with a speed loop are played with a proportional-integral loop and feed-forward of the motor
//! voltage.

use std::str::FromStr;

use drive_model::StandRun;
use drive_rig::{DriveState, RowInput};
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;
use stand_firmware::profile::{Profile, ProfileConfig, ProfileKind};

use crate::identify::explain::answer::experiment::Separation;
use crate::identify::explain::candidates::candidate::FittedCandidate;
use crate::identify::explain::candidates::doubt::Doubt;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::fit::InitialStateKind;
use crate::identify::fit::normal_equations::{NormalEquations, linearize};
use crate::log::{Column, Log};
use crate::model::{Channel, Input};
use crate::recording::prepare;
use crate::statistics::Extremes;

/// Longest simulated part of a run, s: a longer run brings proportionally more.
const MAX_SIMULATED_S: f64 = 30.0;
/// Rows of a simulated run at most.
const MAX_ROWS: usize = 60_000;
/// Bandwidth of the simulated speed loop, rad/s.
const LOOP_BANDWIDTH_RAD_S: f64 = 20.0;
/// Largest product of that bandwidth and the sampling interval.
const MAX_BANDWIDTH_PER_ROW: f64 = 0.2;
/// Seed of random profiles; every seed separates about as well.
const SEED: u64 = 1;

/// All runs of the stand that can be simulated, the best first; `base` is the model to which the candidates were added.
pub fn separations(base: &FittedModel, doubt: &Doubt) -> Vec<Separation> {
    if matches!(base.data.driven, Input::Motion | Input::Setpoint) || doubt.rivals.is_empty() {
        return Vec::new();
    }
    let priors: Vec<DMatrix<f64>> = doubt.rivals.iter().map(|rival| prior(base, rival)).collect();
    let separation = |run: &StandRun| {
        let log = simulated(base, &doubt.chosen, run)?;
        let scale = run.duration_s / log.duration_s().max(base.data.dt_s);
        let gains = doubt.rivals.iter().zip(&priors).map(|(rival, prior)| gain_over(base, rival, prior, &log));
        let nearest = gains.collect::<Option<Vec<f64>>>()?.into_iter().min_or_infinity();
        Some(Separation { run: *run, expected_delta_bic: scale * nearest })
    };
    let mut list: Vec<Separation> = StandRun::ALL.par_iter().filter_map(separation).filter(|s| s.expected_delta_bic.is_finite()).collect();
    list.sort_by(|a, b| b.expected_delta_bic.total_cmp(&a.expected_delta_bic));
    list
}

/// Information of the present logs about the parameters of a candidate.
fn prior(base: &FittedModel, candidate: &FittedCandidate) -> DMatrix<f64> {
    let data = base.data_for(&candidate.trial);
    linearize(&candidate.system, &candidate.parameters, &data, &candidate.states).weighted(&candidate.states, &base.weights).profiled().0
}

/// A run with a candidate as the drive, without noise; `None` where it cannot be played or does not stay finite.
fn simulated(base: &FittedModel, candidate: &FittedCandidate, run: &StandRun) -> Option<Log> {
    let driven = base.data.driven;
    let is_rate = run.mode == "rate";
    if !is_rate && driven != Input::Voltage {
        return None;
    }
    let dt_s = base.data.dt_s;
    let rows = ((run.duration_s.min(MAX_SIMULATED_S) / dt_s) as usize).min(MAX_ROWS);
    let kind = ProfileKind::from_str(run.profile).ok()?;
    let mut profile = Profile::new(&ProfileConfig::new(kind, run.amplitude, SEED)).ok()?;
    let value = |index: Option<usize>| index.map_or(1.0, |k| candidate.parameters.list[k].value);
    let (inertia, motor_constant) = (value(candidate.system.inertia), value(candidate.system.motor_constant));
    // Input by torque, and by the rate.
    let (per_torque, per_rate) = match driven {
        Input::Voltage => (value(candidate.system.resistance) / motor_constant, motor_constant),
        Input::Current => (1.0 / motor_constant, 0.0),
        Input::Torque | Input::Motion | Input::Setpoint => (1.0, 0.0),
    };
    let bandwidth = LOOP_BANDWIDTH_RAD_S.min(MAX_BANDWIDTH_PER_ROW / dt_s);
    let (proportional, integral) = (per_torque * inertia * bandwidth, per_torque * inertia * bandwidth * bandwidth / 4.0);
    let rig = candidate.system.rig::<f64>(&candidate.parameters, driven);
    if !rig.resolves(dt_s) {
        return None;
    }
    let mut state = DriveState::turning(0.0, 0.0);
    let (mut sum, mut command, mut next_ms) = (0.0, 0.0, 0);
    let mut columns: Vec<Vec<f64>> = vec![Vec::with_capacity(rows); 2 + base.data.channels.len()];
    for row in 0..rows {
        let t_s = row as f64 * dt_s;
        while f64::from(next_ms) * 1e-3 <= t_s {
            command = profile.next_value();
            next_ms += 1;
        }
        let input = if is_rate {
            let error = command - state.omega;
            sum += error * dt_s;
            per_rate * command + proportional * error + integral * sum
        } else {
            command
        };
        let span = RowInput { rate_from_encoder: base.data.rate_from_encoder, ..RowInput::new(t_s, dt_s, input) };
        let before = (state.omega, state.theta, state.heat_K);
        let mean = rig.advance(&mut state, &span);
        let reading = rig.read(before, &span, mean);
        if !state.omega.is_finite() {
            return None;
        }
        columns[0].push(t_s);
        columns[1].push(input);
        for (column, channel) in columns[2..].iter_mut().zip(&base.data.channels) {
            column.push(match channel.channel {
                Channel::Rate => reading.omega,
                Channel::Angle => reading.theta,
                Channel::Current => reading.current,
                // Outputs of a prescribed motion.
                Channel::Voltage | Channel::Torque => return None,
            });
        }
    }
    let names = ["t_s", driven.column()].into_iter().chain(base.data.channels.iter().map(|c| c.channel.column()));
    let columns = names.zip(columns).map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    Log::new("next.parquet", columns, Vec::new()).ok()
}

/// Expected gain of what is simulated in `log` over a rival; `None` where the rival cannot be simulated there.
fn gain_over(base: &FittedModel, rival: &FittedCandidate, prior: &DMatrix<f64>, log: &Log) -> Option<f64> {
    let (model, _) = rival.added_to(&base.model);
    let (data, _) = prepare::prepare(log, &model, false).ok()?;
    let channels = |list: &[_]| list.iter().map(|c: &crate::recording::ComparedChannel| c.channel).collect::<Vec<_>>();
    if channels(&data.channels) != channels(&base.data.channels) {
        return None;
    }
    let data = data.with_rate_from_encoder(base.rate_from_encoder(&rival.trial));
    let mut states = base.initial_states_for(&rival.system, &rival.parameters, &data);
    // The run begins at rest.
    let kinds = states.kinds.clone();
    for values in &mut states.values {
        for (value, _) in values.iter_mut().zip(&kinds).filter(|(_, kind)| **kind != InitialStateKind::Angle) {
            *value = 0.0;
        }
    }
    let NormalEquations { segments, cost, free } =
        linearize(&rival.system, &rival.parameters, &data, &states).weighted(&states, &base.weights);
    let mut information = prior.clone();
    let mut gradient = DVector::<f64>::zeros(free);
    for segment in &segments {
        information += segment.h.view((0, 0), (free, free));
        gradient += segment.g.rows(0, free);
    }
    for k in 0..free {
        let d = information[(k, k)];
        information[(k, k)] = if d > 0.0 { d * (1.0 + RIDGE) } else { 1.0 };
    }
    let step = Cholesky::new(information)?.solve(&gradient);
    Some((cost - gradient.dot(&step)).max(0.0)).filter(|gain| gain.is_finite())
}

/// Relative increase of the diagonal of the information matrix, so that its factorisation exists.
const RIDGE: f64 = 1e-12;
