//! The flash as the core meets it: an erase stalls everything but DMA, a write delays the code that writes.
//!
//! The program runs from the same flash, so that the core cannot fetch an instruction during an erase (RM0390 §3.4). Virtual time passes
//! without ticks; bytes of the serial line arrive in the DMA's ring.

use super::SimFlash;
use super::flash::{FlashError, SMALL_SECTOR_BYTES, WORD_BYTES};
use crate::clock::VirtualClock;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use stand_firmware::board::TICKS_PER_S;

/// Erase of a sector of 16 KiB: 0.25 s (DS10693, table 48, typical with 32-bit parallelism).
pub const ERASE_STEPS: u64 = TICKS_PER_S / 4;
/// Programming of a word: 16 µs (DS10693, table 48).
const WRITE_STEPS: u64 = 16 * TICKS_PER_S / 1_000_000;

/// A flash whose operations take time.
pub struct StallingFlash<'a> {
    flash: &'a mut SimFlash,
    clock: &'a VirtualClock,
}

impl<'a> StallingFlash<'a> {
    /// This flash, on this clock.
    pub fn new(flash: &'a mut SimFlash, clock: &'a VirtualClock) -> Self {
        Self { flash, clock }
    }
}

impl ErrorType for StallingFlash<'_> {
    type Error = FlashError;
}

impl ReadNorFlash for StallingFlash<'_> {
    const READ_SIZE: usize = SimFlash::<SMALL_SECTOR_BYTES>::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        self.flash.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for StallingFlash<'_> {
    const WRITE_SIZE: usize = SimFlash::<SMALL_SECTOR_BYTES>::WRITE_SIZE;
    const ERASE_SIZE: usize = SimFlash::<SMALL_SECTOR_BYTES>::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        let before: u32 = self.flash.erases().iter().sum();
        let result = self.flash.erase(from, to);
        let sectors = self.flash.erases().iter().sum::<u32>() - before;
        self.clock.stall(u64::from(sectors) * ERASE_STEPS);
        result
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.clock.charge((bytes.len() / WORD_BYTES) as u64 * WRITE_STEPS);
        self.flash.write(offset, bytes)
    }
}
