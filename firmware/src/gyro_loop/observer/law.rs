//! The law of the exact discrete observer, with any number of states.

use super::{Real, Stability};
use crate::config::ConfigError;

/// The numbers of an observer of `N` states that sees the first of them.
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
    /// A number is not finite, `gain` is nothing, or leaves a pole on or outside the unit circle.
    pub fn new(phi: &[[f64; N]; N], gamma: &[f64; N], gain: &[f64; N]) -> Result<Self, ConfigError> {
        let design = Self::unproved(phi, gamma, gain)?;
        let mut stability = Stability::new(phi, gain);
        loop {
            if let Some(stable) = stability.work() {
                return stable.map(|()| design);
            }
        }
    }

    /// The same without the check of its poles: for who has it done by [`Stability`], in pieces.
    ///
    /// # Errors
    /// A number is not finite.
    pub fn unproved(phi: &[[f64; N]; N], gamma: &[f64; N], gain: &[f64; N]) -> Result<Self, ConfigError> {
        for (name, numbers) in [("phi", phi.as_flattened()), ("gamma", gamma), ("gain", gain)] {
            // What overflows in the observer's own numbers is as bad.
            if !numbers.iter().all(|number| T::of(*number).f64().is_finite()) {
                return Err(ConfigError::NonFinite(name));
            }
        }
        Ok(Self { phi: phi.map(|row| row.map(T::of)), gamma: gamma.map(T::of), gain: gain.map(T::of) })
    }
}

/// An observer's state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observer<T, const N: usize> {
    estimate: [T; N],
}

impl<T: Real, const N: usize> Observer<T, N> {
    /// An observer that begins at the angle it sees, all else at rest: from anywhere else it would throw its rates far about first (theory §1.5).
    pub fn at(angle: T) -> Self {
        let mut estimate = [T::ZERO; N];
        if let Some(first) = estimate.first_mut() {
            *first = angle;
        }
        Self { estimate }
    }

    /// What is so at the next step, by what is known.
    pub fn estimate(&self) -> &[T; N] {
        &self.estimate
    }

    /// A step: `angle` was seen, `input` was in force from then on. Returns by how much the angle was not what was expected.
    pub fn step(&mut self, design: &Design<T, N>, angle: T, input: T) -> T {
        let innovation = self.estimate.first().map_or(T::ZERO, |expected| angle - *expected);
        self.advance(design, innovation, input);
        innovation
    }

    /// A step for which nothing was seen.
    pub fn predict(&mut self, design: &Design<T, N>, input: T) {
        self.advance(design, T::ZERO, input);
    }

    fn advance(&mut self, design: &Design<T, N>, innovation: T, input: T) {
        let before = self.estimate;
        let numbers = design.phi.iter().zip(&design.gamma).zip(&design.gain);
        for (next, ((row, gamma), gain)) in self.estimate.iter_mut().zip(numbers) {
            // The large terms of the model cancel; what is seen comes last.
            let model = row.iter().zip(&before).fold(T::ZERO, |sum, (phi, state)| sum + *phi * *state);
            *next = model + *gamma * input + *gain * innovation;
        }
    }
}
