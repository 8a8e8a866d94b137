//! ADC1 (RM0390 §13): regular sequence of up to 16 conversions, started by the timer's edge, with DMA, overrun included.

use crate::time::{NEVER, Time};

const SR_EOC: u32 = 1 << 1;
const SR_STRT: u32 = 1 << 4;
const SR_OVR: u32 = 1 << 5;
const CR2_ADON: u32 = 1;
const CR2_DMA: u32 = 1 << 8;
/// External trigger TIM1_CC3 (RM0390, table 83), rising edge.
const TRIGGER_TIM1_CC3: u32 = 2;

/// The converter.
#[derive(Default)]
pub struct Adc {
    sr: u32,
    cr: [u32; 2],
    smpr: [u32; 2],
    jofr: [u32; 4],
    thresholds: [u32; 2],
    sqr: [u32; 3],
    jsqr: u32,
    dr: u32,
    ccr: u32,
    /// Rank of the running conversion, and its end.
    rank: usize,
    ends: Option<Time>,
    /// Fault: no trigger starts a sequence.
    pub is_stuck: bool,
    /// Complete sequences.
    pub sequences: u64,
    /// Triggers that came while a sequence was running.
    pub missed_triggers: u64,
}

impl Adc {
    /// Registers as after a reset; the counters stay.
    pub fn reset(&mut self) {
        *self = Self { sequences: self.sequences, missed_triggers: self.missed_triggers, ..Self::default() };
    }

    /// End of the running conversion.
    #[inline]
    pub fn next(&self) -> Time {
        self.ends.unwrap_or(NEVER)
    }

    /// Whether the converter is on.
    pub fn is_on(&self) -> bool {
        self.cr[1] & CR2_ADON != 0
    }

    /// Whether a rising edge of TIM1's channel 3 starts the sequence.
    pub fn waits_for_trigger(&self) -> bool {
        self.is_on() && self.cr[1] >> 28 & 3 == 1 && self.cr[1] >> 24 & 15 == TRIGGER_TIM1_CC3 && self.sr & SR_OVR == 0
    }

    /// Channel of the running conversion.
    pub fn channel(&self) -> u32 {
        let (register, position) = match self.rank {
            0..6 => (2, self.rank),
            6..12 => (1, self.rank - 6),
            _ => (0, self.rank - 12),
        };
        self.sqr[register] >> (5 * position) & 31
    }

    /// Duration of the running conversion with this clock of APB2: sample time and 12 cycles.
    fn duration(&self, pclk: Time) -> Time {
        let channel = self.channel();
        let time = if channel >= 10 { self.smpr[0] >> (3 * (channel - 10)) } else { self.smpr[1] >> (3 * channel) } & 7;
        let cycles = 12 + [3, 15, 28, 56, 84, 112, 144, 480][time as usize];
        cycles * 2 * Time::from((self.ccr >> 16 & 3) + 1) * pclk
    }

    /// The trigger came at `at`; `pclk`: period of APB2.
    pub fn trigger(&mut self, at: Time, pclk: Time) {
        if self.is_stuck || !self.waits_for_trigger() {
            return;
        }
        if self.ends.is_some() {
            self.missed_triggers += 1;
            return;
        }
        self.rank = 0;
        self.sr |= SR_STRT;
        self.ends = Some(at + self.duration(pclk));
    }

    /// The running conversion has ended with `code`.
    pub fn convert(&mut self, code: u32, pclk: Time) {
        let Some(at) = self.ends.take() else { return };
        if self.sr & SR_EOC != 0 && self.cr[1] & CR2_DMA != 0 {
            // The last result was not fetched: no further DMA request until the flag is cleared (RM0390 §13.8.1).
            self.sr |= SR_OVR;
            return;
        }
        self.dr = code;
        self.sr |= SR_EOC;
        if self.rank == (self.sqr[0] >> 20 & 15) as usize {
            self.sequences += 1;
        } else {
            self.rank += 1;
            self.ends = Some(at + self.duration(pclk));
        }
    }

    /// A DMA request is pending.
    pub fn requests_dma(&self) -> bool {
        self.sr & (SR_EOC | SR_OVR) == SR_EOC && self.cr[1] & CR2_DMA != 0
    }

    /// The interrupt line.
    pub fn is_pending(&self) -> bool {
        self.sr & SR_EOC != 0 && self.cr[0] & 1 << 5 != 0 || self.sr & SR_OVR != 0 && self.cr[0] & 1 << 26 != 0
    }

    /// A register; `None`: not modelled.
    pub fn read(&mut self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.sr,
            0x04 => self.cr[0],
            0x08 => self.cr[1],
            0x0C | 0x10 => self.smpr[(offset as usize - 0x0C) / 4],
            0x14..=0x20 => self.jofr[(offset as usize - 0x14) / 4],
            0x24 | 0x28 => self.thresholds[(offset as usize - 0x24) / 4],
            0x2C..=0x34 => self.sqr[(offset as usize - 0x2C) / 4],
            0x38 => self.jsqr,
            0x4C => {
                self.sr &= !SR_EOC;
                self.dr
            }
            0x304 => self.ccr,
            _ => return None,
        })
    }

    /// Writes a register; `None`: not modelled.
    pub fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            0x00 => self.sr &= value,
            0x04 => self.cr[0] = value,
            0x08 => {
                if value & CR2_ADON == 0 {
                    self.ends = None;
                }
                // SWSTART is not modelled: the stand starts conversions by the timer only.
                if value & 1 << 30 != 0 {
                    return None;
                }
                self.cr[1] = value;
            }
            0x0C | 0x10 => self.smpr[(offset as usize - 0x0C) / 4] = value,
            0x14..=0x20 => self.jofr[(offset as usize - 0x14) / 4] = value,
            0x24 | 0x28 => self.thresholds[(offset as usize - 0x24) / 4] = value,
            0x2C..=0x34 => self.sqr[(offset as usize - 0x2C) / 4] = value,
            0x38 => self.jsqr = value,
            0x304 => self.ccr = value,
            _ => return None,
        }
        Some(())
    }
}
