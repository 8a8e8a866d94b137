//! What is asked for over time: profiles, one value per millisecond.
//!
//! In: a [`ProfileConfig`] (volts, rad/s or rad: the profile does not care). Out: one value after the other, each within
//! `offset ± amplitude`, the same for the same seed on every machine. [`ProfileRunner`] turns them into segments for the
//! speed loop, one millisecond ahead: constant within the millisecond in voltage mode, straight in rate mode.
//!
//! The sine of multisine and chirps is micromath's (1e-3): what is asked for is logged as it went out, so nothing measured passes through it.
//! Phases are whole numbers of 2⁻³² (2⁻⁶⁴) turn, so that hour-long sines do not drift.

mod chirp;
mod kind;
mod legs;
mod multisine;
mod parameters;
mod plateaus;
mod prbs;
mod runner;
mod sine;
mod slope;
mod staircase;
mod steps;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_of_slopes;
mod turns;

pub use kind::{ProfileKind, UnknownProfile};
pub use legs::LEGS;
pub use parameters::{PARAMETERS, Parameter, ProfileConfig};
pub use runner::ProfileRunner;

use crate::config::{ConfigError, within};
use crate::speed_loop::Mode;
use slope::Hold;

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
    Chirp(chirp::Chirp),
    Staircase(staircase::Staircase),
    Plateaus(plateaus::Plateaus),
    Sine(sine::Sine),
    Turns(turns::Turns),
    Legs(legs::Legs),
}

impl Profile {
    /// Checks the parameters that this kind uses and begins.
    ///
    /// # Errors
    /// The name of the first parameter that makes no sense.
    pub fn new(c: &ProfileConfig) -> Result<Self, ConfigError> {
        for parameter in c.kind.parameters().iter().filter_map(|name| Parameter::of_name(name)) {
            let (least, greatest) = parameter.range;
            // Of two frequencies the higher one is the second.
            let least = if parameter.name == "to_Hz" { c.from_Hz } else { least };
            within(parameter.name, (parameter.read)(c), least, greatest)?;
        }
        let (amplitude, offset) = (c.amplitude, c.offset);
        let plateaus = |pattern, hold| State::Plateaus(plateaus::Plateaus::new(amplitude, pattern, hold, c));
        let kind = match c.kind {
            ProfileKind::Constant => State::Constant(amplitude),
            ProfileKind::MultiStep => State::MultiStep(steps::MultiStep::new(amplitude, c)),
            ProfileKind::Multisine => State::Multisine(multisine::Multisine::new(amplitude, c)?),
            ProfileKind::Prbs => State::Prbs(prbs::Prbs::new(amplitude, c)),
            ProfileKind::Chirp => State::Chirp(chirp::Chirp::logarithmic(amplitude, c)),
            ProfileKind::ChirpLinear => State::Chirp(chirp::Chirp::linear(amplitude, c)),
            ProfileKind::Staircase => State::Staircase(staircase::Staircase::new(amplitude, c)),
            ProfileKind::Trapezoid => plateaus(plateaus::ONE_SIDE, Hold::straight(c)),
            ProfileKind::SCurve => plateaus(plateaus::ONE_SIDE, Hold::rounded(c)),
            ProfileKind::Alternating => plateaus(plateaus::BOTH_SIDES, Hold::rounded(c)),
            ProfileKind::Abba => plateaus(plateaus::ABBA, Hold::rounded(c)),
            ProfileKind::Sine => State::Sine(sine::Sine::new(amplitude, c)),
            ProfileKind::Turns => State::Turns(turns::Turns::new(amplitude, c)?),
        };
        Ok(Self { offset, kind })
    }

    /// The same for a stand that is regulated by `mode`: a profile that counts turns has no meaning as a voltage.
    ///
    /// # Errors
    /// As [`Profile::new`]; or the profile does not go with the mode.
    pub fn for_mode(c: &ProfileConfig, mode: Mode) -> Result<Self, ConfigError> {
        if c.kind.is_a_rate() && mode != Mode::Rate {
            return Err(ConfigError::Unfit("profile", "turns is a rate: it goes with rate mode only"));
        }
        Self::new(c)
    }

    /// Constant values, each for so many milliseconds, one after the other; then zero. For courses that are no profile of a person's.
    pub fn legs(legs: [(f64, u32); LEGS]) -> Self {
        Self { offset: 0.0, kind: State::Legs(legs::Legs::new(legs)) }
    }

    /// The value of the next millisecond, V, rad/s or rad.
    pub fn next_value(&mut self) -> f64 {
        self.offset
            + match &mut self.kind {
                State::Constant(value) => *value,
                State::MultiStep(steps) => steps.next_value(),
                State::Multisine(sines) => sines.next_value(),
                State::Prbs(bits) => bits.next_value(),
                State::Chirp(chirp) => chirp.next_value(),
                State::Staircase(stairs) => stairs.next_value(),
                State::Plateaus(plateaus) => plateaus.next_value(),
                State::Sine(sine) => sine.next_value(),
                State::Turns(turns) => turns.next_value(),
                State::Legs(legs) => legs.next_value(),
            }
    }
}

/// Milliseconds of a checked duration.
fn milliseconds(seconds: f64) -> u32 {
    crate::maths::to_u32(crate::maths::round(seconds * 1e3))
}

/// Sine of a phase in 2⁻³² turn, to 1e-3.
fn sine(phase: u32) -> f64 {
    let angle = (phase as i32) as f32 * (core::f32::consts::PI / 2_147_483_648.0);
    // By its full name: where the standard library is, `angle.sin()` would be another sine.
    f64::from(micromath::F32Ext::sin(angle))
}
