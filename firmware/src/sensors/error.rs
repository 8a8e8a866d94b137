//! Errors of the sensor under test.

use core::fmt;

/// The reason why there are no samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorError {
    /// The SPI transfer failed on the side of the processor.
    Bus,
    /// No answer: all bits are equal.
    Absent {
        /// Value read from WHO_AM_I.
        who_am_i: u8,
        /// Expected value.
        expected: u8,
    },
    /// Another chip answers.
    WrongChip {
        /// Value read from WHO_AM_I.
        who_am_i: u8,
        /// Expected value.
        expected: u8,
    },
    /// A register does not hold the value written to it.
    NotConfigured {
        /// Address of the register.
        register: u8,
        /// Value written.
        wrote: u8,
        /// Value read back.
        read: u8,
    },
    /// The data are impossible.
    InvalidData(&'static str),
    /// The chip answers, but gives no samples.
    Silent,
}

impl fmt::Display for SensorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus => f.write_str("the SPI transfer failed on the processor's side"),
            Self::Absent { who_am_i, expected } => {
                write!(
                    f,
                    "WHO_AM_I is {who_am_i:#04x} instead of {expected:#04x}: no sensor, or no power; check its supply and the wires CS, SCK, SDO"
                )
            }
            Self::WrongChip { who_am_i, expected } => {
                write!(f, "WHO_AM_I is {who_am_i:#04x} instead of {expected:#04x}: another part, or a bad wire")
            }
            Self::NotConfigured { register, wrote, read } => {
                write!(f, "register {register:#04x} reads {read:#04x} after {wrote:#04x} was written: check the wire SDI and the supply")
            }
            Self::InvalidData(what) => write!(f, "{what}: check the wires' length and ground"),
            Self::Silent => f.write_str("the sensor answers, but gives no samples"),
        }
    }
}

impl core::error::Error for SensorError {}
