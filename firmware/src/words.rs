//! Words for a person, packed: a byte above 127 is a pair of others, so that the image holds half as much.
//!
//! `words!("…")` packs at compile time; [`crate::console::text::Writer::words`] and `Display` write out. The pairs are those that stand together most
//! often in the words of this program (byte-pair encoding: the commonest pair becomes a byte, 128 times over; 8.0 kB of words become 4.6 kB with
//! the table). Words that are new pack less well until the table is made anew, and read the same.

use core::fmt::{self, Write};

/// What the bytes from 128 on stand for; each of plain letters and of bytes before it.
#[rustfmt::skip]
const PAIRS: [[u8; 2]; 128] = [
    [b'e', b' '], [b's', b' '], [b't', b'h'], [b't', b' '], [130, 128], [b'o', b'r'], [b',', b' '], [b'e', b'r'],
    [b'i', b'n'], [b'e', b'n'], [b'a', b'n'], [b'o', b'n'], [b'd', b' '], [b'o', b'f'], [b' ', 132], [b'a', b't'],
    [133, b' '], [b'i', b't'], [b's', b't'], [b'w', b'h'], [b'o', b'w'], [b';', b' '], [b'c', b'h'], [b'n', b'o'],
    [b'a', b'r'], [b'a', b' '], [b'e', b's'], [b'a', 131], [b'i', 129], [b'p', b'l'], [b'r', b'e'], [b'r', b'i'],
    [136, b'g'], [135, b' '], [b'o', b'm'], [b's', b'e'], [b':', b' '], [b'a', b'l'], [b'u', b'n'], [b'a', b'm'],
    [b'i', 131], [b' ', b'f'], [b'a', 129], [b'a', b's'], [b'y', b' '], [b'd', b'e'], [b'c', b'k'], [138, 140],
    [b'e', 129], [b'o', b'l'], [145, 129], [b'o', b' '], [b'e', b'l'], [b'i', 139], [159, b'v'], [b'd', 182],
    [b'i', b'l'], [b' ', b's'], [b't', b'a'], [141, b' '], [147, 155], [b'u', b'r'], [b's', 134], [160, b' '],
    [183, 128], [141, b'f'], [b'e', b't'], [b'o', b'u'], [b'm', b'o'], [b'w', 170], [b' ', 175], [b' ', b' '],
    [b'r', 143], [141, 142], [137, b'c'], [b'a', b'u'], [150, b'e'], [b'u', b'p'], [b'b', b'y'], [137, b's'],
    [b'r', 166], [b'w', b'i'], [186, b'k'], [b'f', 133], [b't', 189], [212, b'n'], [151, b' '], [130, 155],
    [b'\'', 129], [b'e', b'v'], [154, 131], [b'd', 129], [b't', b'e'], [b'p', b'r'], [b'c', 162], [b't', 179],
    [b'l', b'o'], [209, 130], [138, b' '], [b'l', 136], [b'h', 148], [b'e', b'a'], [151, 131], [204, 174],
    [137, b' '], [151, 130], [b'i', b'r'], [b'o', 166], [181, b' '], [135, b'r'], [128, b's'], [134, 144],
    [171, b'k'], [205, 157], [203, b'l'], [233, 191], [b's', 167], [b'c', b't'], [b'f', b'r'], [b's', 131],
    [138, b'g'], [237, 133], [b'i', b'g'], [138, b'd'], [b'c', 139], [b'e', 140], [b'q', b'u'], [b';', 142],
];

/// Bytes of the longest words.
const MOST: usize = 160;

/// Packed words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Words(&'static [u8]);

impl Words {
    /// What [`pack`] made.
    pub const fn of(packed: &'static [u8]) -> Self {
        Self(packed)
    }

    /// Gives each letter to `take`.
    pub fn letters(self, take: &mut dyn FnMut(u8)) {
        for byte in self.0 {
            letters_of(*byte, take);
        }
    }
}

impl fmt::Display for Words {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut written = Ok(());
        self.letters(&mut |letter| written = written.and_then(|()| f.write_char(char::from(letter))));
        written
    }
}

/// Ends, for a pair is of bytes before it.
fn letters_of(byte: u8, take: &mut dyn FnMut(u8)) {
    match usize::from(byte).checked_sub(128).and_then(|place| PAIRS.get(place)) {
        Some(pair) => pair.iter().for_each(|byte| letters_of(*byte, take)),
        None => take(byte),
    }
}

/// The packed bytes and how many of them count. For constants: what is no ASCII or too long is an error of the build.
#[allow(clippy::indexing_slicing)] // only while the program is built
const fn packed(text: &str) -> ([u8; MOST], usize) {
    let text = text.as_bytes();
    assert!(text.len() <= MOST && text.is_ascii());
    let mut bytes = [0; MOST];
    let mut length = text.len();
    let mut k = 0;
    while k < length {
        bytes[k] = text[k];
        k += 1;
    }
    let mut pair = 0;
    while pair < PAIRS.len() {
        let (mut from, mut to) = (0, 0);
        while from < length {
            if from + 1 < length && bytes[from] == PAIRS[pair][0] && bytes[from + 1] == PAIRS[pair][1] {
                bytes[to] = 128 + pair as u8;
                from += 2;
            } else {
                bytes[to] = bytes[from];
                from += 1;
            }
            to += 1;
        }
        length = to;
        pair += 1;
    }
    (bytes, length)
}

/// Bytes that the packed text takes.
pub const fn packed_length(text: &str) -> usize {
    packed(text).1
}

/// The packed text; `N` is its [`packed_length`].
#[allow(clippy::indexing_slicing)] // only while the program is built
pub const fn pack<const N: usize>(text: &str) -> [u8; N] {
    let (all, length) = packed(text);
    assert!(length == N);
    let mut bytes = [0; N];
    let mut k = 0;
    while k < N {
        bytes[k] = all[k];
        k += 1;
    }
    bytes
}

/// Packs a text while the program is built.
macro_rules! words {
    ($text:expr) => {
        const {
            const LENGTH: usize = $crate::words::packed_length($text);
            const PACKED: [u8; LENGTH] = $crate::words::pack($text);
            $crate::words::Words::of(&PACKED)
        }
    };
}
pub(crate) use words;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_read_as_they_were_and_take_less() {
        const TEXT: &str = "the drive is on: OUTPut OFF first; ~\"'[]{}\\ 0x18";
        let packed = words!(TEXT);
        assert_eq!(packed.to_string(), TEXT);
        assert!(packed.0.len() * 4 < TEXT.len() * 3, "{} of {}", packed.0.len(), TEXT.len());
        assert_eq!(words!("").to_string(), "");
    }

    #[test]
    fn a_pair_is_of_plain_letters_and_of_pairs_before_it() {
        for (place, pair) in PAIRS.iter().enumerate() {
            assert!(pair.iter().all(|byte| (b' '..=b'~').contains(byte) || (128..128 + place).contains(&usize::from(*byte))), "{place}");
        }
    }
}
