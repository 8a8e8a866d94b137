//! Received bytes as lines of text, frames of a stream, and counts of losses.
//!
//! In text mode a line ends with a line feed. A zero byte starts a stream; the bytes between zeros are then frames, decoded by the
//! firmware's [`Deframer`]. Printable text that ends with a line feed returns to text mode: it cannot be a frame, whose second byte is a
//! type below 32. A line feed directly after a zero is no text, which ends with CR LF, but the first byte of a frame: the distance to its
//! next zero, as in the frame of a reply of one character.

use std::collections::VecDeque;

use super::error::LinkError;
use stand_firmware::telemetry::frame::Piece;
use stand_firmware::telemetry::{Beat, Body, Deframer, Frame, Hello, RowFrame};

/// Maximum length of a received line, bytes.
const MAX_LINE: usize = 4096;

/// Header of a stream.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamHeader {
    /// Reply to `*IDN?`.
    pub identity: String,
    /// Encoder counts per turn.
    pub counts_per_turn: f64,
    /// Row rate before decimation, Hz.
    pub row_hz: u16,
    /// Rows of the firmware in one row of the stream.
    pub decimation: u16,
    /// Channels of each row, as a bit mask.
    pub channels: u32,
    /// Angles count from the index.
    pub zero_is_index: bool,
}

/// A received item.
#[derive(Debug, Clone, PartialEq)]
pub enum Received {
    /// A line of text, in either mode, without its end.
    Line(String),
    /// A stream begins, or its channels have changed.
    StreamHeader(StreamHeader),
    /// A row of the stream.
    Row(RowFrame),
    /// A heartbeat.
    Beat(Beat),
}

/// A stream of another version of the protocol than this program's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OtherProtocol {
    /// The stand's version.
    pub stand: u8,
}

impl OtherProtocol {
    /// The error of a link by this port.
    pub fn at(self, port: String) -> LinkError {
        LinkError::OtherProtocol { port, stand: self.stand }
    }
}

/// Losses on the line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LineLosses {
    /// Frames missing by their sequence numbers.
    pub frames: u64,
    /// Damaged frames and lines.
    pub damaged: u64,
    /// Rows missing by their sequence numbers.
    pub rows: u64,
}

impl LineLosses {
    /// Nothing was lost.
    pub fn is_none(&self) -> bool {
        *self == LineLosses::default()
    }
}

/// Decoder of received bytes.
#[derive(Debug, Default)]
pub struct Receiver {
    deframer: Deframer,
    line: Vec<u8>,
    /// The current piece has a byte that is not text.
    has_non_text: bool,
    streaming: bool,
    /// Sequence number of the last frame; `None` at the start of a stream.
    seq: Option<u16>,
    row: Option<u32>,
    decimation: u32,
    bytes: u64,
    lines_damaged: u64,
    frames_lost: u64,
    rows_lost: u64,
    damaged_before: u64,
    other_protocol: Option<OtherProtocol>,
}

impl Receiver {
    /// Number of bytes so far.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Frames come.
    pub fn is_streaming(&self) -> bool {
        self.streaming
    }

    /// Losses since the start, or since [`Receiver::reset_losses`].
    pub fn losses(&self) -> LineLosses {
        let damaged = self.deframer.damaged() + self.lines_damaged - self.damaged_before;
        LineLosses { frames: self.frames_lost, damaged, rows: self.rows_lost }
    }

    /// Sets the losses to zero.
    pub fn reset_losses(&mut self) {
        self.damaged_before = self.deframer.damaged() + self.lines_damaged;
        (self.frames_lost, self.rows_lost) = (0, 0);
    }

    /// Decodes bytes and appends the received items.
    ///
    /// # Errors
    /// A stream of another version of the protocol has begun. All bytes are taken; the lines among them are received.
    pub fn take(&mut self, bytes: &[u8], received: &mut VecDeque<Received>) -> Result<(), OtherProtocol> {
        self.bytes += bytes.len() as u64;
        for &byte in bytes {
            match byte {
                0 => self.zero(received),
                b'\n' if !self.streaming || !(self.has_non_text || self.line.is_empty()) => self.end_of_line(received),
                _ => {
                    self.has_non_text |= !matches!(byte, b'\t' | b'\r' | b' '..=b'~');
                    if self.line.len() < MAX_LINE {
                        self.line.push(byte);
                    }
                    self.deframer.push(byte);
                }
            }
        }
        self.other_protocol.take().map_or(Ok(()), Err)
    }

