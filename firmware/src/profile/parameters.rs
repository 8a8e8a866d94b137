//! Parameters of the profiles: one structure with all of them, and one table with name, unit and description.
//!
//! The console and the command line read [`PARAMETERS`], so that a new parameter needs no change there.

use super::ProfileKind;
use crate::config::{ConfigError, within};

/// Parameters of a profile. Amplitude and offset are in V, rad/s or rad, by the mode of the drive; acceleration is their rate of change,
/// jerk the rate of change of the acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileConfig {
    /// Kind of the profile.
    pub kind: ProfileKind,
    /// Greatest deviation from the offset.
    pub amplitude: f64,
    /// Added to all values.
    pub offset: f64,
    /// Mean dwell of `multi-step`; dwell of `staircase` and of the plateaus, s.
    pub dwell_s: f64,
    /// Levels on each side of `staircase`.
    pub levels: u32,
    /// Duration of a bit of `prbs`, s.
    pub bit_s: f64,
    /// Lowest frequency of `multisine` and the chirps, Hz.
    pub from_Hz: f64,
    /// Highest frequency, Hz.
    pub to_Hz: f64,
    /// Duration of one chirp, s.
    pub sweep_s: f64,
    /// Frequency of `sine`, Hz.
    pub frequency_Hz: f64,
    /// Limit of the change per second between plateaus.
    pub acceleration: f64,
    /// Limit of the change of acceleration per second.
    pub jerk: f64,
    /// Number of cycles of `trapezoid`, `s-curve`, `alternating` and `abba`; 0: without end.
    pub cycles: u32,
    /// Number of turns of `turns`.
    pub turns: u32,
    /// Seed of the random profiles.
    pub seed: u64,
}

impl ProfileConfig {
    /// The profile after power-on.
    pub const DEFAULT: Self = Self::new(ProfileKind::Sine, 5.0, 1);

    /// A profile with default parameters.
    pub const fn new(kind: ProfileKind, amplitude: f64, seed: u64) -> Self {
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
            // Two thirds of the acceleration limit of the default stand, reached within 0.1 s.
            acceleration: 40.0,
            jerk: 400.0,
            cycles: 0,
            turns: 10,
            seed,
        }
    }
}

/// Description of a parameter.
pub struct Parameter {
    /// Name of the field, with its unit where it has a fixed one.
    pub name: &'static str,
    /// Unit; `x` stands for the unit of the amplitude.
    pub unit: &'static str,
    /// Description in a line.
    pub help: &'static str,
    /// Reads it.
    pub read: fn(&ProfileConfig) -> f64,
    /// Range accepted by the profiles.
    pub range: (f64, f64),
    write: Write,
}

enum Write {
    Real(fn(&mut ProfileConfig, f64)),
    /// An integer up to this limit.
    Whole(f64, fn(&mut ProfileConfig, f64)),
}

impl Parameter {
    /// The parameter of this name.
    pub fn of_name(name: &str) -> Option<&'static Self> {
        PARAMETERS.iter().find(|p| p.name == name)
    }

    /// Sets it. The range is checked when the profile is made.
    ///
    /// # Errors
    /// The value is not finite, or not an integer where the parameter is one.
    pub fn set(&self, config: &mut ProfileConfig, value: f64) -> Result<(), ConfigError> {
        match self.write {
            Write::Real(write) => {
                within(self.name, value, f64::MIN, f64::MAX)?;
                write(config, value);
            }
            Write::Whole(most, write) => {
                let value = within(self.name, value, 0.0, most)?;
                if libm::trunc(value) != value {
                    return Err(ConfigError::Unfit(self.name, "must be an integer"));
                }
                write(config, value);
            }
        }
        Ok(())
    }
}

/// Greatest integers of the fields; double precision holds them exactly.
const MAX_32_BITS: f64 = 4_294_967_295.0;
const MAX_53_BITS: f64 = 9_007_199_254_740_991.0;

/// Ranges of durations, s, and of frequencies, Hz; a period has at least four values.
const DURATION: (f64, f64) = (1e-3, 1e5);
const FREQUENCY: (f64, f64) = (1e-3, 250.0);

/// All parameters, in the order of `HELP?`.
pub const PARAMETERS: [Parameter; 14] = [
    real("amplitude", "x", (-1e4, 1e4), "greatest deviation from the offset", |c| c.amplitude, |c, x| c.amplitude = x),
    real("offset", "x", (-1e4, 1e4), "added to all values", |c| c.offset, |c, x| c.offset = x),
    real("dwell_s", "s", DURATION, "time on a level (multi-step: mean time)", |c| c.dwell_s, |c, x| c.dwell_s = x),
    whole("levels", MAX_32_BITS, (1.0, 1000.0), "levels on each side of zero", |c| f64::from(c.levels), |c, x| c.levels = x as u32),
    real("bit_s", "s", DURATION, "duration of a bit", |c| c.bit_s, |c, x| c.bit_s = x),
    real("from_Hz", "Hz", FREQUENCY, "lowest frequency", |c| c.from_Hz, |c, x| c.from_Hz = x),
    real("to_Hz", "Hz", FREQUENCY, "highest frequency", |c| c.to_Hz, |c, x| c.to_Hz = x),
    real("sweep_s", "s", DURATION, "duration of a chirp", |c| c.sweep_s, |c, x| c.sweep_s = x),
    real("frequency_Hz", "Hz", FREQUENCY, "frequency", |c| c.frequency_Hz, |c, x| c.frequency_Hz = x),
    real("acceleration", "x/s", (1e-3, 1e6), "limit of the change per second", |c| c.acceleration, |c, x| c.acceleration = x),
    real("jerk", "x/s2", (1e-3, 1e9), "limit of the change of acceleration per second", |c| c.jerk, |c, x| c.jerk = x),
    whole("cycles", MAX_32_BITS, (0.0, 1e6), "number of cycles; 0: without end", |c| f64::from(c.cycles), |c, x| c.cycles = x as u32),
    whole("turns", MAX_32_BITS, (1.0, 1e6), "number of turns", |c| f64::from(c.turns), |c, x| c.turns = x as u32),
    whole("seed", MAX_53_BITS, (0.0, MAX_53_BITS), "seed of the random profiles", |c| c.seed as f64, |c, x| c.seed = x as u64),
];

const fn real(
    name: &'static str,
    unit: &'static str,
    range: (f64, f64),
    help: &'static str,
    read: fn(&ProfileConfig) -> f64,
    write: fn(&mut ProfileConfig, f64),
) -> Parameter {
    Parameter { name, unit, range, help, read, write: Write::Real(write) }
}

const fn whole(
    name: &'static str,
    most: f64,
    range: (f64, f64),
    help: &'static str,
    read: fn(&ProfileConfig) -> f64,
    write: fn(&mut ProfileConfig, f64),
) -> Parameter {
    Parameter { name, unit: "", range, help, read, write: Write::Whole(most, write) }
}
