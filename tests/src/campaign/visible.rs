//! Whether a hidden effect is visible in a log: a fact of the generator, whatever `explain` answers.
//!
//! An effect is visible if the true model is expected to have a 2 Δ ln L of at least [`MIN_GAIN`] against the best model without the
//! effect, all nuisances fitted again. The stand is simulated once more with the same experiment and without noise; both models are fitted
//! to that log, with the noise that the generator adds as weights: the rate's and the current's white noise, and the counts of the angle,
//! q/√12. The fits start at the true values, and at those that fit the increments of the angle best; the lower χ² counts. The difference of
//! the two χ² is the expected gain (the noncentrality of the likelihood ratio: Wilks; Rao, Linear Statistical Inference, 1973, 6e). Where
//! even the true model cannot follow the whole log (impacts of a play are chaotic), rows in windows of 1 s are compared.

use identification::recording;
use std::ops::Range;

use identification::identify::fit::{self, Iterate, Parameters, Problem, initial_state_kinds, solve, starting_states};
use identification::log::Log;
use identification::model::{Channel, Model};
use identification::recording::PreparedLog;
use stand_firmware::board::Hardware;

use super::case::Case;
use crate::dirt::Dirt;
use crate::draw::Drawn;

/// Least expected 2 Δ ln L of a visible effect.
pub const MIN_GAIN: f64 = 50.0;
/// χ² per value by which the true model may leave more than it should where it follows the whole log.
const MAX_EXCESS_CHI2_PER_VALUE: f64 = 0.5;
/// Length of a window where it does not, s.
const WINDOW_S: f64 = 1.0;
/// Seconds of a stand at rest from which the noise of a row is taken.
const REST_S: f64 = 4.0;

/// Expected gain of each hidden effect of a case; none where the log has an imperfection.
pub fn expected_gains(case: &Case) -> Vec<(String, f64)> {
    let Some(truth) = case.truth.as_ref().filter(|_| case.dirt == Dirt::Clean) else { return Vec::new() };
    let hidden = case.hidden.iter().map(|effect| (effect, without(truth, effect)));
    let Some(drawn) = &case.drawn else {
        // Of another simulator: the log as it is, with the noise that the fit estimates.
        let noise = estimated_noise(case, truth);
        let run = Run { log: &case.log, noise, rate_from_encoder: case.rate_from_encoder, true_chi2_per_value: 1.0 };
        return hidden.map(|(effect, less)| (effect.clone(), gain(&run, truth, &less))).collect();
    };
    let noise = row_noise(drawn);
    let clean = drawn.without_noise().log();
    hidden
        .map(|(effect, less)| {
            (effect.clone(), gain(&Run { log: &clean, noise, rate_from_encoder: false, true_chi2_per_value: 0.0 }, truth, &less))
        })
        .collect()
}

/// The true model without one of its effects.
fn without(truth: &Model, effect: &str) -> Model {
    let mut less = truth.clone();
    less.remove(effect).unwrap_or_else(|e| panic!("{effect}: {e}"));
    less
}

/// A log to which models are fitted.
struct Run<'a> {
    log: &'a Log,
    /// Standard deviation of the noise of rate, current and angle, in their units.
    noise: [f64; 3],
    rate_from_encoder: bool,
    /// χ² per value of the true model, if it follows the whole log: 0 without noise, 1 with it.
    true_chi2_per_value: f64,
}

/// Noise of the rows of rate, current and angle.
fn row_noise(drawn: &Drawn) -> [f64; 3] {
    let rest = drawn.at_rest(REST_S).log();
    let of = |channel: Channel| {
        let Some(values) = rest.column(channel.column()) else { return f64::INFINITY };
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
    };
    [of(Channel::Rate), of(Channel::Current), Hardware::default().rad_per_count() / 12f64.sqrt()]
}

fn estimated_noise(case: &Case, truth: &Model) -> [f64; 3] {
    let (mut data, _) = recording::prepare(&case.log, truth, false).unwrap_or_else(|e| panic!("{}: {e}", case.id));
    data.rate_from_encoder |= case.rate_from_encoder;
    let (system, parameters) = fit::build::system(truth, data.temp_C.is_some());
    let fitted = fit::fit(&system, &parameters, &data).unwrap_or_else(|e| panic!("{}: {e}", case.id));
    let of = |channel: Channel| fitted.channels.iter().find(|c| c.channel == channel).map_or(f64::INFINITY, |c| c.noise);
    // An increment of the angle has the noise of two readings.
    [of(Channel::Rate), of(Channel::Current), of(Channel::Angle) / 2f64.sqrt()]
}

