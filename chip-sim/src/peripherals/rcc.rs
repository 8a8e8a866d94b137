//! Reset and clock control (RM0390 §6): oscillators, PLL, prescalers, clock gates, reset flags.

use crate::time::{NEVER, PER_S, PER_US, Time};

/// Frequency of the internal oscillator, Hz.
const HSI_HZ: u64 = 16_000_000;
/// The ST-Link's clock at OSC_IN, Hz.
const HSE_HZ: u64 = 8_000_000;
/// Lock time of the PLL, at most 300 µs (DS10693, table 43).
const PLL_LOCK: Time = 200 * PER_US;
/// Start-up of the internal low-speed oscillator (DS10693, table 42).
const LSI_START: Time = 15 * PER_US;
/// Start-up of the external clock in bypass mode: a few cycles.
const HSE_START: Time = PER_US;

const CR_HSION: u32 = 1;
const CR_HSIRDY: u32 = 1 << 1;
const CR_HSEON: u32 = 1 << 16;
const CR_HSERDY: u32 = 1 << 17;
const CR_CSSON: u32 = 1 << 19;
const CR_PLLON: u32 = 1 << 24;
const CR_PLLRDY: u32 = 1 << 25;
const CR_PLLI2SON: u32 = 1 << 26;
const CR_PLLSAION: u32 = 1 << 28;
/// Reset value of CSR: power-on, pin and brown-out flags.
const CSR_POWER_ON: u32 = 0x0E00_0000;
const CSR_RMVF: u32 = 1 << 24;
const CIR_CSSF: u32 = 1 << 7;
const CIR_CSSC: u32 = 1 << 23;

/// Why the chip was reset (flags of RCC_CSR, RM0390 §6.3.21).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// Power came on.
    PowerOn,
    /// NRST was pulled low.
    Pin,
    /// AIRCR.SYSRESETREQ.
    Software,
    /// The independent watchdog.
    IndependentWatchdog,
    /// The window watchdog.
    WindowWatchdog,
}

impl ResetCause {
    fn flags(self) -> u32 {
        match self {
            Self::PowerOn => CSR_POWER_ON,
            Self::Pin => 1 << 26,
            // Every internal reset also pulls NRST low (RM0390 §6.1.1).
            Self::Software => 1 << 28 | 1 << 26,
            Self::IndependentWatchdog => 1 << 29 | 1 << 26,
            Self::WindowWatchdog => 1 << 30 | 1 << 26,
        }
    }
}

/// The clocks in use, Hz.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clocks {
    /// Core, AHB.
    pub core_Hz: u64,
    /// Peripherals of APB1.
    pub apb1_Hz: u64,
    /// Peripherals of APB2.
    pub apb2_Hz: u64,
    /// Timers of APB1.
    pub apb1_timers_Hz: u64,
    /// Timers of APB2.
    pub apb2_timers_Hz: u64,
}

/// The registers, in words of their offset.
pub struct Rcc {
    words: [u32; 0x98 / 4],
    /// Whether the ST-Link's clock is present.
    hse_present: bool,
    hse_ready_at: Time,
    pll_ready_at: Time,
    lsi_ready_at: Time,
    /// The clock security system has seen the external clock fail: NMI until CIR.CSSC.
    failed: bool,
}

const CR: usize = 0;
const PLLCFGR: usize = 1;
const CFGR: usize = 2;
const CIR: usize = 3;
const CSR: usize = 0x74 / 4;

impl Rcc {
    /// The registers after a reset. `flags`: reset flags that were set before (they survive every reset but that of power-on).
    pub fn new(cause: ResetCause, flags: u32, hse_present: bool) -> Self {
        let mut words = [0; 0x98 / 4];
        words[CR] = 0x80 | CR_HSION;
        words[PLLCFGR] = 0x2400_3010;
        words[0x30 / 4] = 0x0010_0000;
        words[0x50 / 4] = 0x6067_90FF;
        words[CSR] = cause.flags() | if cause == ResetCause::PowerOn { 0 } else { flags & 0xFE00_0000 };
        words[0x84 / 4] = 0x2400_3000;
        words[0x88 / 4] = 0x2400_3000;
        Self { words, hse_present, hse_ready_at: NEVER, pll_ready_at: NEVER, lsi_ready_at: NEVER, failed: false }
    }

    /// Whether the ST-Link's clock is present.
    pub fn has_external_clock(&self) -> bool {
        self.hse_present
    }

    /// Reset flags, to carry over a reset.
    pub fn flags(&self) -> u32 {
        self.words[CSR]
    }

