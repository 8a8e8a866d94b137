//! The part of an effect's gain that the unknown course of the voltage within the rows does not explain.
//!
//! In: a fitted effect. Out: its gain with the course as a second error. The gain takes the noise as the only one. Where the log has means
//! of the voltage, or means and first moments, the course within the rows is open, and the estimates scatter by it as well.

use drive_model::ParameterKind;
use nalgebra::{DMatrix, DVector};

use super::candidate::{FittedCandidate, chi2_per_value};
use crate::identify::explain::fitted::FittedModel;
use crate::identify::fit::solve::Iterate;
use crate::identify::predict::{by_course, with_course};

/// The gain of an effect in so many independent samples, with the unknown course of the voltage as an error beside the noise.
pub fn gain_beside_course(base: &FittedModel, candidate: &FittedCandidate, samples: f64) -> f64 {
    gain_of_part(candidate.gain, part_by_noise(base, candidate), samples)
}

/// The gain of an amplitude a is n ln(1 + a²/(n σ²)), where σ is its standard deviation by a noise whose level is estimated too: that gain
/// with σ²/`part` in the place of σ².
fn gain_of_part(gain: f64, part: f64, samples: f64) -> f64 {
    samples * (part * (gain / samples).exp_m1()).ln_1p()
}

/// aᵀ (C + C_course)⁻¹ a / aᵀ C⁻¹ a of the effect's amplitudes a, with their covariance by the noise and by the course: the part of their
/// significance that the course leaves. Of one amplitude it is σ²/(σ² + σ_course²). 1 where the log leaves nothing open.
fn part_by_noise(base: &FittedModel, candidate: &FittedCandidate) -> f64 {
    let data = base.data_for(&candidate.trial);
    // Where the voltage was taken as constant within the rows, a small effect may be what it does there.
    let Some(data) = with_course(base.context.log, &data) else { return 1.0 };
    let iterate = Iterate::new(&candidate.system, &candidate.parameters, &data, &candidate.states);
    let Some(by_course) = by_course(&candidate.system, &data, &iterate, &base.weights) else { return 1.0 };
    let Some(by_noise) = iterate.normal_equations(&base.weights).profiled().0.try_inverse() else { return 1.0 };
    let excess = chi2_per_value(base, candidate.chi2).max(1.0);
    let parameters = &candidate.parameters;
    let (by_noise, by_course) = (parameters.full_covariance(&by_noise) * excess, parameters.full_covariance(&by_course));
    let free: Vec<usize> = candidate.own.clone().filter(|&k| !parameters.list[k].fixed && by_noise[(k, k)] > 0.0).collect();
    let is_amplitude = |k: &usize| matches!(parameters.list[*k].kind, ParameterKind::NonNegative | ParameterKind::Signed);
    let amplitudes: Vec<usize> = free.iter().copied().filter(is_amplitude).collect();
    // A shaft vanishes with its first parameter, the stiffness at infinity or the gap at zero, not with its damping. k/σ_k is the
    // significance of the compliance 1/k too.
    let judged = match candidate.trial.card.elastic {
        Some(_) => free.into_iter().take(1).collect(),
        None if amplitudes.is_empty() => free,
        None => amplitudes,
    };
    let values = DVector::from_iterator(judged.len(), judged.iter().map(|&k| parameters.list[k].value));
    let of_judged = |of: &DMatrix<f64>| DMatrix::from_fn(judged.len(), judged.len(), |i, j| of[(judged[i], judged[j])]);
    part_of(&values, &of_judged(&by_noise), &of_judged(&by_course))
}

/// aᵀ (C + C_course)⁻¹ a / aᵀ C⁻¹ a of the `values` a; 1 where C is singular or a is zero.
fn part_of(values: &DVector<f64>, by_noise: &DMatrix<f64>, by_course: &DMatrix<f64>) -> f64 {
    let significance = |covariance: DMatrix<f64>| Some(values.dot(&covariance.cholesky()?.solve(values)));
    let part = significance(by_noise + by_course).zip(significance(by_noise.clone())).map(|(both, noise)| both / noise);
    part.filter(|part| part.is_finite()).unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two amplitudes that the noise determines together better than each: the course moves their sum, which is what they are significant
    /// by, or their difference.
    #[test]
    fn course_counts_along_the_direction_of_the_amplitudes() {
        let covariance = |correlation: f64, scale: f64| DMatrix::from_row_slice(2, 2, &[1.0, correlation, correlation, 1.0]) * scale;
        let (values, by_noise) = (DVector::from_vec(vec![10.0, 10.0]), covariance(-0.99, 1.0));
        let along = part_of(&values, &by_noise, &covariance(1.0, 1.0));
        assert!((along / (0.01 / 2.01) - 1.0).abs() < 1e-9, "{along}");
        let across = part_of(&values, &by_noise, &covariance(-1.0, 1.0));
        assert!((across - 1.0).abs() < 1e-9, "{across}");
        let one = part_of(&DVector::from_vec(vec![3.0]), &DMatrix::from_element(1, 1, 1.0), &DMatrix::from_element(1, 1, 4.0));
        assert!((one - 0.2).abs() < 1e-12, "{one}");
    }

    #[test]
    fn gain_counts_in_proportion_near_the_noise_and_by_its_amplitude_far_from_it() {
        assert!((gain_of_part(150.0, 0.1, 20_000.0) / 15.0 - 1.0).abs() < 0.01, "{}", gain_of_part(150.0, 0.1, 20_000.0));
        // 1000 σ in 100 samples; with a course of 100 σ beside the noise it is 10 of the new standard deviations.
        let gain = |sigmas: f64| 100.0 * (sigmas * sigmas / 100.0).ln_1p();
        assert!((gain_of_part(gain(1000.0), 1e-4, 100.0) / gain(10.0) - 1.0).abs() < 1e-9);
        assert_eq!(gain_of_part(500.0, 1.0, 1000.0).round(), 500.0);
    }
}
