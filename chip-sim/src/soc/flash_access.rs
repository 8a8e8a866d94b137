//! Wait states of the flash, with prefetch and the caches of instructions and data (RM0390 §3.4.2).

use super::Soc;

/// Bytes of a line of the flash and of its caches (RM0390 §3.4.2).
const LINE_SHIFT: u32 = 4;
const INSTRUCTION_LINES: usize = 64;
const DATA_LINES: usize = 8;

/// Cached lines of the flash, by line number.
pub(super) struct Caches {
    current: u32,
    entered: u64,
    instructions: [u32; INSTRUCTION_LINES],
    data: [u32; DATA_LINES],
    next_data: usize,
}

impl Default for Caches {
    fn default() -> Self {
        Self { current: u32::MAX, entered: 0, instructions: [u32::MAX; INSTRUCTION_LINES], data: [u32::MAX; DATA_LINES], next_data: 0 }
    }
}

impl Soc {
    /// Wait states of a fetch from the flash (RM0390 §3.4.2).
    #[inline]
    pub(super) fn wait_for_line(&mut self, address: u32) {
        let line = address >> LINE_SHIFT;
        if line == self.caches.current {
            return;
        }
        let follows = line == self.caches.current.wrapping_add(1);
        let spent = self.cycles - self.caches.entered;
        self.caches.current = line;
        self.caches.entered = self.cycles;
        let waits = u64::from(self.flash.wait_states());
        if waits == 0 {
            return;
        }
        let [prefetch, cache, _] = self.flash.accelerated();
        let place = &mut self.caches.instructions[line as usize % INSTRUCTION_LINES];
        if cache && *place == line {
            return;
        }
        if cache {
            *place = line;
        }
        // Prefetch reads the next line while the core executes this one.
        self.waits += if prefetch && follows { waits.saturating_sub(spent) } else { waits };
    }

    /// Wait states of a data read from the flash.
    #[inline]
    pub(super) fn wait_for_data(&mut self, address: u32) {
        let line = address >> LINE_SHIFT;
        let waits = u64::from(self.flash.wait_states());
        if waits == 0 {
            return;
        }
        let [_, _, cache] = self.flash.accelerated();
        if cache {
            if self.caches.data.contains(&line) {
                return;
            }
            self.caches.data[self.caches.next_data] = line;
            self.caches.next_data = (self.caches.next_data + 1) % DATA_LINES;
        }
        self.waits += waits;
    }
}
