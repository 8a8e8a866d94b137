//! Errors of the console: number, text and detail, kept until `SYSTem:ERRor?` reads them.
//!
//! Negative numbers are SCPI's (volume 2, chapter 21), positive ones the stand's own.

use crate::text::Truncated;
use core::fmt::{self, Display, Write};
use heapless::Deque;

/// Number of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code(pub i16);

impl Code {
    /// There is no error.
    pub const NONE: Self = Self(0);
    /// A byte is not printable ASCII.
    pub const INVALID_CHARACTER: Self = Self(-101);
    /// The line cannot be parsed.
    pub const SYNTAX: Self = Self(-102);
    /// A parameter is of the wrong type.
    pub const DATA_TYPE: Self = Self(-104);
    /// There are too many parameters.
    pub const PARAMETER_NOT_ALLOWED: Self = Self(-108);
    /// A parameter is missing.
    pub const MISSING_PARAMETER: Self = Self(-109);
    /// The command does not exist.
    pub const UNDEFINED_HEADER: Self = Self(-113);
    /// A number behind a word of the header; there is one of each.
    pub const HEADER_SUFFIX: Self = Self(-114);
    /// A number cannot be parsed.
    pub const NUMERIC_DATA: Self = Self(-120);
    /// The unit does not belong to the parameter.
    pub const INVALID_SUFFIX: Self = Self(-131);
    /// A text in quotes where a number or a word is meant.
    pub const STRING_NOT_ALLOWED: Self = Self(-158);
    /// The command is not possible in the present state.
    pub const SETTINGS_CONFLICT: Self = Self(-221);
    /// A number is outside its range.
    pub const OUT_OF_RANGE: Self = Self(-222);
    /// A line is longer than 200 bytes.
    pub const TOO_MUCH_DATA: Self = Self(-223);
    /// A word is not one of the choices.
    pub const ILLEGAL_VALUE: Self = Self(-224);
    /// There is no value: not measured, or no source.
    pub const DATA_STALE: Self = Self(-230);
    /// The hardware is missing or does not answer.
    pub const HARDWARE: Self = Self(-240);
    /// Stored data cannot be read or written.
    pub const STORAGE: Self = Self(-320);
    /// The self-test has found something.
    pub const SELF_TEST: Self = Self(-330);
    /// Errors were lost because the queue was full.
    pub const QUEUE_OVERFLOW: Self = Self(-350);
    /// The check sum of a line is wrong or missing.
    pub const CHECKSUM: Self = Self(-362);
    /// More input than can be kept.
    pub const INPUT_OVERRUN: Self = Self(-363);
    /// A fault has switched the drive off.
    pub const FAULT: Self = Self(101);
    /// The selected channels need more bandwidth than the line has.
    pub const LINE_TOO_SLOW: Self = Self(102);
    /// A calibration ended without a result.
    pub const CALIBRATION: Self = Self(103);
    /// A setting is invalid.
    pub const SETTING: Self = Self(104);

