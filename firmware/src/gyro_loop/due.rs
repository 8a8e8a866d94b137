//! What the torquer is given next: said by a task a millisecond before, taken by the control interrupt in its tick.
//!
//! In: a step and the tick from which on it is given ([`Due::give`]). Out: in that tick the step ([`Due::take`]), whose taker then leaves where its converters
//! stood ([`Due::sampled`]); the tasks find both afterwards ([`Due::sample`]). So pulse edges, samples and ticks have one timer, whatever the tasks do in
//! between. Promises: a dozen instructions in a tick, no wait, no lock; one task, one interrupt above it.

use core::sync::atomic::{AtomicU32, Ordering};

/// Nothing is asked for; no sample.
const NONE: u32 = u32::MAX;

/// The place where a task leaves it and the interrupt takes it.
#[derive(Debug)]
pub struct Due {
    /// What is given next, and from which tick on (low word).
    next: AtomicU32,
    due: AtomicU32,
    /// The tick that took it (low word), and the sweep of the converters that was under way then.
    taken: AtomicU32,
    sweep: AtomicU32,
}

impl Default for Due {
    fn default() -> Self {
        Self::new()
    }
}

impl Due {
    /// Nothing asked for.
    pub const fn new() -> Self {
        Self { next: AtomicU32::new(NONE), due: AtomicU32::new(0), taken: AtomicU32::new(0), sweep: AtomicU32::new(NONE) }
    }

    /// From the tick with this low word on, this value of the converter; what was asked for before and not yet given is forgotten.
    #[inline]
    pub fn give(&self, tick: u32, value: u16) {
        // In this order: the interrupt may come between, and finds the old value late rather than the new one early.
        self.due.store(tick, Ordering::Relaxed);
        self.next.store(u32::from(value), Ordering::Relaxed);
    }

    /// In each tick: the value that is due. What is late is given at once; its sample shows it.
    #[inline]
    pub fn take(&self, tick: u32) -> Option<u16> {
        let next = self.next.load(Ordering::Relaxed);
        if next == NONE || tick.wrapping_sub(self.due.load(Ordering::Relaxed)) > u32::MAX >> 1 {
            return None;
        }
        self.taken.store(tick, Ordering::Relaxed);
        self.next.store(NONE, Ordering::Relaxed);
        Some(next as u16)
    }

    /// In the tick that took a value: this sweep of the converters was under way.
    #[inline]
    pub fn sampled(&self, sweep: u32) {
        self.sweep.store(sweep, Ordering::Relaxed);
    }

    /// The sweep and the tick (low word) of the newest sample, once.
    pub fn sample(&self) -> Option<(u32, u32)> {
        let sweep = self.sweep.swap(NONE, Ordering::Relaxed);
        (sweep != NONE).then(|| (sweep, self.taken.load(Ordering::Relaxed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_given_in_its_tick_once_or_at_once_where_it_is_late() {
        let due = Due::new();
        assert_eq!((due.take(7), due.sample()), (None, None));
        due.give(10, 2100);
        assert_eq!([8, 9, 10, 11].map(|tick| due.take(tick)), [None, None, Some(2100), None]);
        due.sampled(3);
        assert_eq!((due.sample(), due.sample()), (Some((3, 10)), None));
        due.give(12, 1);
        assert_eq!(due.take(15), Some(1), "late");
        // The low word of a tick goes round after five days.
        due.give(2, 5);
        assert_eq!([u32::MAX, 0, 1, 2].map(|tick| due.take(tick)), [None, None, None, Some(5)]);
        due.give(20, 6);
        due.give(30, 7);
        assert_eq!([20, 30].map(|tick| due.take(tick)), [None, Some(7)], "the newest counts");
    }
}
