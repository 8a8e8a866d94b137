//! The two flash sectors of the settings.
//!
//! Sectors 1 and 2 of 16 KiB each are the smallest ones; an erase takes 0.25 s, at most 0.5 s (DS10693, table 48). The program's code
//! begins behind them (memory.x), and flashing a new program does not erase them. The core and the tick stall during an erase, so settings
//! are written only with the drive off; afterwards the cycle counter gives the number of lost ticks.

use core::sync::atomic::{AtomicBool, Ordering};
use embassy_stm32::flash::{Bank1Region1, Blocking, Error, Flash};
use embassy_stm32::{Peri, peripherals};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

/// Size of a sector, bytes.
pub const SECTOR_BYTES: u32 = 16 * 1024;
/// Offset of the settings in the flash: behind the sector of the vector table.
const BASE_OFFSET: u32 = SECTOR_BYTES;
/// Offsets of the two sectors in [`SettingsFlash`].
pub const SECTOR_OFFSETS: [u32; 2] = [0, SECTOR_BYTES];
/// Size of both sectors, bytes.
const LENGTH_BYTES: u32 = 2 * SECTOR_BYTES;

/// An erase stalls the core: the tick takes the lost ticks for announced.
static ERASING: AtomicBool = AtomicBool::new(false);

/// Whether a sector is being erased.
#[inline]
pub fn is_erasing() -> bool {
    ERASING.load(Ordering::Relaxed)
}

/// Flash of the settings: 32 KiB, addressed from 0.
pub struct SettingsFlash {
    region: Bank1Region1<'static, Blocking>,
}

impl SettingsFlash {
    /// Takes the chip's flash; the program occupies the other sectors.
    pub fn new(flash: Peri<'static, peripherals::FLASH>) -> Self {
        Self { region: Flash::new_blocking(flash).into_blocking_regions().bank1_region1 }
    }

    /// Offset in the chip's flash of `length` bytes from `offset` on.
    ///
    /// # Errors
    /// The range is outside both sectors.
    fn chip_offset(offset: u32, length: usize) -> Result<u32, Error> {
        match u32::try_from(length).ok().and_then(|length| offset.checked_add(length)) {
            Some(end) if end <= LENGTH_BYTES => Ok(BASE_OFFSET + offset),
            _ => Err(Error::Size),
        }
    }
}

impl ErrorType for SettingsFlash {
    type Error = Error;
}

impl ReadNorFlash for SettingsFlash {
    const READ_SIZE: usize = Bank1Region1::<Blocking>::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        self.region.read(Self::chip_offset(offset, bytes.len())?, bytes)
    }

    fn capacity(&self) -> usize {
        LENGTH_BYTES as usize
    }
}

impl NorFlash for SettingsFlash {
    const WRITE_SIZE: usize = Bank1Region1::<Blocking>::WRITE_SIZE;
    const ERASE_SIZE: usize = SECTOR_BYTES as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        let length = to.checked_sub(from).ok_or(Error::Size)? as usize;
        let from = Self::chip_offset(from, length)?;
        ERASING.store(true, Ordering::Relaxed);
        // The tick that was pending during the stall runs before this returns.
        let done = self.region.erase(from, from + length as u32);
        ERASING.store(false, Ordering::Relaxed);
        done
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.region.write(Self::chip_offset(offset, bytes.len())?, bytes)
    }
}
