//! The exact discrete observer with any number of states.

use super::{Real, Stability};
use crate::config::ConfigError;

/// Matrices of an observer of `N` states that measures the first one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Design<T, const N: usize> {
    phi: [[T; N]; N],
    gamma: [T; N],
    gain: [T; N],
}

impl<T: Real, const N: usize> Design<T, N> {
    /// An observer of the plant x[n+1] = `phi` x[n] + `gamma` u[n] with these gains.
    ///
    /// # Errors
    /// A number is not finite, or `gain` leaves a pole on or outside the unit circle.
    pub fn new(phi: &[[f64; N]; N], gamma: &[f64; N], gain: &[f64; N]) -> Result<Self, ConfigError> {
        let design = Self::unchecked(phi, gamma, gain)?;
        let mut stability = Stability::new(phi, gain);
        loop {
            if let Some(stable) = stability.step() {
                return stable.map(|()| design);
            }
        }
    }

    /// The same without the check of the poles, for callers that run [`Stability`] in steps.
    ///
    /// # Errors
    /// A number is not finite.
    pub fn unchecked(phi: &[[f64; N]; N], gamma: &[f64; N], gain: &[f64; N]) -> Result<Self, ConfigError> {
        for (name, numbers) in [("phi", phi.as_flattened()), ("gamma", gamma), ("gain", gain)] {
            // An overflow in the observer's own precision counts, too.
            if !numbers.iter().all(|number| T::from_f64(*number).to_f64().is_finite()) {
                return Err(ConfigError::NonFinite(name));
            }
        }
        Ok(Self { phi: phi.map(|row| row.map(T::from_f64)), gamma: gamma.map(T::from_f64), gain: gain.map(T::from_f64) })
    }
}

/// State of an observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observer<T, const N: usize> {
    estimate: [T; N],
}

impl<T: Real, const N: usize> Observer<T, N> {
    /// An observer that starts at the measured angle, at rest: from another angle its rates would peak first (docs/theory.md §1.5).
    pub fn at(angle: T) -> Self {
        let mut estimate = [T::ZERO; N];
        if let Some(first) = estimate.first_mut() {
            *first = angle;
        }
        Self { estimate }
    }

    /// The estimates for the next step.
    pub fn estimate(&self) -> &[T; N] {
        &self.estimate
    }

    /// One step with the measured `angle` and the `input` from then on. Returns the innovation.
    pub fn step(&mut self, design: &Design<T, N>, angle: T, input: T) -> T {
        let innovation = self.estimate.first().map_or(T::ZERO, |expected| angle - *expected);
        self.advance(design, innovation, input);
        innovation
    }

    /// One step without a measurement.
    pub fn predict(&mut self, design: &Design<T, N>, input: T) {
        self.advance(design, T::ZERO, input);
    }

    fn advance(&mut self, design: &Design<T, N>, innovation: T, input: T) {
        let before = self.estimate;
        let rows = design.phi.iter().zip(&design.gamma).zip(&design.gain);
        for (next, ((row, gamma), gain)) in self.estimate.iter_mut().zip(rows) {
            // The large terms of the model cancel, so the innovation is added last.
            let model = row.iter().zip(&before).fold(T::ZERO, |sum, (phi, state)| sum + *phi * *state);
            *next = model + *gamma * input + *gain * innovation;
        }
    }
}
