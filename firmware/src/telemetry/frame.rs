//! Frames: `00 COBS(type u8, seq u16, postcard body, CRC-32) 00`, as interfaces.md rules.
//!
//! In: a [`Body`] and a number. Out: bytes for the line ([`encode`]); and back, byte by byte, in a [`Deframer`]. A piece between two zeros is
//! a frame if COBS, length, CRC and body hold to the last byte; else it is counted as damaged and never shown. `seq` counts the frames
//! that were made, so that one that found no room leaves a gap. Numbers are little-endian, as postcard's are; the CRC is over type, seq and body.

use super::body;
use super::channel::{CHANNELS, Channels, Coding};
use super::crc32;
use super::stuffing::{stuff, unstuff};
use crate::measurement_loop::Row;
use core::fmt;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// Version of this protocol, in the [`Hello`].
pub const PROTOCOL: u8 = 1;
/// Most bytes of a body.
pub const MOST_BODY: usize = 240;
/// Most bytes of text in a frame.
pub const MOST_TEXT: usize = MOST_BODY - 2;
/// Type and number before a body.
const HEAD: usize = 3;
/// The CRC behind it.
const TAIL: usize = 4;
/// Most bytes of a piece, between the zeros.
pub const MOST_PIECE: usize = HEAD + MOST_BODY + TAIL + 1;
/// Most bytes of a frame, zeros included.
pub const MOST_FRAME: usize = MOST_PIECE + 2;

/// What a stream begins with: what a receiver must know to make a log of it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Hello<'a> {
    /// [`PROTOCOL`].
    pub protocol: u8,
    /// The answer to `*IDN?`: maker, model, serial number, firmware.
    pub identity: &'a str,
    /// Encoder counts in a turn.
    pub counts_per_turn: f64,
    /// Rows in a second, before decimation.
    pub row_Hz: u16,
    /// Rows of the loop in one row of the line.
    pub decimation: u16,
    /// The channels of each row.
    pub channels: u32,
    /// Whether angles are from the index.
    pub zero_is_index: bool,
}

/// Once a second, whatever else is sent: the stand is alive, and what was lost on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub struct Beat {
    /// Board clock, 0.1 µs since power-on.
    pub at: u64,
    /// Frames that found no room since the stream was turned on.
    pub lost: u32,
    /// The latched fault's number, 0 for none.
    pub fault: u8,
}

/// One row of chosen channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowFrame {
    /// The measurement loop's number of the row.
    pub sequence: u32,
    /// t_k, 0.1 µs since power-on.
    pub at: u64,
    /// Which channels are there.
    pub channels: Channels,
    /// Values by the channel's place; NaN where it is not chosen or has none.
    pub values: [f64; CHANNELS.len()],
}

impl RowFrame {
    /// The chosen channels of a row.
    pub fn new(row: &Row, channels: Channels) -> Self {
        let mut values = [f64::NAN; CHANNELS.len()];
        for (bit, (value, channel)) in values.iter_mut().zip(&CHANNELS).enumerate() {
            if channels.0 >> bit & 1 == 1 {
                *value = (channel.read)(row);
            }
        }
        Self { sequence: row.sequence, at: row.at.0, channels, values }
    }

    /// Names and values of the channels that are there.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let chosen = self.channels.0;
        let all = CHANNELS.iter().zip(self.values).enumerate();
        all.filter(move |(bit, _)| chosen >> bit & 1 == 1).map(|(_, (channel, value))| (channel.name, value))
    }
}

/// What a frame says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Body<'a> {
    /// The stream begins, or its channels have changed.
    Hello(Hello<'a>),
    /// A row.
    Row(RowFrame),
    /// A line of text: a reply, an error, a progress.
    Text(&'a str),
    /// A sign of life.
    Beat(Beat),
}

/// A frame as it was received.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<'a> {
    /// Its number; a gap is a loss.
    pub seq: u16,
    /// What it says.
    pub body: Body<'a>,
}

const HELLO: u8 = 1;
const ROW: u8 = 2;
const TEXT: u8 = 3;
const BEAT: u8 = 4;

/// Makes a frame in `out`; the bytes to send. `None` if the body is longer than [`MOST_BODY`].
pub fn encode<'o>(body: &Body<'_>, seq: u16, out: &'o mut [u8; MOST_FRAME]) -> Option<&'o [u8]> {
    let mut raw = [0_u8; HEAD + MOST_BODY + TAIL];
    let (head, rest) = raw.split_first_chunk_mut::<HEAD>()?;
    let space = rest.get_mut(..MOST_BODY)?;
    let kind = match body {
        Body::Hello(_) => HELLO,
        Body::Row(_) => ROW,
        Body::Text(_) => TEXT,
        Body::Beat(_) => BEAT,
    };
    let length = HEAD + body::write(body, space)?;
    let [low, high] = seq.to_le_bytes();
    *head = [kind, low, high];
    let crc = crc32(raw.get(..length)?).to_le_bytes();
    raw.get_mut(length..length + TAIL)?.copy_from_slice(&crc);
    let sent = stuff(raw.get(..length + TAIL)?, out.get_mut(1..=MOST_PIECE)?)?;
    // The zeros of the two ends; what the last frame left is in between.
    *out.first_mut()? = 0;
    *out.get_mut(sent + 1)? = 0;
    out.get(..sent + 2)
}

