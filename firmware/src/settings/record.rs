//! [`Kept`] as bytes: the numbers of [`FIELDS`] in their order, 8 bytes each, then the harmonics; all little-endian.
//!
//! The list does it, not a derived reader for each structure: one loop in place of some KiB of code. Numbers are taken as they are; whether they
//! make sense is checked where a [`Kept`] is put in force.

use super::{FIELDS, Kept};
use crate::compensation::{Harmonic, Harmonics};

/// What a store keeps.
pub trait Record: Sized {
    /// Writes it at the beginning of `space`; its length, `None` where there is no room.
    fn write(&self, space: &mut [u8]) -> Option<usize>;
    /// Reads all of `bytes`; `None` where that is no record.
    fn read(bytes: &[u8]) -> Option<Self>;
}

/// Bytes of a harmonic: order u16, amplitude and phase f64.
const HARMONIC: usize = 18;

impl Record for Kept {
    fn write(&self, space: &mut [u8]) -> Option<usize> {
        let mut written = 0;
        let mut put = |bytes: &[u8]| {
            let place = space.get_mut(written..)?.get_mut(..bytes.len())?;
            place.copy_from_slice(bytes);
            written += bytes.len();
            Some(())
        };
        for field in FIELDS {
            put(&(field.read)(self).to_le_bytes())?;
        }
        for harmonic in self.settings.compensation.harmonics.as_slice() {
            put(&harmonic.order.to_le_bytes())?;
            put(&harmonic.torque_N_m.to_le_bytes())?;
            put(&harmonic.phase_rad.to_le_bytes())?;
        }
        Some(written)
    }

    fn read(bytes: &[u8]) -> Option<Self> {
        let mut kept = Self::default();
        let mut rest = bytes;
        for field in FIELDS {
            (field.write)(&mut kept, number(&mut rest)?);
        }
        let (harmonics, left_over) = rest.as_chunks::<HARMONIC>();
        let mut all = Harmonics::default();
        for harmonic in harmonics {
            let (order, mut rest) = harmonic.split_first_chunk()?;
            let (torque_N_m, phase_rad) = (number(&mut rest)?, number(&mut rest)?);
            all.push(Harmonic { order: u16::from_le_bytes(*order), torque_N_m, phase_rad })?;
        }
        kept.settings.compensation.harmonics = all;
        left_over.is_empty().then_some(kept)
    }
}

/// Takes a number off.
fn number(rest: &mut &[u8]) -> Option<f64> {
    let (number, after) = rest.split_first_chunk()?;
    *rest = after;
    Some(f64::from_le_bytes(*number))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compensation::MOST_HARMONICS;

    fn kept(harmonics: usize) -> Kept {
        let mut kept = Kept::default();
        for (n, field) in FIELDS.iter().enumerate() {
            (field.write)(&mut kept, 17.0 + n as f64);
        }
        let nth = |n| Harmonic { order: 7 * (n as u16 + 1), torque_N_m: 1e-3 / (n as f64 + 1.0), phase_rad: n as f64 - 0.3 };
        kept.settings.compensation.harmonics = Harmonics::of((0..harmonics).map(nth)).unwrap();
        kept
    }

    #[test]
    fn what_is_kept_comes_back_bit_for_bit() {
        for harmonics in 0..=MOST_HARMONICS {
            let mut space = [0; 1024];
            let length = kept(harmonics).write(&mut space).unwrap();
            assert_eq!(length, 8 * FIELDS.len() + HARMONIC * harmonics);
            assert_eq!(Kept::read(&space[..length]), Some(kept(harmonics)));
        }
    }

    #[test]
    fn what_is_too_short_too_long_or_has_no_room_is_no_record() {
        let mut space = [0; 1024];
        let length = kept(MOST_HARMONICS).write(&mut space).unwrap();
        // Cut between two harmonics it is a record of fewer; the store's CRC and length are against that.
        assert_eq!(Kept::read(&space[..length - 1]), None);
        assert_eq!(Kept::read(&space[..8 * FIELDS.len() - 8]), None);
        assert_eq!(Kept::read(&space[..length + HARMONIC]), None, "a ninth harmonic");
        assert_eq!(kept(MOST_HARMONICS).write(&mut space[..length - 1]), None);
    }
}
