//! Simulated flash that enforces the rules of the chip and can lose its supply at any write or erase.
//!
//! Input: the lengths of its sectors, from address 0 on. Output: [`NorFlash`]. Words have four bytes; a word is written once
//! between two erases, bits change from 1 to 0 only, an erase covers whole sectors (STM32F446: RM0390 §3). The chip has no error
//! correction that refuses a second write; the trait allows one write, so a second one is an error here.
//!
//! A *step* is indivisible: one word written, one sector erased. [`SimFlash::cut_after`] sets the number of whole steps before
//! the supply fails; the next step is left incomplete: in a word some bits have changed; in a sector some words are erased, some
//! unchanged, some between. From then on all calls return [`FlashError::NoSupply`] until
//! [`SimFlash::power_on`]. A seed determines the result of an incomplete step.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Bytes per word: the unit of a write.
pub const WORD_BYTES: usize = 4;
/// Size of the small sectors of an STM32F446RE (sectors 0 to 3; RM0390, table 4).
pub const SMALL_SECTOR_BYTES: usize = 16 * 1024;

/// Errors of the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FlashError {
    /// Beyond the end.
    #[error("flash: {offset:#x} and {length} bytes are beyond its end")]
    OutOfBounds {
        /// First byte.
        offset: u32,
        /// Bytes.
        length: usize,
    },
    /// Not aligned to words or sectors.
    #[error("flash: {offset:#x} and {length} bytes are no whole words or sectors")]
    NotAligned {
        /// First byte.
        offset: u32,
        /// Bytes.
        length: usize,
    },
    /// The word has been written since the last erase.
    #[error("flash: the word at {offset:#x} was written before; erase its sector first")]
    NotErased {
        /// Its first byte.
        offset: u32,
    },
    /// No supply.
    #[error("flash: there is no supply")]
    NoSupply,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            FlashError::OutOfBounds { .. } => NorFlashErrorKind::OutOfBounds,
            FlashError::NotAligned { .. } => NorFlashErrorKind::NotAligned,
            FlashError::NotErased { .. } | FlashError::NoSupply => NorFlashErrorKind::Other,
        }
    }
}

/// A sector: start, end, number of erases.
#[derive(Clone, Copy, Debug)]
struct Sector {
    begin: usize,
    end: usize,
    erases: u32,
}

/// The flash. `ERASE_BYTES` is the erase size of the trait: the length of the smallest sector.
#[derive(Clone, Debug)]
pub struct SimFlash<const ERASE_BYTES: usize = SMALL_SECTOR_BYTES> {
    bytes: Vec<u8>,
    sectors: Vec<Sector>,
    steps: u64,
    cut_at: Option<u64>,
    has_supply: bool,
    generator: Xoshiro256PlusPlus,
}

impl<const ERASE_BYTES: usize> SimFlash<ERASE_BYTES> {
    /// Erased flash with sectors of these lengths in bytes, each rounded up to a multiple of `ERASE_BYTES`, which is a multiple of
    /// the word size. `seed` determines incomplete steps.
    pub fn new(sectors_bytes: &[usize], seed: u64) -> Self {
        const { assert!(ERASE_BYTES > 0 && ERASE_BYTES.is_multiple_of(WORD_BYTES)) };
        let mut begin = 0;
        let mut sectors = Vec::new();
        for bytes in sectors_bytes {
            let end = begin + bytes.next_multiple_of(ERASE_BYTES);
            sectors.push(Sector { begin, end, erases: 0 });
            begin = end;
        }
        let generator = Xoshiro256PlusPlus::seed_from_u64(seed);
        Self { bytes: vec![0xff; begin], sectors, steps: 0, cut_at: None, has_supply: true, generator }
    }

    /// Lets the supply fail after `steps` more whole steps, within the next.
    pub fn cut_after(&mut self, steps: u64) {
        self.cut_at = Some(self.steps.saturating_add(steps));
    }

    /// Lets the supply fail now, between two steps.
    pub fn cut(&mut self) {
        self.has_supply = false;
        self.cut_at = None;
    }

