//! A model held against a log: compared unchanged, or fitted by output error.
//!
//! In: a [`PreparedLog`] (the log as the model sees it), a [`System`] and its [`Parameters`]. Out: a [`FitResult`] with residuals, noise and whiteness
//! of every channel, and for a fit the parameters with their standard errors.
//!
//! The initial state of every segment is fitted, always. Weights are 1/noise², where the noise is the tool's own estimate: first from
//! the measured series, then from the residuals' fine structure, which a wrong model hardly touches. Every fourth block of 2 s is held
//! out: the simulation runs through it, only its weights are zero.

pub mod build;
pub mod covariance;
pub mod equation_error;
pub mod measurement;
pub mod noise;
pub mod normal_equations;
pub mod parameters;
pub mod prepare;
pub mod prepared_log;
pub mod simulate;
pub mod solve;
pub mod starting_point;

use covariance::{Covariance, NoiseColour};
use normal_equations::{InitialStates, MAX_UNKNOWNS};
pub use parameters::{Parameter, Parameters};
pub use prepared_log::{ComparedChannel, PreparedLog};

use crate::model::Channel;
use crate::statistics::Extremes;
pub use simulate::{Effect, LawSource, System};
use simulate::{InitialStateKind, initial_state_kinds};

/// Why a model cannot be held against a log.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// There are more unknowns than the tool carries at once.
    #[error(
        "the model has {0} free parameters and initial states; at most {MAX_UNKNOWNS} can be fitted at once: fix some with {{ value = …, fixed = true }}"
    )]
    TooManyUnknowns(usize),
    /// There are fewer rows than unknowns.
    #[error("the log has {rows} rows to fit {unknowns} unknowns: record longer, or fix some parameters")]
    TooFewRows {
        /// Rows of the log.
        rows: usize,
        /// Free parameters and initial states.
        unknowns: usize,
    },
    /// The simulation does not stay finite at the start.
    #[error("the simulation does not stay finite at these parameters (output {0}): check their units and signs")]
    Diverges(&'static str),
}

/// One channel of a model held against a log.
#[derive(Debug, Clone)]
pub struct ChannelFit {
    /// What it shows.
    pub channel: Channel,
    /// Root mean square of the residual over the rows that were fitted (angles: of increments over 20 ms).
    pub rms: f64,
    /// The same over the held-out rows; `None` where nothing was held out.
    pub heldout_rms: Option<f64>,
    /// The tool's estimate of the channel's noise.
    pub noise: f64,
    /// 100 (1 − ‖residual‖/‖measured − mean‖).
    pub fit_percent: f64,
    /// Ljung–Box p-value of the residual.
    pub white_p: f64,
    /// Rows compared, held-out ones too.
    pub rows: usize,
    /// Measured minus modelled, per row of the log; NaN where a row is not compared.
    pub residual: Vec<f64>,
}

impl ChannelFit {
    /// Mean square of the residual over the noise's.
    pub fn chi2_per_n(&self) -> f64 {
        (self.rms / self.noise).powi(2)
    }

    /// The residual cannot be told from white noise (at one in a thousand).
    pub fn white(&self) -> bool {
        self.white_p > 1e-3
    }
}

/// A model held against a log.
#[derive(Debug, Clone)]
pub struct FitResult {
    /// The parameters: as given, or fitted.
    pub parameters: Parameters,
    /// Their standard errors, 0 where fixed; all 0 after a mere comparison.
    pub sigmas: Vec<f64>,
    /// Initial states.
    pub starts: InitialStates,
    /// The channels, in the record's order.
    pub channels: Vec<ChannelFit>,
    /// Parameters that this log does not determine, each with the one it trades against most, and their correlation.
    pub not_identifiable: Vec<(String, Option<(String, f64)>)>,
    /// The descent ended because nothing was left to gain.
    pub converged: bool,
    /// Steps of the descents.
    pub steps: usize,
    /// Weighted sum of squares over the fitted rows.
    pub chi2: f64,
}

/// Holds the model against the log as it is; only the initial states are fitted.
///
/// # Errors
/// [`FitError`], where the model cannot be simulated along this log.
pub fn compare(system: &System, parameters: &Parameters, record: &PreparedLog) -> Result<FitResult, FitError> {
    let mut fixed = parameters.clone();
    for p in &mut fixed.list {
        p.fixed = true;
    }
    let mut held = fit(system, &fixed, record)?;
    held.parameters = parameters.clone();
    Ok(held)
}

