//! Frames: `00 COBS(type u8, sequence u16, message, CRC-32) 00`.
//!
//! [`encode`] makes a frame of a [`Body`] and a sequence number; [`Deframer`] finds frames in received bytes. Bytes between two zeros are a
//! frame if COBS, length, CRC and message are correct; else they count as damaged and are dropped. The sequence number counts frames, those
//! without room included, so that a loss leaves a gap. Numbers are little-endian; the CRC covers type, sequence number and message.

use super::codec;
use super::crc32;
use super::message::{Body, PROTOCOL};
use super::stuffing::{stuff, unstuff};
use heapless::Vec;
use serde::Deserialize;

/// Longest message, bytes.
pub const MAX_BODY: usize = 240;
/// Longest text in a frame, bytes.
pub const MAX_TEXT: usize = MAX_BODY - 2;
/// Type and sequence number before a message, bytes.
const HEAD: usize = 3;
/// CRC behind a message, bytes.
const TAIL: usize = 4;
/// Longest piece between zeros, bytes.
pub const MAX_PIECE: usize = HEAD + MAX_BODY + TAIL + 1;
/// Longest frame with its zeros, bytes.
pub const MAX_FRAME: usize = MAX_PIECE + 2;

/// A received frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<'a> {
    /// Sequence number; a gap is a loss.
    pub seq: u16,
    /// Its message.
    pub body: Body<'a>,
}

const HELLO: u8 = 1;
const ROW: u8 = 2;
const TEXT: u8 = 3;
const BEAT: u8 = 4;

/// Makes a frame in `out`; returns the bytes to send. `None` if the message is longer than [`MAX_BODY`].
pub fn encode<'o>(body: &Body<'_>, seq: u16, out: &'o mut [u8; MAX_FRAME]) -> Option<&'o [u8]> {
    let mut raw = [0_u8; HEAD + MAX_BODY + TAIL];
    let (head, rest) = raw.split_first_chunk_mut::<HEAD>()?;
    let space = rest.get_mut(..MAX_BODY)?;
    let kind = match body {
        Body::Hello(_) => HELLO,
        Body::Row(_) => ROW,
        Body::Text(_) => TEXT,
        Body::Beat(_) => BEAT,
    };
    let length = HEAD + codec::write(body, space)?;
    let [low, high] = seq.to_le_bytes();
    *head = [kind, low, high];
    let crc = crc32(raw.get(..length)?).to_le_bytes();
    raw.get_mut(length..length + TAIL)?.copy_from_slice(&crc);
    let sent = stuff(raw.get(..length + TAIL)?, out.get_mut(1..=MAX_PIECE)?)?;
    // The zeros at both ends; `out` may hold an older frame.
    *out.first_mut()? = 0;
    *out.get_mut(sent + 1)? = 0;
    out.get(..sent + 2)
}

/// A piece between two zeros.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "a piece is used once and not stored")]
pub enum Piece<'a> {
    /// A frame.
    Frame(Frame<'a>),
    /// The start of a stream of this version of the protocol, not [`PROTOCOL`]: the rest of it and the frames behind it may have another
    /// layout.
    OtherProtocol(u8),
    /// COBS, length, CRC or message is wrong.
    Damaged,
}

/// Finds frames in received bytes.
#[derive(Clone, Debug, Default)]
pub struct Deframer {
    piece: Vec<u8, MAX_PIECE>,
    is_too_long: bool,
    /// The piece was returned; the next byte starts a new one.
    is_complete: bool,
    damaged: u64,
}

impl Deframer {
    /// Number of damaged pieces.
    pub fn damaged(&self) -> u64 {
        self.damaged
    }

    /// Discards an incomplete piece without counting it: for a receiver that starts in the middle of a stream.
    pub fn restart(&mut self) {
        self.piece.clear();
        self.is_too_long = false;
    }

    /// Takes the next byte; at a zero, returns the piece before it. Empty pieces are ignored.
    pub fn push(&mut self, byte: u8) -> Option<Piece<'_>> {
        if core::mem::take(&mut self.is_complete) {
            self.restart();
        }
        if byte != 0 {
            self.is_too_long |= self.piece.push(byte).is_err();
            return None;
        }
        self.is_complete = true;
        if self.piece.is_empty() {
            return None;
        }
        let piece = if self.is_too_long { None } else { decode(&mut self.piece) };
        if piece.is_none() {
            self.damaged += 1;
        }
        Some(piece.unwrap_or(Piece::Damaged))
    }
}

/// The contents of a piece, decoded in place; `None` if it is damaged.
fn decode(piece: &mut [u8]) -> Option<Piece<'_>> {
    let length = unstuff(piece)?;
    // `split_last_chunk` would do, but for a panic within it as far as the compiler can see.
    let (kept, crc) = piece.get(..length)?.split_at_checked(length.checked_sub(TAIL)?)?;
    if crc32(kept) != u32::from_le_bytes(crc.try_into().ok()?) {
        return None;
    }
    let ([kind, low, high], body) = kept.split_first_chunk::<HEAD>()?;
    let body = match *kind {
        HELLO if body.first().is_some_and(|version| *version != PROTOCOL) => return body.first().copied().map(Piece::OtherProtocol),
        HELLO => Body::Hello(whole(body)?),
        ROW => Body::Row(whole(body)?),
        TEXT => Body::Text(whole(body)?),
        BEAT => Body::Beat(whole(body)?),
        _ => return None,
    };
    Some(Piece::Frame(Frame { seq: u16::from_le_bytes([*low, *high]), body }))
}

/// A value that takes all of `bytes`.
fn whole<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Option<T> {
    postcard::take_from_bytes(bytes).ok().and_then(|(value, rest)| rest.is_empty().then_some(value))
}
