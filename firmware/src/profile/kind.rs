//! Which profile, by name; and which parameters it takes.

use core::fmt;
use core::str::FromStr;

use crate::words::{Words, words};

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
    Chirp,
    /// A sine whose frequency rises by the same number of hertz in each second, up and again from the start.
    ChirpLinear,
    /// Steps up, down through zero to the other side, and back, with a dwell on each.
    Staircase,
    /// Straight up to the amplitude, a dwell, straight down to zero, a dwell; under an acceleration limit.
    Trapezoid,
    /// The same with rounded corners: under a jerk limit, too.
    SCurve,
    /// One sine.
    Sine,
    /// +amplitude, −amplitude, a dwell on each, under acceleration and jerk limits.
    Alternating,
    /// Blocks of A B B A, A the amplitude and B its negative: a drift that grows evenly falls out of each block.
    Abba,
    /// Whole turns at a rate: begins and ends at rest at the same angle.
    Turns,
}

impl ProfileKind {
    /// All of them.
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

    /// Its name on the command line and in the logs' notes.
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

    /// Another name that is understood.
    pub fn alias(self) -> Option<&'static str> {
        match self {
            Self::Chirp => Some("sweep"),
            _ => None,
        }
    }

    /// What it does, in a line.
    pub fn says(self) -> Words {
        match self {
            Self::Constant => words!("one value"),
            Self::MultiStep => words!("random levels for random times, both signs"),
            Self::Multisine => words!("twenty sines at once"),
            Self::Prbs => words!("a pseudo-random binary sequence"),
            Self::Chirp => words!("a sine of rising frequency, the same factor each second"),
            Self::ChirpLinear => words!("a sine of rising frequency, the same hertz each second"),
            Self::Staircase => words!("levels up, down through zero to the other side, and back"),
            Self::Trapezoid => words!("up to a plateau and down, straight"),
            Self::SCurve => words!("up to a plateau and down, with rounded corners"),
            Self::Sine => words!("one sine"),
            Self::Alternating => words!("plus, minus, plus, minus"),
            Self::Abba => words!("blocks of plus, minus, minus, plus"),
            Self::Turns => words!("whole turns, ends at the angle where it began"),
        }
    }

    /// The names of the parameters that it takes, in [`super::PARAMETERS`]; it takes no other.
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

    /// Whether it makes sense only as a rate: it counts turns.
    pub fn is_a_rate(self) -> bool {
        matches!(self, Self::Turns)
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
        Self::ALL.into_iter().find(|kind| kind.name() == name || kind.alias() == Some(name)).ok_or(UnknownProfile)
    }
}
