//! Records in two flash sectors: the newest that is whole wins.
//!
//! A sector is a row of slots of one size. A record goes into the first slot of its sector behind which nothing was ever written; where there
//! is none, the other sector, which holds only older records, is erased and takes it. So at least one whole record is in flash at any moment,
//! once there was one. What was written is read back before it counts. A slot that a power cut left half-written is passed over.
//!
//! A record: length u32, number u32, layout u32, CRC-32 over those and the body, the body ([`Record`]). Numbers rise; the greatest is the newest.
//! Erasing an STM32F446's 16 KiB stalls the core for half a second (DS10693, table 48), so whoever calls sees to it that the drive is off.

use super::Record;
use crate::telemetry::crc32;
use crate::words::{Words, words};
use core::fmt;
use embedded_storage::nor_flash::NorFlash;

/// Bytes of a slot.
pub const SLOT_BYTES: usize = 2048;
const HEAD_BYTES: usize = 16;

/// Why nothing was kept or found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreError {
    /// The flash refused to read, write or erase.
    Flash,
    /// What was read back is not what was written, in every slot that was tried.
    NotKept,
    /// The record is longer than a slot.
    TooLong,
    /// The newest record is another firmware's.
    OtherLayout,
}

impl StoreError {
    /// In words, with what to do.
    pub fn says(self) -> Words {
        match self {
            Self::Flash => words!("the flash refused; switch off and on, then try again"),
            Self::NotKept => words!("the flash does not keep what is written: worn out or protected"),
            Self::TooLong => words!("the settings do not fit into the flash"),
            Self::OtherLayout => words!("the kept settings are of another firmware; SETTings:SAVE anew"),
        }
    }
}

impl fmt::Display for StoreError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.says().fmt(f)
    }
}

impl core::error::Error for StoreError {}

/// Two sectors of a flash.
pub struct Store<F> {
    flash: F,
    begins: [u32; 2],
    sector_bytes: u32,
}

/// A whole record's place.
#[derive(Clone, Copy)]
struct Found {
    sector: usize,
    number: u32,
    at: u32,
    length: usize,
    layout: u32,
}

impl<F: NorFlash> Store<F> {
    /// The store in two sectors of `sector_bytes` that begin at these offsets of `flash`.
    pub fn new(flash: F, begins: [u32; 2], sector_bytes: u32) -> Self {
        Self { flash, begins, sector_bytes }
    }

    /// The flash.
    pub fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// The newest whole record; `None` where there is none.
    ///
    /// # Errors
    /// The flash cannot be read; or the newest is of another layout.
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
    /// It does not fit, the flash refuses, or does not keep it; what was kept before is still there.
    pub fn save<T: Record>(&mut self, value: &T, layout: u32) -> Result<(), StoreError> {
        let mut slot = [0; SLOT_BYTES];
        let newest = self.newest(&mut slot)?;
        let number = newest.map_or(1, |found| found.number.wrapping_add(1));
        let home = newest.map_or(0, |found| found.sector);
        let (length, bytes) = record::<T, F>(value, number, layout, &mut slot)?;
        let record = slot.get(..bytes).ok_or(StoreError::TooLong)?;
        debug_assert!(length <= bytes);

        let mut free = self.free(home)?;
        while free < self.slots() {
            if self.write(home, free, record)? {
                return Ok(());
            }
            free += 1;
        }
        // This sector is full, and stays as it is until the record is whole in the other.
        let other = home ^ 1;
        if self.free(other)? > 0 {
            let begin = self.begin(other);
            self.flash.erase(begin, begin.saturating_add(self.sector_bytes)).map_err(|_| StoreError::Flash)?;
        }
        for place in 0..self.slots() {
            if self.write(other, place, record)? {
                return Ok(());
            }
        }
        Err(StoreError::NotKept)
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

    /// The record with the greatest number of both sectors.
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

    /// The first slot of a sector from which on nothing is written.
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

    /// Writes a record and reads it back; whether it is there.
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

/// Makes a record in `slot`; its length, and with what fills up the last unit of a write.
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

/// Number, layout and length of the record in a slot, if it is whole.
fn whole(slot: &[u8; SLOT_BYTES]) -> Option<(u32, u32, usize)> {
    let mut words = slot.chunks_exact(4).map(|word| word.iter().rev().fold(0_u32, |sum, byte| sum << 8 | u32::from(*byte)));
    let (length, number, layout, crc) = (words.next()? as usize, words.next()?, words.next()?, words.next()?);
    (check(slot, length)? == crc).then_some((number, layout, length))
}

/// The CRC over all of a record but itself.
fn check(slot: &[u8; SLOT_BYTES], length: usize) -> Option<u32> {
    let body = slot.get(HEAD_BYTES..length)?;
    let head = slot.get(..12)?;
    // The body's CRC, then that of head and body's CRC: each bit of both counts.
    let mut both = [0; 16];
    both.get_mut(..12)?.copy_from_slice(head);
    both.get_mut(12..)?.copy_from_slice(&crc32(body).to_le_bytes());
    Some(crc32(&both))
}
