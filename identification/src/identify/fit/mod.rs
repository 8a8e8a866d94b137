//! Output-error method: the model is simulated along a log and compared with it, with given or with fitted parameters.
//!
//! Input: a [`PreparedLog`], a [`System`] and its [`Parameters`]. Output: a [`FitResult`] with residuals, noise and whiteness of each
//! channel, and for a fit the parameters with their standard errors.
//!
//! The initial state of each segment is always fitted. Weights are 1/noise². The noise is estimated first from the measured series, then
//! from the differences of successive residuals, on which a wrong model has little influence. One block of 2 s in four is held out: it is
//! simulated, but has zero weight.

pub mod build;
pub mod channel_fit;
pub mod covariance;
pub mod equation_error;
pub mod held_out;
pub mod initial_states;
pub mod measurement;
pub mod noise;
pub mod normal_equations;
pub mod outliers;
pub mod parameters;
pub mod problem;
pub mod simulate;
pub mod solve;
pub mod starting_point;
pub mod system;

pub use channel_fit::ChannelFit;
pub(crate) use channel_fit::differencing_rows;
use channel_fit::{MAX_NOISE_CHI2_PER_N, compared, noise_of_residual, noise_of_series};
use covariance::{Covariance, NoiseColour};
pub use initial_states::{InitialStateKind, InitialStates, initial_state_kinds, starting_states};
use normal_equations::{MAX_UNKNOWNS, NormalEquations};
pub use parameters::{Parameter, Parameters};
pub use problem::Problem;
pub use solve::Iterate;
pub use system::{Effect, System};

use crate::recording::PreparedLog;
use crate::statistics::Extremes;

/// Reason why a comparison or a fit is impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Too many unknowns.
    #[error(
        "the model has {0} free parameters and initial states, of which {MAX_UNKNOWNS} can be fitted together: fix some with {{ value = …, fixed = true }}"
    )]
    TooManyUnknowns(usize),
    /// Too few rows for the number of unknowns.
    #[error("the log has {rows} rows for {unknowns} unknowns: record a longer log, or fix some parameters")]
    TooFewRows {
        /// Rows of the log.
        rows: usize,
        /// Free parameters and initial states.
        unknowns: usize,
    },
    /// The simulation diverges with the starting parameters.
    #[error("the simulation diverges with these parameters (output {0}): check their units and signs")]
    Diverges(&'static str),
}

/// A parameter that the log does not determine.
#[derive(Debug, Clone, PartialEq)]
pub struct Unidentifiable {
    /// The parameter.
    pub parameter: String,
    /// The parameter that compensates for it most, with the correlation of the two estimates.
    pub partner: Option<(String, f64)>,
}

/// A parameter that the fit holds at an end of its physical range.
#[derive(Debug, Clone, PartialEq)]
pub struct AtBound {
    /// The parameter.
    pub parameter: String,
    /// Distance of an unbounded estimate from the bound, in its standard errors, by the model linearised at the bound.
    pub excess_sigmas: f64,
}

/// Result of a comparison or a fit.
#[derive(Debug, Clone)]
pub struct FitResult {
    /// Parameters, as given or fitted.
    pub parameters: Parameters,
    /// Standard errors of the parameters, 0 for fixed ones and for those at a bound; all 0 after a comparison.
    pub sigmas: Vec<f64>,
    /// Covariance of the parameters; its diagonal is the square of the standard errors.
    pub covariance: nalgebra::DMatrix<f64>,
    /// Fitted initial states.
    pub initial_states: InitialStates,
    /// The channels, in the order of the prepared log.
    pub channels: Vec<ChannelFit>,
    /// Parameters that this log does not determine.
    pub unidentifiable: Vec<Unidentifiable>,
    /// Parameters held at an end of their physical range. The other standard errors are those of a fit with these parameters fixed.
    pub at_bound: Vec<AtBound>,
    /// The minimisation reached its stopping criterion.
    pub converged: bool,
    /// Steps of the minimisation.
    pub steps: usize,
    /// Weighted sum of squares over the fitted rows.
    pub chi2: f64,
    /// Of a standard error, the larger part is by the input within the rows, whose course is not known.
    pub rests_on_course: bool,
}

/// χ²/n of the worst channel up to which a fit leaves only noise: rms 4 % above it, the error of the noise estimate.
pub const MAX_CHI2_PER_N_OF_NOISE: f64 = 1.08;

impl FitResult {
    /// χ²/n of the worst channel: 1 where only noise is left.
    pub fn worst_chi2_per_n(&self) -> f64 {
        self.channels.iter().map(ChannelFit::chi2_per_n).max_or_zero()
    }