/// χ² of the best model without the effect minus that of the best true one.
fn gain(run: &Run, truth: &Model, less: &Model) -> f64 {
    let (with, values) = least_chi2(run, truth, None);
    if with / values < run.true_chi2_per_value + MAX_EXCESS_CHI2_PER_VALUE {
        return least_chi2(run, less, None).0 - with;
    }
    least_chi2(run, less, Some(WINDOW_S)).0 - least_chi2(run, truth, Some(WINDOW_S)).0
}

/// The least χ² of a model, from its values, and the number of compared values.
fn least_chi2(run: &Run, model: &Model, window_s: Option<f64>) -> (f64, f64) {
    let (mut data, _) = recording::prepare(run.log, model, false).unwrap_or_else(|e| panic!("{e}"));
    data.rate_from_encoder |= run.rate_from_encoder;
    data.absolute_angle = true;
    if let Some(window_s) = window_s {
        data.segments = windows(&data, window_s);
    }
    let weight = |channel: Channel| match channel {
        Channel::Rate => run.noise[0].powi(-2),
        Channel::Current => run.noise[1].powi(-2),
        Channel::Angle => run.noise[2].powi(-2),
        Channel::Voltage | Channel::Torque => 0.0,
    };
    let weights: Vec<f64> = data.channels.iter().map(|c| weight(c.channel)).collect();
    let (system, parameters) = fit::build::system(model, data.temp_C.is_some());
    let kinds = initial_state_kinds(&system.rig::<f64>(&parameters, data.driven), &data);
    let least_from = |data: &PreparedLog, parameters: &Parameters| {
        let begin = Iterate::new(&system, parameters, data, &starting_states(&kinds, data, parameters, &system));
        solve::minimize(Problem { system: &system, data, weights: &weights }, begin, |_| solve::MIN_CHI2_DECREASE)
    };
    // The error of an angle accumulates over the log, and χ² has several minima; that of its increments does not.
    let by_increments = least_from(&data.clone().comparing_increments(), &parameters);
    let from_both = [&parameters, &by_increments.parameters].map(|from| least_from(&data, from).normal_equations(&weights).cost);
    (from_both.into_iter().fold(f64::INFINITY, f64::min), (data.len() * data.channels.len()) as f64)
}

fn windows(data: &PreparedLog, window_s: f64) -> Vec<Range<usize>> {
    let rows = ((window_s / data.dt_s) as usize).max(1);
    let of = |segment: &Range<usize>| segment.clone().step_by(rows).map(|from| from..(from + rows).min(segment.end)).collect::<Vec<_>>();
    data.segments.iter().flat_map(of).filter(|window| window.len() == rows).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A large cogging is visible by far, one of a thousandth of it is not; the gain grows with the square of the amplitude.
    #[test]
    fn expected_gain_is_that_of_the_amplitude() {
        let mut case = Case::by_name("own/cogging/voltage/multisine/3", None).expect("a case");
        let gain = |case: &Case| expected_gains(case)[0].1;
        let large = gain(&case);
        let mut drawn = case.drawn.clone().expect("one of our own");
        let effect = drawn.stand.effects.get_mut("cogging").expect("the effect");
        let amplitude = effect.get_mut("cogging_N_m").expect("its amplitude");
        *amplitude *= 1e-6;
        case.truth = Some(drawn.true_model());
        case.drawn = Some(drawn);
        let small = gain(&case);
        assert!(large > 1e4 && small < MIN_GAIN, "{large} {small}");
    }

    /// Without a measured supply a droop is a larger resistance. From the true values alone the fit without it ends at a gain of 2.5e6.
    #[test]
    fn droop_of_a_supply_that_is_not_measured_is_not_visible() {
        let case = Case::by_name("own/supply-droop/voltage/multi-step/20049", None).expect("a case");
        let gain = expected_gains(&case)[0].1;
        assert!(gain < MIN_GAIN, "{gain}");
    }
}
