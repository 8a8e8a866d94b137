//! What goes to the line: text in text mode, frames in stream mode, whole or not at all.
//!
//! One ring of bytes, filled here and emptied by the transmit task. Rows and signs of life never wait: what finds no room is lost, counted, and
//! leaves a gap in the frames' numbers. Replies wait, and leave the rows some room.

use crate::board::{Clock, TICKS_PER_ROW};
use crate::telemetry::frame::MOST_FRAME;
use crate::telemetry::{Body, encode};
use core::cell::Cell;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::pipe::Pipe;

/// Bytes that wait for the line: 22 ms of it at 921 600 baud.
const RING_BYTES: usize = 2048;
/// What replies leave free for rows, bytes.
const FOR_ROWS: usize = 512;

/// The ring, and how things are put into it.
pub struct Out {
    ring: Pipe<NoopRawMutex, RING_BYTES>,
    streaming: Cell<bool>,
    seq: Cell<u16>,
    lost: Cell<u32>,
}

impl Default for Out {
    fn default() -> Self {
        Self { ring: Pipe::new(), streaming: Cell::new(false), seq: Cell::new(0), lost: Cell::new(0) }
    }
}

impl Out {
    /// Whether frames are sent.
    pub fn is_streaming(&self) -> bool {
        self.streaming.get()
    }

    /// Frames or text from now on; what waits goes out as it is.
    pub fn set_streaming(&self, on: bool) {
        if on && !self.streaming.get() {
            self.lost.set(0);
        }
        self.streaming.set(on);
    }

    /// Frames that found no room since the stream was turned on.
    pub fn lost(&self) -> u32 {
        self.lost.get()
    }

    /// Sends a frame if there is room.
    pub fn frame(&self, body: &Body<'_>) {
        let mut space = [0; MOST_FRAME];
        let seq = self.seq.get();
        self.seq.set(seq.wrapping_add(1));
        match encode(body, seq, &mut space) {
            Some(bytes) if self.ring.free_capacity() >= bytes.len() => self.put(bytes),
            _ => self.lost.set(self.lost.get().saturating_add(1)),
        }
    }

    /// Sends a line of text in the mode's form if there is room; else it is lost and, as a frame, counted.
    pub fn try_line(&self, text: &str) {
        if self.streaming.get() {
            self.frame(&Body::Text(text));
        } else if self.ring.free_capacity() >= text.len() + 2 {
            self.put(text.as_bytes());
            self.put(b"\r\n");
        }
    }

    /// Sends a line of text in the mode's form when there is room.
    pub async fn line<C: Clock>(&self, clock: &C, text: &str) {
        // As a frame: two zeros, COBS, type, number, length, CRC.
        while self.ring.free_capacity() < text.len() + 12 + FOR_ROWS {
            clock.until(clock.now() + TICKS_PER_ROW).await;
        }
        self.try_line(text);
    }

    /// The next bytes for the line.
    pub async fn take(&self, into: &mut [u8]) -> usize {
        self.ring.read(into).await
    }

    fn put(&self, mut bytes: &[u8]) {
        // In two pieces where the ring comes round; there is room for all of it.
        while let Ok(put @ 1..) = self.ring.try_write(bytes) {
            bytes = bytes.get(put..).unwrap_or_default();
            if bytes.is_empty() {
                break;
            }
        }
    }
}
