//! Parameters, random torque and noise of largest likelihood.
//!
//! From the parameters of a free run, which are the best where there is no random torque: density of the random torque, noise and parameters
//! follow in turn, until the likelihood does not grow.

use std::sync::Arc;

use super::gain::stationary_filter;
use super::row_model::row_model;
use crate::identify::fit::normal_equations::MAX_UNKNOWNS;
use crate::identify::fit::simulate::run;
use crate::identify::fit::{self, InitialStates, Iterate, Parameters, Problem, System, initial_state_kinds, solve, starting_states};
use crate::model::Channel;
use crate::recording::PreparedLog;
use crate::recording::predictor::Predictor;

/// What is random in a log.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseModel {
    /// Density of the random torque, (N m)²/Hz two-sided.
    pub torque_density: f64,
    /// Standard deviation of the white noise of each channel, in its unit.
    pub white: Vec<f64>,
}

/// A model in prediction-error form: parameters, what is random, and the likelihood.
#[derive(Debug, Clone)]
pub struct PredictionFit {
    /// Parameters.
    pub parameters: Parameters,
    /// Initial states of each segment.
    pub initial_states: InitialStates,
    /// Random torque and noise.
    pub noise: NoiseModel,
    /// −2 ln of the likelihood of the innovations of the fitted rows, up to a constant of the log.
    pub minus_2_ln_likelihood: f64,
    /// Mean square of each channel's innovations in the fitted rows.
    pub mean_squares: Vec<f64>,
    /// The filter.
    pub predictor: Arc<Predictor>,
}

/// Decades from the largest density to the smallest, at which the rows since the start count as much as the last ones.
const DECADES: i32 = 12;
/// Predicted decrease of −2 ln L below which the parameters are at their best.
const MIN_DECREASE: f64 = 0.05;
/// Part of a variance to which it may fall at once.
const MIN_WHITE_FALL: f64 = 0.01;

/// Rounds of noise and parameters from a near start at most, and steps of the parameters in each.
const NEAR_ROUNDS: usize = 12;
const NEAR_STEPS: usize = 40;

/// A system and the rows that it predicts.
pub struct Prediction<'s, 'a> {
    /// The system.
    pub system: &'s System,
    /// The data without a filter.
    pub data: PreparedLog<'a>,
}

impl<'s, 'a> Prediction<'s, 'a> {
    /// The system on the data.
    pub fn new(system: &'s System, data: &PreparedLog<'a>) -> Self {
        Prediction { system, data: data.following(None) }
    }

    /// White noise of each channel, from its series.
    pub fn first_noise(&self) -> Vec<f64> {
        let noise = self.data.channels.iter().enumerate().map(|(c, channel)| match (channel.channel, channel.quantum) {
            (Channel::Angle, Some(_)) => self.least_noise(c),
            _ => fit::noise::of_series(channel.measured.iter().copied()).max(self.least_noise(c)),
        });
        noise.collect()
    }

