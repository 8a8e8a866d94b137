//! Profiles: setpoints over time, one value per millisecond.
//!
//! In: a [`ProfileConfig`], in V, rad/s or rad by the mode of the drive. Out: a sequence of values within `offset ± amplitude`, equal for
//! equal seeds on every machine. [`ProfileRunner`] makes segments for the speed loop from them, one millisecond ahead: constant within
//! the millisecond in voltage mode, linear in rate mode.
//!
//! Multisine and chirps use the sine of micromath (error 1e-3). The commanded values are logged, so this error does not affect a
//! measurement. Phases are integers in units of 2⁻³² or 2⁻⁶⁴ turn, so that long sines do not drift.

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
use slope::SlopeLimits;

/// A running profile.
#[derive(Clone, Debug)]
pub struct Profile {
    offset: f64,
    kind: ProfileState,
}

#[allow(clippy::large_enum_variant, reason = "a profile exists once, in its runner")]
#[derive(Clone, Debug)]
enum ProfileState {
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
    /// Checks the parameters of the kind and starts at the first value.
    ///
    /// # Errors
    /// A parameter is invalid; names the first.
    pub fn new(c: &ProfileConfig) -> Result<Self, ConfigError> {
        for parameter in c.kind.parameters().iter().filter_map(|name| Parameter::of_name(name)) {
            let (least, greatest) = parameter.range;
            // The highest frequency is at least the lowest.
            let least = if parameter.name == "to_Hz" { c.from_Hz } else { least };
            within(parameter.name, (parameter.read)(c), least, greatest)?;
        }
        let (amplitude, offset) = (c.amplitude, c.offset);
        let plateaus = |pattern, limits| ProfileState::Plateaus(plateaus::Plateaus::new(amplitude, pattern, limits, c));
        let kind = match c.kind {
            ProfileKind::Constant => ProfileState::Constant(amplitude),
            ProfileKind::MultiStep => ProfileState::MultiStep(steps::MultiStep::new(amplitude, c)),
            ProfileKind::Multisine => ProfileState::Multisine(multisine::Multisine::new(amplitude, c)?),
            ProfileKind::Prbs => ProfileState::Prbs(prbs::Prbs::new(amplitude, c)),
            ProfileKind::Chirp => ProfileState::Chirp(chirp::Chirp::logarithmic(amplitude, c)),
            ProfileKind::ChirpLinear => ProfileState::Chirp(chirp::Chirp::linear(amplitude, c)),
            ProfileKind::Staircase => ProfileState::Staircase(staircase::Staircase::new(amplitude, c)),
            ProfileKind::Trapezoid => plateaus(plateaus::ONE_SIDE, SlopeLimits::straight(c)),
            ProfileKind::SCurve => plateaus(plateaus::ONE_SIDE, SlopeLimits::rounded(c)),
            ProfileKind::Alternating => plateaus(plateaus::BOTH_SIDES, SlopeLimits::rounded(c)),
            ProfileKind::Abba => plateaus(plateaus::ABBA, SlopeLimits::rounded(c)),
            ProfileKind::Sine => ProfileState::Sine(sine::Sine::new(amplitude, c)),
            ProfileKind::Turns => ProfileState::Turns(turns::Turns::new(amplitude, c)?),
        };
        Ok(Self { offset, kind })
    }

    /// As [`Profile::new`], for a mode of the drive.
    ///
    /// # Errors
    /// As [`Profile::new`]; or the profile is not possible in this mode.
    pub fn for_mode(c: &ProfileConfig, mode: Mode) -> Result<Self, ConfigError> {
        if c.kind.is_a_rate() && mode != Mode::Rate {
            return Err(ConfigError::Unfit("profile", "turns is possible in rate mode only"));
        }
        Self::new(c)
    }

    /// A sequence of constant values, each with its duration in milliseconds; then zero. For the calibration.
    pub fn legs(legs: [(f64, u32); LEGS]) -> Self {
        Self { offset: 0.0, kind: ProfileState::Legs(legs::Legs::new(legs)) }
    }

    /// The value of the next millisecond, V, rad/s or rad.
    pub fn next_value(&mut self) -> f64 {
        self.offset
            + match &mut self.kind {
                ProfileState::Constant(value) => *value,
                ProfileState::MultiStep(steps) => steps.next_value(),
                ProfileState::Multisine(sines) => sines.next_value(),
                ProfileState::Prbs(bits) => bits.next_value(),
                ProfileState::Chirp(chirp) => chirp.next_value(),
                ProfileState::Staircase(stairs) => stairs.next_value(),
                ProfileState::Plateaus(plateaus) => plateaus.next_value(),
                ProfileState::Sine(sine) => sine.next_value(),
                ProfileState::Turns(turns) => turns.next_value(),
                ProfileState::Legs(legs) => legs.next_value(),
            }
    }
}

/// Milliseconds of a valid duration, s.
fn milliseconds(seconds: f64) -> u32 {
    libm::round(seconds * 1e3) as u32
}

/// Sine of a phase in 2⁻³² turn, to 1e-3.
fn sine(phase: u32) -> f64 {
    let angle = (phase as i32) as f32 * (core::f32::consts::PI / 2_147_483_648.0);
    // The full path: with the standard library, `angle.sin()` would select another method.
    f64::from(micromath::F32Ext::sin(angle))
}
