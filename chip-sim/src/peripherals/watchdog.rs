//! Independent watchdog (RM0390 §20) and window watchdog (RM0390 §21).

use crate::peripherals::rcc::period;
use crate::time::{NEVER, Time};

/// Frequency of the internal low-speed oscillator, Hz, typical (DS10693, table 42: 17 to 47 kHz).
const LSI_HZ: u64 = 32_000;

/// The independent watchdog.
pub struct IndependentWatchdog {
    prescaler: u32,
    reload: u32,
    unlocked: bool,
    /// Time of the reset.
    expires: Time,
    /// Refreshes since power-on.
    pub refreshes: u64,
}

impl Default for IndependentWatchdog {
    fn default() -> Self {
        Self { prescaler: 0, reload: 0xFFF, unlocked: false, expires: NEVER, refreshes: 0 }
    }
}

impl IndependentWatchdog {
    /// Time of the reset; never before the start.
    #[inline]
    pub fn next(&self) -> Time {
        self.expires
    }

    /// A register; `None`: not modelled.
    pub fn read(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => 0,
            0x04 => self.prescaler,
            0x08 => self.reload,
            0x0C => 0, // registers are updated at once
            _ => return None,
        })
    }

    /// Writes a register; `None`: not modelled.
    pub fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        match (offset, value) {
            (0x00, 0x5555) => self.unlocked = true,
            (0x00, 0xAAAA | 0xCCCC) => {
                self.unlocked = false;
                if value == 0xCCCC || self.expires != NEVER {
                    self.expires = now + Time::from(self.reload + 1) * (4 << self.prescaler.min(6)) * period(LSI_HZ);
                    self.refreshes += 1;
                }
            }
            (0x04, _) if self.unlocked => self.prescaler = value & 7,
            (0x08, _) if self.unlocked => self.reload = value & 0xFFF,
            (0x00 | 0x04 | 0x08, _) => {}
            _ => return None,
        }
        Some(())
    }
}

/// The window watchdog: counts down from APB1's clock / 4096 / prescaler; resets where bit 6 becomes zero.
pub struct WindowWatchdog {
    cr: u32,
    cfr: u32,
    sr: u32,
    /// Time at which `cr` was written.
    since: Time,
    /// Period of APB1.
    pub pclk: Time,
}

impl Default for WindowWatchdog {
    fn default() -> Self {
        Self { cr: 0x7F, cfr: 0x7F, sr: 0, since: 0, pclk: 45 }
    }
}

impl WindowWatchdog {
    fn step(&self) -> Time {
        (4096 * self.pclk) << (self.cfr >> 7 & 3)
    }

    fn counter(&self, now: Time) -> u32 {
        let passed = (now.saturating_sub(self.since) / self.step()) as u32;
        (self.cr & 0x7F).saturating_sub(passed)
    }

    /// Time of the reset; never before the start.
    #[inline]
    pub fn next(&self) -> Time {
        if self.cr & 0x80 == 0 {
            return NEVER;
        }
        self.since + Time::from((self.cr & 0x7F).saturating_sub(0x3F)) * self.step()
    }

    /// A register; `None`: not modelled.
    pub fn read(&self, offset: u32, now: Time) -> Option<u32> {
        Some(match offset {
            0x00 => self.cr & 0x80 | if self.cr & 0x80 != 0 { self.counter(now) } else { self.cr & 0x7F },
            0x04 => self.cfr,
            0x08 => self.sr,
            _ => return None,
        })
    }

    /// Writes a register; `None`: not modelled. `Some(true)`: a refresh outside the window resets the chip.
    pub fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<bool> {
        match offset {
            0x00 => {
                let early = self.cr & 0x80 != 0 && self.counter(now) > self.cfr & 0x7F;
                self.cr = self.cr & 0x80 | value & 0xFF;
                self.since = now;
                return Some(early || self.cr & 0xC0 == 0x80);
            }
            0x04 => self.cfr = value & 0x3FF,
            0x08 => self.sr &= value,
            _ => return None,
        }
        Some(false)
    }
}
