//! The text of a file, whatever its encoding.

use chardetng::{EncodingDetector, Iso2022JpDetection, Utf8Detection};
use encoding_rs::{Encoding, UTF_8};

/// Bytes from which the encoding is found.
const EXAMINED_BYTES: usize = 1 << 16;

/// UTF-8 or UTF-16 by its mark, else UTF-8 if it is that, else the 8-bit encoding of the language that its letters suggest. `None` for
/// bytes that are no text.
pub(super) fn decoded(bytes: Vec<u8>) -> Option<String> {
    if let Some((encoding, _)) = Encoding::for_bom(&bytes) {
        return Some(encoding.decode_with_bom_removal(&bytes).0.into_owned());
    }
    let begin = &bytes[..bytes.len().min(EXAMINED_BYTES)];
    if begin.contains(&0) {
        return None;
    }
    String::from_utf8(bytes).map_or_else(
        |error| {
            let bytes = error.into_bytes();
            let mut detector = EncodingDetector::new(Iso2022JpDetection::Deny);
            // Only lines with letters beyond ASCII tell the language, and they may be few.
            let telling = bytes.split(|b| *b == b'\n').filter(|line| !line.is_ascii()).take(64);
            for line in telling {
                detector.feed(line, false);
            }
            detector.feed(b"", true);
            let encoding = detector.guess(None, Utf8Detection::Deny);
            // A mark of µ, ° or ² alone tells no language.
            let encoding = if has_word(&bytes) { encoding } else { encoding_rs::WINDOWS_1252 };
            Some(if encoding == UTF_8 { String::from_utf8_lossy(&bytes).into_owned() } else { encoding.decode(&bytes).0.into_owned() })
        },
        Some,
    )
}

/// Three bytes beyond ASCII in a row: letters of a word.
fn has_word(bytes: &[u8]) -> bool {
    bytes.windows(3).any(|w| w.iter().all(|b| *b >= 0x80))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encodings_of_spreadsheets_are_text() {
        assert_eq!(decoded(b"t;\xb0/s\n1;2\n".to_vec()).as_deref(), Some("t;°/s\n1;2\n"));
        assert_eq!(decoded(b"Zeit;\xb5s;Geschw\xe4ndigkeit\n".to_vec()).as_deref(), Some("Zeit;µs;Geschwändigkeit\n"));
        assert_eq!(decoded(vec![0xff, 0xfe, b't', 0, b';', 0]).as_deref(), Some("t;"));
        assert_eq!(decoded("\u{feff}t;u".as_bytes().to_vec()).as_deref(), Some("t;u"));
        let (ukrainian, ..) = encoding_rs::WINDOWS_1251.encode("Час, мс;Напруга, В;Швидкість, об/хв\n0;1;2\n");
        assert_eq!(decoded(ukrainian.into_owned()).as_deref(), Some("Час, мс;Напруга, В;Швидкість, об/хв\n0;1;2\n"));
        assert_eq!(decoded(vec![1, 0, 2, 0]), None);
    }
}
