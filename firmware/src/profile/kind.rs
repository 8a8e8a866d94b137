//! Kinds of profiles: names, descriptions, parameters.

use core::fmt;
use core::str::FromStr;

/// Kind of a profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfileKind {
    /// `offset + amplitude`.
    Constant,
    /// Random levels of both signs for random times.
    MultiStep,
    /// A sum of sines at logarithmically spaced frequencies, with Schroeder phases.
    Multisine,
    /// A pseudo-random binary sequence of 1023 bits (PRBS10).
    Prbs,
    /// A repeated logarithmic chirp: the frequency rises by the same factor in each second.
    Chirp,
    /// A repeated linear chirp: the frequency rises by the same number of hertz in each second.
    ChirpLinear,
    /// Steps up, down through zero to the negative amplitude, and back, with a dwell on each level.
    Staircase,
    /// Up to the amplitude, a dwell, down to zero, a dwell; limited acceleration.
    Trapezoid,
    /// As the trapezoid, with limited jerk.
    SCurve,
    /// A sine.
    Sine,
    /// +amplitude and −amplitude in turn, a dwell on each; limited acceleration and jerk.
    Alternating,
    /// Blocks of A B B A with A = +amplitude, B = −amplitude: a linear drift cancels in each block.
    Abba,
    /// Whole turns at a rate; begins and ends at rest at the same angle.
    Turns,
}

impl ProfileKind {
    /// All kinds.
    pub const ALL: [Self; 13] = [
        Self::Constant,
        Self::MultiStep,
        Self::Multisine,
        Self::Prbs,
        Self::Chirp,
        Self::ChirpLinear,
        Self::Staircase,
        Self::Trapezoid,
        Self::SCurve,
        Self::Sine,
        Self::Alternating,
        Self::Abba,
        Self::Turns,
    ];

    /// Name on the command line and in the notes of a log.
    pub fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::MultiStep => "multi-step",
            Self::Multisine => "multisine",
            Self::Prbs => "prbs",
            Self::Chirp => "chirp",
            Self::ChirpLinear => "chirp-linear",
            Self::Staircase => "staircase",
            Self::Trapezoid => "trapezoid",
            Self::SCurve => "s-curve",
            Self::Sine => "sine",
            Self::Alternating => "alternating",
            Self::Abba => "abba",
            Self::Turns => "turns",
        }
    }

    /// A second accepted name.
    pub fn alias(self) -> Option<&'static str> {
        match self {
            Self::Chirp => Some("sweep"),
            _ => None,
        }
    }

    /// Description in a line.
    pub fn description(self) -> &'static str {
        match self {
            Self::Constant => "a constant",
            Self::MultiStep => "random levels of both signs for random times",
            Self::Multisine => "sum of twenty sines",
            Self::Prbs => "pseudo-random binary sequence",
            Self::Chirp => "logarithmic chirp",
            Self::ChirpLinear => "linear chirp",
            Self::Staircase => "steps up, down through zero to the negative amplitude, and back",
            Self::Trapezoid => "plateaus with limited acceleration",
            Self::SCurve => "plateaus with limited acceleration and jerk",
            Self::Sine => "sine",
            Self::Alternating => "plateaus + - + -",
            Self::Abba => "blocks of plateaus + - - +",
            Self::Turns => "whole turns; ends at its first angle",
        }
    }

    /// The names of its parameters in [`super::PARAMETERS`].
    pub fn parameters(self) -> &'static [&'static str] {
        match self {
            Self::Constant => &["amplitude", "offset"],
            Self::MultiStep => &["amplitude", "offset", "dwell_s", "seed"],
            Self::Multisine => &["amplitude", "offset", "from_Hz", "to_Hz"],
            Self::Prbs => &["amplitude", "offset", "bit_s", "seed"],
            Self::Chirp | Self::ChirpLinear => &["amplitude", "offset", "from_Hz", "to_Hz", "sweep_s"],
            Self::Staircase => &["amplitude", "offset", "dwell_s", "levels"],
            Self::Trapezoid => &["amplitude", "offset", "dwell_s", "acceleration", "cycles"],
            Self::SCurve | Self::Alternating | Self::Abba => &["amplitude", "offset", "dwell_s", "acceleration", "jerk", "cycles"],
            Self::Sine => &["amplitude", "offset", "frequency_Hz"],
            Self::Turns => &["amplitude", "acceleration", "jerk", "turns"],
        }
    }

    /// Whether it is possible in rate mode only, because it counts turns.
    pub fn is_a_rate(self) -> bool {
        matches!(self, Self::Turns)
    }
}

impl fmt::Display for ProfileKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// There is no profile of this name.
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
        Self::ALL.into_iter().find(|kind| kind.name() == name || kind.alias() == Some(name)).ok_or(UnknownProfile)
    }
}