    /// No channel has more than noise left.
    pub fn leaves_noise_only(&self) -> bool {
        self.worst_chi2_per_n() <= MAX_CHI2_PER_N_OF_NOISE
    }

    /// The standard errors may be too small: the model leaves more than noise, or they rest on an assumption about the voltage within the
    /// rows.
    pub fn sigma_is_lower_bound(&self) -> bool {
        !self.leaves_noise_only() || self.rests_on_course
    }

    /// The fit holds the parameter of this name at an end of its physical range.
    pub fn is_at_bound(&self, name: &str) -> bool {
        self.at_bound.iter().any(|b| b.parameter == name)
    }
}

/// Noise estimates are final if they change by less than this fraction.
const NOISE_TOLERANCE: f64 = 0.01;
/// Greatest number of further minimisations with updated noise estimates.
const MAX_NOISE_UPDATES: usize = 3;

/// Compares the model with the log: parameters are kept, initial states are fitted.
///
/// # Errors
/// [`FitError`] if the simulation diverges, or the log is too short for the number of unknowns, or there are too many.
pub fn compare(system: &System, parameters: &Parameters, data: &PreparedLog) -> Result<FitResult, FitError> {
    let mut fixed = parameters.clone();
    for p in &mut fixed.list {
        p.fixed = true;
    }
    let mut result = fit(system, &fixed, data)?;
    result.parameters = parameters.clone();
    Ok(result)
}

/// Fits the free parameters and the initial states.
///
/// # Errors
/// [`FitError`] if the simulation diverges, or the log is too short for the number of unknowns, or there are too many.
pub fn fit(system: &System, parameters: &Parameters, data: &PreparedLog) -> Result<FitResult, FitError> {
    let kinds = initial_state_kinds(&system.rig::<f64>(parameters, data.driven), data);
    let unknowns = parameters.free().len() + kinds.len();
    if unknowns > MAX_UNKNOWNS {
        return Err(FitError::TooManyUnknowns(unknowns));
    }
    if data.len() < 2 * unknowns.max(2) {
        return Err(FitError::TooFewRows { rows: data.len(), unknowns });
    }
    let noise: Vec<f64> = (0..data.channels.len()).map(|c| noise_of_series(data, c)).collect();
    let problem = Problem { system, data, weights: &weights(&noise) };
    let start = if data.absolute_angle && !parameters.free().is_empty() {
        // The error of an angle accumulates over the log. That of its increments does not: from there the minimum is near.
        let near = fit(system, parameters, &data.clone().comparing_increments())?;
        Iterate::new(system, &near.parameters, data, &starting_states(&kinds, data, &near.parameters, system))
    } else {
        starting_point::starting_iterate(problem, parameters, &kinds)
    };
    fit_from(system, data, start, noise)
}

/// Fits from parameters and initial states near the solution, without a search for a starting point. `noise` is the standard
/// deviation of the noise of each channel.
///
/// # Errors
/// [`FitError`] if the simulation diverges there, or there are too many unknowns.
pub fn refit(
    system: &System,
    parameters: &Parameters,
    data: &PreparedLog,
    initial_states: &InitialStates,
    noise: &[f64],
) -> Result<FitResult, FitError> {
    let unknowns = parameters.free().len() + initial_states.kinds.len();
    if unknowns > MAX_UNKNOWNS {
        return Err(FitError::TooManyUnknowns(unknowns));
    }
    fit_from(system, data, Iterate::new(system, parameters, data, initial_states), noise.to_vec())
}

/// Fits other data of the same log, from the result of a fit.
///
/// # Errors
/// As [`refit`].
pub fn refit_from(system: &System, data: &PreparedLog, near: &FitResult) -> Result<FitResult, FitError> {
    let noise: Vec<f64> = near.channels.iter().map(|c| c.noise).collect();
    refit(system, &near.parameters, data, &near.initial_states, &noise)
}

/// Minimises χ² from `start`, with noise estimates updated from the residuals.
fn fit_from(system: &System, data: &PreparedLog, start: Iterate, mut noise: Vec<f64>) -> Result<FitResult, FitError> {
    for (residual, channel) in start.linearization.residuals.iter().zip(&data.channels) {
        if residual.iter().all(|r| !r.is_finite()) {
            return Err(FitError::Diverges(channel.channel.column()));
        }
    }
    // With a wrong model, χ² per value exceeds 1. The standard errors are then larger, and the smallest relevant decrease of χ² grows with
    // χ² per value.
    let values = (data.len() * data.channels.len()) as f64;
    let tolerance = |cost: f64| solve::MIN_CHI2_DECREASE * (cost / values).max(1.0);
    let mut iterate = solve::minimize(Problem { system, data, weights: &weights(&noise) }, start, tolerance);
    for _ in 0..MAX_NOISE_UPDATES {
        let before = noise.clone();
        noise = (0..noise.len()).map(|c| noise_of_residual(data, c, &iterate.linearization.residuals[c])).collect();
        if !iterate.converged || noise.iter().zip(&before).all(|(n, b)| (n / b - 1.0).abs() < NOISE_TOLERANCE) {
            break;
        }
        iterate = solve::minimize(Problem { system, data, weights: &weights(&noise) }, iterate, tolerance);
    }
    if has_slow_misfit_only(data, &iterate, &noise) {
        iterate = starting_point::escape_local_minimum(Problem { system, data, weights: &weights(&noise) }, iterate);
    }
    Ok(evaluate(system, data, iterate, &noise))
}

