//! Records in two flash sectors; the newest complete record is valid.
//!
//! A sector is an array of slots of equal size. A record is written to the first slot of its sector behind the last one written. Without
//! such a slot the other sector, which holds only older records, is erased and takes the record. So the flash holds a complete record at
//! any time after the first save. A record is read back after writing. A slot left incomplete by a power cut is skipped.
//!
//! Layout of a record: length u32, number u32, layout u32, CRC-32 over these and the body, body ([`Record`]). The greatest number is the
//! newest. Erasing 16 KiB stalls the core of an STM32F446 for half a second (DS10693, table 48): the caller must have switched the drive
//! off.

use super::Record;
use crate::telemetry::crc32;
use core::fmt;
use embedded_storage::nor_flash::NorFlash;

/// Size of a slot, bytes.
pub const SLOT_BYTES: usize = 2048;
const HEAD_BYTES: usize = 16;

/// The reason why a record was not saved or loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreError {
    /// The flash rejected a read, write or erase.
    Flash,
    /// The data read back differ from the data written, in every slot that was tried.
    NotHeld,
    /// The record is longer than a slot.
    TooLong,
    /// The newest record belongs to another firmware version.
    OtherLayout,
}

impl StoreError {
    /// The cause and what to do.
    pub fn message(self) -> &'static str {
        match self {
            Self::Flash => "the flash rejected the operation; switch off and on, then try again",
            Self::NotHeld => "the flash does not hold the written data: it is worn out or protected",
            Self::TooLong => "the settings do not fit into the flash",
            Self::OtherLayout => "the saved settings belong to another firmware version; SETTings:SAVE replaces them",
        }
    }
}

impl fmt::Display for StoreError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.message())
    }
}

impl core::error::Error for StoreError {}

/// A store in two sectors of a flash.
pub struct Store<F> {
    flash: F,
    begins: [u32; 2],
    sector_bytes: u32,
}

/// Location of a complete record.
#[derive(Clone, Copy)]
struct Found {
    sector: usize,
    number: u32,
    at: u32,
    length: usize,
    layout: u32,
}

impl<F: NorFlash> Store<F> {
    /// A store in two sectors of `sector_bytes`, which begin at these offsets of `flash`.
    pub fn new(flash: F, begins: [u32; 2], sector_bytes: u32) -> Self {
        Self { flash, begins, sector_bytes }
    }

    /// The flash.
    pub fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// The newest complete record; `None` if there is none.
    ///
    /// # Errors
    /// The flash cannot be read, or the newest record has another layout.
    pub fn load<T: Record>(&mut self, layout: u32) -> Result<Option<T>, StoreError> {
        let mut slot = [0; SLOT_BYTES];
        let Some(newest) = self.newest(&mut slot)? else { return Ok(None) };
        if newest.layout != layout {
            return Err(StoreError::OtherLayout);
        }
        self.read(newest.at, &mut slot)?;
        let body = slot.get(HEAD_BYTES..newest.length).unwrap_or_default();
        T::read(body).map(Some).ok_or(StoreError::OtherLayout)
    }

    /// Appends a record.
    ///
    /// # Errors
    /// The record is too long, or the flash rejects or does not hold it. The record before is still valid.
    pub fn save<T: Record>(&mut self, value: &T, layout: u32) -> Result<(), StoreError> {
        let mut slot = [0; SLOT_BYTES];
        let newest = self.newest(&mut slot)?;
        let number = newest.map_or(1, |found| found.number.wrapping_add(1));
        let current = newest.map_or(0, |found| found.sector);
        let (length, bytes) = record::<T, F>(value, number, layout, &mut slot)?;
        let record = slot.get(..bytes).ok_or(StoreError::TooLong)?;
        debug_assert!(length <= bytes);

        let mut free = self.free(current)?;
        while free < self.slots() {
            if self.write(current, free, record)? {
                return Ok(());
            }
            free += 1;
        }
        // This sector is full. It stays valid until the record is complete in the other.
        let other = current ^ 1;
        if self.free(other)? > 0 {
            let begin = self.begin(other);
            self.flash.erase(begin, begin.saturating_add(self.sector_bytes)).map_err(|_| StoreError::Flash)?;
        }
        for place in 0..self.slots() {
            if self.write(other, place, record)? {
                return Ok(());
            }
        }
        Err(StoreError::NotHeld)
    }