/// Fits the free parameters and the initial states.
///
/// # Errors
/// [`FitError`], where the model cannot be simulated along this log.
pub fn fit(system: &System, parameters: &Parameters, record: &PreparedLog) -> Result<FitResult, FitError> {
    let plain = system.rig::<f64>(parameters, record.driven);
    let kinds = initial_state_kinds(&plain, record);
    let unknowns = parameters.free().len() + kinds.len();
    if unknowns > MAX_UNKNOWNS {
        return Err(FitError::TooManyUnknowns(unknowns));
    }
    if record.len() < 2 * unknowns.max(2) {
        return Err(FitError::TooFewRows { rows: record.len(), unknowns });
    }
    let noise: Vec<f64> = (0..record.channels.len()).map(|c| first_noise(record, c)).collect();
    let begin = starting_point::begin(system, parameters, record, &kinds, &weights(&noise));
    settle(system, record, begin, noise)
}

/// Fits from a place that is known to be near: no search for one. `noise` is each channel's.
///
/// # Errors
/// [`FitError::Diverges`], where the model cannot be simulated there.
pub fn refit(
    system: &System,
    parameters: &Parameters,
    record: &PreparedLog,
    starts: &InitialStates,
    noise: &[f64],
) -> Result<FitResult, FitError> {
    let unknowns = parameters.free().len() + starts.kinds.len();
    if unknowns > MAX_UNKNOWNS {
        return Err(FitError::TooManyUnknowns(unknowns));
    }
    settle(system, record, solve::Iterate::new(system, parameters, record, starts), noise.to_vec())
}

/// Descends from `begin` and says how far the result can be trusted.
fn settle(system: &System, record: &PreparedLog, begin: solve::Iterate, noise: Vec<f64>) -> Result<FitResult, FitError> {
    let mut noise = noise;
    for (residual, channel) in begin.linearization.residuals.iter().zip(&record.channels) {
        if residual.iter().all(|r| !r.is_finite()) {
            return Err(FitError::Diverges(channel.channel.column()));
        }
    }
    // What a wrong model leaves widens its standard errors, too.
    let values = (record.len() * record.channels.len()) as f64;
    let nothing_left = |cost: f64| solve::MIN_CHI2_DECREASE * (cost / values).max(1.0);
    // Again with the noise of the residuals, in place of that of the measured series, until it no longer changes.
    let mut place = solve::minimize(system, record, begin, &weights(&noise), nothing_left);
    for _ in 0..3 {
        let before = noise.clone();
        noise = (0..noise.len()).map(|c| residual_noise(record, c, &place.linearization.residuals[c])).collect();
        if !place.converged || noise.iter().zip(&before).all(|(n, b)| (n / b - 1.0).abs() < 0.01) {
            break;
        }
        place = solve::minimize(system, record, place, &weights(&noise), nothing_left);
    }
    if nearly(record, &place, &noise) {
        place = starting_point::escape_local_minimum(system, record, place, &weights(&noise));
    }
    Ok(evaluate(system, record, place, &noise))
}

/// A place as it is, with how far it can be trusted; `noise` is each channel's.
pub fn evaluate(system: &System, record: &PreparedLog, mut place: solve::Iterate, noise: &[f64]) -> FitResult {
    let channels: Vec<ChannelFit> =
        std::mem::take(&mut place.linearization.residuals).into_iter().enumerate().map(|(c, r)| fitness(record, c, noise[c], r)).collect();
    let colours: Vec<NoiseColour> = channels.iter().enumerate().map(|(c, f)| colour(record, c, f)).collect();
    let linear = place.normal_equations(&weights(noise));
    let covariance = covariance::covariance(system, &place.parameters, record, &place.starts, &weights(noise), &colours, &linear);
    FitResult {
        sigmas: place.parameters.sigmas(&covariance.matrix),
        not_identifiable: not_identifiable(&place.parameters, &covariance),
        parameters: place.parameters,
        starts: place.starts,
        channels,
        converged: place.converged,
        steps: place.steps,
        chi2: linear.cost,
    }
}

/// The model describes the log but for a slow misfit: as it does where a moment of sticking is missed.
fn nearly(record: &PreparedLog, place: &solve::Iterate, noise: &[f64]) -> bool {
    let mut slow = false;
    for (c, residual) in place.linearization.residuals.iter().enumerate() {
        let compared: Vec<f64> = residual.iter().copied().filter(|r| !r.is_nan()).collect();
        let square = compared.iter().map(|r| r * r).sum::<f64>() / compared.len().max(1) as f64;
        if square > MISFIT * noise[c] * noise[c] {
            return false;
        }
        slow |= differencing_rows(record, c) == 0 && noise::slow_inflation(&compared, noise[c]) > 1.0;
    }
    slow
}

