//! Command lines from bytes, and their check sum.
//!
//! CR, LF and CR LF end a line; empty lines are ignored. A line has at most 200 bytes; a longer one is refused whole. Backspace removes the
//! last byte, for typing in a terminal. Nothing is echoed, so that programs need not separate the echo from the reply; terminals echo
//! locally (`picocom --echo`, `stand console`). `~` and eight hex digits at the end are the CRC-32 of the bytes before the `~`. While a
//! program uses check sums, the app refuses lines without one: a damaged byte that became an end of line would otherwise leave a plain
//! command.

use crate::telemetry::crc32;
use heapless::Vec;

/// Longest line, bytes, including the check sum.
pub const MAX_LINE: usize = 200;

/// The reason why a line is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadLine {
    /// Longer than [`MAX_LINE`].
    TooLong,
    /// A byte is neither printable ASCII nor a tab.
    NotText,
    /// The check sum is wrong.
    Check,
}

/// A complete line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line<'a> {
    /// Its text, without line end and without a correct check sum.
    pub text: Result<&'a [u8], BadLine>,
    /// The line had a correct check sum: a program has sent it.
    pub is_checked: bool,
    /// The line ended with CR, as from a keyboard, and not with LF.
    pub by_hand: bool,
}

/// Assembles bytes to lines.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    bytes: Vec<u8, MAX_LINE>,
    /// The first defect of the present line.
    bad: Option<BadLine>,
    /// The line in `bytes` was returned; the next byte starts a new one.
    is_complete: bool,
    after_cr: bool,
}

impl Lines {
    /// Discards an incomplete line: after a break or the byte 0x18.
    pub fn restart(&mut self) {
        self.bytes.clear();
        self.bad = None;
    }

    /// Takes the next byte; returns the line at its end.
    pub fn push(&mut self, byte: u8) -> Option<Line<'_>> {
        if core::mem::take(&mut self.is_complete) {
            self.restart();
        }
        let after_cr = core::mem::replace(&mut self.after_cr, byte == b'\r');
        match byte {
            b'\n' if after_cr => None,
            b'\r' | b'\n' => self.end(byte == b'\r'),
            0x08 | 0x7f => {
                self.bytes.pop();
                None
            }
            b'\t' | b' '..=b'~' => {
                if self.bytes.push(byte).is_err() {
                    self.bad = Some(BadLine::TooLong);
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
        self.is_complete = true;
        match self.bad {
            Some(bad) => Some(Line { text: Err(bad), is_checked: false, by_hand }),
            None if self.bytes.is_empty() => None,
            None => {
                let text = without_check(&self.bytes);
                Some(Line { text, is_checked: text.is_ok_and(|text| text.len() < self.bytes.len()), by_hand })
            }
        }
    }
}

/// The line without its check sum. A `~` without a correct check sum behind it marks a damaged line.
fn without_check(line: &[u8]) -> Result<&[u8], BadLine> {
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

    fn lines(bytes: &[u8]) -> std::vec::Vec<Result<String, BadLine>> {
        let mut lines = Lines::default();
        let text = |line: Line<'_>| line.text.map(|text| str::from_utf8(text).unwrap().to_string());
        bytes.iter().filter_map(|byte| lines.push(*byte).map(text)).collect()
    }

    #[test]
    fn cr_lf_and_cr_lf_end_one_line() {
        assert_eq!(lines(b"A\rB\nC\r\nD\n\r\n\nE\r"), ["A", "B", "C", "D", "E"].map(|l| Ok(l.to_string())));
    }

    #[test]
    fn a_correct_check_sum_is_removed_and_a_wrong_one_refused() {
        let good = format!("OUTP ON~{:08X}\n", crc32(b"OUTP ON"));
        assert_eq!(lines(good.as_bytes()), [Ok("OUTP ON".to_string())]);
        assert_eq!(lines(good.to_lowercase().as_bytes()), [Err(BadLine::Check)], "the case counts");
        for bad in ["OUTP ON~00000000\n", "OUTP ON~\n", "OUTP ON~123\n", "OUTP~ON\n", "OUTP ON~ABCDEFGH\n"] {
            assert_eq!(lines(bad.as_bytes()), [Err(BadLine::Check)], "{bad}");
        }
    }

    #[test]
    fn a_long_or_binary_line_is_refused_whole_and_the_next_accepted() {
        let long = [vec![b'x'; 201], b"\nA\x01B\nC\n".to_vec()].concat();
        assert_eq!(lines(&long), [Err(BadLine::TooLong), Err(BadLine::NotText), Ok("C".to_string())]);
        assert_eq!(lines(&[vec![b'x'; 200], b"\n".to_vec()].concat()), [Ok("x".repeat(200))]);
    }

    /// Bytes are flipped, lost and inserted: a line that passes its check is the line that was sent.
    #[test]
    fn no_damaged_line_passes_its_check_sum() {
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
                    // An additional line end, or a byte removed by a backspace, leaves the line intact.
                    assert_eq!(String::from_utf8_lossy(text), command);
                    passed += u32::from(was_damaged);
                }
            }
        }
        assert!(passed < damaged / 10 && pieces > damaged, "{passed} intact");
    }

    #[test]
    fn backspace_removes_a_byte() {
        assert_eq!(lines(b"\x08*IDM\x7fN?\r"), [Ok("*IDN?".to_string())]);
    }
}
