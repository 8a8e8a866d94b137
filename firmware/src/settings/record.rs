//! [`Kept`] as bytes: the numbers of [`FIELDS`] in their order, 8 bytes each, then the harmonics; all little-endian.
//!
//! Numbers are not checked here, but where a [`Kept`] is put in force.

use super::{FIELDS, Kept};
use crate::compensation::{Harmonic, Harmonics};
use crate::gyro_loop::observer::ObserverParameters;

/// Content of a record in the store.
pub trait Record: Sized {
    /// Writes the record to the beginning of `space`; its length, or `None` if it does not fit.
    fn write(&self, space: &mut [u8]) -> Option<usize>;
    /// Reads a record that takes all of `bytes`; `None` if they are not a record.
    fn read(bytes: &[u8]) -> Option<Self>;
}

/// The content of the flash: settings and the numbers of an observer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Saved {
    /// The settings.
    pub kept: Kept,
    /// The observer.
    pub observer: ObserverParameters,
}

/// Count of the observer's numbers, these numbers, then the settings.
impl Record for Saved {
    fn write(&self, space: &mut [u8]) -> Option<usize> {
        let count = if self.observer.states() == 0 { 0 } else { self.observer.0.len() };
        let (first, mut rest) = space.split_first_mut()?;
        *first = count as u8;
        for number in self.observer.0.iter().take(count) {
            let place;
            (place, rest) = rest.split_first_chunk_mut()?;
            *place = number.to_le_bytes();
        }
        self.kept.write(rest).map(|written| 1 + 8 * count + written)
    }

    fn read(bytes: &[u8]) -> Option<Self> {
        let (count, mut rest) = bytes.split_first()?;
        let mut observer = ObserverParameters::default();
        for place in observer.0.get_mut(..usize::from(*count))? {
            *place = number(&mut rest)?;
        }
        Kept::read(rest).map(|kept| Self { kept, observer })
    }
}

/// Size of a harmonic, bytes: order u16, torque and phase f64.
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

/// Takes a number from the front.
fn number(rest: &mut &[u8]) -> Option<f64> {
    let (number, after) = rest.split_first_chunk()?;
    *rest = after;
    Some(f64::from_le_bytes(*number))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compensation::MAX_HARMONICS;

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
    fn a_record_reads_back_bit_for_bit() {
        for harmonics in 0..=MAX_HARMONICS {
            let mut space = [0; 1024];
            let length = kept(harmonics).write(&mut space).unwrap();
            assert_eq!(length, 8 * FIELDS.len() + HARMONIC * harmonics);
            assert_eq!(Kept::read(&space[..length]), Some(kept(harmonics)));
        }
    }

    #[test]
    fn an_observer_is_stored_only_if_there_is_one() {
        let none = Saved { kept: kept(3), observer: ObserverParameters::default() };
        let mut some = none;
        some.observer.0.iter_mut().enumerate().for_each(|(n, number)| *number = 0.1 * n as f64 - 3.0);
        some.observer.get_mut(crate::gyro_loop::observer::parameters::STATES).fill(7.0);
        for (saved, more) in [(none, 0), (some, 8 * some.observer.0.len())] {
            let mut space = [0; 2048];
            let length = saved.write(&mut space).unwrap();
            assert_eq!(length, 1 + more + 8 * FIELDS.len() + 3 * HARMONIC);
            assert_eq!(Saved::read(&space[..length]), Some(saved));
            assert_eq!((Saved::read(&space[..length - 1]), Saved::read(&[200])), (None, None));
        }
    }

    #[test]
    fn a_record_of_wrong_length_is_refused() {
        let mut space = [0; 1024];
        let length = kept(MAX_HARMONICS).write(&mut space).unwrap();
        // A cut between two harmonics is a record with fewer of them; the CRC and length of the store detect that.
        assert_eq!(Kept::read(&space[..length - 1]), None);
        assert_eq!(Kept::read(&space[..8 * FIELDS.len() - 8]), None);
        assert_eq!(Kept::read(&space[..length + HARMONIC]), None, "one harmonic too many");
        assert_eq!(kept(MAX_HARMONICS).write(&mut space[..length - 1]), None);
    }
}
