//! Words of ST's tagged FIFO put together to samples (AN5398 §9; tags and parity as in ST's `st_fifo.c`).
//!
//! A word is a tag and six bytes. The words of one moment, rate, acceleration and time, share a counter of two bits in their tags. A tag of
//! odd parity or of no known kind is refused; a moment of which a word is missing is lost and counted.

use super::Sample;

/// Bytes of a word.
pub const WORD: usize = 7;

/// Kinds of words, as the tag has them.
const RATE: u8 = 0x01;
const ACCEL: u8 = 0x02;
const STAMP: u8 = 0x04;
/// Words that are none of the three but may come: temperature, and a change of the set-up.
const OTHERS: [u8; 2] = [0x03, 0x05];

/// What a word did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Took {
    /// Nothing yet.
    Part,
    /// It was the last of its moment.
    Sample(Sample),
    /// It is no word.
    Refused,
}

/// A moment under way.
#[derive(Clone, Copy, Debug, Default)]
pub struct Assembly {
    counter: Option<u8>,
    rate: Option<[f32; 3]>,
    accel: Option<[f32; 3]>,
    stamp: Option<u32>,
    lost: u32,
}

impl Assembly {
    /// Samples lost since the last call.
    pub fn take_lost(&mut self) -> u32 {
        core::mem::take(&mut self.lost)
    }

    /// Takes a word; the scales turn codes into rad/s and m/s².
    pub fn take(&mut self, word: [u8; WORD], rate_rad_s: f32, accel_m_s2: f32) -> Took {
        let [tag, a, b, c, d, e, f] = word;
        let (kind, counter) = (tag >> 3, tag >> 1 & 3);
        let known = [RATE, ACCEL, STAMP].contains(&kind);
        if tag.count_ones() & 1 != 0 || !(known || OTHERS.contains(&kind)) {
            return Took::Refused;
        }
        if !known {
            return Took::Part;
        }
        if self.counter != Some(counter) {
            let begun = self.rate.is_some() || self.accel.is_some() || self.stamp.is_some();
            self.lost = self.lost.saturating_add(u32::from(begun));
            *self = Self { counter: Some(counter), lost: self.lost, ..Self::default() };
        }
        let codes = [[a, b], [c, d], [e, f]].map(i16::from_le_bytes);
        match kind {
            RATE => self.rate = Some(codes.map(|code| f32::from(code) * rate_rad_s)),
            ACCEL => self.accel = Some(codes.map(|code| f32::from(code) * accel_m_s2)),
            _ => self.stamp = Some(u32::from_le_bytes([a, b, c, d])),
        }
        match (self.rate, self.accel, self.stamp) {
            (Some(rate_rad_s), Some(accel_m_s2), Some(stamp)) => {
                *self = Self { lost: self.lost, ..Self::default() };
                Took::Sample(Sample { stamp, rate_rad_s, accel_m_s2 })
            }
            _ => Took::Part,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn word(kind: u8, counter: u8, body: [u8; 6]) -> [u8; WORD] {
        let tag = kind << 3 | counter << 1;
        let tag = tag | (tag.count_ones() & 1) as u8;
        let [a, b, c, d, e, f] = body;
        [tag, a, b, c, d, e, f]
    }

    #[test]
    fn three_words_of_a_moment_are_a_sample_in_any_order() {
        let mut assembly = Assembly::default();
        for (n, order) in [[RATE, ACCEL, STAMP], [STAMP, ACCEL, RATE]].into_iter().enumerate() {
            let body = |kind| if kind == STAMP { [1, 2, 0, 0, 9, 9] } else { [1, 0, 0xFF, 0xFF, 0, 0x80] };
            let took = order.map(|kind| assembly.take(word(kind, n as u8, body(kind)), 2.0, 0.5));
            let expected = Sample { stamp: 513, rate_rad_s: [2.0, -2.0, -65_536.0], accel_m_s2: [0.5, -0.5, -16_384.0] };
            assert_eq!(took, [Took::Part, Took::Part, Took::Sample(expected)]);
        }
        assert_eq!(assembly.take_lost(), 0);
    }

    #[test]
    fn a_missing_word_is_a_lost_sample_and_a_bad_tag_is_refused() {
        let mut assembly = Assembly::default();
        assembly.take(word(RATE, 1, [0; 6]), 1.0, 1.0);
        assembly.take(word(STAMP, 2, [0; 6]), 1.0, 1.0);
        assert_eq!((assembly.take_lost(), assembly.take_lost()), (1, 0));
        let [good, ..] = word(RATE, 2, [0; 6]);
        for bit in 0..8 {
            assert_eq!(assembly.take([good ^ 1 << bit, 0, 0, 0, 0, 0, 0], 1.0, 1.0), Took::Refused, "bit {bit}");
        }
        for all in [0x00, 0xFF] {
            assert_eq!(assembly.take([all; WORD], 1.0, 1.0), Took::Refused);
        }
        assert_eq!(assembly.take(word(3, 2, [0; 6]), 1.0, 1.0), Took::Part, "a temperature is no rubbish");
    }
}
