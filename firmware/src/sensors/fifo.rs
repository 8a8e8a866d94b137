//! Decoder of ST's tagged FIFO (AN5398 §9; tags and parity as in ST's `st_fifo.c`).
//!
//! A word is a tag and six bytes. The three words of a sample, rate, acceleration and time stamp, share a two-bit counter in their tags. A
//! word with a wrong parity or an unknown tag is refused; a sample with a missing word is counted as lost.

use super::Sample;

/// Size of a word, bytes.
pub const WORD: usize = 7;

/// Kinds of words by tag.
const RATE: u8 = 0x01;
const ACCEL: u8 = 0x02;
const STAMP: u8 = 0x04;
/// Other kinds that are ignored: temperature, and a change of configuration.
const OTHERS: [u8; 2] = [0x03, 0x05];

/// Result of a word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decoded {
    /// The sample is incomplete.
    Incomplete,
    /// The sample is complete.
    Sample(Sample),
    /// The word is invalid.
    Refused,
}

/// A sample that is being assembled.
#[derive(Clone, Copy, Debug, Default)]
pub struct Decoder {
    counter: Option<u8>,
    rate: Option<[f32; 3]>,
    accel: Option<[f32; 3]>,
    stamp: Option<u32>,
    lost: u32,
}

impl Decoder {
    /// Samples lost since the last call.
    pub fn take_lost(&mut self) -> u32 {
        core::mem::take(&mut self.lost)
    }

    /// Takes a word; the scales are rad/s and m/s² per code.
    pub fn take(&mut self, word: [u8; WORD], rate_rad_s: f32, accel_m_s2: f32) -> Decoded {
        let [tag, a, b, c, d, e, f] = word;
        let (kind, counter) = (tag >> 3, tag >> 1 & 3);
        let known = [RATE, ACCEL, STAMP].contains(&kind);
        if tag.count_ones() & 1 != 0 || !(known || OTHERS.contains(&kind)) {
            return Decoded::Refused;
        }
        if !known {
            return Decoded::Incomplete;
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
                Decoded::Sample(Sample { stamp, rate_rad_s: Some(rate_rad_s), accel_m_s2 })
            }
            _ => Decoded::Incomplete,
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
    fn three_words_make_a_sample_in_any_order() {
        let mut decoder = Decoder::default();
        for (n, order) in [[RATE, ACCEL, STAMP], [STAMP, ACCEL, RATE]].into_iter().enumerate() {
            let body = |kind| if kind == STAMP { [1, 2, 0, 0, 9, 9] } else { [1, 0, 0xFF, 0xFF, 0, 0x80] };
            let took = order.map(|kind| decoder.take(word(kind, n as u8, body(kind)), 2.0, 0.5));
            let expected = Sample { stamp: 513, rate_rad_s: Some([2.0, -2.0, -65_536.0]), accel_m_s2: [0.5, -0.5, -16_384.0] };
            assert_eq!(took, [Decoded::Incomplete, Decoded::Incomplete, Decoded::Sample(expected)]);
        }
        assert_eq!(decoder.take_lost(), 0);
    }

    #[test]
    fn a_missing_word_is_a_lost_sample_and_a_bad_tag_is_refused() {
        let mut decoder = Decoder::default();
        decoder.take(word(RATE, 1, [0; 6]), 1.0, 1.0);
        decoder.take(word(STAMP, 2, [0; 6]), 1.0, 1.0);
        assert_eq!((decoder.take_lost(), decoder.take_lost()), (1, 0));
        let [good, ..] = word(RATE, 2, [0; 6]);
        for bit in 0..8 {
            assert_eq!(decoder.take([good ^ 1 << bit, 0, 0, 0, 0, 0, 0], 1.0, 1.0), Decoded::Refused, "bit {bit}");
        }
        for all in [0x00, 0xFF] {
            assert_eq!(decoder.take([all; WORD], 1.0, 1.0), Decoded::Refused);
        }
        assert_eq!(decoder.take(word(3, 2, [0; 6]), 1.0, 1.0), Decoded::Incomplete, "a temperature is valid");
    }
}
