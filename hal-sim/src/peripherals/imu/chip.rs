//! The part on the platform: one of the supported chips.

use super::adxl355::Adxl355;
use super::fault::Fault;
use super::ism330dhcx::Ism330dhcx;
use embedded_hal_async::spi::{MODE_0, MODE_3, Mode};
use serde::{Deserialize, Serialize};

/// Type of the sensor under test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// ST's gyro with accelerometer.
    #[default]
    Ism330dhcx,
    /// Analog Devices' accelerometer.
    Adxl355,
}

/// A chip behind its bus.
#[derive(Clone, Debug)]
#[expect(missing_docs, reason = "as in Part")]
pub enum Chip {
    Ism330dhcx(Box<Ism330dhcx>),
    Adxl355(Box<Adxl355>),
}

/// Calls a method of the present chip.
macro_rules! of_chip {
    ($self:ident, $chip:ident => $call:expr) => {
        match $self {
            Chip::Ism330dhcx($chip) => $call,
            Chip::Adxl355($chip) => $call,
        }
    };
}

impl Chip {
    /// Sets or clears a fault.
    pub fn set_fault(&mut self, fault: Fault) {
        of_chip!(self, chip => chip.set_fault(fault));
    }

    /// Whether the chip takes samples.
    #[inline]
    pub fn samples(&self) -> bool {
        of_chip!(self, chip => chip.samples())
    }

    /// Number of software resets; a part without a gyro has no bias of a start.
    #[inline]
    pub fn starts(&self) -> u32 {
        match self {
            Self::Ism330dhcx(chip) => chip.starts(),
            Self::Adxl355(_) => 0,
        }
    }

    /// Advances without samples.
    #[inline]
    pub fn pass(&mut self, now_s: f64) {
        of_chip!(self, chip => chip.pass(now_s));
    }

    /// Ends a tick at `now_s` with these rates and forces at its end.
    pub fn tick(&mut self, now_s: f64, seen: &[f64; 6], temp_C: f64) {
        match self {
            Self::Ism330dhcx(chip) => chip.tick(now_s, seen, temp_C),
            Self::Adxl355(chip) => chip.tick(now_s, [seen[3], seen[4], seen[5]], temp_C),
        }
    }

    /// Chip select went low at `now_s`.
    pub fn select(&mut self, now_s: f64) {
        match self {
            Self::Ism330dhcx(chip) => chip.select(now_s),
            Self::Adxl355(chip) => chip.select(),
        }
    }

    /// Transfers a byte with the clock of `mode`. In the other mode than its own the chip shifts its answer one clock edge early, so that
    /// the controller reads each byte shifted by a bit.
    pub fn byte(&mut self, sent: u8, mode: Mode) -> u8 {
        let (own, answer) = match self {
            Self::Ism330dhcx(chip) => (MODE_3, chip.byte(sent)),
            Self::Adxl355(chip) => (MODE_0, chip.byte(sent)),
        };
        if mode == own { answer } else { answer << 1 | 1 }
    }
}
