//! Timed output of the torquer: a task sets a value for a given tick, the control interrupt writes it in that tick.
//!
//! In: a value and its tick ([`TimedOutput::set`]). Out: the value in its tick ([`TimedOutput::take`]); the interrupt then leaves the sweep
//! of the converters that was under way ([`TimedOutput::set_sweep`]), and the task reads both ([`TimedOutput::take_sweep`]). So one timer
//! paces pulse edges, samples and ticks, however late the task runs. No wait and no lock; one task, and one interrupt above it.

use core::sync::atomic::{AtomicU32, Ordering};

/// No value; no sweep.
const NONE: u32 = u32::MAX;

/// The value between task and interrupt.
#[derive(Debug)]
pub struct TimedOutput {
    /// The next value and its tick, low word.
    value: AtomicU32,
    due: AtomicU32,
    /// The tick in which a value was taken, low word, and the sweep of the converters that was under way.
    taken: AtomicU32,
    sweep: AtomicU32,
}

impl Default for TimedOutput {
    fn default() -> Self {
        Self::new()
    }
}

impl TimedOutput {
    /// No value.
    pub const fn new() -> Self {
        Self { value: AtomicU32::new(NONE), due: AtomicU32::new(0), taken: AtomicU32::new(0), sweep: AtomicU32::new(NONE) }
    }

    /// Sets the converter's value from the tick with this low word on. Replaces a value that has not been taken yet.
    #[inline]
    pub fn set(&self, tick: u32, value: u16) {
        // The tick first: an interrupt in between takes the old value late rather than the new one early.
        self.due.store(tick, Ordering::Relaxed);
        self.value.store(u32::from(value), Ordering::Relaxed);
    }

    /// Each tick: the value that is due. A late value is given at once; its sample shows the delay.
    #[inline]
    pub fn take(&self, tick: u32) -> Option<u16> {
        let value = self.value.load(Ordering::Relaxed);
        if value == NONE || tick.wrapping_sub(self.due.load(Ordering::Relaxed)) > u32::MAX >> 1 {
            return None;
        }
        self.taken.store(tick, Ordering::Relaxed);
        self.value.store(NONE, Ordering::Relaxed);
        Some(value as u16)
    }

    /// In the tick that took a value: the sweep of the converters that was under way.
    #[inline]
    pub fn set_sweep(&self, sweep: u32) {
        self.sweep.store(sweep, Ordering::Relaxed);
    }

    /// The sweep of the newest value and its tick, low word, once.
    pub fn take_sweep(&self) -> Option<(u32, u32)> {
        let sweep = self.sweep.swap(NONE, Ordering::Relaxed);
        (sweep != NONE).then(|| (sweep, self.taken.load(Ordering::Relaxed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_taken_once_in_its_tick_or_at_once_if_late() {
        let output = TimedOutput::new();
        assert_eq!((output.take(7), output.take_sweep()), (None, None));
        output.set(10, 2100);
        assert_eq!([8, 9, 10, 11].map(|tick| output.take(tick)), [None, None, Some(2100), None]);
        output.set_sweep(3);
        assert_eq!((output.take_sweep(), output.take_sweep()), (Some((3, 10)), None));
        output.set(12, 1);
        assert_eq!(output.take(15), Some(1), "late");
        // The low word of a tick wraps after five days.
        output.set(2, 5);
        assert_eq!([u32::MAX, 0, 1, 2].map(|tick| output.take(tick)), [None, None, None, Some(5)]);
        output.set(20, 6);
        output.set(30, 7);
        assert_eq!([20, 30].map(|tick| output.take(tick)), [None, Some(7)], "the newest counts");
    }
}