    /// The text of the error.
    pub fn message(self) -> &'static str {
        match self {
            Self::NONE => "No error",
            Self::INVALID_CHARACTER => "Invalid character",
            Self::SYNTAX => "Syntax error",
            Self::DATA_TYPE => "Data type error",
            Self::PARAMETER_NOT_ALLOWED => "Parameter not allowed",
            Self::MISSING_PARAMETER => "Missing parameter",
            Self::UNDEFINED_HEADER => "Undefined header",
            Self::HEADER_SUFFIX => "Header suffix out of range",
            Self::NUMERIC_DATA => "Numeric data error",
            Self::INVALID_SUFFIX => "Invalid suffix",
            Self::STRING_NOT_ALLOWED => "String data not allowed",
            Self::SETTINGS_CONFLICT => "Settings conflict",
            Self::OUT_OF_RANGE => "Data out of range",
            Self::TOO_MUCH_DATA => "Too much data",
            Self::ILLEGAL_VALUE => "Illegal parameter value",
            Self::DATA_STALE => "Data corrupt or stale",
            Self::HARDWARE => "Hardware error",
            Self::STORAGE => "Storage fault",
            Self::QUEUE_OVERFLOW => "Queue overflow",
            Self::CHECKSUM => "Checksum error in the line",
            Self::INPUT_OVERRUN => "Input buffer overrun",
            Self::SELF_TEST => "Self-test failed",
            Self::FAULT => "Drive switched off",
            Self::LINE_TOO_SLOW => "Serial line too slow",
            Self::CALIBRATION => "Calibration failed",
            Self::SETTING => "Setting refused",
            _ => "Error",
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

/// Longest detail, bytes; with the text of the code it fits into a line of a reply.
const DETAIL_BYTES: usize = 120;

/// An error of the console.
#[derive(Clone, Debug)]
pub struct ErrorEntry {
    /// Its number.
    pub code: Code,
    /// The cause and what to do about it; may be empty.
    detail: Truncated<DETAIL_BYTES>,
}

impl ErrorEntry {
    /// An error without a detail.
    pub fn new(code: Code) -> Self {
        Self { code, detail: Truncated::default() }
    }

    /// An error with a detail, which is cut at 120 bytes.
    pub fn with(code: Code, detail: impl Display) -> Self {
        let mut entry = Self::new(code);
        // Writing into a `Truncated` cannot fail.
        _ = write!(entry.detail, "{detail}");
        entry
    }

    /// The detail; may be empty.
    pub fn detail(&self) -> &str {
        &self.detail.0
    }
}

/// As the reply has it: number, comma, text in quotes.
impl Display for ErrorEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},\"{}", self.code.0, self.code.message())?;
        if !self.detail().is_empty() {
            f.write_str("; ")?;
            // A quote inside would end the text.
            self.detail().chars().try_for_each(|character| f.write_char(if character == '"' { '\'' } else { character }))?;
        }
        f.write_char('"')
    }
}

/// A reply that is longer than its buffer.
impl From<fmt::Error> for ErrorEntry {
    fn from(_: fmt::Error) -> Self {
        Self::with(Code::TOO_MUCH_DATA, "the reply does not fit into a line")
    }
}

/// Length of the queue.
pub const QUEUE_LENGTH: usize = 16;

/// The errors that were not read yet, the oldest first.
#[derive(Debug, Default)]
pub struct ErrorQueue {
    entries: Deque<ErrorEntry, QUEUE_LENGTH>,
}

impl ErrorQueue {
    /// Number of errors.
    pub fn count(&self) -> usize {
        self.entries.len()
    }

    /// Adds an error. In a full queue the newest entry becomes [`Code::QUEUE_OVERFLOW`], as SCPI has it.
    pub fn push(&mut self, entry: ErrorEntry) {
        if self.entries.push_back(entry).is_err()
            && let Some(newest) = self.entries.back_mut()
        {
            *newest = ErrorEntry::new(Code::QUEUE_OVERFLOW);
        }
    }

    /// Takes the oldest.
    pub fn pop(&mut self) -> Option<ErrorEntry> {
        self.entries.pop_front()
    }

    /// Removes all.
    pub fn clear(&mut self) {
        self.entries.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_errors_are_kept_in_order_and_an_overflow_is_reported() {
        let mut queue = ErrorQueue::default();
        for n in 0..20_u8 {
            queue.push(ErrorEntry::with(Code::UNDEFINED_HEADER, char::from(b'A' + n)));
        }
        let all: Vec<_> = core::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(all.len(), 16);
        assert!(all[..15].iter().zip('A'..).all(|(entry, letter)| entry.detail() == letter.to_string()));
        assert_eq!(all[15].code, Code::QUEUE_OVERFLOW);
        assert_eq!(queue.count(), 0);
    }

    #[test]
    fn a_reply_has_number_and_text_in_quotes() {
        let entry = ErrorEntry::with(Code::UNDEFINED_HEADER, "SOUR:\"FOO");
        assert_eq!(entry.to_string(), "-113,\"Undefined header; SOUR:'FOO\"");
    }

    #[test]
    fn the_longest_error_fits_into_a_frame() {
        let entry = ErrorEntry::with(Code::CHECKSUM, "x".repeat(200));
        assert!("ERROR ".len() + entry.to_string().len() <= crate::telemetry::frame::MAX_TEXT);
    }
}
