//! The part of an effect's gain that the unknown course of the voltage within the rows does not explain.
//!
//! In: a fitted effect. Out: its gain with the course as a second error. The gain takes the noise as the only one. Where the log has means of the voltage, or means and first
//! moments, the course within the rows is open, and the estimates scatter by it as well.

use drive_model::ParameterKind;

use super::candidate::FittedCandidate;
use super::fitted_model::FittedModel;
use crate::identify::fit::solve::Iterate;
use crate::identify::predict::{by_course, with_course};
use crate::statistics::Extremes;

/// The gain of an effect in so many independent samples, with the unknown course of the voltage as an error beside the noise.
pub fn gain_beside_course(base: &FittedModel, candidate: &FittedCandidate, samples: f64) -> f64 {
    gain_of_part(candidate.gain, part_by_noise(base, candidate), samples)
}

/// The gain of an amplitude a is n ln(1 + a²/(n σ²)), where σ is its standard deviation by a noise whose level is estimated too: that gain with σ²/`part` in the place of σ².
fn gain_of_part(gain: f64, part: f64, samples: f64) -> f64 {
    samples * (part * (gain / samples).exp_m1()).ln_1p()
}

/// σ²/(σ² + σ_course²) of the effect's amplitude: its variance by the noise over that by noise and course. Of several amplitudes the largest part; 1 where the log leaves
/// nothing open.
fn part_by_noise(base: &FittedModel, candidate: &FittedCandidate) -> f64 {
    let data = base.data_for(&candidate.trial);
    // Where the voltage was taken as constant within the rows, a small effect may be what it does there.
    let Some(data) = with_course(base.context.log, &data) else { return 1.0 };
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

#[cfg(test)]
mod tests {
    use super::gain_of_part;

    #[test]
    fn gain_counts_in_proportion_near_the_noise_and_by_its_amplitude_far_from_it() {
        assert!((gain_of_part(150.0, 0.1, 20_000.0) / 15.0 - 1.0).abs() < 0.01, "{}", gain_of_part(150.0, 0.1, 20_000.0));
        // 1000 σ in 100 samples; with a course of 100 σ beside the noise it is 10 of the new standard deviations.
        let gain = |sigmas: f64| 100.0 * (sigmas * sigmas / 100.0).ln_1p();
        assert!((gain_of_part(gain(1000.0), 1e-4, 100.0) / gain(10.0) - 1.0).abs() < 1e-9);
        assert_eq!(gain_of_part(500.0, 1.0, 1000.0).round(), 500.0);
    }
}
