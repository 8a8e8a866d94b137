//! The core's own registers: NVIC, system control block, SysTick, MPU, FPU control (ARMv7-M, DDI 0403E chapter B3), debug and trace
//! counters.

/// Exception numbers.
pub const NMI: u32 = 2;
const PEND_SV: u32 = 14;
/// Exception number of the chip's interrupt 0.
pub const FIRST_INTERRUPT: u32 = 16;
/// Interrupts of the chip (RM0390, table 38).
pub const INTERRUPTS: u32 = 97;
/// The four implemented bits of a priority.
const PRIORITY_BITS: u8 = 0xF0;

/// An access that must reset or stop the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Nothing.
    None,
    /// AIRCR.SYSRESETREQ.
    Reset,
}

/// SysTick: a counter of the core's clock.
#[derive(Default)]
struct SysTick {
    control: u32,
    reload: u32,
    /// Core cycle at which the counter was zero or was started.
    since: u64,
}

/// The registers.
pub struct SystemControl {
    enabled: u128,
    pending: u128,
    lines: u128,
    active: Vec<(u32, u32)>,
    priorities: [u8; 112],
    system_priorities: [u8; 12],
    nmi_line: bool,
    nmi_pending: bool,
    pend_sv: bool,
    systick: SysTick,
    vtor: u32,
    scr: u32,
    ccr: u32,
    shcsr: u32,
    aircr: u32,
    cpacr: u32,
    fpccr: u32,
    demcr: u32,
    dwt_control: u32,
    cycle_offset: u32,
    mpu: Mpu,
    debug: [u32; 3],
    /// Something that a pending exception depends on has changed.
    pub changed: bool,
}

/// The memory protection unit (DDI 0403E B3.5), as far as a guard region needs it: regions without access.
#[derive(Default)]
struct Mpu {
    control: u32,
    region: usize,
    bases: [u32; 8],
    attributes: [u32; 8],
}

impl Default for SystemControl {
    fn default() -> Self {
        Self {
            enabled: 0,
            pending: 0,
            lines: 0,
            active: Vec::new(),
            priorities: [0; 112],
            system_priorities: [0; 12],
            nmi_line: false,
            nmi_pending: false,
            pend_sv: false,
            systick: SysTick::default(),
            vtor: 0,
            scr: 0,
            ccr: 0x200,
            shcsr: 0,
            aircr: 0,
            cpacr: 0,
            fpccr: 0xC000_0000,
            demcr: 0,
            dwt_control: 0x4000_0000,
            cycle_offset: 0,
            mpu: Mpu::default(),
            debug: [0; 3],
            changed: true,
        }
    }
}

impl SystemControl {
    /// Sets the levels of all interrupts; a rising level pends its interrupt.
    #[inline]
    pub fn set_lines(&mut self, lines: u128) {
        let rising = lines & !self.lines;
        if rising != 0 {
            self.pending |= rising;
            self.changed = true;
        }
        self.lines = lines;
    }

    /// Sets the level of the NMI.
    pub fn set_nmi(&mut self, high: bool) {
        if high && !self.nmi_line {
            self.nmi_pending = true;
            self.changed = true;
        }
        self.nmi_line = high;
    }

    fn priority(&self, exception: u32) -> u32 {
        match exception {
            NMI => 0,
            3 => 1,
            4..=15 => 2 + u32::from(self.system_priorities[exception as usize - 4] & PRIORITY_BITS),
            _ => 2 + u32::from(self.priorities[(exception - FIRST_INTERRUPT) as usize] & PRIORITY_BITS),
        }
    }

    /// The pending exception with the highest priority, with that priority + 2 (0: NMI, 1: hard fault), if it preempts what is active.
    pub fn candidate(&self) -> Option<(u32, u32)> {
        let mut best: Option<(u32, u32)> = None;
        let mut offer = |exception: u32, priority: u32| {
            if best.is_none_or(|(_, least)| priority < least) {
                best = Some((exception, priority));
            }
        };
        if self.nmi_pending {
            offer(NMI, 0);
        }
        if self.pend_sv {
            offer(PEND_SV, self.priority(PEND_SV));
        }
        let mut waiting = self.enabled & self.pending;
        while waiting != 0 {
            let number = waiting.trailing_zeros();
            waiting &= waiting - 1;
            offer(FIRST_INTERRUPT + number, self.priority(FIRST_INTERRUPT + number));
        }
        let running = self.active.iter().map(|(_, priority)| *priority).min().unwrap_or(u32::MAX);
        best.filter(|(_, priority)| *priority < running)
    }

    /// The handler of `exception` starts.
    pub fn enter(&mut self, exception: u32) {
        let priority = self.priority(exception);
        match exception {
            NMI => self.nmi_pending = false,
            PEND_SV => self.pend_sv = false,
            FIRST_INTERRUPT.. => self.pending &= !(1 << (exception - FIRST_INTERRUPT)),
            _ => {}
        }
        self.active.push((exception, priority));
        self.changed = true;
    }

