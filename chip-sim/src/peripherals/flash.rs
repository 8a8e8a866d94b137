//! Flash interface (RM0390 §3): wait states and caches, unlock sequence, sector erase, programming.

use crate::time::{PER_MS, PER_US, Time};

/// Bytes of the chip's flash.
pub const BYTES: usize = 512 * 1024;
/// First address.
pub const BASE: u32 = 0x0800_0000;

const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
const SR_WRPERR: u32 = 1 << 4;
const SR_PGSERR: u32 = 1 << 7;
const CR_PG: u32 = 1;
const CR_SER: u32 = 1 << 1;
const CR_STRT: u32 = 1 << 16;
const CR_LOCK: u32 = 1 << 31;
/// Programming time of one unit, typical (DS10693, table 47).
const PROGRAM: Time = 16 * PER_US;

/// Contents and registers.
pub struct Flash {
    bytes: Vec<u8>,
    acr: u32,
    cr: u32,
    sr: u32,
    key: usize,
    /// Typical duration of the erase of a sector of 16, 64, 128 KiB with a parallelism of 32 bits (DS10693, table 48), ms.
    pub erase_ms: [u64; 3],
    /// Sector and start time of each erase.
    pub erases: Vec<(u32, Time)>,
    /// Programmed units.
    pub programmed: u64,
}

/// What an access makes the core wait for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stall {
    /// Nothing.
    None,
    /// The flash is busy for this long; the core, which executes from it, waits.
    Busy(Time),
}

impl Flash {
    /// Flash with these contents from [`BASE`] on; the rest is erased.
    pub fn new(image: &[(u32, &[u8])]) -> Self {
        let mut bytes = vec![0xFF; BYTES];
        for (address, data) in image {
            let start = address.wrapping_sub(BASE) as usize;
            if let Some(target) = bytes.get_mut(start..start + data.len()) {
                target.copy_from_slice(data);
            }
        }
        Self { bytes, acr: 0, cr: CR_LOCK, sr: 0, key: 0, erase_ms: [250, 550, 1000], erases: Vec::new(), programmed: 0 }
    }

    /// Registers as after a reset; the contents stay.
    pub fn reset(&mut self) {
        (self.acr, self.cr, self.sr, self.key) = (0, CR_LOCK, 0, 0);
    }

    /// The contents.
    #[inline]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The contents, to prepare a test.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.bytes
    }

    /// Wait states of an access.
    pub fn wait_states(&self) -> u32 {
        self.acr & 0xF
    }

    /// Prefetch, instruction cache, data cache are enabled.
    pub fn accelerated(&self) -> [bool; 3] {
        [8, 9, 10].map(|bit| self.acr >> bit & 1 != 0)
    }

    /// A register; `None`: not modelled.
    pub fn read(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.acr,
            0x0C => self.sr,
            0x10 => self.cr,
            // Option bytes as delivered: BOR off, software watchdog, no protection (RM0390 §3.8.6).
            0x14 => 0x0FFF_AAED,
            _ => return None,
        })
    }

    /// Writes a register; `None`: not modelled.
    pub fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<Stall> {
        match offset {
            0x00 => self.acr = value & 0x0000_070F,
            0x04 => {
                self.key = if KEYS.get(self.key) == Some(&value) { self.key + 1 } else { usize::MAX };
                if self.key == KEYS.len() {
                    self.cr &= !CR_LOCK;
                    self.key = 0;
                }
            }
            0x0C => self.sr &= !value,
            0x10 if self.cr & CR_LOCK == 0 => {
                self.cr = value & !CR_STRT;
                if value & (CR_STRT | CR_SER) == CR_STRT | CR_SER {
                    return Some(self.erase(value >> 3 & 0xF, now));
                }
                if value & CR_LOCK != 0 {
                    self.key = 0;
                }
            }
            // A locked control register ignores writes.
            0x10 => {}
            _ => return None,
        }
        Some(Stall::None)
    }

    fn erase(&mut self, sector: u32, now: Time) -> Stall {
        let (start, length, kind) = match sector {
            0..=3 => (sector * 0x4000, 0x4000, 0),
            4 => (0x1_0000, 0x1_0000, 1),
            5..=7 => ((sector - 4) * 0x2_0000, 0x2_0000, 2),
            _ => {
                self.sr |= SR_WRPERR;
                return Stall::None;
            }
        };
        self.erases.push((sector, now));
        self.bytes[start as usize..(start + length) as usize].fill(0xFF);
        // PSIZE: with 8 or 16 bits at a time an erase takes 1.2 to 2.2 times as long (DS10693, table 48); taken as twice.
        let factor = if self.cr >> 8 & 3 == 2 { 1 } else { 2 };
        Stall::Busy(self.erase_ms[kind] * PER_MS * factor)
    }

    /// Programs a unit; `None`: the flash is locked or not in programming mode, which hard-faults the core.
    pub fn program(&mut self, address: u32, bytes: &[u8]) -> Option<Stall> {
        if self.cr & (CR_LOCK | CR_PG) != CR_PG {
            self.sr |= SR_PGSERR;
            return None;
        }
        let start = address.wrapping_sub(BASE) as usize;
        for (target, byte) in self.bytes.get_mut(start..start + bytes.len())?.iter_mut().zip(bytes) {
            *target &= byte;
        }
        self.programmed += 1;
        Some(Stall::Busy(PROGRAM))
    }
}
