//! The evidence for an effect beside what the log leaves open of the voltage within its rows.
//!
//! A gain counts the noise alone. Where the log has only means of the voltage, or means and moments, the estimates also scatter by the course within the rows,
//! and a course that differs from the assumed one has a gain too.

use drive_model::ParameterKind;

use super::candidate::FittedCandidate;
use super::criteria::MisfitClass;
use super::fitted_model::FittedModel;
use crate::identify::fit::solve::Iterate;
use crate::identify::predict::by_course;
use crate::identify::recording_conventions::{Convention, apply};
use crate::statistics::Extremes;

/// Part of the variance of the effect's amplitude that is by the noise, for the amplitude of which it is largest; 1 where the log leaves nothing open. The gain of an effect of one amplitude is the
/// square of its estimate over its variance, so that this part of the gain remains beside the variance by the course.
pub fn part_by_noise(base: &FittedModel, candidate: &FittedCandidate) -> f64 {
    let mut data = base.data_for(&candidate.trial).into_owned();
    if data.voltage_course.is_none() && base.misfit() <= MisfitClass::Invisible {
        // Taken as constant within the rows, which no note states: beside noise alone, an effect may be what the voltage does there.
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