    /// The handler of `exception` returns; a line that is still high pends again. `false`: another handler is the innermost.
    pub fn leave(&mut self, exception: u32) -> bool {
        let innermost = self.active.pop().is_some_and(|(number, _)| number == exception);
        if exception >= FIRST_INTERRUPT {
            self.pending |= self.lines & 1 << (exception - FIRST_INTERRUPT);
        } else if exception == NMI && self.nmi_line {
            self.nmi_pending = true;
        }
        self.changed = true;
        innermost
    }

    /// Address of the vector table.
    pub fn vector_table(&self) -> u32 {
        self.vtor
    }

    /// Whether the MPU forbids access to `address`.
    #[inline]
    pub fn forbids(&self, address: u32) -> bool {
        self.mpu.control & 1 != 0 && self.mpu.forbids(address)
    }

    /// A register; `None`: not modelled.
    pub fn read(&mut self, address: u32, cycles: u64) -> Option<u32> {
        let word = |bits: u128, address: u32| (bits >> ((address & 0x1F) * 8)) as u32;
        Some(match address {
            0xE000_1000 => self.dwt_control,
            0xE000_1004 => self.cycle_count(cycles),
            0xE000_1008..=0xE000_1018 => 0, // event counters, which are off
            0xE000_E004 => 3,               // ICTR: 97 to 128 interrupts
            0xE000_E008 => 0,
            0xE000_E010 => self.systick.control,
            0xE000_E014 => self.systick.reload,
            0xE000_E018 => {
                let period = u64::from(self.systick.reload) + 1;
                (period - 1 - cycles.wrapping_sub(self.systick.since) % period) as u32
            }
            0xE000_E01C => 0xC000_0000 | (22_500 - 1),
            0xE000_E100..=0xE000_E10F => word(self.enabled, address & 0xF),
            0xE000_E180..=0xE000_E18F => word(self.enabled, address & 0xF),
            0xE000_E200..=0xE000_E20F => word(self.pending, address & 0xF),
            0xE000_E280..=0xE000_E28F => word(self.pending, address & 0xF),
            0xE000_E300..=0xE000_E30F => {
                let active = self.active.iter().filter(|(number, _)| *number >= FIRST_INTERRUPT);
                word(active.fold(0, |bits, (number, _)| bits | 1 << (number - FIRST_INTERRUPT)), address & 0xF)
            }
            0xE000_E400..=0xE000_E46F => four(&self.priorities, address - 0xE000_E400),
            0xE000_ED00 => 0x410F_C241, // Cortex-M4 r0p1
            0xE000_ED04 => {
                let running = self.active.last().map_or(0, |(number, _)| *number);
                let next = self.candidate().map_or(0, |(number, _)| number);
                running | next << 12 | u32::from(self.pend_sv) << 28 | u32::from(self.active.len() <= 1) << 11
            }
            0xE000_ED08 => self.vtor,
            0xE000_ED0C => 0xFA05_0000 | self.aircr,
            0xE000_ED10 => self.scr,
            0xE000_ED14 => self.ccr,
            0xE000_ED18..=0xE000_ED23 => four(&self.system_priorities, address - 0xE000_ED18),
            0xE000_ED24 => self.shcsr,
            0xE000_ED28..=0xE000_ED3C => 0, // no fault is pending: a fault ends the simulation
            0xE000_ED88 => self.cpacr,
            0xE000_ED90 => 0x0000_0800, // 8 regions
            0xE000_ED94 => self.mpu.control,
            0xE000_ED98 => self.mpu.region as u32,
            0xE000_ED9C => self.mpu.bases[self.mpu.region] | self.mpu.region as u32,
            0xE000_EDA0 => self.mpu.attributes[self.mpu.region],
            0xE000_EDF0 => 0, // DHCSR: no debugger
            0xE000_EDFC => self.demcr,
            0xE000_EF34 => self.fpccr,
            0xE000_EF38 | 0xE000_EF3C => 0,
            0xE004_2000 => 0x1000_6421, // STM32F446, revision A (RM0390 §33.6.1)
            0xE004_2004..=0xE004_200C => self.debug[(address - 0xE004_2004) as usize / 4],
            _ => return None,
        })
    }

    fn cycle_count(&self, cycles: u64) -> u32 {
        if self.demcr & 1 << 24 != 0 && self.dwt_control & 1 != 0 {
            (cycles as u32).wrapping_sub(self.cycle_offset)
        } else {
            self.cycle_offset
        }
    }

