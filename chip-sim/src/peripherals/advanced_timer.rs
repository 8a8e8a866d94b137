//! TIM1 (RM0390 §16) as the bridge's timer: centre-aligned counting, repetition counter, preloaded compare values, break and main output
//! enable.

use crate::peripherals::rcc::period;
use crate::time::{NEVER, Time};

const CR1_CEN: u32 = 1;
const CR1_CMS: u32 = 3 << 5;
const BDTR_MOE: u32 = 1 << 15;
const BDTR_OSSI: u32 = 1 << 10;
const PWM_MODE_1: u32 = 6;
const PWM_MODE_2: u32 = 7;

/// What happened at a turning point of the counter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Turn {
    /// Time of the turning point.
    pub at: Time,
    /// The update event came: shadow registers are loaded.
    pub update: bool,
    /// The counter starts to count up.
    pub at_bottom: bool,
}

/// The timer.
pub struct AdvancedTimer {
    cr1: u32,
    cr2: u32,
    smcr: u32,
    dier: u32,
    sr: u32,
    ccmr: [u32; 2],
    ccer: u32,
    psc: u32,
    /// Preload registers and the shadows in force.
    arr: u32,
    arr_shadow: u32,
    rcr: u32,
    repetitions_left: u32,
    ccr: [u32; 4],
    ccr_shadow: [u32; 4],
    bdtr: u32,
    dcr: u32,
    clock: Time,
    counts_up: bool,
    next_turn: Time,
}

impl Default for AdvancedTimer {
    fn default() -> Self {
        Self {
            cr1: 0,
            cr2: 0,
            smcr: 0,
            dier: 0,
            sr: 0,
            ccmr: [0; 2],
            ccer: 0,
            psc: 0,
            arr: 0xFFFF,
            arr_shadow: 0xFFFF,
            rcr: 0,
            repetitions_left: 0,
            ccr: [0; 4],
            ccr_shadow: [0; 4],
            bdtr: 0,
            dcr: 0,
            clock: period(16_000_000),
            counts_up: true,
            next_turn: NEVER,
        }
    }
}

impl AdvancedTimer {
    /// The timer's clock changes; the running half period keeps its end.
    pub fn set_clock(&mut self, clock_Hz: u64) {
        self.clock = period(clock_Hz);
    }

    fn is_running(&self) -> bool {
        self.cr1 & CR1_CEN != 0
    }

    fn half_period(&self) -> Time {
        Time::from(self.arr_shadow.max(1)) * self.clock * Time::from(self.psc + 1)
    }

    /// Time of the next turning point.
    #[inline]
    pub fn next(&self) -> Time {
        self.next_turn
    }

    /// Passes the turning point that is due.
    pub fn turn(&mut self) -> Turn {
        let at = self.next_turn;
        self.counts_up = !self.counts_up;
        let update = self.repetitions_left == 0;
        if update {
            self.update_event();
            self.sr |= 1;
        } else {
            self.repetitions_left -= 1;
        }
        self.next_turn = at + self.half_period();
        Turn { at, update, at_bottom: self.counts_up }
    }

    fn update_event(&mut self) {
        self.ccr_shadow = self.ccr;
        self.arr_shadow = self.arr;
        self.repetitions_left = self.rcr;
    }

    fn mode(&self, channel: usize) -> u32 {
        self.ccmr[channel / 2] >> (8 * (channel % 2) + 4) & 7
    }

    /// Mean level of the output of `channel` (0 to 3) over a period of the counter; `None`: the timer does not drive the pin.
    pub fn mean_level(&self, channel: usize) -> Option<f64> {
        let enabled = self.ccer >> (4 * channel) & 1 != 0;
        if !enabled {
            return None;
        }
        if self.bdtr & BDTR_MOE == 0 {
            // With OSSI the output takes its idle level OISx, else the timer releases the pin (RM0390 §16.4.18).
            let idle = f64::from(self.cr2 >> (8 + 2 * channel) & 1);
            return (self.bdtr & BDTR_OSSI != 0).then_some(idle);
        }
        let active = f64::from(self.ccr_shadow[channel]) / f64::from(self.arr_shadow.max(1));
        let level = match self.mode(channel) {
            PWM_MODE_1 => active.min(1.0),
            PWM_MODE_2 => 1.0 - active.min(1.0),
            5 => 1.0,
            4 => 0.0,
            _ => return None,
        };
        let inverted = self.ccer >> (4 * channel + 1) & 1 != 0;
        Some(if inverted { 1.0 - level } else { level })
    }

