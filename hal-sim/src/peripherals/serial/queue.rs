//! Items on a wire, with the time at which each has passed.

use stand_firmware::board::{TICKS_PER_S, Ticks};
use std::collections::VecDeque;

/// Bits per byte on the line: start, eight, stop.
pub(super) const BITS_PER_BYTE: u64 = 10;
/// Resolution of the times, finer than the board clock so that bytes do not drift: 2⁻¹⁶ of its step.
const FINE: u32 = 16;

/// Items in sequence, each of the duration of a byte.
pub(super) struct Timed<T> {
    queue: VecDeque<(Ticks, T)>,
    byte_fine: u64,
    free_fine: u64,
}

impl<T> Timed<T> {
    pub fn new(baud: u32) -> Self {
        let byte_fine = ((BITS_PER_BYTE * TICKS_PER_S) << FINE) / u64::from(baud.max(1));
        Self { queue: VecDeque::new(), byte_fine, free_fine: 0 }
    }

    /// Starts `what` as soon as the wire is free, at the earliest now.
    #[inline]
    pub fn push(&mut self, now: Ticks, what: T) {
        self.free_fine = self.free_fine.max(now.0 << FINE) + self.byte_fine;
        // An item has passed with its last bit: rounded up to a clock step.
        self.queue.push_back((Ticks(self.free_fine.div_ceil(1 << FINE)), what));
    }

    /// The next item that has passed by `now`.
    #[inline]
    pub fn pop(&mut self, now: Ticks) -> Option<T> {
        if self.queue.front()?.0 > now {
            return None;
        }
        self.queue.pop_front().map(|(_, what)| what)
    }

    /// When the next item will have passed.
    pub fn next(&self) -> Option<Ticks> {
        self.queue.front().map(|(at, _)| *at)
    }

    /// When at most `most` items are left; `None`: now.
    pub fn when_down_to(&self, most: usize) -> Option<Ticks> {
        let last = self.queue.len().checked_sub(most + 1)?;
        self.queue.get(last).map(|(at, _)| *at)
    }

    /// Discards the items on the wire.
    pub fn clear(&mut self, now: Ticks) {
        self.queue.clear();
        self.free_fine = now.0 << FINE;
    }

    pub fn len(&self) -> usize {
        self.queue.len()
    }
}
