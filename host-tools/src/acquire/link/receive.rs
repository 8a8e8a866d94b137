//! From bytes to what was said: lines of text, frames of a stream, and what was lost.
//!
//! In text mode a line ends with a line feed. A zero byte begins a stream; from then on pieces between zeros are frames, found by the
//! firmware's own [`Deframer`]. A piece of printable text that ends with a line feed is the text mode again: no frame is so, since its
//! second byte is a type below 32.

use std::collections::VecDeque;

use stand_firmware::telemetry::frame::Piece;
use stand_firmware::telemetry::{Beat, Body, Deframer, Frame, Hello, RowFrame};

/// Most bytes of a line that are kept.
const MOST_LINE: usize = 4096;

/// What a stream begins with, to keep.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamHeader {
    /// The answer to `*IDN?`.
    pub identity: String,
    /// Encoder counts in a turn.
    pub counts_per_turn: f64,
    /// Rows in a second, before decimation.
    pub row_hz: u16,
    /// Rows of the stand's loop in one row of the line.
    pub decimation: u16,
    /// The channels of each row.
    pub channels: u32,
    /// Whether angles are from the index.
    pub zero_is_index: bool,
}

/// What was heard.
#[derive(Debug, Clone, PartialEq)]
pub enum Received {
    /// A line of text, in either mode, without its end.
    Line(String),
    /// A stream begins, or its channels have changed.
    StreamHeader(StreamHeader),
    /// A row.
    Row(RowFrame),
    /// A sign of life.
    Beat(Beat),
}

/// What was lost on the line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LineLosses {
    /// Frames whose number is missing.
    pub frames: u64,
    /// Pieces that were no frame, and lines that were no text.
    pub damaged: u64,
    /// Rows whose number is missing.
    pub rows: u64,
}

impl LineLosses {
    /// Whether nothing was lost.
    pub fn is_none(&self) -> bool {
        *self == LineLosses::default()
    }
}

/// Takes bytes, gives what was heard.
#[derive(Debug, Default)]
pub struct Receiver {
    deframer: Deframer,
    line: Vec<u8>,
    /// The piece since the last end has a byte that no text has.
    foreign: bool,
    streaming: bool,
    /// The first piece of a stream may be the rest of one.
    seq: Option<u16>,
    row: Option<u32>,
    decimation: u32,
    bytes: u64,
    lines_damaged: u64,
    frames_lost: u64,
    rows_lost: u64,
    damaged_before: u64,
}

impl Receiver {
    /// Bytes so far.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// What was lost since the beginning, or since [`Receiver::forget`].
    pub fn losses(&self) -> LineLosses {
        let damaged = self.deframer.damaged() + self.lines_damaged - self.damaged_before;
        LineLosses { frames: self.frames_lost, damaged, rows: self.rows_lost }
    }

    /// What was lost so far is nobody's: the line was opened in the middle of something.
    pub fn forget(&mut self) {
        self.damaged_before = self.deframer.damaged() + self.lines_damaged;
        (self.frames_lost, self.rows_lost) = (0, 0);
    }

    /// Takes bytes as they came.
    pub fn take(&mut self, bytes: &[u8], heard: &mut VecDeque<Received>) {
        self.bytes += bytes.len() as u64;
        for &byte in bytes {
            match byte {
                0 => self.zero(heard),
                b'\n' if !self.streaming || !self.foreign => self.end_of_line(heard),
                _ => {
                    self.foreign |= !matches!(byte, b'\t' | b'\r' | b' '..=b'~');
                    if self.line.len() < MOST_LINE {
                        self.line.push(byte);
                    }
                    self.deframer.push(byte);
                }
            }
        }
    }

    fn end_of_line(&mut self, heard: &mut VecDeque<Received>) {
        self.deframer.restart();
        self.streaming = false;
        // The next stream may go on anywhere.
        (self.seq, self.row) = (None, None);
        let text = String::from_utf8_lossy(&self.line).trim().to_owned();
        if self.foreign {
            self.lines_damaged += 1;
        } else {
            heard.push_back(Received::Line(text));
        }
        self.line.clear();
        self.foreign = false;
    }

