//! Regulator on an incomplete state vector: a control moment from some of the estimates, with optional feed-forward of the disturbance.

use super::Real;
use crate::config::ConfigError;

/// Gains from the estimates to the control moment; 0 for unused states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regulator<T, const N: usize> {
    gains: [T; N],
    limit: f64,
}

impl<T: Real, const N: usize> Regulator<T, N> {
    /// A regulator u = −Σ gains · x̂ within ± `limit`. The gain 1 on an estimated disturbing moment feeds it forward.
    ///
    /// # Errors
    /// A number is not finite, or the limit not above 0.
    pub fn new(gains: &[f64; N], limit: f64) -> Result<Self, ConfigError> {
        if !gains.iter().all(|gain| T::from_f64(*gain).to_f64().is_finite()) {
            return Err(ConfigError::NonFinite("regulator"));
        }
        crate::config::within("moment limit", limit, f64::MIN_POSITIVE, 1e9)?;
        Ok(Self { gains: gains.map(T::from_f64), limit })
    }

    /// The moment for an estimate. The observer must then be given the actual moment, limited and rounded to steps.
    pub fn moment(&self, estimate: &[T; N]) -> f64 {
        let sum = self.gains.iter().zip(estimate).fold(T::ZERO, |sum, (gain, state)| sum + *gain * *state);
        let moment = -sum.to_f64();
        if moment > self.limit {
            self.limit
        } else if moment < -self.limit {
            -self.limit
        } else if moment.is_nan() {
            0.0
        } else {
            moment
        }
    }
}
