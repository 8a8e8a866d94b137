//! What is on a wire, with the time at which each has passed.

use stand_firmware::board::{TICKS_PER_S, Ticks};
use std::collections::VecDeque;

/// Bits of a byte on the line: start, eight, stop.
pub(super) const BITS_PER_BYTE: u64 = 10;
/// Times are kept finer than the board clock, so that bytes do not drift: 2⁻¹⁶ of its step.
const FINE: u32 = 16;

/// One after another, each as long as a byte.
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

    /// Begins `what` as soon as the wire is free, now at the earliest.
    #[inline]
    pub fn push(&mut self, now: Ticks, what: T) {
        self.free_fine = self.free_fine.max(now.0 << FINE) + self.byte_fine;
        // It has passed when its last bit has: rounded up to a step of the clock.
        self.queue.push_back((Ticks(self.free_fine.div_ceil(1 << FINE)), what));
    }

    /// The next that has passed by `now`.
    #[inline]
    pub fn pop(&mut self, now: Ticks) -> Option<T> {
        if self.queue.front()?.0 > now {
            return None;
        }
        self.queue.pop_front().map(|(_, what)| what)
    }

    /// When the next will have passed.
    pub fn next(&self) -> Option<Ticks> {
        self.queue.front().map(|(at, _)| *at)
    }

    /// When there will be no more than `most`; `None`: now.
    pub fn when_down_to(&self, most: usize) -> Option<Ticks> {
        let last = self.queue.len().checked_sub(most + 1)?;
        self.queue.get(last).map(|(at, _)| *at)
    }

    pub fn len(&self) -> usize {
        self.queue.len()
    }
}
