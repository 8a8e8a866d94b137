//! What went wrong, by number and in words, kept until it is asked for: `SYSTem:ERRor?`, at most 16.
//!
//! Negative numbers are SCPI's (volume 2, chapter 21), positive ones the stand's own. The words say what it was about, too.

use super::text::{Text, Writer};
use crate::words::{Words, words};

/// An error's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code(pub i16);

impl Code {
    /// A byte that is no text.
    pub const INVALID_CHARACTER: Self = Self(-101);
    /// The line cannot be read.
    pub const SYNTAX: Self = Self(-102);
    /// A parameter of another kind than what is taken.
    pub const DATA_TYPE: Self = Self(-104);
    /// More parameters than are taken.
    pub const PARAMETER_NOT_ALLOWED: Self = Self(-108);
    /// Fewer parameters than are needed.
    pub const MISSING_PARAMETER: Self = Self(-109);
    /// No such command.
    pub const UNDEFINED_HEADER: Self = Self(-113);
    /// A number that is none.
    pub const NUMERIC_DATA: Self = Self(-120);
    /// A unit that is none of this parameter's.
    pub const INVALID_SUFFIX: Self = Self(-131);
    /// It cannot be done now.
    pub const SETTINGS_CONFLICT: Self = Self(-221);
    /// A number outside of what is allowed.
    pub const OUT_OF_RANGE: Self = Self(-222);
    /// A line of more than 200 bytes.
    pub const TOO_MUCH_DATA: Self = Self(-223);
    /// A word that is none of those that are taken.
    pub const ILLEGAL_VALUE: Self = Self(-224);
    /// Nothing to tell: not measured, not there.
    pub const DATA_STALE: Self = Self(-230);
    /// The hardware does not have it or does not answer.
    pub const HARDWARE: Self = Self(-240);
    /// What was stored cannot be read.
    pub const STORAGE: Self = Self(-320);
    /// Some errors found no room.
    pub const QUEUE_OVERFLOW: Self = Self(-350);
    /// The line's check does not fit the line.
    pub const CHECKSUM: Self = Self(-362);
    /// The drive was switched off by a fault.
    pub const FAULT: Self = Self(101);
    /// The choice of channels is more than the line carries.
    pub const LINE_TOO_SLOW: Self = Self(102);
    /// A calibration ended without an answer.
    pub const CALIBRATION: Self = Self(103);
    /// A setting makes no sense.
    pub const SETTING: Self = Self(104);

    /// Its words.
    pub fn words(self) -> Words {
        match self {
            Self(0) => words!("No error"),
            Self::INVALID_CHARACTER => words!("Invalid character"),
            Self::SYNTAX => words!("Syntax error"),
            Self::DATA_TYPE => words!("Data type error"),
            Self::PARAMETER_NOT_ALLOWED => words!("Parameter not allowed"),
            Self::MISSING_PARAMETER => words!("Missing parameter"),
            Self::UNDEFINED_HEADER => words!("Undefined header"),
            Self::NUMERIC_DATA => words!("Numeric data error"),
            Self::INVALID_SUFFIX => words!("Invalid suffix"),
            Self::SETTINGS_CONFLICT => words!("Settings conflict"),
            Self::OUT_OF_RANGE => words!("Data out of range"),
            Self::TOO_MUCH_DATA => words!("Too much data"),
            Self::ILLEGAL_VALUE => words!("Illegal parameter value"),
            Self::DATA_STALE => words!("Data corrupt or stale"),
            Self::HARDWARE => words!("Hardware error"),
            Self::STORAGE => words!("Storage fault"),
            Self::QUEUE_OVERFLOW => words!("Queue overflow"),
            Self::CHECKSUM => words!("Checksum error in the line"),
            Self::FAULT => words!("Drive switched off"),
            Self::LINE_TOO_SLOW => words!("More than the line carries"),
            Self::CALIBRATION => words!("Calibration without an answer"),
            Self::SETTING => words!("Setting refused"),
            _ => words!("Error"),
        }
    }

