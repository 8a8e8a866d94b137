//! Final parameters and standard errors of a fit; by prediction errors, where the input was made from a compared channel.
//!
//! In a loop the noise of a reading returns in the input. An angle is compared in a free run by its increments, and the noise at the begin
//! of an increment then correlates with the input within it: the estimates are biased (Ljung, System Identification, 1999, section 13.4).
//! The innovations of a filter depend on no earlier noise; their estimates are consistent. Where a free run leaves more than noise, its
//! parameters stay: the filter would take what the model lacks for a random torque.

use nalgebra::DMatrix;

use super::course::{add_course, course_covariance, with_course_of_free_run};
use super::fit::Prediction;
use crate::identify::fit::covariance::clustered;
use crate::identify::fit::{self, FitResult, Iterate, Problem, System};
use crate::log::Log;
use crate::model::{Channel, Input};
use crate::recording::PreparedLog;

/// The fit with its final parameters and standard errors: those of the prediction errors where the input may be from a loop, otherwise
/// those of the free run; both with what the log leaves open of the input within its rows. Also whether they are of the prediction errors.
pub fn refined(system: &System, log: &Log, data: &PreparedLog, free_run: FitResult) -> (FitResult, bool) {
    let in_loop = may_be_in_loop(log, data) && free_run.converged && !data.budget.is_exhausted();
    if in_loop
        && free_run.leaves_noise_only()
        && let Some(found) = by_prediction_errors(system, log, data, &free_run)
    {
        return (found, true);
    }
    let mut fit = free_run;
    if in_loop {
        let weights = fit::weights(&fit.channels.iter().map(|c| c.noise).collect::<Vec<_>>());
        let iterate = Iterate::new(system, &fit.parameters, data, &fit.initial_states);
        widen(&mut fit, covariance_by_blocks(Problem { system, data, weights: &weights }, &iterate));
    }
    (with_course_of_free_run(system, log, data, fit), false)
}

/// The increments of the angle are compared, and its noise may have returned in the input.
fn may_be_in_loop(log: &Log, data: &PreparedLog) -> bool {
    let increments = !data.angle_is_absolute() && data.channels.iter().any(|c| c.channel == Channel::Angle);
    increments && !matches!(data.driven, Input::Motion | Input::Setpoint) && !log.notes().is_open_loop()
}

/// The parameters of largest likelihood of the innovations, with their standard errors, and the free run with these parameters. `None`
/// where the model has no prediction-error form, or the free run leaves more than noise: the filter then follows an error of the
/// simulation.
fn by_prediction_errors(system: &System, log: &Log, data: &PreparedLog, free_run: &FitResult) -> Option<FitResult> {
    let prediction = Prediction::new(system, data);
    let (found, converged) = prediction.fit_near(&free_run.parameters)?;
    let following = prediction.following(&found.predictor);
    let noise: Vec<f64> = found.predictor.innovation_variances.iter().map(|s| s.sqrt()).collect();
    let iterate = Iterate::new(system, &found.parameters, &following, &found.initial_states);
    let weights = fit::weights(&noise);
    let by_blocks = covariance_by_blocks(Problem { system, data: &following, weights: &weights }, &iterate);
    let by_course = course_covariance(system, log, &following, &iterate, &weights);
    let mut innovations = fit::evaluate(system, &following, iterate, &noise);
    widen(&mut innovations, by_blocks);
    if let Some(by_course) = by_course {
        add_course(&mut innovations, &by_course);
    }
    let mut fixed = found.parameters.clone();
    fixed.list.iter_mut().for_each(|p| p.fixed = true);
    let noise: Vec<f64> = free_run.channels.iter().map(|c| c.noise).collect();
    let run = fit::refit(system, &fixed, data, &free_run.initial_states, &noise).ok()?;
    run.leaves_noise_only().then_some(FitResult {
        channels: run.channels,
        initial_states: run.initial_states,
        chi2: run.chi2,
        steps: free_run.steps,
        converged: free_run.converged && converged,
        ..innovations
    })
}

/// Covariance of the parameters from blocks of rows, within which the noise may have any correlation. In a loop it returns in the input,
/// and the counting error of an encoder at rest or at a steady rate is constant or periodic: neither is the white noise of a free run or of
/// a filter. `None` where there are too few blocks.
fn covariance_by_blocks(problem: Problem, iterate: &Iterate) -> Option<DMatrix<f64>> {
    let by_blocks = clustered(problem, iterate, &iterate.normal_equations(problem.weights))?;
    Some(iterate.parameters.full_covariance(&by_blocks.matrix))
}

/// Widens the standard errors to those of another covariance, where these are larger; the correlations stay.
fn widen(fit: &mut FitResult, other: Option<DMatrix<f64>>) {
    let Some(other) = other else { return };
    let factors: Vec<f64> = (0..fit.sigmas.len())
        .map(|k| if fit.sigmas[k] > 0.0 { (other[(k, k)].max(0.0).sqrt() / fit.sigmas[k]).max(1.0) } else { 1.0 })
        .collect();
    fit.sigmas.iter_mut().zip(&factors).for_each(|(sigma, factor)| *sigma *= factor);
    for i in 0..factors.len() {
        for j in 0..factors.len() {
            fit.covariance[(i, j)] *= factors[i] * factors[j];
        }
    }
}
