//! Why there is no reading, in words for the bench.

use core::fmt;

/// Why there is no reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// The processor's side of the line failed.
    Bus,
    /// Nothing answers: all bits alike.
    Absent {
        /// What was read as WHO_AM_I.
        who_am_i: u8,
        /// What it should be.
        expected: u8,
    },
    /// Something else answers.
    WrongChip {
        /// What it says it is.
        who_am_i: u8,
        /// What it should be.
        expected: u8,
    },
    /// A register does not hold what was written to it.
    NotConfigured {
        /// Its address.
        register: u8,
        /// What was written.
        wrote: u8,
        /// What was read back.
        read: u8,
    },
    /// What it answers cannot be.
    Rubbish(&'static str),
    /// It answers, but no sample comes.
    Silent,
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus => f.write_str("the SPI transfer failed on the processor's side"),
            Self::Absent { who_am_i, expected } => {
                write!(
                    f,
                    "WHO_AM_I {who_am_i:#04x} instead of {expected:#04x}: no sensor, or no power; check its supply and the wires CS, SCK, SDO"
                )
            }
            Self::WrongChip { who_am_i, expected } => {
                write!(f, "WHO_AM_I {who_am_i:#04x} instead of {expected:#04x}: another part, or a bad wire")
            }
            Self::NotConfigured { register, wrote, read } => {
                write!(f, "register {register:#04x} reads {read:#04x} after {wrote:#04x} was written: check the wire SDI and the supply")
            }
            Self::Rubbish(what) => write!(f, "{what}: check the wires' length and ground"),
            Self::Silent => f.write_str("the sensor answers, but no sample comes"),
        }
    }
}

impl core::error::Error for Trouble {}