    fn slots(&self) -> u32 {
        self.sector_bytes.checked_div(SLOT_BYTES as u32).unwrap_or(0)
    }

    fn begin(&self, sector: usize) -> u32 {
        let [first, second] = self.begins;
        if sector == 0 { first } else { second }
    }

    fn at(&self, sector: usize, slot: u32) -> u32 {
        self.begin(sector).saturating_add(slot.saturating_mul(SLOT_BYTES as u32))
    }

    fn read(&mut self, at: u32, into: &mut [u8]) -> Result<(), StoreError> {
        self.flash.read(at, into).map_err(|_| StoreError::Flash)
    }

    /// The record with the greatest number in both sectors.
    fn newest(&mut self, slot: &mut [u8; SLOT_BYTES]) -> Result<Option<Found>, StoreError> {
        let mut newest: Option<Found> = None;
        for sector in [0, 1] {
            for place in 0..self.slots() {
                let at = self.at(sector, place);
                self.read(at, slot)?;
                if let Some((number, layout, length)) = whole(slot)
                    && newest.is_none_or(|other| number.wrapping_sub(other.number) as i32 > 0)
                {
                    newest = Some(Found { sector, number, at, length, layout });
                }
            }
        }
        Ok(newest)
    }

    /// The first slot of a sector behind the last one written.
    fn free(&mut self, sector: usize) -> Result<u32, StoreError> {
        let mut free = 0;
        let mut slot = [0; SLOT_BYTES];
        for place in 0..self.slots() {
            self.read(self.at(sector, place), &mut slot)?;
            if slot.iter().any(|byte| *byte != 0xff) {
                free = place + 1;
            }
        }
        Ok(free)
    }

    /// Writes a record and reads it back; whether both agree.
    fn write(&mut self, sector: usize, place: u32, record: &[u8]) -> Result<bool, StoreError> {
        let at = self.at(sector, place);
        if self.flash.write(at, record).is_err() {
            return Err(StoreError::Flash);
        }
        let mut back = [0; SLOT_BYTES];
        let back = back.get_mut(..record.len()).ok_or(StoreError::TooLong)?;
        self.read(at, back)?;
        Ok(back == record)
    }
}

/// Builds a record in `slot`; its length, and its length padded to the write size of the flash.
fn record<T: Record, F: NorFlash>(value: &T, number: u32, layout: u32, slot: &mut [u8; SLOT_BYTES]) -> Result<(usize, usize), StoreError> {
    slot.fill(0xff);
    let body = slot.get_mut(HEAD_BYTES..).and_then(|space| value.write(space));
    let length = HEAD_BYTES + body.ok_or(StoreError::TooLong)?;
    for (place, word) in slot.chunks_exact_mut(4).zip([length as u32, number, layout]) {
        place.copy_from_slice(&word.to_le_bytes());
    }
    let crc = check(slot, length).ok_or(StoreError::TooLong)?;
    slot.get_mut(12..HEAD_BYTES).ok_or(StoreError::TooLong)?.copy_from_slice(&crc.to_le_bytes());
    let bytes = length.checked_next_multiple_of(F::WRITE_SIZE).ok_or(StoreError::TooLong)?;
    if bytes > SLOT_BYTES { Err(StoreError::TooLong) } else { Ok((length, bytes)) }
}

/// Number, layout and length of the record in a slot, if it is complete.
fn whole(slot: &[u8; SLOT_BYTES]) -> Option<(u32, u32, usize)> {
    let mut words = slot.chunks_exact(4).map(|word| word.iter().rev().fold(0_u32, |sum, byte| sum << 8 | u32::from(*byte)));
    let (length, number, layout, crc) = (words.next()? as usize, words.next()?, words.next()?, words.next()?);
    (check(slot, length)? == crc).then_some((number, layout, length))
}

/// The CRC over a record without its CRC field.
fn check(slot: &[u8; SLOT_BYTES], length: usize) -> Option<u32> {
    let body = slot.get(HEAD_BYTES..length)?;
    let head = slot.get(..12)?;
    // CRC of the head and of the CRC of the body.
    let mut both = [0; 16];
    both.get_mut(..12)?.copy_from_slice(head);
    both.get_mut(12..)?.copy_from_slice(&crc32(body).to_le_bytes());
    Some(crc32(&both))
}