    /// A register; `None`: not modelled.
    pub fn read(&self, offset: u32, now: Time) -> Option<u32> {
        let index = offset as usize / 4;
        let word = *self.words.get(index)?;
        Some(match index {
            CR => {
                let pll = word & CR_PLLON != 0 && now >= self.pll_ready_at;
                let hse = word & CR_HSEON != 0 && self.hse_present && now >= self.hse_ready_at;
                // PLLI2S and PLLSAI are not used; they lock at once.
                word & !(CR_HSIRDY | CR_HSERDY | CR_PLLRDY)
                    | (word & CR_HSION) << 1
                    | if hse { CR_HSERDY } else { 0 }
                    | if pll { CR_PLLRDY } else { 0 }
                    | (word & (CR_PLLI2SON | CR_PLLSAION)) << 1
            }
            CFGR => word & !0xC | (word & 3) << 2,
            CIR => word & !CIR_CSSF | if self.failed { CIR_CSSF } else { 0 },
            CSR => word & !2 | if word & 1 != 0 && now >= self.lsi_ready_at { 2 } else { 0 },
            4..=6 | 8 | 9 | 0xC..=0xE | 0x10 | 0x11 | 0x14..=0x16 | 0x18 | 0x19 | 0x1C | 0x20..=0x25 | PLLCFGR => word,
            _ => return None,
        })
    }

    /// Writes a register; `None`: not modelled.
    pub fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        let index = offset as usize / 4;
        let old = *self.words.get(index)?;
        match index {
            CR => {
                if value & !old & CR_HSEON != 0 {
                    self.hse_ready_at = now + HSE_START;
                }
                if value & !old & CR_PLLON != 0 {
                    self.pll_ready_at = now + PLL_LOCK;
                }
                self.words[CR] = value;
            }
            CIR => {
                if value & CIR_CSSC != 0 {
                    self.failed = false;
                }
                self.words[CIR] = value & 0x7F00;
            }
            CSR => {
                if value & !old & 1 != 0 {
                    self.lsi_ready_at = now + LSI_START;
                }
                let flags = if value & CSR_RMVF != 0 { 0 } else { old & 0xFE00_0000 };
                self.words[CSR] = flags | value & 1;
            }
            PLLCFGR | CFGR | 4..=6 | 8 | 9 | 0xC..=0xE | 0x10 | 0x11 | 0x14..=0x16 | 0x18 | 0x19 | 0x1C | 0x20..=0x25 => {
                self.words[index] = value;
            }
            _ => return None,
        }
        Some(())
    }

    /// Whether the clock gate `bit` of the enable register at `offset` is open.
    #[inline]
    pub fn is_enabled(&self, offset: u32, bit: u32) -> bool {
        self.words.get(offset as usize / 4).is_some_and(|word| word >> bit & 1 != 0)
    }

    /// The clocks that follow from the registers.
    pub fn clocks(&self, now: Time) -> Clocks {
        let source = self.words[CFGR] & 3;
        let pll = self.words[PLLCFGR];
        let input_Hz = if pll & 1 << 22 != 0 { HSE_HZ } else { HSI_HZ };
        let (m, n, p) = (u64::from(pll & 0x3F).max(2), u64::from(pll >> 6 & 0x1FF), u64::from(2 * ((pll >> 16 & 3) + 1)));
        let sysclk_Hz = match source {
            1 => HSE_HZ,
            2 if now >= self.pll_ready_at => input_Hz * n / m / p,
            _ => HSI_HZ,
        };
        let cfgr = self.words[CFGR];
        let ahb = match cfgr >> 4 & 15 {
            k @ 8..=11 => 2 << (k - 8),
            k @ 12..=15 => 64 << (k - 12),
            _ => 1,
        };
        let apb = |field: u32| if field & 4 != 0 { 2 << (field & 3) } else { 1 };
        let (apb1, apb2) = (apb(cfgr >> 10 & 7), apb(cfgr >> 13 & 7));
        let core_Hz = sysclk_Hz / ahb;
        // Timers run at twice their bus where that is divided (RM0390 §6.2, TIMPRE = 0).
        let timer = |divider: u64| core_Hz / divider * if divider == 1 { 1 } else { 2 };
        Clocks { core_Hz, apb1_Hz: core_Hz / apb1, apb2_Hz: core_Hz / apb2, apb1_timers_Hz: timer(apb1), apb2_timers_Hz: timer(apb2) }
    }

    /// The ST-Link's clock stops. With the clock security system the chip continues on the internal oscillator and takes an NMI (RM0390
    /// §6.2.7); without it the core stops. Returns whether the core still has a clock.
    pub fn stop_external_clock(&mut self) -> bool {
        self.hse_present = false;
        let uses = match self.words[CFGR] & 3 {
            1 => true,
            2 => self.words[PLLCFGR] & 1 << 22 != 0,
            _ => false,
        };
        let guarded = self.words[CR] & CR_CSSON != 0;
        if guarded && self.words[CR] & CR_HSEON != 0 {
            self.words[CR] &= !(CR_HSEON | CR_CSSON);
            self.failed = true;
            if uses {
                self.words[CR] &= !CR_PLLON;
                self.words[CR] |= CR_HSION;
                self.words[CFGR] &= !3;
            }
        }
        guarded || !uses
    }

    /// The NMI of the clock security system is pending.
    pub fn has_failed(&self) -> bool {
        self.failed
    }
}

/// Steps of a cycle of `frequency_Hz`.
pub fn period(frequency_Hz: u64) -> Time {
    (PER_S + frequency_Hz / 2) / frequency_Hz.max(1)
}