    /// Writes a register (bytes of priorities included); `None`: not modelled.
    pub fn write(&mut self, address: u32, bytes: u32, value: u32, cycles: u64) -> Option<Request> {
        let bits = |address: u32| u128::from(value) << ((address & 0xF) * 8);
        self.changed = true;
        match address {
            0xE000_1000 => {
                let before = self.cycle_count(cycles);
                self.dwt_control = self.dwt_control & !1 | value & 1;
                self.cycle_offset = if self.dwt_control & 1 != 0 { (cycles as u32).wrapping_sub(before) } else { before };
            }
            0xE000_1004 => self.cycle_offset = (cycles as u32).wrapping_sub(value),
            0xE000_E008 => {}
            // TICKINT is not modelled: the stand has no SysTick handler.
            0xE000_E010 if value & 2 != 0 => return None,
            0xE000_E010 => {
                self.systick.control = value & 7;
                self.systick.since = cycles;
            }
            0xE000_E014 => self.systick.reload = value & 0xFF_FFFF,
            0xE000_E018 => self.systick.since = cycles,
            0xE000_E100..=0xE000_E10F => self.enabled |= bits(address),
            0xE000_E180..=0xE000_E18F => self.enabled &= !bits(address),
            0xE000_E200..=0xE000_E20F => self.pending |= bits(address),
            0xE000_E280..=0xE000_E28F => self.pending = self.pending & !bits(address) | self.lines & bits(address),
            0xE000_E400..=0xE000_E46F => set(&mut self.priorities, address - 0xE000_E400, bytes, value),
            0xE000_ED04 => {
                if value & 1 << 28 != 0 {
                    self.pend_sv = true;
                }
                if value & 1 << 27 != 0 {
                    self.pend_sv = false;
                }
                if value & 1 << 31 != 0 {
                    self.nmi_pending = true;
                }
                // PENDSTSET: see SysTick.
                if value & 1 << 26 != 0 {
                    return None;
                }
            }
            0xE000_ED08 => self.vtor = value & !0x7F,
            0xE000_ED0C if value >> 16 == 0x05FA => {
                // A group of sub-priorities is not modelled: all four bits preempt.
                if value >> 8 & 7 > 3 {
                    return None;
                }
                self.aircr = value & 0x700;
                if value & 4 != 0 {
                    return Some(Request::Reset);
                }
            }
            0xE000_ED0C => {}
            0xE000_ED10 => self.scr = value,
            0xE000_ED14 => self.ccr = value,
            0xE000_ED18..=0xE000_ED23 => set(&mut self.system_priorities, address - 0xE000_ED18, bytes, value),
            0xE000_ED24 => self.shcsr = value,
            0xE000_ED28..=0xE000_ED3C => {}
            0xE000_ED88 => self.cpacr = value,
            0xE000_ED94 => self.mpu.control = value & 7,
            0xE000_ED98 => self.mpu.region = (value & 7) as usize,
            0xE000_ED9C => {
                if value & 0x10 != 0 {
                    self.mpu.region = (value & 7) as usize;
                }
                self.mpu.bases[self.mpu.region] = value & !0x1F;
            }
            0xE000_EDA0 => self.mpu.attributes[self.mpu.region] = value,
            0xE000_EDFC => self.demcr = value,
            // STIR: the executor pends its own interrupt.
            0xE000_EF00 => self.pending |= 1 << (value & 0x7F),
            0xE000_EF34 => self.fpccr = value,
            0xE000_EF38 | 0xE000_EF3C => {}
            0xE004_2004..=0xE004_200C => self.debug[(address - 0xE004_2004) as usize / 4] = value,
            _ => return None,
        }
        Some(Request::None)
    }
}

impl Mpu {
    fn forbids(&self, address: u32) -> bool {
        // The highest region that contains the address decides.
        for region in (0..8).rev() {
            let attributes = self.attributes[region];
            let size_bits = (attributes >> 1 & 0x1F) + 1;
            if attributes & 1 == 0 || size_bits < 5 {
                continue;
            }
            let size = 1_u64 << size_bits;
            let base = u64::from(self.bases[region]) & !(size - 1);
            let at = u64::from(address);
            if at < base || at >= base + size {
                continue;
            }
            // A region of 256 bytes or more has eight subregions that can be left out.
            let subregion = (at - base) * 8 / size;
            if size_bits >= 8 && attributes >> (8 + subregion) & 1 != 0 {
                continue;
            }
            return attributes >> 24 & 7 == 0;
        }
        false
    }
}

fn four(bytes: &[u8], at: u32) -> u32 {
    (0..4).fold(0, |word, k| word | u32::from(bytes.get((at & !3) as usize + k).copied().unwrap_or(0)) << (8 * k))
}

fn set(target: &mut [u8], at: u32, bytes: u32, value: u32) {
    for k in 0..bytes {
        if let Some(byte) = target.get_mut((at + k) as usize) {
            *byte = (value >> (8 * k)) as u8;
        }
    }
}
