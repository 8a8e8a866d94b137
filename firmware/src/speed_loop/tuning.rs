//! Another configuration for the law while it stands: how a setting that is changed at the console gets into the interrupt.
//!
//! It is too large for a mailbox of words and comes once in a while, with the drive off: so it is copied with interrupts held for that long
//! (some 150 cycles), and the interrupt looks at one flag.

use super::Config;
use core::cell::Cell;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;

/// What the tasks have for the interrupt.
pub struct Tuning {
    is_new: AtomicBool,
    config: Mutex<CriticalSectionRawMutex, Cell<Option<Config>>>,
}

impl Default for Tuning {
    fn default() -> Self {
        Self::new()
    }
}

impl Tuning {
    /// Nothing yet.
    pub const fn new() -> Self {
        Self { is_new: AtomicBool::new(false), config: Mutex::new(Cell::new(None)) }
    }

    /// Hands a checked configuration over; the newest wins. The drive must be off.
    pub fn post(&self, config: Config) {
        self.config.lock(|cell| cell.set(Some(config)));
        self.is_new.store(true, Ordering::Release);
    }

    /// What was posted since the last call.
    #[inline]
    pub(super) fn take(&self) -> Option<Config> {
        if !self.is_new.load(Ordering::Acquire) {
            return None;
        }
        self.is_new.store(false, Ordering::Relaxed);
        self.config.lock(Cell::take)
    }
}