    /// The bit of the standard event status register: command, execution, device or query error.
    pub fn event_bit(self) -> u8 {
        match self.0 {
            -199..=-100 => 1 << 5,
            -299..=-200 => 1 << 4,
            -499..=-400 => 1 << 2,
            0 => 0,
            _ => 1 << 3,
        }
    }
}

/// What an error is about.
pub type Detail = Text<72>;

/// An error and what it is about.
#[derive(Clone, Copy, Debug)]
pub struct ErrorEntry {
    /// Its number.
    pub code: Code,
    /// What it is about; may be empty.
    pub detail: Detail,
}

impl ErrorEntry {
    /// With nothing more to say.
    pub fn new(code: Code) -> Self {
        Self { code, detail: Detail::default() }
    }

    /// With words of the stand.
    pub fn saying(code: Code, words: Words) -> Self {
        let mut entry = Self::new(code);
        entry.detail.writer().words(words);
        entry
    }

    /// About some words of the line.
    pub fn about(code: Code, what: &[u8]) -> Self {
        let mut entry = Self::new(code);
        entry.detail.writer().bytes(what);
        entry
    }

    /// As the reply has it: number, comma, words in quotes.
    pub fn write(&self, out: &mut Writer<'_>) {
        out.signed(i64::from(self.code.0)).text(",\"").words(self.code.words());
        if !self.detail.is_empty() {
            out.text("; ");
            // A quote within would end the text.
            for byte in self.detail.as_bytes() {
                out.byte(if *byte == b'"' { b'\'' } else { *byte });
            }
        }
        out.byte(b'"');
    }
}

/// The queue's places.
pub const PLACES: usize = 16;

/// The errors that nobody has asked for yet, the oldest first.
#[derive(Clone, Debug)]
pub struct ErrorQueue {
    entries: [ErrorEntry; PLACES],
    first: usize,
    count: usize,
}

impl Default for ErrorQueue {
    fn default() -> Self {
        let empty = ErrorEntry { code: Code(0), detail: Detail::default() };
        Self { entries: [empty; PLACES], first: 0, count: 0 }
    }
}

impl ErrorQueue {
    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Adds one; where there is no room, the newest says so.
    pub fn push(&mut self, entry: ErrorEntry) {
        let entry = if self.count < PLACES { entry } else { ErrorEntry::new(Code::QUEUE_OVERFLOW) };
        let place = (self.first + self.count.min(PLACES - 1)) & (PLACES - 1);
        if let Some(place) = self.entries.get_mut(place) {
            *place = entry;
        }
        self.count = (self.count + 1).min(PLACES);
    }

    /// Takes the oldest.
    pub fn pop(&mut self) -> Option<ErrorEntry> {
        if self.count == 0 {
            return None;
        }
        let entry = self.entries.get(self.first).copied();
        self.first = (self.first + 1) & (PLACES - 1);
        self.count -= 1;
        entry
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.count = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_are_kept_in_order_and_a_loss_is_told() {
        let mut queue = ErrorQueue::default();
        for n in 0..20_u8 {
            queue.push(ErrorEntry::about(Code::UNDEFINED_HEADER, &[b'A' + n]));
        }
        let all: Vec<_> = core::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(all.len(), 16);
        assert!(all[..15].iter().zip(b'A'..).all(|(entry, letter)| entry.detail.as_bytes() == [letter]));
        assert_eq!(all[15].code, Code::QUEUE_OVERFLOW);
        assert_eq!(queue.count(), 0);
    }

    #[test]
    fn a_reply_has_number_and_words_in_quotes() {
        let mut text = Text::<120>::default();
        ErrorEntry::about(Code::UNDEFINED_HEADER, b"SOUR:\"FOO").write(&mut text.writer());
        assert_eq!(text.as_str(), "-113,\"Undefined header; SOUR:'FOO\"");
    }
}
