//! Inequality of positive and negative pulses by two amplitudes: it is proportional to the amplitude, the drift is not.
//!
//! A torquer that is stronger in one direction adds −ε w/2 to formula (13), equally for + − and − + (docs/theory.md §3.2). The measured
//! current corrects an unequal current, but not an unequal torquer gain. [`super::session_fit`] fits the part that is proportional to the
//! amplitude w beside the drift, one for all positions, so that the azimuth is not affected.

use super::error::DriftError;

/// Smallest ratio of two amplitudes that determines the inequality.
pub const MIN_AMPLITUDE_RATIO: f64 = 1.2;

/// Checks that amplitudes of pulses determine the inequality; any unit.
///
/// # Errors
/// The first amplitude that differs too little from an earlier one.
pub fn check_amplitudes(amplitudes: &[f64]) -> Result<(), DriftError> {
    let is_similar = |a: f64, b: f64| a.max(b) < MIN_AMPLITUDE_RATIO * a.min(b);
    for (k, rate) in amplitudes.iter().enumerate() {
        if amplitudes[..k].iter().any(|earlier| is_similar(*rate, *earlier)) {
            return Err(DriftError::SimilarAmplitudes { rate: *rate, min_ratio: MIN_AMPLITUDE_RATIO });
        }
    }
    Ok(())
}
