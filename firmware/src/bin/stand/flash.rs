//! The two flash sectors of the settings.
//!
//! Sectors 1 and 2, 16 KiB each: the smallest there are, 0.25 s to erase, 0.5 s at most (DS10693, table 48); the program's code
//! begins behind them (memory.x), and flashing a new program leaves them alone. While a sector is erased the core stands still, the tick with it, so
//! that settings are written with the drive off only; the tick finds its place again by the cycle counter.

use embassy_stm32::flash::{Bank1Region1, Blocking, Error, Flash};
use embassy_stm32::{Peri, peripherals};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

/// One sector, bytes.
const SECTOR: u32 = 16 * 1024;
/// Where the settings begin, from the flash's start: behind the sector of the vector table.
const BEGIN: u32 = SECTOR;
/// Both sectors.
const LENGTH: u32 = 2 * SECTOR;

/// The settings' flash: 32 KiB from address 0 on.
pub struct SettingsFlash {
    region: Bank1Region1<'static, Blocking>,
}

impl SettingsFlash {
    /// Takes the chip's flash, of which the rest is the program's.
    pub fn new(flash: Peri<'static, peripherals::FLASH>) -> Self {
        Self { region: Flash::new_blocking(flash).into_blocking_regions().bank1_region1 }
    }

    /// Where `length` bytes from `offset` on lie in the chip.
    fn place(offset: u32, length: usize) -> Result<u32, Error> {
        match u32::try_from(length).ok().and_then(|length| offset.checked_add(length)) {
            Some(end) if end <= LENGTH => Ok(BEGIN + offset),
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
        self.region.read(Self::place(offset, bytes.len())?, bytes)
    }

    fn capacity(&self) -> usize {
        LENGTH as usize
    }
}

impl NorFlash for SettingsFlash {
    const WRITE_SIZE: usize = Bank1Region1::<Blocking>::WRITE_SIZE;
    const ERASE_SIZE: usize = SECTOR as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        let length = to.checked_sub(from).ok_or(Error::Size)? as usize;
        let from = Self::place(from, length)?;
        self.region.erase(from, from + length as u32)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.region.write(Self::place(offset, bytes.len())?, bytes)
    }
}
