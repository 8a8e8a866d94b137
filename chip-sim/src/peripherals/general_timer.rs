//! General-purpose timers TIM2 to TIM5 (RM0390 §17) as the stand uses them: encoder counters, free-running counters with captures.

use crate::time::{PER_S, Time};

const CR1_CEN: u32 = 1;
const SMCR_SMS: u32 = 7;
/// Encoder mode 3: counts on both inputs.
const ENCODER_BOTH: u32 = 3;

/// One timer.
pub struct GeneralTimer {
    cr1: u32,
    cr2: u32,
    smcr: u32,
    dier: u32,
    sr: u32,
    ccmr: [u32; 2],
    ccer: u32,
    psc: u32,
    arr: u32,
    ccr: [u32; 4],
    dcr: u32,
    or: u32,
    /// Bits of the counter.
    mask: u32,
    /// Count at `since`, and the clock from then on.
    count: u32,
    since: Time,
    clock_Hz: u64,
    /// Encoder mode: disc count at which the counter is zero.
    encoder_zero: i64,
}

impl GeneralTimer {
    /// A timer after reset; 32 bits for TIM2 and TIM5.
    pub fn new(wide: bool) -> Self {
        let mask = if wide { u32::MAX } else { 0xFFFF };
        Self {
            cr1: 0,
            cr2: 0,
            smcr: 0,
            dier: 0,
            sr: 0,
            ccmr: [0; 2],
            ccer: 0,
            psc: 0,
            arr: mask,
            ccr: [0; 4],
            dcr: 0,
            or: 0,
            mask,
            count: 0,
            since: 0,
            clock_Hz: 16_000_000,
            encoder_zero: 0,
        }
    }

    fn is_encoder(&self) -> bool {
        self.smcr & SMCR_SMS == ENCODER_BOTH
    }

    /// Whether the counter is enabled.
    pub fn is_running(&self) -> bool {
        self.cr1 & CR1_CEN != 0
    }

    /// The free-running count at `at`.
    pub fn count_at(&self, at: Time) -> u32 {
        if !self.is_running() {
            return self.count;
        }
        let ticks = u128::from(at.saturating_sub(self.since)) * u128::from(self.clock_Hz) / u128::from(PER_S) / u128::from(self.psc + 1);
        let period = u128::from(self.arr) + 1;
        ((u128::from(self.count) + ticks) % period) as u32 & self.mask
    }

    /// Fixes the count at `now` before something that determines it changes.
    fn rebase(&mut self, now: Time) {
        self.count = self.count_at(now);
        self.since = now;
    }

    /// The timer's clock changes.
    pub fn set_clock(&mut self, clock_Hz: u64, now: Time) {
        if clock_Hz != self.clock_Hz {
            self.rebase(now);
            self.clock_Hz = clock_Hz;
        }
    }

    /// Whether capture channel `channel` (0 to 3) is enabled, as an input.
    fn captures(&self, channel: usize) -> bool {
        let selected = self.ccmr[channel / 2] >> (8 * (channel % 2)) & 3;
        self.is_running() && self.ccer >> (4 * channel) & 1 != 0 && selected != 0
    }

    fn capture(&mut self, channel: usize, value: u32) {
        if self.sr >> (channel + 1) & 1 != 0 {
            self.sr |= 1 << (channel + 9); // overcapture
        }
        self.ccr[channel] = value & self.mask;
        self.sr |= 1 << (channel + 1);
    }

    /// An edge of the encoder at `at`, on the input of channel 1 as A XOR B.
    pub fn encoder_edge(&mut self, at: Time) {
        // TI1S: the XOR of the inputs; both polarity bits: both edges (RM0390 §17.3.19).
        if self.captures(0) && self.cr2 & 0x80 != 0 && self.ccer & 0xA == 0xA && !self.is_encoder() {
            let count = self.count_at(at);
            self.capture(0, count);
        }
    }

    /// A rising edge at `at` on the input of `channel`; `disc` is the count of the disc.
    pub fn rising_edge(&mut self, channel: usize, at: Time, disc: i64) {
        if self.captures(channel) {
            let count = if self.is_encoder() { (disc - self.encoder_zero) as u32 } else { self.count_at(at) };
            self.capture(channel, count);
        }
    }

    /// The interrupt line.
    pub fn is_pending(&self) -> bool {
        self.sr & self.dier & 0x5F != 0
    }

    /// A register; `disc`: count of the decoder in encoder mode. `None`: not modelled.
    pub fn read(&mut self, offset: u32, now: Time, disc: i64) -> Option<u32> {
        Some(match offset {
            0x00 => self.cr1,
            0x04 => self.cr2,
            0x08 => self.smcr,
            0x0C => self.dier,
            0x10 => self.sr,
            0x14 => 0,
            0x18 => self.ccmr[0],
            0x1C => self.ccmr[1],
            0x20 => self.ccer,
            0x24 if self.is_encoder() && self.is_running() => (disc - self.encoder_zero) as u32 & self.mask,
            0x24 => self.count_at(now),
            0x28 => self.psc,
            0x2C => self.arr,
            0x34..=0x40 => {
                let channel = (offset as usize - 0x34) / 4;
                // Reading a capture clears its flag.
                self.sr &= !(2 << channel);
                self.ccr[channel]
            }
            0x48 => self.dcr,
            0x50 => self.or,
            _ => return None,
        })
    }

    /// Writes a register; `None`: not modelled.
    pub fn write(&mut self, offset: u32, value: u32, now: Time, disc: i64) -> Option<()> {
        self.rebase(now);
        match offset {
            0x00 => {
                if value & !self.cr1 & CR1_CEN != 0 && self.is_encoder() {
                    self.encoder_zero = disc - i64::from(self.count);
                }
                self.cr1 = value & 0x3FF;
            }
            0x04 => self.cr2 = value,
            0x08 => self.smcr = value,
            0x0C => self.dier = value,
            0x10 => self.sr &= value,
            0x14 => {
                if value & 1 != 0 {
                    // UG initialises the counter (and loads the prescaler); URS keeps the flag low.
                    self.count = 0;
                    self.encoder_zero = disc;
                    if self.cr1 & 4 == 0 {
                        self.sr |= 1;
                    }
                }
            }
            0x18 => self.ccmr[0] = value,
            0x1C => self.ccmr[1] = value,
            0x20 => self.ccer = value,
            0x24 => {
                self.count = value & self.mask;
                self.encoder_zero = disc - i64::from(self.count);
            }
            0x28 => self.psc = value & 0xFFFF,
            0x2C => self.arr = value & self.mask,
            0x34..=0x40 => self.ccr[(offset as usize - 0x34) / 4] = value & self.mask,
            0x48 => self.dcr = value,
            0x50 => self.or = value,
            _ => return None,
        }
        Some(())
    }
}
