//! Values exchanged between priorities: the newest value wins, and nobody waits. [`Mailbox`] gives each value once, [`SharedCell`] keeps
//! it.
//!
//! The value is copied with interrupts held off, some hundred cycles for the largest one. A flag says whether it is new, so that a reader
//! who polls in each tick pays one load. (`embassy_sync::signal::Signal` moves the whole value at each poll.)

use core::cell::Cell;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;

/// A value that several priorities read and write: a `Cell` whose accesses are whole. Two accesses in sequence are not.
pub struct SharedCell<T>(Mutex<CriticalSectionRawMutex, Cell<T>>);

impl<T> SharedCell<T> {
    /// A cell with this value.
    pub const fn new(value: T) -> Self {
        Self(Mutex::new(Cell::new(value)))
    }

    /// Replaces the value.
    #[inline(never)] // for the size of the image
    pub fn set(&self, value: T) {
        self.0.lock(|cell| cell.set(value));
    }

    /// Replaces the value and returns the one before.
    #[inline(never)] // for the size of the image
    pub fn replace(&self, value: T) -> T {
        self.0.lock(|cell| cell.replace(value))
    }
}

impl<T: Copy> SharedCell<T> {
    /// The value.
    #[inline(never)]
    pub fn get(&self) -> T {
        self.0.lock(Cell::get)
    }
}

impl<T: Default> SharedCell<T> {
    /// Returns the value and leaves the default one.
    #[inline(never)] // for the size of the image
    pub fn take(&self) -> T {
        self.0.lock(Cell::take)
    }
}

impl<T: Default> Default for SharedCell<T> {
    fn default() -> Self {
        Self::new(T::default())
    }
}

impl<T: Copy + core::fmt::Debug> core::fmt::Debug for SharedCell<T> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_tuple("SharedCell").field(&self.get()).finish()
    }
}

/// Holds the newest value until it is taken.
pub struct Mailbox<T> {
    is_new: AtomicBool,
    value: Mutex<CriticalSectionRawMutex, Cell<Option<T>>>,
}

impl<T> Default for Mailbox<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T> Mailbox<T> {
    /// An empty mailbox.
    pub const fn new() -> Self {
        Self { is_new: AtomicBool::new(false), value: Mutex::new(Cell::new(None)) }
    }

    /// Replaces the value that has not been taken yet, if any.
    #[inline]
    pub fn post(&self, value: T) {
        self.value.lock(|cell| cell.set(Some(value)));
        self.is_new.store(true, Ordering::Release);
    }

    /// Whether a value waits to be taken.
    pub fn has_new(&self) -> bool {
        self.is_new.load(Ordering::Acquire)
    }

    /// The value posted since the last call; `None` if there is none.
    #[inline]
    pub fn take(&self) -> Option<T> {
        if !self.is_new.load(Ordering::Acquire) {
            return None;
        }
        self.is_new.store(false, Ordering::Relaxed);
        self.value.lock(Cell::take)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use critical_section as _;

    #[test]
    fn the_newest_value_is_given_once() {
        let mailbox = Mailbox::new();
        assert_eq!(mailbox.take(), None);
        mailbox.post([1; 16]);
        mailbox.post([2; 16]);
        assert_eq!(mailbox.take(), Some([2; 16]));
        assert_eq!(mailbox.take(), None);
    }

    #[test]
    fn values_are_whole_and_in_sequence_between_two_threads() {
        let mailbox = &Mailbox::new();
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for n in 1..=400_000_u32 {
                    mailbox.post([n; 16]);
                }
            });
            let mut last = 0;
            while last < 400_000 {
                if let Some(words) = mailbox.take() {
                    assert!(words.iter().all(|word| *word == words[0]), "torn: {words:?}");
                    assert!(words[0] > last, "{} after {last}", words[0]);
                    last = words[0];
                }
            }
        });
    }
}
