//! The part of an effect's gain that the unknown course of the voltage within the rows does not explain.
//!
//! In: a fitted effect. Out: the part of its gain that counts. The gain takes the noise as the only error. Where the log has means of the voltage, or means and first
//! moments, the course within the rows is open, and the estimates scatter by it as well.

use drive_model::ParameterKind;

use super::candidate::FittedCandidate;
use super::fitted_model::FittedModel;
use crate::identify::fit::solve::Iterate;
use crate::identify::predict::by_course;
use crate::identify::recording_conventions::{Convention, apply};
use crate::statistics::Extremes;

/// σ²/(σ² + σ_course²) of the effect's amplitude: its variance by the noise over that by noise and course. The gain of an effect is the square of its amplitude over the variance, so
/// that this part of it counts. Of several amplitudes the largest part; 1 where the log leaves nothing open.
pub fn part_by_noise(base: &FittedModel, candidate: &FittedCandidate) -> f64 {
    let mut data = base.data_for(&candidate.trial).into_owned();
    if data.voltage_course.is_none() {
        // The voltage was taken as constant within the rows. A small effect may be what it does there.
        apply(Convention::InputMoves, base.context.log, &mut data);
    }
    let iterate = Iterate::new(&candidate.system, &candidate.parameters, &data, &candidate.states);
    let Some(by_course) = by_course(&candidate.system, &data, &iterate, &base.weights) else { return 1.0 };
    let by_course = candidate.parameters.full_covariance(&by_course);
    let free: Vec<usize> = candidate.own.clone().filter(|&k| !candidate.parameters.list[k].fixed && candidate.sigmas[k] > 0.0).collect();
    let is_amplitude = |k: &usize| matches!(candidate.parameters.list[*k].kind, ParameterKind::NonNegative | ParameterKind::Signed);
    let amplitudes: Vec<usize> = free.iter().copied().filter(is_amplitude).collect();
    let judged = if amplitudes.is_empty() { free } else { amplitudes };
    if judged.is_empty() {
        return 1.0;
    }
    let part = |k: usize| {
        let (noise, course) = (candidate.sigmas[k].powi(2), by_course[(k, k)].max(0.0));
        noise / (noise + course)
    };
    judged.into_iter().map(part).max_or_zero()
}