pub(crate) fn weights(noise: &[f64]) -> Vec<f64> {
    noise.iter().map(|n| 1.0 / (n * n)).collect()
}

/// Smallest noise that a channel can have, so that its weight stays finite.
fn noise_floor(record: &PreparedLog, channel: usize) -> f64 {
    let c = &record.channels[channel];
    let size = c.measured.iter().copied().max_abs();
    let quantised = c.quantum.map_or(0.0, |q| q / 12f64.sqrt());
    quantised.max(1e-9 * size).max(1e-15)
}

fn first_noise(record: &PreparedLog, channel: usize) -> f64 {
    let c = &record.channels[channel];
    let scale = if c.channel == Channel::Angle { 2f64.sqrt() } else { 1.0 };
    (noise::of_series(c.measured.iter().copied()) * scale).max(noise_floor(record, channel))
}

pub(crate) fn residual_noise(record: &PreparedLog, channel: usize, residual: &[f64]) -> f64 {
    let c = &record.channels[channel];
    let correlation = c.filter_hz.map_or(0.0, |hz| (-std::f64::consts::TAU * hz * record.dt_s).exp());
    let fine = noise::of_residuals(residual, correlation);
    let quantised = match (c.channel, c.quantum) {
        (Channel::Angle, Some(quantum)) => quantised_increments(record, channel, residual, quantum),
        _ => 0.0,
    };
    fine.max(quantised).max(noise_floor(record, channel))
}

/// What the encoder's counts alone leave of the increments along the modelled motion: less than LSB/√6 where it stands, and not white where
/// the rate beats with the rows, so that fine structure cannot tell it.
fn quantised_increments(record: &PreparedLog, channel: usize, residual: &[f64], quantum: f64) -> f64 {
    let lag = record.angle_lag();
    let (mut sum, mut n) = (0.0, 0usize);
    for rows in &record.segments {
        for first in 0..lag.min(rows.len()) {
            // Every chain of increments has its own place within the count.
            let mut path = (first as f64 + 0.5) / lag as f64;
            let mut error = path.floor() - path;
            for row in (rows.start + first + lag..rows.end).step_by(lag) {
                let Some(target) = record.target(channel, row, rows.start) else { continue };
                path += (target - residual[row]) / quantum;
                let next = path.floor() - path;
                sum += (next - error).powi(2);
                error = next;
                n += 1;
            }
        }
    }
    if n > 0 { quantum * (sum / n as f64).sqrt() } else { 0.0 }
}

/// Start values of the initial states: what the first rows show.
pub(crate) fn starting_states(kinds: &[InitialStateKind], record: &PreparedLog, parameters: &Parameters, system: &System) -> InitialStates {
    let channel = |shows: Channel| record.channels.iter().find(|c| c.channel == shows);
    let mut values = Vec::new();
    for rows in &record.segments {
        let few = rows.len().min(5);
        let mean = |y: &[f64]| y[rows.start..rows.start + few].iter().sum::<f64>() / few as f64;
        values.push(
            kinds
                .iter()
                .map(|kind| match kind {
                    InitialStateKind::Rate => match (channel(Channel::Rate), record.theta) {
                        (Some(c), _) => mean(c.measured),
                        (None, Some(theta)) => {
                            let last = (rows.start + record.angle_lag()).min(rows.end - 1);
                            let length_s = record.t_s[last] - record.t_s[rows.start];
                            if length_s > 0.0 { (theta[last] - theta[rows.start]) / length_s } else { 0.0 }
                        }
                        _ => 0.0,
                    },
                    InitialStateKind::Current => channel(Channel::Current).map_or(0.0, |c| c.measured[rows.start]),
                    InitialStateKind::Twist | InitialStateKind::Bristle | InitialStateKind::Heat => 0.0,
                })
                .collect::<Vec<f64>>(),
        );
    }
    let value = |stem: &str| parameters.list.iter().find(|p| p.name == stem).map_or(1.0, |p| p.value.abs());
    let resistance = system.resistance.map_or(1.0, |k| parameters.list[k].value);
    let prior_sigma = kinds
        .iter()
        .map(|kind| match kind {
            InitialStateKind::Rate => 1e4,
            InitialStateKind::Current => 10.0 / resistance,
            InitialStateKind::Twist => 0.1 + value("gap_rad"),
            InitialStateKind::Bristle => (value("coulomb_N_m") / value("presliding_stiffness_N_m_rad")).max(1e-4),
            InitialStateKind::Heat => 30.0,
        })
        .collect();
    InitialStates { kinds: kinds.to_vec(), prior: values.clone(), values, prior_sigma }
}