    /// Time of the rising edge of OC3REF in the half period in which the counter counts up from `bottom`; `None` without an edge.
    pub fn compare3_rises(&self, bottom: Time) -> Option<Time> {
        let ready = self.is_running() && self.ccer & 0x100 != 0 && self.bdtr & BDTR_MOE != 0 && self.mode(2) == PWM_MODE_2;
        // Active while the count is above the compare value.
        (ready && self.ccr_shadow[2] < self.arr_shadow)
            .then(|| bottom + Time::from(self.ccr_shadow[2] + 1) * self.clock * Time::from(self.psc + 1))
    }

    /// The interrupt line of the update event.
    pub fn is_update_pending(&self) -> bool {
        self.sr & self.dier & 1 != 0
    }

    /// The interrupt line of the break.
    pub fn is_break_pending(&self) -> bool {
        self.sr & self.dier & 0x80 != 0
    }

    /// The break input is active, or the clock has failed: the outputs are disabled by hardware (RM0390 §16.3.12).
    pub fn break_now(&mut self) {
        if self.bdtr & 1 << 12 != 0 {
            self.bdtr &= !BDTR_MOE;
            self.sr |= 0x80;
        }
    }

    /// A register; `None`: not modelled.
    pub fn read(&self, offset: u32, now: Time) -> Option<u32> {
        Some(match offset {
            0x00 => self.cr1 & !0x10 | if self.counts_up { 0 } else { 0x10 },
            0x04 => self.cr2,
            0x08 => self.smcr,
            0x0C => self.dier,
            0x10 => self.sr,
            0x14 => 0,
            0x18 => self.ccmr[0],
            0x1C => self.ccmr[1],
            0x20 => self.ccer,
            0x24 => {
                let left = (self.next_turn.saturating_sub(now) / (self.clock * Time::from(self.psc + 1))) as u32;
                if !self.is_running() {
                    0
                } else if self.counts_up {
                    self.arr_shadow.saturating_sub(left)
                } else {
                    left.min(self.arr_shadow)
                }
            }
            0x28 => self.psc,
            0x2C => self.arr,
            0x30 => self.rcr,
            0x34..=0x40 => self.ccr[(offset as usize - 0x34) / 4],
            0x44 => self.bdtr,
            0x48 => self.dcr,
            _ => return None,
        })
    }

    /// Writes a register; `None`: not modelled (another alignment than centre-aligned included).
    pub fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        match offset {
            0x00 => {
                if value & CR1_CEN != 0 && value & CR1_CMS == 0 {
                    return None;
                }
                if value & !self.cr1 & CR1_CEN != 0 {
                    self.counts_up = true;
                    self.next_turn = now + self.half_period();
                } else if value & CR1_CEN == 0 {
                    self.next_turn = NEVER;
                }
                self.cr1 = value & 0x3EF;
            }
            0x04 => self.cr2 = value,
            0x08 => self.smcr = value,
            0x0C => self.dier = value,
            0x10 => self.sr &= value,
            0x14 => {
                if value & 1 != 0 {
                    self.update_event();
                    self.counts_up = true;
                    if self.is_running() {
                        self.next_turn = now + self.half_period();
                    }
                    if self.cr1 & 4 == 0 {
                        self.sr |= 1;
                    }
                }
                if value & 0x80 != 0 {
                    self.break_now();
                }
            }
            0x18 => self.ccmr[0] = value,
            0x1C => self.ccmr[1] = value,
            0x20 => self.ccer = value,
            0x24 => {}
            0x28 => self.psc = value & 0xFFFF,
            0x2C => {
                self.arr = value & 0xFFFF;
                if self.cr1 & 0x80 == 0 {
                    self.arr_shadow = self.arr;
                }
            }
            0x30 => self.rcr = value & 0xFF,
            0x34..=0x40 => {
                let channel = (offset as usize - 0x34) / 4;
                self.ccr[channel] = value & 0xFFFF;
                if self.ccmr[channel / 2] >> (8 * (channel % 2)) & 8 == 0 {
                    self.ccr_shadow[channel] = self.ccr[channel];
                }
            }
            0x44 => self.bdtr = value & 0xFFFF,
            0x48 => self.dcr = value,
            _ => return None,
        }
        Some(())
    }
}