/// What a piece between two zeros was.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "a piece is looked at once and kept nowhere")]
pub enum Piece<'a> {
    /// A whole frame.
    Frame(Frame<'a>),
    /// Not a frame: its COBS, length, CRC or body does not hold.
    Damaged,
}

/// Cuts a stream of bytes at its zeros.
#[derive(Clone, Debug)]
pub struct Deframer {
    piece: [u8; MOST_PIECE],
    length: usize,
    damaged: u64,
}

impl Default for Deframer {
    fn default() -> Self {
        Self { piece: [0; MOST_PIECE], length: 0, damaged: 0 }
    }
}

impl Deframer {
    /// Pieces that were no frames so far.
    pub fn damaged(&self) -> u64 {
        self.damaged
    }

    /// Forgets a piece that was begun, uncounted: for a receiver that knows it came in the middle.
    pub fn restart(&mut self) {
        self.length = 0;
    }

    /// Takes the next byte; at a zero, what the piece before it was. Nothing between two zeros is nothing.
    pub fn push(&mut self, byte: u8) -> Option<Piece<'_>> {
        if byte != 0 {
            if let Some(place) = self.piece.get_mut(self.length) {
                *place = byte;
            }
            // One past the end says that it was too long.
            self.length = (self.length + 1).min(MOST_PIECE + 1);
            return None;
        }
        let length = core::mem::take(&mut self.length);
        if length == 0 {
            return None;
        }
        let frame = self.piece.get_mut(..length).and_then(decode);
        if frame.is_none() {
            self.damaged += 1;
        }
        Some(frame.map_or(Piece::Damaged, Piece::Frame))
    }
}

/// The frame of a piece, decoded in its place.
fn decode(piece: &mut [u8]) -> Option<Frame<'_>> {
    let length = unstuff(piece)?;
    // `split_last_chunk` would do, but for a panic within it as far as the compiler can see.
    let (kept, crc) = piece.get(..length)?.split_at_checked(length.checked_sub(TAIL)?)?;
    if crc32(kept) != u32::from_le_bytes(crc.try_into().ok()?) {
        return None;
    }
    let ([kind, low, high], body) = kept.split_first_chunk::<HEAD>()?;
    let body = match *kind {
        HELLO => Body::Hello(whole(body)?),
        ROW => Body::Row(whole(body)?),
        TEXT => Body::Text(whole(body)?),
        BEAT => Body::Beat(whole(body)?),
        _ => return None,
    };
    Some(Frame { seq: u16::from_le_bytes([*low, *high]), body })
}

/// A value that takes all bytes.
fn whole<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Option<T> {
    postcard::take_from_bytes(bytes).ok().and_then(|(value, rest)| rest.is_empty().then_some(value))
}

impl<'de> Deserialize<'de> for RowFrame {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_tuple(3 + CHANNELS.len(), Parts)
    }
}

struct Parts;

impl<'de> Visitor<'de> for Parts {
    type Value = RowFrame;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("number, time, channels and their values")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut parts: A) -> Result<RowFrame, A::Error> {
        let short = || A::Error::custom("a row that ends early");
        let sequence = parts.next_element()?.ok_or_else(short)?;
        let at = parts.next_element()?.ok_or_else(short)?;
        let channels = Channels(parts.next_element()?.ok_or_else(short)?);
        if channels.0 & !Channels::ALL.0 != 0 {
            return Err(A::Error::custom("a channel that is not known here"));
        }
        let mut values = [f64::NAN; CHANNELS.len()];
        for (bit, (channel, value)) in CHANNELS.iter().zip(&mut values).enumerate() {
            if channels.0 >> bit & 1 == 0 {
                continue;
            }
            *value = match channel.coding {
                Coding::Single => f64::from(parts.next_element::<f32>()?.ok_or_else(short)?),
                Coding::Nano => match parts.next_element::<i64>()?.ok_or_else(short)? {
                    i64::MIN => f64::NAN,
                    nano => nano as f64 / 1e9,
                },
                Coding::Whole => f64::from(parts.next_element::<u32>()?.ok_or_else(short)?),
            };
        }
        Ok(RowFrame { sequence, at, channels, values })
    }
}