    /// Density that moves the rate from row to row as much as it moves in the log; `None` where neither rate nor angle moves.
    pub fn largest_density(&self, parameters: &Parameters) -> Option<f64> {
        let model = row_model(self.system, parameters, &self.data)?;
        let rate = self.data.channels.iter().find(|c| c.channel == Channel::Rate);
        let (squares, rows): (f64, usize) = match (rate, self.data.theta) {
            (Some(rate), _) => (rate.measured.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum(), rate.measured.len()),
            (None, Some(theta)) => {
                let dt2 = self.data.dt_s * self.data.dt_s;
                (theta.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).powi(2) / dt2).sum(), theta.len())
            }
            _ => return None,
        };
        Some(squares / rows.max(1) as f64 / model.by_torque[(0, 0)]).filter(|d| *d > 0.0 && d.is_finite())
    }

    /// The smallest density that is tried.
    pub fn smallest_density(&self, parameters: &Parameters) -> Option<f64> {
        Some(self.largest_density(parameters)? * 10f64.powi(-DECADES))
    }

    /// The data followed by a filter.
    pub fn following(&self, predictor: &Arc<Predictor>) -> PreparedLog<'a> {
        self.data.following(Some(Arc::clone(predictor)))
    }

    /// The fit of largest likelihood from the parameters of a free run: from the smallest density, at which they are near the best, upwards
    /// to the most likely one, with all that is random, and the parameters to the end; and whether it has converged.
    pub fn fit_near(&self, parameters: &Parameters) -> Option<(PredictionFit, bool)> {
        let floor = self.smallest_density(parameters)?;
        let noise = NoiseModel { torque_density: floor, white: self.first_noise() };
        let mut best = self.descend(self.at(parameters, None, noise)?, NEAR_STEPS)?;
        for _ in 0..NEAR_ROUNDS {
            let before = best.minus_2_ln_likelihood;
            self.match_density(&mut best, floor);
            self.match_white_noise(&mut best);
            best = self.descend(best, NEAR_STEPS)?;
            if self.data.budget.is_exhausted() {
                break;
            }
            if best.minus_2_ln_likelihood > before - MIN_DECREASE {
                return Some((best, true));
            }
        }
        Some((best, false))
    }

    /// The most likely density at the parameters and the white noise of a point, from its density, not below `floor`.
    fn match_density(&self, best: &mut PredictionFit, floor: f64) {
        for decades in [1.0_f64, 0.5, 0.25] {
            for sign in [1.0, -1.0] {
                let mut has_moved = false;
                loop {
                    let density = (best.noise.torque_density * 10f64.powf(sign * decades)).max(floor);
                    if density == best.noise.torque_density {
                        break;
                    }
                    let next = self.at_density(best, density);
                    let Some(next) = next.filter(|next| next.minus_2_ln_likelihood < best.minus_2_ln_likelihood) else { break };
                    *best = next;
                    has_moved = true;
                }
                if has_moved {
                    break;
                }
            }
        }
    }

    /// White noise with which the variance of each channel's innovations is that of the filter, where the likelihood rises by it.
    fn match_white_noise(&self, best: &mut PredictionFit) {
        let mut noise = best.noise.clone();
        for (c, white) in noise.white.iter_mut().enumerate() {
            // The noise of counts is known.
            let counts = self.data.channels[c].channel == Channel::Angle && self.data.channels[c].quantum.is_some();
            let least = self.least_noise(c);
            if !counts && best.mean_squares[c].is_finite() {
                let variance = white.powi(2) + best.mean_squares[c] - best.predictor.innovation_variances[c];
                *white = variance.max(MIN_WHITE_FALL * white.powi(2)).sqrt().max(least);
            }
        }
        if let Some(next) = self.at(&best.parameters, Some(best.initial_states.clone()), noise)
            && next.minus_2_ln_likelihood < best.minus_2_ln_likelihood
        {
            *best = next;
        }
    }

    /// Least noise of a channel, so that its weight is finite: its counts, or the rounding of its numbers.
    fn least_noise(&self, channel: usize) -> f64 {
        let channel = &self.data.channels[channel];
        let size = channel.measured.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        channel.quantum.map_or(0.0, |q| q / 12f64.sqrt()).max(1e-9 * size).max(1e-15)
    }

    /// The prediction at these parameters, with the filter for this noise; initial states from the first rows where none are given.
    pub fn at(&self, parameters: &Parameters, states: Option<InitialStates>, noise: NoiseModel) -> Option<PredictionFit> {
        let model = row_model(self.system, parameters, &self.data)?;
        let predictor = stationary_filter(&model, noise.torque_density, &noise.white).map(Arc::new)?;
        let states = states.unwrap_or_else(|| {
            let data = self.following(&predictor);
            let kinds = initial_state_kinds(&self.system.rig::<f64>(parameters, data.driven), &data);
            starting_states(&kinds, &data, parameters, self.system)
        });
        if parameters.free().len() + states.kinds.len() > MAX_UNKNOWNS {
            return None;
        }
        let (minus_2_ln_likelihood, mean_squares) = self.innovations(parameters, &states, &predictor);
        Some(PredictionFit {
            parameters: parameters.clone(),
            initial_states: states,
            noise,
            minus_2_ln_likelihood,
            mean_squares,
            predictor,
        })
    }

    fn at_density(&self, point: &PredictionFit, torque_density: f64) -> Option<PredictionFit> {
        let noise = NoiseModel { torque_density, white: point.noise.white.clone() };
        self.at(&point.parameters, Some(point.initial_states.clone()), noise)
    }

    /// Steps of the parameters with the filter of the point.
    pub fn descend(&self, point: PredictionFit, steps: usize) -> Option<PredictionFit> {
        let data = self.following(&point.predictor);
        let weights: Vec<f64> = point.predictor.innovation_variances.iter().map(|s| 1.0 / s).collect();
        let begin = Iterate::new(self.system, &point.parameters, &data, &point.initial_states);
        let end = solve::minimize_within(Problem { system: self.system, data: &data, weights: &weights }, begin, steps, |_| MIN_DECREASE);
        let minus_2_ln_likelihood = end.normal_equations(&weights).cost + self.log_determinant(&point.predictor);
        let mean_squares = end.linearization.residuals.iter().map(|residual| self.mean_square(residual)).collect();
        let end =
            PredictionFit { parameters: end.parameters, initial_states: end.initial_states, minus_2_ln_likelihood, mean_squares, ..point };
        minus_2_ln_likelihood.is_finite().then_some(end)
    }

    /// Mean square of a channel's innovations in the fitted rows.
    fn mean_square(&self, innovations: &[f64]) -> f64 {
        let fitted = innovations.iter().enumerate().filter(|(row, e)| e.is_finite() && !self.data.held_out(*row));
        let (sum, rows) = fitted.fold((0.0, 0_usize), |(sum, rows), (_, e)| (sum + e * e, rows + 1));
        sum / rows as f64
    }

    /// Σ n ln s over the channels, of the fitted rows.
    fn log_determinant(&self, predictor: &Predictor) -> f64 {
        let compared = |c: usize| {
            let outlier = |row: usize| self.data.channels[c].outliers.as_ref().is_some_and(|o| o[row]);
            let rows = self.data.segments.iter().flat_map(Clone::clone);
            rows.filter(|row| !self.data.held_out(*row) && !outlier(*row)).count() as f64
        };
        predictor.innovation_variances.iter().enumerate().map(|(c, s)| compared(c) * s.ln()).sum()
    }

    /// −2 ln of the likelihood of the innovations, with the prior of the initial states; and the mean square of each channel's innovations.
    fn innovations(&self, parameters: &Parameters, states: &InitialStates, predictor: &Arc<Predictor>) -> (f64, Vec<f64>) {
        let data = self.following(predictor);
        let rig = self.system.rig::<f64>(parameters, data.driven);
        let mut squares = vec![(0.0, 0usize); data.channels.len()];
        let mut sum = self.log_determinant(predictor);
        for segment in 0..data.segments.len() {
            let begin = data.segments[segment].start;
            run(&rig, &data, segment, (&states.kinds, &states.values[segment]), 0, &mut |c, row, value: &f64| {
                if let Some(target) = data.target(c, row, begin).filter(|_| !data.held_out(row)) {
                    squares[c].0 += (target - value).powi(2);
                    squares[c].1 += 1;
                }
                true
            });
            let prior = states.values[segment].iter().zip(&states.prior[segment]).zip(&states.prior_sigma);
            sum += prior.map(|((v, p), s)| ((v - p) / s).powi(2)).sum::<f64>();
        }
        sum += squares.iter().zip(&predictor.innovation_variances).map(|((square, _), s)| square / s).sum::<f64>();
        let mean_squares = squares.iter().map(|(square, n)| square / *n as f64).collect();
        (if sum.is_finite() { sum } else { f64::INFINITY }, mean_squares)
    }
}