    /// Drops an incomplete line or frame and returns to text mode. A space that the line changes to a zero byte, followed by a character
    /// that it changes to a non-text byte, looks like a frame and would hide all replies until the next zero byte.
    pub fn restart(&mut self) {
        self.deframer.restart();
        self.line.clear();
        (self.streaming, self.has_non_text) = (false, false);
        (self.seq, self.row) = (None, None);
    }

    fn end_of_line(&mut self, received: &mut VecDeque<Received>) {
        self.deframer.restart();
        self.streaming = false;
        // The numbers of the next stream are unrelated.
        (self.seq, self.row) = (None, None);
        let text = String::from_utf8_lossy(&self.line).trim().to_owned();
        if self.has_non_text {
            self.lines_damaged += 1;
        } else {
            received.push_back(Received::Line(text));
        }
        self.line.clear();
        self.has_non_text = false;
    }

    fn zero(&mut self, received: &mut VecDeque<Received>) {
        if !self.streaming {
            // Text cut short by a stream is not a damaged frame.
            self.streaming = true;
            self.deframer.restart();
        }
        self.line.clear();
        self.has_non_text = false;
        let Frame { seq, body } = match self.deframer.push(0) {
            Some(Piece::Frame(frame)) => frame,
            Some(Piece::OtherProtocol(stand)) => {
                self.other_protocol = Some(OtherProtocol { stand });
                return;
            }
            Some(Piece::Damaged) | None => return,
        };
        if let Some(last) = self.seq.replace(seq) {
            self.frames_lost += u64::from(seq.wrapping_sub(last.wrapping_add(1)));
        }
        received.push_back(match body {
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
    use proptest::prelude::*;
    use stand_firmware::telemetry::encode;
    use stand_firmware::telemetry::frame::MAX_FRAME;
    use stand_firmware::telemetry::message::PROTOCOL;

    fn frame(body: &Body<'_>, seq: u16) -> Vec<u8> {
        encode(body, seq, &mut [0; MAX_FRAME]).unwrap().to_vec()
    }

    #[test]
    fn restart_ends_a_false_frame_of_damaged_text() {
        let mut receiver = Receiver::default();
        // A zero for a space, then a character with its highest bit set: taken for a frame, whose line feed is data.
        assert!(heard(&mut receiver, b"Rotary\0St\xe1nd\r\n0\r\n").is_empty());
        assert!(heard(&mut receiver, b"1\r\n").is_empty());
        receiver.restart();
        assert_eq!(heard(&mut receiver, b"2\r\n"), [Received::Line("2".to_owned())]);
    }

    fn heard(receiver: &mut Receiver, bytes: &[u8]) -> Vec<Received> {
        let mut all = VecDeque::new();
        // Byte by byte, the hardest case.
        for byte in bytes {
            receiver.take(&[*byte], &mut all).unwrap();
        }
        all.into()
    }

    fn row(sequence: u32) -> RowFrame {
        let channels = stand_firmware::telemetry::Channels::named("u_V").unwrap();
        RowFrame::new(&stand_firmware::measurement_loop::Row { sequence, u_V: 1.5, ..Default::default() }, channels)
    }

    #[test]
    fn text_stream_and_text_are_received_without_loss() {
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

    /// What a stand sends.
    #[derive(Debug, Clone)]
    enum Sent {
        Row,
        Beat,
        Reply(String),
        /// The stream is switched off, a reply is sent as text, and the stream is switched on again.
        TextReply(String),
    }

    fn sent() -> impl Strategy<Value = Sent> {
        let reply = || prop_oneof!["[ -~]{1,3}", "[ -~]{0,200}"];
        prop_oneof![3 => Just(Sent::Row), 1 => Just(Sent::Beat), 3 => reply().prop_map(Sent::Reply), 1 => reply().prop_map(Sent::TextReply)]
    }

    /// The bytes of each item, and what is to be received. Frame numbers begin anywhere, so that any byte can be zero or a line feed.
    fn line_of(items: &[Sent], first: u16) -> (Vec<Vec<u8>>, Vec<String>) {
        let (mut bytes, mut expected) = (Vec::new(), Vec::new());
        for (k, item) in items.iter().enumerate() {
            let seq = first.wrapping_add(k as u16);
            let (sent, received) = match item {
                Sent::Row => (frame(&Body::Row(row(k as u32)), seq), format!("row {k}")),
                Sent::Beat => (frame(&Body::Beat(Beat::default()), seq), "beat".to_owned()),
                Sent::Reply(reply) => (frame(&Body::Text(reply), seq), format!("line {}", reply.trim_end())),
                Sent::TextReply(reply) => (format!("{reply}\r\n").into_bytes(), format!("line {}", reply.trim())),
            };
            bytes.push(sent);
            expected.push(received);
        }
        (bytes, expected)
    }

    /// What was received, without the values of the rows, which are not numbers for most channels.
    fn received(bytes: &[u8]) -> Vec<String> {
        let text = |received| match received {
            Received::Line(line) => format!("line {line}"),
            Received::StreamHeader(_) => "header".to_owned(),
            Received::Row(row) => format!("row {}", row.sequence),
            Received::Beat(_) => "beat".to_owned(),
        };
        heard(&mut Receiver::default(), bytes).into_iter().map(text).collect()
    }

    proptest! {
        #[test]
        fn every_reply_and_row_of_a_healthy_line_is_received_once(items in prop::collection::vec(sent(), 1..40), first: u16) {
            let (bytes, expected) = line_of(&items, first);
            prop_assert_eq!(received(&bytes.concat()), expected);
        }

        /// A client that joins in the middle of the stream may take what is left of one item for a line; from the next zero on it receives
        /// all.
        #[test]
        fn client_that_joins_midway_receives_all_later_items(items in prop::collection::vec(sent(), 1..20), first: u16, from: prop::sample::Index) {
            let items: Vec<Sent> = items.into_iter().filter(|item| !matches!(item, Sent::TextReply(_))).chain([Sent::Row, Sent::Row]).collect();
            let (bytes, expected) = line_of(&items, first);
            let from = from.index(bytes.concat().len());
            let mut end = 0;
            let whole = bytes.iter().position(|item| { end += item.len(); end > from }).unwrap_or(0);
            let all = received(&bytes.concat()[from..]);
            let later = &expected[whole + 1..];
            prop_assert!(all.ends_with(later), "from byte {from}: {all:?}");
        }

        /// A damaged byte costs at most its own item and the next one, and invents no row.
        #[test]
        fn damaged_byte_costs_two_items_at_most(items in prop::collection::vec(sent(), 3..20), first: u16, at: prop::sample::Index, damage in 1..=255_u8) {
            let items: Vec<Sent> = items.into_iter().filter(|item| !matches!(item, Sent::TextReply(_))).chain([Sent::Row, Sent::Row]).collect();
            let (bytes, expected) = line_of(&items, first);
            let mut line = bytes.concat();
            let at = at.index(line.len());
            line[at] ^= damage;
            let mut end = 0;
            let hit = bytes.iter().position(|item| { end += item.len(); end > at }).unwrap_or(0);
            let all = received(&line);
            prop_assert!(all.starts_with(&expected[..hit]), "{all:?}");
            prop_assert!(all.ends_with(&expected[(hit + 2).min(expected.len())..]), "byte {at}: {all:?}");
            prop_assert!(all.iter().all(|item| !item.starts_with("row") || expected.contains(item)), "{all:?}");
        }
    }

    #[test]
    fn stream_of_another_protocol_is_refused_once_and_lines_still_arrive() {
        let identity = "Rotary Stand,other,1,9.0.0";
        let hello = |protocol| {
            let hello = Hello { protocol, identity, counts_per_turn: 4e4, row_Hz: 1000, decimation: 1, channels: 1, zero_is_index: false };
            frame(&Body::Hello(hello), 0)
        };
        let (mut receiver, mut all) = (Receiver::default(), VecDeque::new());
        receiver.take(&hello(PROTOCOL), &mut all).unwrap();
        assert!(matches!(all.pop_front(), Some(Received::StreamHeader(header)) if header.identity == identity));
        let mut bytes = hello(PROTOCOL + 1);
        bytes.extend(frame(&Body::Text("1"), 1));
        assert_eq!(receiver.take(&bytes, &mut all), Err(OtherProtocol { stand: PROTOCOL + 1 }));
        assert_eq!(receiver.take(b"2\r\n", &mut all), Ok(()));
        assert_eq!(all, ["1", "2"].map(|line| Received::Line(line.to_owned())));
        assert!(receiver.losses().is_none(), "{:?}", receiver.losses());
    }

    #[test]
    fn missing_frames_and_rows_are_counted() {
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
