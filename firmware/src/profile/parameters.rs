//! The parameters of the profiles: one record of all, and one table with name, unit and words, for whoever asks a person.
//!
//! Console and command line go over [`PARAMETERS`]; a parameter that is new here is new there.

use super::ProfileKind;
use crate::config::{ConfigError, within};
use crate::maths::{to_u32, to_u64};
use crate::words::{Words, words};

/// A profile's parameters. Amplitude and offset are in V, rad/s or rad, as the mode has it; acceleration is their change per
/// second, jerk the change of that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileConfig {
    /// Which one.
    pub kind: ProfileKind,
    /// Largest distance from the offset.
    pub amplitude: f64,
    /// Added to all values.
    pub offset: f64,
    /// Mean dwell of `multi-step`; dwell of `staircase` and of the plateaus, s.
    pub dwell_s: f64,
    /// Levels on each side of `staircase`.
    pub levels: u32,
    /// Length of a bit of `prbs`, s.
    pub bit_s: f64,
    /// Lowest frequency of `multisine` and the chirps, Hz.
    pub from_Hz: f64,
    /// Highest frequency, Hz.
    pub to_Hz: f64,
    /// Duration of one chirp, s.
    pub sweep_s: f64,
    /// Frequency of `sine`, Hz.
    pub frequency_Hz: f64,
    /// Greatest change per second on the way to a plateau.
    pub acceleration: f64,
    /// Greatest change of that per second.
    pub jerk: f64,
    /// How often `trapezoid`, `s-curve`, `alternating` and `abba` go round before they end at the offset; 0: without end.
    pub cycles: u32,
    /// Whole turns of `turns`.
    pub turns: u32,
    /// What random profiles are drawn from.
    pub seed: u64,
}

impl ProfileConfig {
    /// A profile with the usual parameters.
    pub fn new(kind: ProfileKind, amplitude: f64, seed: u64) -> Self {
        Self {
            kind,
            amplitude,
            offset: 0.0,
            dwell_s: 1.0,
            levels: 5,
            bit_s: 0.1,
            from_Hz: 0.05,
            to_Hz: 20.0,
            sweep_s: 30.0,
            frequency_Hz: 0.5,
            // Two thirds of what the default stand's speed loop allows, reached within 0.1 s.
            acceleration: 40.0,
            jerk: 400.0,
            cycles: 0,
            turns: 10,
            seed,
        }
    }
}

/// One parameter, for whoever asks a person for it.
pub struct Parameter {
    /// Its name, with its unit where it has one of its own; that of the field.
    pub name: &'static str,
    /// Its unit; `x` stands for the unit of the amplitude.
    pub unit: &'static str,
    /// What it is, in a line.
    pub says: Words,
    /// Its value.
    pub read: fn(&ProfileConfig) -> f64,
    /// What a profile can work with.
    pub(super) range: (f64, f64),
    write: Write,
}

enum Write {
    Real(fn(&mut ProfileConfig, f64)),
    /// A whole number up to so many.
    Whole(f64, fn(&mut ProfileConfig, f64)),
}

impl Parameter {
    /// The parameter of this name.
    pub fn of_name(name: &str) -> Option<&'static Self> {
        PARAMETERS.iter().find(|p| p.name == name)
    }

    /// Sets it. Whether the profile can work with the value is checked where the profile is made.
    ///
    /// # Errors
    /// Not a finite number; or not a whole one where only those make sense.
    pub fn set(&self, config: &mut ProfileConfig, value: f64) -> Result<(), ConfigError> {
        match self.write {
            Write::Real(write) => {
                within(self.name, value, f64::MIN, f64::MAX)?;
                write(config, value);
            }
            Write::Whole(most, write) => {
                let value = within(self.name, value, 0.0, most)?;
                if crate::maths::trunc(value) != value {
                    return Err(ConfigError::Unfit(self.name, "must be a whole number"));
                }
                write(config, value);
            }
        }
        Ok(())
    }
}

/// Greatest whole number that double precision and the record hold exactly.
const ALL_32_BITS: f64 = 4_294_967_295.0;
const ALL_53_BITS: f64 = 9_007_199_254_740_991.0;

/// Durations, s, and frequencies, Hz: a period has at least four values.
const LASTS: (f64, f64) = (1e-3, 1e5);
const SWINGS: (f64, f64) = (1e-3, 250.0);

/// All parameters, in the order in which a person would ask for them.
pub const PARAMETERS: [Parameter; 14] = [
    real("amplitude", "x", (-1e4, 1e4), words!("largest distance from offset"), |c| c.amplitude, |c, x| c.amplitude = x),
    real("offset", "x", (-1e4, 1e4), words!("added to all values"), |c| c.offset, |c, x| c.offset = x),
    real("dwell_s", "s", LASTS, words!("time on a level (multi-step: its mean)"), |c| c.dwell_s, |c, x| c.dwell_s = x),
    whole(
        "levels",
        ALL_32_BITS,
        (1.0, 1000.0),
        words!("levels on each side of zero"),
        |c| f64::from(c.levels),
        |c, x| c.levels = to_u32(x),
    ),
    real("bit_s", "s", LASTS, words!("length of one bit"), |c| c.bit_s, |c, x| c.bit_s = x),
    real("from_Hz", "Hz", SWINGS, words!("lowest frequency"), |c| c.from_Hz, |c, x| c.from_Hz = x),
    real("to_Hz", "Hz", SWINGS, words!("highest frequency"), |c| c.to_Hz, |c, x| c.to_Hz = x),
    real("sweep_s", "s", LASTS, words!("time from lowest to highest frequency"), |c| c.sweep_s, |c, x| c.sweep_s = x),
    real("frequency_Hz", "Hz", SWINGS, words!("frequency"), |c| c.frequency_Hz, |c, x| c.frequency_Hz = x),
    real("acceleration", "x/s", (1e-3, 1e6), words!("greatest change per second"), |c| c.acceleration, |c, x| c.acceleration = x),
    real("jerk", "x/s2", (1e-3, 1e9), words!("greatest change of acceleration per second"), |c| c.jerk, |c, x| c.jerk = x),
    whole(
        "cycles",
        ALL_32_BITS,
        (0.0, 1e6),
        words!("how often it goes round, 0: without end"),
        |c| f64::from(c.cycles),
        |c, x| c.cycles = to_u32(x),
    ),
    whole("turns", ALL_32_BITS, (1.0, 1e6), words!("whole turns"), |c| f64::from(c.turns), |c, x| c.turns = to_u32(x)),
    whole(
        "seed",
        ALL_53_BITS,
        (0.0, f64::MAX),
        words!("what random profiles are drawn from"),
        |c| c.seed as f64,
        |c, x| c.seed = to_u64(x),
    ),
];

const fn real(
    name: &'static str,
    unit: &'static str,
    range: (f64, f64),
    says: Words,
    read: fn(&ProfileConfig) -> f64,
    write: fn(&mut ProfileConfig, f64),
) -> Parameter {
    Parameter { name, unit, range, says, read, write: Write::Real(write) }
}

const fn whole(
    name: &'static str,
    most: f64,
    range: (f64, f64),
    says: Words,
    read: fn(&ProfileConfig) -> f64,
    write: fn(&mut ProfileConfig, f64),
) -> Parameter {
    Parameter { name, unit: "", range, says, read, write: Write::Whole(most, write) }
}
