//! SPI2 (RM0390 §26) as a master with 8 bits: bit times, buffers, overrun.

use crate::time::{NEVER, Time};
use embedded_hal::spi::{Mode, Phase, Polarity};

const SR_RXNE: u32 = 1;
const SR_TXE: u32 = 1 << 1;
const SR_OVR: u32 = 1 << 6;
const SR_BSY: u32 = 1 << 7;
const CR1_SPE: u32 = 1 << 6;
const CR1_DFF: u32 = 1 << 11;

/// The master.
pub struct Spi {
    cr: [u32; 2],
    sr: u32,
    dr: u8,
    crcpr: u32,
    i2s: [u32; 2],
    shifting: Option<(u8, Time)>,
    waiting: Option<u8>,
    /// Period of APB1.
    pub pclk: Time,
}

impl Default for Spi {
    fn default() -> Self {
        Self { cr: [0; 2], sr: SR_TXE, dr: 0, crcpr: 7, i2s: [0, 2], shifting: None, waiting: None, pclk: 45 }
    }
}

impl Spi {
    fn byte_time(&self) -> Time {
        8 * (2 << (self.cr[0] >> 3 & 7)) * self.pclk
    }

    /// Polarity and phase of the clock.
    pub fn mode(&self) -> Mode {
        let polarity = if self.cr[0] & 2 != 0 { Polarity::IdleHigh } else { Polarity::IdleLow };
        let phase = if self.cr[0] & 1 != 0 { Phase::CaptureOnSecondTransition } else { Phase::CaptureOnFirstTransition };
        Mode { polarity, phase }
    }

    /// End of the byte on the bus.
    #[inline]
    pub fn next(&self) -> Time {
        self.shifting.map_or(NEVER, |(_, end)| end)
    }

    /// The byte on the bus at its end.
    pub fn sent(&self) -> Option<u8> {
        self.shifting.map(|(byte, _)| byte)
    }

    /// The byte on the bus has ended; the device answered `received`.
    pub fn finish(&mut self, received: u8) {
        let Some((_, end)) = self.shifting.take() else { return };
        if self.sr & SR_RXNE != 0 {
            self.sr |= SR_OVR;
        }
        self.dr = received;
        self.sr |= SR_RXNE;
        match self.waiting.take() {
            Some(next) => {
                self.sr |= SR_TXE;
                self.shifting = Some((next, end + self.byte_time()));
            }
            None => self.sr &= !SR_BSY,
        }
    }

    /// DMA requests of receiver and transmitter.
    pub fn requests_dma(&self) -> [bool; 2] {
        let on = self.cr[0] & CR1_SPE != 0;
        [on && self.cr[1] & 1 != 0 && self.sr & SR_RXNE != 0, on && self.cr[1] & 2 != 0 && self.sr & SR_TXE != 0]
    }

    /// The interrupt line.
    pub fn is_pending(&self) -> bool {
        self.cr[1] & 0x40 != 0 && self.sr & SR_RXNE != 0
            || self.cr[1] & 0x80 != 0 && self.sr & SR_TXE != 0
            || self.cr[1] & 0x20 != 0 && self.sr & SR_OVR != 0
    }

    /// A register; `None`: not modelled.
    pub fn read(&mut self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 | 0x04 => self.cr[offset as usize / 4],
            0x08 => self.sr,
            0x0C => {
                self.sr &= !(SR_RXNE | SR_OVR);
                u32::from(self.dr)
            }
            0x10 => self.crcpr,
            0x1C | 0x20 => self.i2s[(offset as usize - 0x1C) / 4],
            _ => return None,
        })
    }

    /// Writes a register; `None`: not modelled (frames of 16 bits included).
    pub fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        match offset {
            0x00 if value & CR1_DFF != 0 => return None,
            0x00 | 0x04 => self.cr[offset as usize / 4] = value,
            0x08 => {}
            0x0C => {
                self.sr |= SR_BSY;
                if self.shifting.is_none() {
                    self.shifting = Some((value as u8, now + self.byte_time()));
                } else {
                    self.waiting = Some(value as u8);
                    self.sr &= !SR_TXE;
                }
            }
            0x10 => self.crcpr = value,
            0x1C | 0x20 => self.i2s[(offset as usize - 0x1C) / 4] = value,
            _ => return None,
        }
        Some(())
    }
}
