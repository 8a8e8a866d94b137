//! Lines from bytes, and the check that a tool puts behind its line.
//!
//! CR, LF and CR LF end a line; an empty line is nothing. At most 200 bytes; a longer one is refused whole. Backspace takes the last byte
//! away, for a person who types into a plain terminal; nothing is echoed (the terminal does that: `picocom --echo`, `stand console`), because a
//! program would have to tell the echo from the answer. `~` and eight hex digits at the end are the CRC-32 of all that is before the `~`.
//! Where a tool speaks, the app takes no line without a check: a byte that damage has made an end of line would leave a plain command.

use crate::telemetry::crc32;

/// Most bytes of a line, the check included.
pub const MOST_LINE: usize = 200;

/// Why a line is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadLine {
    /// Longer than [`MOST_LINE`].
    TooLong,
    /// A byte that is neither printable ASCII nor a tab.
    NotText,
    /// The check behind it is not that of the line.
    Check,
}

/// A whole line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line<'a> {
    /// What is in it, without its end and without a check that was right.
    pub text: Result<&'a [u8], BadLine>,
    /// There was a check, and it was right: it is a tool's.
    pub is_checked: bool,
    /// It ended with CR, as a person's key does, and not with LF.
    pub by_hand: bool,
}

/// Puts bytes together to lines.
#[derive(Clone, Debug)]
pub struct Lines {
    bytes: [u8; MOST_LINE],
    length: usize,
    bad: Option<BadLine>,
    after_cr: bool,
}

impl Default for Lines {
    fn default() -> Self {
        Self { bytes: [0; MOST_LINE], length: 0, bad: None, after_cr: false }
    }
}

impl Lines {
    /// Forgets a line that was begun: after a break, after 0x18.
    pub fn restart(&mut self) {
        self.length = 0;
        self.bad = None;
    }

    /// Takes the next byte; at an end, the line.
    pub fn push(&mut self, byte: u8) -> Option<Line<'_>> {
        let after_cr = core::mem::replace(&mut self.after_cr, byte == b'\r');
        match byte {
            b'\n' if after_cr => None,
            b'\r' | b'\n' => self.end(byte == b'\r'),
            0x08 | 0x7f => {
                self.length = self.length.saturating_sub(1);
                None
            }
            b'\t' | b' '..=b'~' => {
                match self.bytes.get_mut(self.length) {
                    Some(place) => {
                        *place = byte;
                        self.length += 1;
                    }
                    None => self.bad = Some(BadLine::TooLong),
                }
                None
            }
            _ => {
                self.bad = self.bad.or(Some(BadLine::NotText));
                None
            }
        }
    }

    fn end(&mut self, by_hand: bool) -> Option<Line<'_>> {
        let length = core::mem::take(&mut self.length);
        let bad = self.bad.take();
        let text = self.bytes.get(..length).unwrap_or_default();
        match bad {
            Some(bad) => Some(Line { text: Err(bad), is_checked: false, by_hand }),
            None if text.is_empty() => None,
            None => {
                let whole = checked(text);
                Some(Line { text: whole, is_checked: whole.is_ok_and(|whole| whole.len() < text.len()), by_hand })
            }
        }
    }
}

/// The line without its check, if it has one and that is right; a `~` without a right check behind it is a damaged one.
fn checked(line: &[u8]) -> Result<&[u8], BadLine> {
    let Some(place) = line.iter().rposition(|byte| *byte == b'~') else { return Ok(line) };
    let (text, check) = line.split_at_checked(place).ok_or(BadLine::Check)?;
    let digits = check.get(1..).unwrap_or_default();
    if digits.len() != 8 {
        return Err(BadLine::Check);
    }
    let mut value = 0_u32;
    for digit in digits {
        let nibble = char::from(*digit).to_digit(16).ok_or(BadLine::Check)?;
        value = value << 4 | nibble;
    }
    if value == crc32(text) { Ok(text) } else { Err(BadLine::Check) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};

    fn lines(bytes: &[u8]) -> Vec<Result<String, BadLine>> {
        let mut lines = Lines::default();
        bytes.iter().filter_map(|byte| lines.push(*byte).map(|l| l.text.map(|t| String::from_utf8(t.to_vec()).unwrap()))).collect()
    }

    #[test]
    fn every_end_ends_one_line() {
        assert_eq!(lines(b"A\rB\nC\r\nD\n\r\n\nE\r"), ["A", "B", "C", "D", "E"].map(|l| Ok(l.to_string())));
    }

    #[test]
    fn a_right_check_is_stripped_and_a_wrong_one_refused() {
        let good = format!("OUTP ON~{:08X}\n", crc32(b"OUTP ON"));
        assert_eq!(lines(good.as_bytes()), [Ok("OUTP ON".to_string())]);
        assert_eq!(lines(good.to_lowercase().as_bytes()), [Err(BadLine::Check)], "case is content");
        for bad in ["OUTP ON~00000000\n", "OUTP ON~\n", "OUTP ON~123\n", "OUTP~ON\n", "OUTP ON~ABCDEFGH\n"] {
            assert_eq!(lines(bad.as_bytes()), [Err(BadLine::Check)], "{bad}");
        }
    }

    #[test]
    fn what_is_too_long_or_no_text_is_refused_whole_and_the_next_is_taken() {
        let long = [vec![b'x'; 201], b"\nA\x01B\nC\n".to_vec()].concat();
        assert_eq!(lines(&long), [Err(BadLine::TooLong), Err(BadLine::NotText), Ok("C".to_string())]);
        assert_eq!(lines(&[vec![b'x'; 200], b"\n".to_vec()].concat()), [Ok("x".repeat(200))]);
    }

    /// Flipped, lost and inserted bytes, as many as it takes: a line that passes its check is the one that was sent.
    #[test]
    fn no_damaged_line_passes_its_check() {
        let damaged = if cfg!(debug_assertions) { 100_000 } else { 1_000_000 };
        let mut random = Xoshiro256PlusPlus::seed_from_u64(6);
        let (mut passed, mut pieces) = (0_u32, 0_u32);
        for n in 0..damaged {
            let command = format!("SOURce:RATE {}.{:03} DEG/S;:PROFile:AMPLitude {n}", n % 2000, n % 1000);
            let sent = format!("{command}~{:08X}\n", crc32(command.as_bytes()));
            let mut bytes = sent.clone().into_bytes();
            for _ in 0..=random.next_u32() % 3 {
                let place = random.next_u32() as usize % bytes.len();
                match random.next_u32() % 4 {
                    0 => bytes[place] ^= 1 << (random.next_u32() % 8),
                    1 => drop(bytes.remove(place)),
                    2 => bytes.insert(place, random.next_u32() as u8),
                    _ => bytes.insert(place, b'\n'),
                }
            }
            let was_damaged = bytes.strip_suffix(b"\n").unwrap_or(&bytes) != sent.trim_end().as_bytes();
            let mut lines = Lines::default();
            for byte in bytes.into_iter().chain(*b"\n") {
                let Some(line) = lines.push(byte) else { continue };
                pieces += 1;
                if let (Ok(text), true) = (line.text, line.is_checked) {
                    // A line end more before or behind it, or a byte that a backspace takes away again, leaves it whole.
                    assert_eq!(String::from_utf8_lossy(text), command);
                    passed += u32::from(was_damaged);
                }
            }
        }
        assert!(passed < damaged / 10 && pieces > damaged, "{passed} whole in spite of it");
    }

    #[test]
    fn a_persons_backspace_takes_a_byte_away() {
        assert_eq!(lines(b"\x08*IDM\x7fN?\r"), [Ok("*IDN?".to_string())]);
    }
}
