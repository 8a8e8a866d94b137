//! The stop that needs nobody: it acts in the receive interrupt, in text and in stream mode, whatever the tasks do.
//!
//! In: every byte of the line, as it comes ([`Guard::byte`]), and its breaks. Out: flags in a [`StopLine`], which `TickIo::sense` hands to the
//! tick as `stop` and which the app clears once the drive's fault is latched. Two things stop: the byte 0x18 (Ctrl-X) anywhere, and the
//! word STOP, in any case, where a command begins (the start of a line, after `;`) and as a whole word (the line's end, `;`, `~` or a
//! blank follows). A check behind it (`STOP~1A2B3C4D`) is not waited for: a stop too many costs a run, one too few costs a stand.
//!
//! Promises: a few instructions per byte, no panic, no wait, no memory but one byte.

use core::sync::atomic::{AtomicU8, Ordering};

/// Ctrl-X: stop, and back to text mode.
pub const CANCEL: u8 = 0x18;

/// What the line has asked for and the app has not yet seen to.
#[derive(Debug, Default)]
pub struct StopLine {
    asked: AtomicU8,
}

const STOP: u8 = 1;
const TEXT: u8 = 2;

impl StopLine {
    /// Nothing asked.
    pub const fn new() -> Self {
        Self { asked: AtomicU8::new(0) }
    }

    /// Asks for an emergency stop.
    #[inline]
    pub fn ask_stop(&self) {
        self.asked.fetch_or(STOP, Ordering::Relaxed);
    }

    /// Whether a stop is asked for: what `TickIo::sense` reports.
    #[inline]
    pub fn is_stop_asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed) & STOP != 0
    }

    /// The stop was seen to: the fault is latched.
    pub fn clear_stop(&self) {
        self.asked.fetch_and(!STOP, Ordering::Relaxed);
    }

    /// Whether text mode was asked for (0x18, a break) since the last call.
    pub fn take_text(&self) -> bool {
        self.asked.fetch_and(!TEXT, Ordering::Relaxed) & TEXT != 0
    }

    #[inline]
    fn ask_text(&self) {
        self.asked.fetch_or(TEXT, Ordering::Relaxed);
    }
}

/// Watches the bytes for a stop.
#[derive(Clone, Debug)]
pub struct Guard<'a> {
    line: &'a StopLine,
    /// Letters of STOP seen since a command began; [`OTHER`] within another word.
    seen: u8,
}

const WORD: &[u8; 4] = b"STOP";
const OTHER: u8 = u8::MAX;

impl<'a> Guard<'a> {
    /// A guard at the start of a line.
    pub const fn new(line: &'a StopLine) -> Self {
        Self { line, seen: 0 }
    }

    /// The next byte of the line, in either mode.
    #[inline]
    pub fn byte(&mut self, byte: u8) {
        match byte {
            CANCEL => {
                self.line.ask_stop();
                self.line.ask_text();
                self.seen = 0;
            }
            b'\r' | b'\n' | b';' | b'~' | b' ' | b'\t' => {
                if usize::from(self.seen) == WORD.len() {
                    self.line.ask_stop();
                }
                let begins = matches!(byte, b'\r' | b'\n' | b';') || (self.seen == 0 && byte != b'~');
                self.seen = if begins { 0 } else { OTHER };
            }
            letter => {
                let fits = WORD.get(usize::from(self.seen)).is_some_and(|expected| letter.eq_ignore_ascii_case(expected));
                self.seen = if fits { self.seen.saturating_add(1) } else { OTHER };
            }
        }
    }

    /// The line was held low for longer than a byte: back to text mode; a line that was begun is no more.
    #[inline]
    pub fn line_break(&mut self) {
        self.line.ask_text();
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
        line.is_stop_asked()
    }

    #[test]
    fn stop_acts_as_a_whole_command_word_only() {
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
    fn the_cancel_byte_acts_anywhere_and_asks_for_text() {
        let line = StopLine::new();
        let mut guard = Guard::new(&line);
        b"SOUR:RA".iter().for_each(|byte| guard.byte(*byte));
        assert!(!line.is_stop_asked() && !line.take_text());
        guard.byte(CANCEL);
        assert!(line.is_stop_asked() && line.take_text());
        assert!(!line.take_text(), "taken once");
        line.clear_stop();
        assert!(!line.is_stop_asked());
    }

    #[test]
    fn a_break_asks_for_text_and_stops_nothing() {
        let line = StopLine::new();
        let mut guard = Guard::new(&line);
        b"STOP".iter().for_each(|byte| guard.byte(*byte));
        guard.line_break();
        guard.byte(b'\n');
        assert!(line.take_text() && !line.is_stop_asked());
    }
}
