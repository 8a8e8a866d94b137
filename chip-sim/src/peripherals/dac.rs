//! DAC (RM0390 §14), channel 1 with 12 bits right-aligned: the torquer's output.

use crate::time::Time;

/// The registers of channel 1 that a simple output uses.
#[derive(Default)]
pub struct Dac {
    cr: u32,
    holding: u32,
    /// Time and code of each output that differs from the one before.
    pub outputs: Vec<(Time, u16)>,
}

impl Dac {
    /// Registers as after a reset.
    pub fn reset(&mut self) {
        *self = Self { outputs: std::mem::take(&mut self.outputs), ..Self::default() };
    }

    /// The code at the pin; `None`: the channel is off.
    pub fn code(&self) -> Option<u16> {
        (self.cr & 1 != 0).then_some(self.holding as u16 & 0xFFF)
    }

    /// A register; `None`: not modelled.
    pub fn read(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.cr,
            0x08 => self.holding,
            0x2C => self.holding,
            0x34 => 0,
            _ => return None,
        })
    }

    /// Writes a register; `None`: not modelled.
    pub fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        match offset {
            0x00 => self.cr = value,
            0x04 => {}
            0x08 => {
                self.holding = value & 0xFFF;
                if self.outputs.last().is_none_or(|(_, code)| u32::from(*code) != self.holding) {
                    self.outputs.push((now, self.holding as u16));
                }
            }
            0x34 => {}
            _ => return None,
        }
        Some(())
    }
}
