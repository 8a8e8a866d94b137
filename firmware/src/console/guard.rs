//! Emergency stop over the serial line. It acts in the receive interrupt, independently of the tasks, in text mode and in stream mode.
//!
//! Input: every received byte ([`Guard::byte`]) and every break ([`Guard::line_break`]). Output: two requests in a [`StopLine`], for a stop
//! and for text mode. `TickIo::sense` passes the stop request to the tick as `stop`; the app clears it once the fault is latched.
//!
//! Two inputs request a stop: the byte 0x18 (Ctrl-X) anywhere, and the word STOP, in any case, at the start of a command (start of the line
//! or after `;`). STOP must be followed by a line end, `;`, `~`, a space or a tab. The guard does not wait for a check sum after it
//! (`STOP~1A2B3C4D`): an unwanted stop costs a run, a missed stop may destroy the stand.
//!
//! The guard needs a few instructions per byte and one byte of state. It never panics and never waits.

use core::sync::atomic::{AtomicU8, Ordering};

/// Ctrl-X: stop, and return to text mode.
pub const CANCEL: u8 = 0x18;

/// Requests received over the serial line and not yet handled.
#[derive(Debug, Default)]
pub struct StopLine {
    requests: AtomicU8,
}

/// Bit of an emergency stop.
const STOP: u8 = 1;
/// Bit of the return to text mode.
const TEXT: u8 = 2;

impl StopLine {
    /// No request.
    pub const fn new() -> Self {
        Self { requests: AtomicU8::new(0) }
    }

    /// Requests an emergency stop.
    #[inline]
    pub fn request_stop(&self) {
        self.requests.fetch_or(STOP, Ordering::Relaxed);
    }

    /// Whether a stop is requested; `TickIo::sense` reports it.
    #[inline]
    pub fn is_stop_requested(&self) -> bool {
        self.requests.load(Ordering::Relaxed) & STOP != 0
    }

    /// Clears the stop request. For use once the fault is latched.
    pub fn clear_stop(&self) {
        self.requests.fetch_and(!STOP, Ordering::Relaxed);
    }

    /// Whether text mode was requested (0x18, a break) since the last call.
    pub fn take_text(&self) -> bool {
        self.requests.fetch_and(!TEXT, Ordering::Relaxed) & TEXT != 0
    }

    #[inline]
    fn request_text(&self) {
        self.requests.fetch_or(TEXT, Ordering::Relaxed);
    }
}

/// Detects requests for a stop and for text mode in the received bytes.
#[derive(Clone, Debug)]
pub struct Guard<'a> {
    line: &'a StopLine,
    /// Number of letters of STOP received since the start of the command; [`OTHER`] after any other text.
    seen: u8,
}

const WORD: &[u8; 4] = b"STOP";
const OTHER: u8 = u8::MAX;

impl<'a> Guard<'a> {
    /// A guard at the start of a line.
    pub const fn new(line: &'a StopLine) -> Self {
        Self { line, seen: 0 }
    }

    /// Takes the next byte, in either mode.
    #[inline]
    pub fn byte(&mut self, byte: u8) {
        match byte {
            CANCEL => {
                self.line.request_stop();
                self.line.request_text();
                self.seen = 0;
            }
            b'\r' | b'\n' | b';' | b'~' | b' ' | b'\t' => {
                if usize::from(self.seen) == WORD.len() {
                    self.line.request_stop();
                }
                // A line end or `;` starts a command; blanks before the first word do not count.
                let at_start = matches!(byte, b'\r' | b'\n' | b';') || (self.seen == 0 && byte != b'~');
                self.seen = if at_start { 0 } else { OTHER };
            }
            letter => {
                let fits = WORD.get(usize::from(self.seen)).is_some_and(|expected| letter.eq_ignore_ascii_case(expected));
                self.seen = if fits { self.seen.saturating_add(1) } else { OTHER };
            }
        }
    }

    /// Takes a break (the line was held low for longer than a byte): requests text mode and forgets the letters of STOP received so far.
    #[inline]
    pub fn line_break(&mut self) {
        self.line.request_text();
        self.seen = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stops(bytes: &[u8]) -> bool {
        let line = StopLine::new();
        let mut guard = Guard::new(&line);
        bytes.iter().for_each(|byte| guard.byte(*byte));
        line.is_stop_requested()
    }

    #[test]
    fn stop_acts_only_as_a_whole_command_word() {
        for yes in ["STOP\n", "stop\r", "Stop;", "OUTP ON;STOP\n", "*CLS; sToP \n", "STOP~0123abcd\n", "  stop\r\n", "x\nstop\n"] {
            assert!(stops(yes.as_bytes()), "{yes:?}");
        }
        for no in
            ["STOP", "STOPS\n", "PROF:STOP\n", "SOUR:RATE STOP\n", "S TOP\n", "TSTOP\n", "~STOP\n", "STOP?\n", "STO\nP\n", "\"STOP\"\n"]
        {
            assert!(!stops(no.as_bytes()), "{no:?}");
        }
    }

    #[test]
    fn the_cancel_byte_acts_anywhere_and_requests_text_mode() {
        let line = StopLine::new();
        let mut guard = Guard::new(&line);
        b"SOUR:RA".iter().for_each(|byte| guard.byte(*byte));
        assert!(!line.is_stop_requested() && !line.take_text());
        guard.byte(CANCEL);
        assert!(line.is_stop_requested() && line.take_text());
        assert!(!line.take_text(), "the request is taken only once");
        line.clear_stop();
        assert!(!line.is_stop_requested());
    }

    #[test]
    fn a_break_requests_text_mode_without_a_stop() {
        let line = StopLine::new();
        let mut guard = Guard::new(&line);
        b"STOP".iter().for_each(|byte| guard.byte(*byte));
        guard.line_break();
        guard.byte(b'\n');
        assert!(line.take_text() && !line.is_stop_requested());
    }
}
