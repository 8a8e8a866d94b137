//! What is asked for over time: profiles, one value per millisecond.
//!
//! In: a [`ProfileConfig`] (volts or rad/s: the profile does not care). Out: one value after the other, each within
//! `offset ± amplitude`, the same for the same seed on every machine. [`ProfileRunner`] turns them into segments for the
//! speed loop, one millisecond ahead: constant within the millisecond in voltage mode, straight in rate mode.
//!
//! The sine is micromath's (1e-3): what is asked for is logged as it went out, so nothing measured passes through it.
//! Phases are whole numbers of 2⁻³² (2⁻⁶⁴) turn, so that hour-long sines do not drift.

mod legs;
mod multisine;
mod prbs;
mod runner;
mod staircase;
mod steps;
mod sweep;
#[cfg(test)]
mod tests;

pub use legs::LEGS;
pub use runner::ProfileRunner;

use crate::config::{ConfigError, within};
use core::fmt;
use core::str::FromStr;

/// Which profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfileKind {
    /// `offset + amplitude`, always.
    Constant,
    /// Random levels for random times, through zero, both signs.
    MultiStep,
    /// A sum of sines, 0.05–20 Hz in even steps of log frequency, with Schroeder's phases.
    Multisine,
    /// A pseudo-random binary sequence of 1023 bits.
    Prbs,
    /// A sine whose frequency rises by the same factor in each second, up and again from the start.
    Sweep,
    /// Steps up, down through zero to the other side, and back, with a dwell on each.
    Staircase,
}

impl ProfileKind {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Constant, Self::MultiStep, Self::Multisine, Self::Prbs, Self::Sweep, Self::Staircase];

    /// Its name on the command line and in the logs' notes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::MultiStep => "multi-step",
            Self::Multisine => "multisine",
            Self::Prbs => "prbs",
            Self::Sweep => "sweep",
            Self::Staircase => "staircase",
        }
    }
}

impl fmt::Display for ProfileKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that no profile has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownProfile;

impl fmt::Display for UnknownProfile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("unknown profile; there are")?;
        for (n, kind) in ProfileKind::ALL.iter().enumerate() {
            write!(f, "{} {kind}", if n == 0 { "" } else { "," })?;
        }
        Ok(())
    }
}

impl core::error::Error for UnknownProfile {}

impl FromStr for ProfileKind {
    type Err = UnknownProfile;
    fn from_str(name: &str) -> Result<Self, UnknownProfile> {
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or(UnknownProfile)
    }
}

/// A profile's parameters. Amplitude and offset are in V or rad/s, as the mode has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileConfig {
    /// Which one.
    pub kind: ProfileKind,
    /// Largest distance from the offset.
    pub amplitude: f64,
    /// Added to all values.
    pub offset: f64,
    /// Mean dwell of `multi-step`, dwell of `staircase`, s.
    pub dwell_s: f64,
    /// Levels on each side of `staircase`.
    pub levels: u32,
    /// Length of a bit of `prbs`, s.
    pub bit_s: f64,
    /// Lowest frequency of `multisine` and `sweep`, Hz.
    pub from_Hz: f64,
    /// Highest frequency, Hz.
    pub to_Hz: f64,
    /// Duration of one `sweep`, s.
    pub sweep_s: f64,
    /// What random profiles are drawn from; `multisine` takes no seed.
    pub seed: u64,
}

impl ProfileConfig {
    /// A profile with the usual parameters.
    pub fn new(kind: ProfileKind, amplitude: f64, seed: u64) -> Self {
        Self { kind, amplitude, offset: 0.0, dwell_s: 1.0, levels: 5, bit_s: 0.1, from_Hz: 0.05, to_Hz: 20.0, sweep_s: 30.0, seed }
    }
}

/// A profile under way.
#[derive(Clone, Debug)]
pub struct Profile {
    offset: f64,
    kind: State,
}

// The largest is the multisine's table; a profile exists once, in its runner.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug)]
enum State {
    Constant(f64),
    MultiStep(steps::MultiStep),
    Multisine(multisine::Multisine),
    Prbs(prbs::Prbs),
    Sweep(sweep::Sweep),
    Staircase(staircase::Staircase),
    Legs(legs::Legs),
}

impl Profile {
    /// Checks the parameters that this kind uses and begins.
    ///
    /// # Errors
    /// The name of the first parameter that makes no sense.
    pub fn new(c: &ProfileConfig) -> Result<Self, ConfigError> {
        let amplitude = within("amplitude", c.amplitude, -1e4, 1e4)?;
        let offset = within("offset", c.offset, -1e4, 1e4)?;
        let kind = match c.kind {
            ProfileKind::Constant => State::Constant(amplitude),
            ProfileKind::MultiStep => State::MultiStep(steps::MultiStep::new(amplitude, c)?),
            ProfileKind::Multisine => State::Multisine(multisine::Multisine::new(amplitude, c)?),
            ProfileKind::Prbs => State::Prbs(prbs::Prbs::new(amplitude, c)?),
            ProfileKind::Sweep => State::Sweep(sweep::Sweep::new(amplitude, c)?),
            ProfileKind::Staircase => State::Staircase(staircase::Staircase::new(amplitude, c)?),
        };
        Ok(Self { offset, kind })
    }

    /// Constant values, each for so many milliseconds, one after the other; then zero. For courses that are no profile of a person's.
    pub fn legs(legs: [(f64, u32); LEGS]) -> Self {
        Self { offset: 0.0, kind: State::Legs(legs::Legs::new(legs)) }
    }

    /// The value of the next millisecond, V or rad/s.
    pub fn next_value(&mut self) -> f64 {
        self.offset
            + match &mut self.kind {
                State::Constant(value) => *value,
                State::MultiStep(steps) => steps.next_value(),
                State::Multisine(sines) => sines.next_value(),
                State::Prbs(bits) => bits.next_value(),
                State::Sweep(sweep) => sweep.next_value(),
                State::Staircase(stairs) => stairs.next_value(),
                State::Legs(legs) => legs.next_value(),
            }
    }
}

/// Milliseconds of a checked duration, at least one.
fn milliseconds(name: &'static str, seconds: f64) -> Result<u32, ConfigError> {
    Ok(libm::round(within(name, seconds, 1e-3, 1e5)? * 1e3) as u32)
}

/// Sine of a phase in 2⁻³² turn, to 1e-3.
fn sine(phase: u32) -> f64 {
    let angle = (phase as i32) as f32 * (core::f32::consts::PI / 2_147_483_648.0);
    // By its full name: where the standard library is, `angle.sin()` would be another sine.
    f64::from(micromath::F32Ext::sin(angle))
}