    /// Restores the supply; the contents stay.
    pub fn power_on(&mut self) {
        self.has_supply = true;
        self.cut_at = None;
    }

    /// Whether the supply is present.
    pub fn has_supply(&self) -> bool {
        self.has_supply
    }

    /// Words written and sectors erased so far, including incomplete steps.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Number of erases of each sector, including incomplete ones.
    pub fn erases(&self) -> Vec<u32> {
        self.sectors.iter().map(|sector| sector.erases).collect()
    }

    /// All bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Writes bytes as a programmer does; excess bytes are ignored, missing ones stay.
    pub fn load(&mut self, bytes: &[u8]) {
        for (to, from) in self.bytes.iter_mut().zip(bytes) {
            *to = *from;
        }
    }

    fn span(&self, offset: u32, length: usize, unit: usize) -> Result<std::ops::Range<usize>, FlashError> {
        if !self.has_supply {
            return Err(FlashError::NoSupply);
        }
        let begin = offset as usize;
        let end = begin.checked_add(length).filter(|end| *end <= self.bytes.len()).ok_or(FlashError::OutOfBounds { offset, length })?;
        if begin.is_multiple_of(unit) && length.is_multiple_of(unit) {
            Ok(begin..end)
        } else {
            Err(FlashError::NotAligned { offset, length })
        }
    }

    /// Counts a step; `false` if the supply fails within it.
    fn step(&mut self) -> bool {
        let whole = self.cut_at.is_none_or(|at| self.steps < at);
        self.steps += 1;
        if !whole {
            self.cut();
        }
        whole
    }
}

impl<const ERASE_BYTES: usize> ErrorType for SimFlash<ERASE_BYTES> {
    type Error = FlashError;
}