/// Lags of the test for whiteness.
const WHITE_LAGS: usize = 20;

fn fitness(record: &PreparedLog, channel: usize, noise: f64, residual: Vec<f64>) -> ChannelFit {
    let mean_square = |held: bool| {
        let (sum, n) = residual
            .iter()
            .enumerate()
            .filter(|(row, r)| !r.is_nan() && record.held_out(*row) == held)
            .fold((0.0, 0usize), |(s, n), (_, r)| (s + r * r, n + 1));
        (n > 0).then(|| (sum / n as f64).sqrt())
    };
    let mut targets = Vec::with_capacity(residual.len());
    for rows in &record.segments {
        targets.extend(rows.clone().filter_map(|row| record.target(channel, row, rows.start)));
    }
    let mean = targets.iter().sum::<f64>() / targets.len().max(1) as f64;
    let spread = (targets.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / targets.len().max(1) as f64).sqrt();
    let compared: Vec<f64> = residual.iter().copied().filter(|r| !r.is_nan()).collect();
    let whole = (compared.iter().map(|r| r * r).sum::<f64>() / compared.len().max(1) as f64).sqrt();
    let shown = record.channels[channel].channel;
    // Increments over m rows share a reading with those m rows before and after.
    let stride = if shown == Channel::Angle { 2 * record.angle_lag() } else { differencing_rows(record, channel).max(1) * 2 - 1 };
    let (_, white_p) = noise::ljung_box(&compared, stride, WHITE_LAGS);
    ChannelFit {
        channel: shown,
        rms: mean_square(false).unwrap_or(whole),
        heldout_rms: mean_square(true),
        noise,
        fit_percent: if spread > 0.0 { 100.0 * (1.0 - whole / spread) } else { 0.0 },
        white_p,
        rows: compared.len(),
        residual,
    }
}

/// Rows over which white noise was differenced in this channel; 0: it was not.
pub(crate) fn differencing_rows(record: &PreparedLog, channel: usize) -> usize {
    let c = &record.channels[channel];
    match c.channel {
        Channel::Angle => record.angle_lag(),
        Channel::Rate if record.rate_from_encoder => {
            c.mean_before_s.map_or(0, |window_s| ((window_s / record.dt_s).round() as usize).max(1))
        }
        _ => 0,
    }
}

/// χ²/n from which on what is left is no longer the noise, and its correlation is what it shows.
const MISFIT: f64 = 1.5;

fn colour(record: &PreparedLog, channel: usize, fitness: &ChannelFit) -> NoiseColour {
    let misfit = fitness.chi2_per_n().max(1.0);
    let compared: Vec<f64> = fitness.residual.iter().copied().filter(|r| !r.is_nan()).collect();
    if misfit >= MISFIT {
        return NoiseColour { differenced: 0, inflation: misfit * noise::inflation(&compared) };
    }
    let differenced = differencing_rows(record, channel);
    let seen = if differenced > 0 { 1.0 } else { noise::inflation(&compared).max(noise::slow_inflation(&compared, fitness.noise)) };
    NoiseColour { differenced, inflation: misfit * seen }
}

/// Share of a direction without information from which on a parameter belongs to it.
const BELONGS: f64 = 0.2;

fn not_identifiable(parameters: &Parameters, covariance: &Covariance) -> Vec<(String, Option<(String, f64)>)> {
    let free = parameters.free();
    let name = |lane: usize| parameters.list[free[lane]].name.clone();
    let mut list = Vec::new();
    for direction in &covariance.unseen {
        let members: Vec<usize> = (0..free.len()).filter(|&k| direction[k].abs() > BELONGS).collect();
        for &lane in &members {
            let partner = members.iter().copied().find(|&other| other != lane);
            if !list.iter().any(|(n, _)| *n == name(lane)) {
                list.push((name(lane), partner.map(|other| (name(other), -(direction[lane] * direction[other]).signum()))));
            }
        }
    }
    for lane in 0..free.len() {
        let p = &parameters.list[free[lane]];
        let sigma = covariance.matrix[(lane, lane)].sqrt();
        let relative = match p.kind {
            drive_model::ParameterKind::Positive | drive_model::ParameterKind::Fraction => sigma,
            _ => 0.0,
        };
        if relative > 1.0 && !list.iter().any(|(n, _)| *n == p.name) {
            let partner = (0..free.len())
                .filter(|&other| other != lane)
                .max_by(|&a, &b| covariance.correlation[(lane, a)].abs().total_cmp(&covariance.correlation[(lane, b)].abs()));
            list.push((p.name.clone(), partner.map(|other| (name(other), covariance.correlation[(lane, other)]))));
        }
    }
    list
}
