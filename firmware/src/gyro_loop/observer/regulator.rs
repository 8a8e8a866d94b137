//! The regulator by the incomplete state vector: a control moment of some of the estimates, with and without the disturbance fed forward.

use super::Real;
use crate::config::ConfigError;

/// Gains from the estimates to the control moment; those of states that are not used are 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regulator<T, const N: usize> {
    gains: [T; N],
    greatest: f64,
}

impl<T: Real, const N: usize> Regulator<T, N> {
    /// A regulator u = −Σ gains · x̂ within ± `greatest`. An estimated disturbance that enters as the control does is fed forward by the gain 1.
    ///
    /// # Errors
    /// A number is not finite, or the limit not above 0.
    pub fn new(gains: &[f64; N], greatest: f64) -> Result<Self, ConfigError> {
        if !gains.iter().all(|gain| T::of(*gain).f64().is_finite()) {
            return Err(ConfigError::NonFinite("regulator"));
        }
        crate::config::within("greatest moment", greatest, f64::MIN_POSITIVE, 1e9)?;
        Ok(Self { gains: gains.map(T::of), greatest })
    }

    /// The moment for an estimate. The observer must be told what came of it, limits and steps included.
    pub fn moment(&self, estimate: &[T; N]) -> f64 {
        let sum = self.gains.iter().zip(estimate).fold(T::ZERO, |sum, (gain, state)| sum + *gain * *state);
        let moment = -sum.f64();
        if moment > self.greatest {
            self.greatest
        } else if moment < -self.greatest {
            -self.greatest
        } else if moment.is_nan() {
            0.0
        } else {
            moment
        }
    }
}