impl<const ERASE_BYTES: usize> ReadNorFlash for SimFlash<ERASE_BYTES> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let span = self.span(offset, bytes.len(), 1)?;
        bytes.copy_from_slice(&self.bytes[span]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const ERASE_BYTES: usize> NorFlash for SimFlash<ERASE_BYTES> {
    const WRITE_SIZE: usize = WORD_BYTES;
    const ERASE_SIZE: usize = ERASE_BYTES;

    /// Erases the sectors from `from` up to `to` (exclusive); both must be the start of a sector or the end of the flash.
    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        let length = (to as usize).saturating_sub(from as usize);
        let span = self.span(from, length, WORD_BYTES)?;
        let begins_one = |at: usize| at == self.bytes.len() || self.sectors.iter().any(|sector| sector.begin == at);
        if to < from || !begins_one(span.start) || !begins_one(span.end) {
            return Err(FlashError::NotAligned { offset: from, length });
        }
        for k in 0..self.sectors.len() {
            let Sector { begin, end, .. } = self.sectors[k];
            if begin < span.start || end > span.end {
                continue;
            }
            self.sectors[k].erases += 1;
            if self.step() {
                self.bytes[begin..end].fill(0xff);
                continue;
            }
            for word in self.bytes[begin..end].chunks_exact_mut(WORD_BYTES) {
                match self.generator.next_u64() % 3 {
                    0 => word.fill(0xff),
                    1 => word.iter_mut().for_each(|byte| *byte |= self.generator.next_u64() as u8),
                    _ => {}
                }
            }
            return Err(FlashError::NoSupply);
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let span = self.span(offset, bytes.len(), WORD_BYTES)?;
        for (at, new) in span.step_by(WORD_BYTES).zip(bytes.chunks_exact(WORD_BYTES)) {
            let word = at..at + WORD_BYTES;
            if self.bytes[word.clone()] != [0xff; WORD_BYTES] {
                return Err(FlashError::NotErased { offset: at as u32 });
            }
            let whole = self.step();
            for (cell, new) in self.bytes[word].iter_mut().zip(new) {
                // Some of the bits that should change have not yet.
                let late = if whole { 0 } else { self.generator.next_u64() as u8 };
                *cell = new | late;
            }
            if !whole {
                return Err(FlashError::NoSupply);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Small = SimFlash<16>;

    fn read(flash: &mut Small, offset: u32) -> [u8; 4] {
        let mut word = [0; 4];
        flash.read(offset, &mut word).unwrap();
        word
    }

    #[test]
    fn a_word_is_written_once_between_two_erases() {
        let mut flash = Small::new(&[16, 32], 1);
        flash.write(4, &[1, 2, 3, 4, 5, 6, 7, 8]).unwrap();
        assert_eq!(read(&mut flash, 8), [5, 6, 7, 8]);
        assert_eq!(flash.write(8, &[0; 4]), Err(FlashError::NotErased { offset: 8 }), "even if bits change to 0 only");
        assert_eq!(read(&mut flash, 8), [5, 6, 7, 8], "contents unchanged");
        flash.erase(0, 16).unwrap();
        assert_eq!(flash.bytes(), [0xff; 48]);
        flash.write(8, &[0; 4]).unwrap();
        assert_eq!(flash.erases(), [1, 0]);
        assert_eq!(flash.steps(), 4);
    }

    #[test]
    fn only_whole_words_and_sectors_within_the_bounds_are_accepted() {
        let mut flash = Small::new(&[16, 32], 1);
        assert_eq!(flash.capacity(), 48);
        for (offset, length) in [(2, 4), (0, 3)] {
            assert_eq!(flash.write(offset, &[0; 4][..length]), Err(FlashError::NotAligned { offset, length }));
        }
        assert_eq!(flash.write(48, &[0; 4]), Err(FlashError::OutOfBounds { offset: 48, length: 4 }));
        assert_eq!(flash.erase(16, 32), Err(FlashError::NotAligned { offset: 16, length: 16 }), "half of the second sector");
        assert_eq!(flash.erase(32, 16), Err(FlashError::NotAligned { offset: 32, length: 0 }), "backwards");
        assert_eq!(flash.erase(16, 64), Err(FlashError::OutOfBounds { offset: 16, length: 48 }));
        assert_eq!(flash.steps(), 0);
        flash.erase(0, 48).unwrap();
        assert_eq!(flash.erases(), [1, 1]);
    }

    #[test]
    fn words_before_a_cut_are_written_and_words_after_it_are_erased() {
        let new = [0xA5_u8, 0x5A, 0x00, 0x0F];
        let mut half_done = 0;
        for seed in 0..50 {
            let mut flash = Small::new(&[16], seed);
            flash.cut_after(2);
            assert_eq!(flash.write(0, &new.repeat(4)), Err(FlashError::NoSupply));
            assert_eq!(flash.read(0, &mut [0]), Err(FlashError::NoSupply));
            assert_eq!(flash.erase(0, 16), Err(FlashError::NoSupply));
            flash.power_on();
            assert_eq!([read(&mut flash, 0), read(&mut flash, 4)], [new; 2]);
            let cut = read(&mut flash, 8);
            assert!(cut.iter().zip(new).all(|(cell, new)| cell & new == new), "a wrong bit was cleared: {cut:x?}");
            half_done += u32::from(cut != new && cut != [0xff; 4]);
            assert_eq!(read(&mut flash, 12), [0xff; 4]);
        }
        assert!(half_done > 40, "incomplete words must occur: {half_done} of 50");
    }

    #[test]
    fn an_interrupted_erase_leaves_a_partial_sector_and_counts() {
        let mut flash = SimFlash::<1024>::new(&[1024, 1024], 3);
        flash.write(0, &[0; 2048]).unwrap();
        flash.cut_after(1);
        assert_eq!(flash.erase(0, 2048), Err(FlashError::NoSupply));
        flash.power_on();
        assert_eq!(flash.bytes()[..1024], [0xff; 1024], "the first sector is erased");
        let second: Vec<&[u8]> = flash.bytes()[1024..].chunks(4).collect();
        let erased = second.iter().filter(|word| **word == [0xff; 4]).count();
        let kept = second.iter().filter(|word| **word == [0; 4]).count();
        assert!(erased > 50 && kept > 50 && erased + kept < 256, "{erased} erased, {kept} kept of 256");
        assert_eq!(flash.erases(), [1, 1]);
    }
}
