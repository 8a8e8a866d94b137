//! TIM8 (RM0390 §16) as a timeout: counting up, update event with its flag and its DMA request.

use crate::peripherals::rcc::period;
use crate::time::{NEVER, Time};

const CR1_CEN: u32 = 1;
const CR1_UDIS: u32 = 1 << 1;
/// Only the counter's overflow sets the flag and requests DMA, not UG.
const CR1_URS: u32 = 1 << 2;
const CR1_OPM: u32 = 1 << 3;
const DIER_UIE: u32 = 1;
const DIER_UDE: u32 = 1 << 8;

/// The timer.
pub struct UpCounter {
    cr1: u32,
    dier: u32,
    sr: u32,
    psc: u32,
    /// Prescaler in force: loaded at an update event.
    psc_shadow: u32,
    arr: u32,
    clock: Time,
    /// Time at which the count was zero; where the counter is stopped, the count.
    zero_at: Time,
    stopped_count: u32,
    requests_dma: bool,
}

impl Default for UpCounter {
    fn default() -> Self {
        Self {
            cr1: 0,
            dier: 0,
            sr: 0,
            psc: 0,
            psc_shadow: 0,
            arr: 0xFFFF,
            clock: period(16_000_000),
            zero_at: 0,
            stopped_count: 0,
            requests_dma: false,
        }
    }
}

impl UpCounter {
    /// The timer's clock changes at `now`; the count goes on from where it is.
    pub fn set_clock(&mut self, clock_Hz: u64, now: Time) {
        let count = self.count(now);
        self.clock = period(clock_Hz);
        self.zero_at = now.saturating_sub(Time::from(count) * self.step());
    }

    fn step(&self) -> Time {
        self.clock * Time::from(self.psc_shadow + 1)
    }

    fn is_running(&self) -> bool {
        self.cr1 & CR1_CEN != 0
    }

    fn count(&self, now: Time) -> u32 {
        if self.is_running() { (now.saturating_sub(self.zero_at) / self.step()) as u32 } else { self.stopped_count }
    }

    /// Time of the next overflow.
    #[inline]
    pub fn next(&self) -> Time {
        if self.is_running() { self.zero_at + Time::from(self.arr + 1) * self.step() } else { NEVER }
    }

    /// Passes the overflow that is due.
    pub fn overflow(&mut self) {
        self.zero_at = self.next();
        if self.cr1 & CR1_OPM != 0 {
            self.cr1 &= !CR1_CEN;
            self.stopped_count = 0;
        }
        self.update_event(true);
    }

    fn update_event(&mut self, signals: bool) {
        self.psc_shadow = self.psc;
        if signals {
            self.sr |= 1;
            self.requests_dma |= self.dier & DIER_UDE != 0;
        }
    }

    /// Takes the DMA request of the update event.
    pub fn take_dma_request(&mut self) -> bool {
        std::mem::take(&mut self.requests_dma)
    }

    /// The interrupt line of the update event.
    pub fn is_pending(&self) -> bool {
        self.sr & self.dier & DIER_UIE != 0
    }

    /// A register; `None`: not modelled.
    pub fn read(&self, offset: u32, now: Time) -> Option<u32> {
        Some(match offset {
            0x00 => self.cr1,
            0x04 | 0x08 => 0,
            0x0C => self.dier,
            0x10 => self.sr,
            0x24 => self.count(now),
            0x28 => self.psc,
            0x2C => self.arr,
            0x30 => 0,
            _ => return None,
        })
    }

    /// Writes a register; `None`: not modelled (other modes, channels, repetitions, preload of the top).
    pub fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        match offset {
            0x00 => {
                if value & !(CR1_CEN | CR1_URS | CR1_OPM) != 0 || value & CR1_UDIS != 0 {
                    return None;
                }
                let count = self.count(now);
                self.cr1 = value;
                self.stopped_count = count;
                self.zero_at = now.saturating_sub(Time::from(count) * self.step());
            }
            0x04 | 0x08 | 0x30 if value == 0 => {}
            0x0C => self.dier = value,
            0x10 => self.sr &= value,
            0x14 if value == 1 => {
                self.update_event(self.cr1 & CR1_URS == 0);
                self.zero_at = now;
                self.stopped_count = 0;
            }
            0x28 => self.psc = value & 0xFFFF,
            0x2C => self.arr = value & 0xFFFF,
            _ => return None,
        }
        Some(())
    }
}
