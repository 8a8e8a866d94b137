//! Output to the line: text in text mode, frames in stream mode, each complete or not at all.
//!
//! One ring of bytes is filled here and emptied by the transmit task. Rows and heartbeats never wait: without room they are lost, counted,
//! and leave a gap in the frame numbers. Replies wait, and leave some room to the rows.

use crate::board::{Clock, TICKS_PER_ROW};
use crate::telemetry::frame::MAX_FRAME;
use crate::telemetry::{Body, encode};
use core::cell::Cell;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::pipe::Pipe;

/// Length of the ring, bytes: 22 ms at 921 600 baud.
const RING_BYTES: usize = 2048;
/// End of a line of text.
pub const LINE_END: &str = "\r\n";
/// Room that replies leave to rows, bytes.
const RESERVED_FOR_ROWS: usize = 512;

/// The ring and the mode of the output.
pub struct Out {
    ring: Pipe<NoopRawMutex, RING_BYTES>,
    streaming: Cell<bool>,
    /// `FORMat:UNITs ON`: numbers in replies have their units.
    pub has_units: Cell<bool>,
    seq: Cell<u16>,
    lost: Cell<u32>,
}

impl Default for Out {
    fn default() -> Self {
        Self { ring: Pipe::new(), streaming: Cell::new(false), has_units: Cell::new(false), seq: Cell::new(0), lost: Cell::new(0) }
    }
}

impl Out {
    /// Whether the stream mode is on.
    pub fn is_streaming(&self) -> bool {
        self.streaming.get()
    }

    /// Switches between frames and text. Bytes in the ring are sent unchanged.
    pub fn set_streaming(&self, on: bool) {
        if on && !self.streaming.get() {
            self.lost.set(0);
        }
        self.streaming.set(on);
    }

    /// Frames lost for lack of room since the stream began.
    pub fn lost(&self) -> u32 {
        self.lost.get()
    }

    /// Counts frames that were lost before they were made, and leaves their numbers out.
    pub fn skip(&self, frames: u32) {
        self.seq.set(self.seq.get().wrapping_add(frames as u16));
        self.lost.set(self.lost.get().saturating_add(frames));
    }

    /// Sends a frame if there is room.
    pub fn frame(&self, body: &Body<'_>) {
        let mut space = [0; MAX_FRAME];
        let seq = self.seq.get();
        self.seq.set(seq.wrapping_add(1));
        match encode(body, seq, &mut space) {
            Some(bytes) if self.ring.free_capacity() >= bytes.len() => self.put(bytes),
            _ => self.lost.set(self.lost.get().saturating_add(1)),
        }
    }

    /// Sends a line of text, as text or frame by the mode, if there is room; else it is lost and, as a frame, counted.
    pub fn try_line(&self, text: &str) {
        self.try_text(text, LINE_END);
    }

    fn try_text(&self, text: &str, end: &str) {
        if self.streaming.get() {
            self.frame(&Body::Text(text));
        } else if self.ring.free_capacity() >= text.len() + end.len() {
            self.put(text.as_bytes());
            self.put(end.as_bytes());
        }
    }

    /// Sends text when there is room: with `end` behind it, or as a frame, which ends by itself.
    pub async fn text<C: Clock>(&self, clock: &C, text: &str, end: &str) {
        // Overhead of a frame: two zeros, COBS, type, number, length, CRC.
        while self.ring.free_capacity() < text.len() + 12 + RESERVED_FOR_ROWS {
            clock.until(clock.now() + TICKS_PER_ROW).await;
        }
        self.try_text(text, end);
    }

    /// Takes the next bytes for the line.
    pub async fn take(&self, into: &mut [u8]) -> usize {
        self.ring.read(into).await
    }

    fn put(&self, mut bytes: &[u8]) {
        // Two pieces where the ring wraps; the caller has checked the room.
        while let Ok(put @ 1..) = self.ring.try_write(bytes) {
            bytes = bytes.get(put..).unwrap_or_default();
            if bytes.is_empty() {
                break;
            }
        }
    }
}