/// The result at an iterate: residual statistics and covariance. `noise` is the standard deviation of the noise of each channel.
pub fn evaluate(system: &System, data: &PreparedLog, mut iterate: Iterate, noise: &[f64]) -> FitResult {
    let residuals = std::mem::take(&mut iterate.linearization.residuals);
    let channels: Vec<ChannelFit> = residuals.into_iter().enumerate().map(|(c, r)| ChannelFit::new(data, c, noise[c], r)).collect();
    let colours: Vec<NoiseColour> = channels.iter().enumerate().map(|(c, f)| f.noise_colour(data, c)).collect();
    let weights = weights(noise);
    let equations = iterate.normal_equations(&weights);
    let problem = Problem { system, data, weights: &weights };
    let all = covariance::covariance(problem, &iterate, &colours, &equations);
    let at_bound = at_bound(&iterate.parameters, &equations, &all);
    let (covariance, unidentifiable) = if at_bound.is_empty() {
        (iterate.parameters.full_covariance(&all.matrix), all.unidentifiable(&iterate.parameters))
    } else {
        let mut held = iterate.parameters.clone();
        for p in &mut held.list {
            p.fixed |= at_bound.iter().any(|b| b.parameter == p.name);
        }
        let held = Iterate::new(system, &held, data, &iterate.initial_states);
        let others = covariance::covariance(problem, &held, &colours, &held.normal_equations(&weights));
        (held.parameters.full_covariance(&others.matrix), others.unidentifiable(&held.parameters))
    };
    let sigmas = (0..covariance.nrows()).map(|k| covariance[(k, k)].max(0.0).sqrt()).collect();
    FitResult {
        sigmas,
        covariance,
        unidentifiable,
        at_bound,
        parameters: iterate.parameters,
        initial_states: iterate.initial_states,
        channels,
        converged: iterate.converged,
        steps: iterate.steps,
        chi2: equations.cost,
        rests_on_course: false,
    }
}

/// The parameters at their bounds on which the outputs depend, at an iterate with these `equations` and this `covariance`.
fn at_bound(parameters: &Parameters, equations: &NormalEquations, covariance: &Covariance) -> Vec<AtBound> {
    let at_bounds = parameters.at_bounds();
    if at_bounds.is_empty() {
        return Vec::new();
    }
    let free = parameters.free();
    let (information, descent) = equations.profiled();
    let step = information.clone().cholesky().map(|factor| factor.solve(&descent));
    let positions = free.iter().enumerate().filter(|(index, k)| at_bounds.contains(k) && information[(*index, *index)] > 0.0);
    positions
        .map(|(index, &k)| {
            let sigma = covariance.matrix[(index, index)].sqrt();
            let excess = step.as_ref().map_or(0.0, |step| step[index].abs() / sigma);
            AtBound { parameter: parameters.list[k].name.clone(), excess_sigmas: if excess.is_finite() { excess } else { 0.0 } }
        })
        .collect()
}

/// True if the model describes the log except for a slow misfit, for example after an interval of stiction that the simulation misses.
fn has_slow_misfit_only(data: &PreparedLog, iterate: &Iterate, noise: &[f64]) -> bool {
    let mut slow = false;
    for (c, residual) in iterate.linearization.residuals.iter().enumerate() {
        let compared = compared(residual);
        let mean_square = compared.iter().map(|r| r * r).sum::<f64>() / compared.len().max(1) as f64;
        if mean_square > MAX_NOISE_CHI2_PER_N * noise[c] * noise[c] {
            return false;
        }
        slow |= differencing_rows(data, c) == 0 && noise::slow_inflation(&compared, noise[c]) > 1.0;
    }
    slow
}

/// Weight of each channel, 1/noise².
pub(crate) fn weights(noise: &[f64]) -> Vec<f64> {
    noise.iter().map(|n| 1.0 / (n * n)).collect()
}