    fn zero(&mut self, heard: &mut VecDeque<Received>) {
        if !self.streaming {
            // Text that was cut short by a stream is no damaged frame.
            self.streaming = true;
            self.deframer.restart();
        }
        self.line.clear();
        self.foreign = false;
        let Some(Piece::Frame(Frame { seq, body })) = self.deframer.push(0) else { return };
        if let Some(last) = self.seq.replace(seq) {
            self.frames_lost += u64::from(seq.wrapping_sub(last.wrapping_add(1)));
        }
        heard.push_back(match body {
            Body::Text(text) => Received::Line(text.trim_end().to_owned()),
            Body::Beat(beat) => Received::Beat(beat),
            Body::Hello(Hello { identity, counts_per_turn, row_Hz, decimation, channels, zero_is_index, .. }) => {
                self.decimation = u32::from(decimation.max(1));
                self.row = None;
                Received::StreamHeader(StreamHeader {
                    identity: identity.to_owned(),
                    counts_per_turn,
                    row_hz: row_Hz,
                    decimation,
                    channels,
                    zero_is_index,
                })
            }
            Body::Row(row) => {
                if let Some(last) = self.row.replace(row.sequence) {
                    let steps = row.sequence.wrapping_sub(last) / self.decimation.max(1);
                    self.rows_lost += u64::from(steps.saturating_sub(1));
                }
                Received::Row(row)
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stand_firmware::telemetry::encode;
    use stand_firmware::telemetry::frame::MAX_FRAME;

    fn frame(body: &Body<'_>, seq: u16) -> Vec<u8> {
        encode(body, seq, &mut [0; MAX_FRAME]).unwrap().to_vec()
    }

    fn heard(receiver: &mut Receiver, bytes: &[u8]) -> Vec<Received> {
        let mut all = VecDeque::new();
        // Byte by byte and at once must be the same.
        for byte in bytes {
            receiver.take(&[*byte], &mut all);
        }
        all.into()
    }

    fn row(sequence: u32) -> RowFrame {
        let channels = stand_firmware::telemetry::Channels::named("u_V").unwrap();
        RowFrame::new(&stand_firmware::measurement_loop::Row { sequence, u_V: 1.5, ..Default::default() }, channels)
    }

    #[test]
    fn text_then_a_stream_then_text_again_without_a_loss() {
        let mut bytes = b"rotary\r\n1\r\n".to_vec();
        for k in 0..300_u16 {
            bytes.extend(frame(&Body::Row(row(u32::from(k))), k));
        }
        bytes.extend(frame(&Body::Text("ok"), 300));
        bytes.extend(b"text again\r\n");
        bytes.extend(frame(&Body::Beat(Beat::default()), 7));
        let mut receiver = Receiver::default();
        let all = heard(&mut receiver, &bytes);
        let lines: Vec<&Received> = all.iter().filter(|h| matches!(h, Received::Line(_))).collect();
        let line = |text: &str| Received::Line(text.to_owned());
        assert_eq!(lines, [&line("rotary"), &line("1"), &line("ok"), &line("text again")]);
        assert_eq!(all.iter().filter(|h| matches!(h, Received::Row(_))).count(), 300);
        assert_eq!(all.last(), Some(&Received::Beat(Beat::default())));
        assert!(receiver.losses().is_none(), "{:?}", receiver.losses());
    }

    #[test]
    fn what_is_missing_is_counted_by_its_number() {
        let mut receiver = Receiver::default();
        let mut bytes = Vec::new();
        for k in (0..10).chain(13..20) {
            bytes.extend(frame(&Body::Row(row(k)), k as u16));
        }
        let mut broken = frame(&Body::Row(row(20)), 20);
        broken[4] ^= 1;
        bytes.extend(broken);
        bytes.extend(frame(&Body::Row(row(21)), 21));
        let all = heard(&mut receiver, &bytes);
        assert_eq!(all.len(), 18);
        assert_eq!(receiver.losses(), LineLosses { frames: 4, damaged: 1, rows: 4 });
    }
}
