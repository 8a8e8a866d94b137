//! The chip's FIFO: 512 words of a tag and six bytes (AN5398 §9).

use std::collections::VecDeque;

/// Capacity in words: 3 KiB.
pub(super) const WORDS: usize = 512;

/// Kinds of words.
pub(super) const RATE: u8 = 1;
pub(super) const ACCEL: u8 = 2;
pub(super) const STAMP: u8 = 4;

/// The words.
#[derive(Clone, Debug)]
pub(super) struct Fifo {
    words: VecDeque<[u8; 7]>,
    counter: u8,
    overrun: bool,
    latched: bool,
}

impl Fifo {
    pub fn new() -> Self {
        Self { words: VecDeque::with_capacity(WORDS), counter: 0, overrun: false, latched: false }
    }

    pub fn clear(&mut self) {
        self.words.clear();
        (self.overrun, self.latched) = (false, false);
    }

    /// The following words belong to another sampling time.
    pub fn next_moment(&mut self) {
        self.counter = (self.counter + 1) & 3;
    }

    /// Adds a word; a full FIFO loses its oldest word, or the new one in stop mode.
    pub fn push(&mut self, kind: u8, body: [u8; 6], runs_on: bool) {
        if self.words.len() >= WORDS {
            (self.overrun, self.latched) = (true, true);
            if !runs_on {
                return;
            }
            self.words.pop_front();
        }
        let tag = kind << 3 | self.counter << 1;
        let tag = tag | (tag.count_ones() & 1) as u8;
        let [a, b, c, d, e, f] = body;
        self.words.push_back([tag, a, b, c, d, e, f]);
    }

    /// A byte of the oldest word; the last byte removes the word.
    pub fn read(&mut self, index: usize) -> u8 {
        let byte = self.words.front().map_or(0, |word| word[index]);
        if index == 6 {
            self.words.pop_front();
            self.overrun = false;
        }
        byte
    }

    /// FIFO_STATUS1 and FIFO_STATUS2.
    pub fn status(&self) -> [u8; 2] {
        let level = self.words.len() as u16;
        let flags = u8::from(self.latched) << 3 | u8::from(self.words.len() >= WORDS) << 5 | u8::from(self.overrun) << 6;
        [level as u8, (level >> 8) as u8 & 3 | flags]
    }

    pub fn unlatch(&mut self) {
        self.latched = false;
    }
}
