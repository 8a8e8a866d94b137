//! A mailbox for one value between the interrupt and the tasks: the newest wins, nobody waits, nothing is `unsafe`.
//!
//! A sequence lock whose payload is atomic words. The writer makes the sequence odd, writes, makes it even; a reader
//! that sees an odd or a changed sequence has a torn value and drops it. Each mailbox has one writer and one reader,
//! which `split` hands out.
//!
//! The interrupt never spins: as a writer it has nothing to wait for, and as a reader it tries once — a torn read means
//! that it has interrupted the writing task, so it keeps what it had and finds the new value a tick later. A task that
//! reads may be interrupted by the writer in the middle; it tries a few times and then also keeps what it had.

use core::marker::PhantomData;
use core::sync::atomic::{AtomicU32, Ordering, fence};

/// A value as a fixed number of words.
pub trait Words<const N: usize>: Copy {
    /// The value as words.
    fn to_words(&self) -> [u32; N];
    /// The value from words that `to_words` made.
    fn from_words(words: &[u32; N]) -> Self;
}

/// The two words of a 64-bit number, low first.
#[inline]
pub fn split_u64(value: u64) -> [u32; 2] {
    [value as u32, (value >> 32) as u32]
}

/// The 64-bit number of two words.
#[inline]
pub fn join_u64(low: u32, high: u32) -> u64 {
    (high as u64) << 32 | low as u64
}

/// The shared part. Sequence 0 means that nothing was ever written.
pub struct Mailbox<T, const N: usize> {
    sequence: AtomicU32,
    words: [AtomicU32; N],
    of: PhantomData<fn(T) -> T>,
}

impl<T: Words<N>, const N: usize> Default for Mailbox<T, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Words<N>, const N: usize> Mailbox<T, N> {
    /// An empty mailbox.
    pub const fn new() -> Self {
        Self { sequence: AtomicU32::new(0), words: [const { AtomicU32::new(0) }; N], of: PhantomData }
    }

    /// Its one writer and its one reader.
    pub fn split(&mut self) -> (Writer<'_, T, N>, Reader<'_, T, N>) {
        (Writer { mailbox: self }, Reader { mailbox: self, seen: 0 })
    }
}

/// The side that posts.
pub struct Writer<'a, T, const N: usize> {
    mailbox: &'a Mailbox<T, N>,
}

impl<T: Words<N>, const N: usize> Writer<'_, T, N> {
    /// Puts `value` in the place of what was there. Never waits.
    #[inline]
    pub fn post(&mut self, value: &T) {
        let sequence = self.mailbox.sequence.load(Ordering::Relaxed);
        self.mailbox.sequence.store(sequence.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::Release);
        for (cell, word) in self.mailbox.words.iter().zip(&value.to_words()) {
            cell.store(*word, Ordering::Relaxed);
        }
        // After 2^31 posts the sequence passes 0, "nothing yet", which would hide one value: skip it.
        let next = sequence.wrapping_add(2);
        self.mailbox.sequence.store(if next == 0 { 2 } else { next }, Ordering::Release);
    }
}

/// The side that looks.
pub struct Reader<'a, T, const N: usize> {
    mailbox: &'a Mailbox<T, N>,
    seen: u32,
}

impl<T: Words<N>, const N: usize> Reader<'_, T, N> {
    /// What was posted since the last look, if it can be read whole at the first try. For the interrupt.
    #[inline]
    pub fn take_once(&mut self) -> Option<T> {
        let before = self.mailbox.sequence.load(Ordering::Acquire);
        if before == self.seen || before & 1 == 1 {
            return None;
        }
        let mut words = [0; N];
        for (word, cell) in words.iter_mut().zip(&self.mailbox.words) {
            *word = cell.load(Ordering::Relaxed);
        }
        fence(Ordering::Acquire);
        if self.mailbox.sequence.load(Ordering::Relaxed) != before {
            return None;
        }
        self.seen = before;
        Some(T::from_words(&words))
    }

    /// The same with a few tries. For the tasks: the interrupt writes for less than a microsecond in each 100.
    pub fn take(&mut self) -> Option<T> {
        (0..4).find_map(|_| self.take_once())
    }
}

/// A value on its way out of a mailbox, a few words at a time: for the interrupt, where a long value would take too long at once.
pub struct Parts<const N: usize> {
    words: [u32; N],
    taken: usize,
    sequence: u32,
}

impl<const N: usize> Default for Parts<N> {
    fn default() -> Self {
        Self { words: [0; N], taken: 0, sequence: 0 }
    }
}

impl<const N: usize> Parts<N> {
    /// The words, once all are there.
    pub fn words(&self) -> &[u32; N] {
        &self.words
    }
}

impl<T: Words<N>, const N: usize> Reader<'_, T, N> {
    /// Takes up to `most` more words of what was posted; true when they are all there. Begins anew where something else was posted meanwhile.
    #[inline]
    pub fn take_part(&mut self, parts: &mut Parts<N>, most: usize) -> bool {
        let sequence = self.mailbox.sequence.load(Ordering::Acquire);
        if sequence == self.seen || sequence & 1 == 1 {
            return false;
        }
        if sequence != parts.sequence {
            parts.sequence = sequence;
            parts.taken = 0;
        }
        let pairs = parts.words.iter_mut().zip(&self.mailbox.words);
        for (word, cell) in pairs.skip(parts.taken).take(most) {
            *word = cell.load(Ordering::Relaxed);
        }
        fence(Ordering::Acquire);
        if self.mailbox.sequence.load(Ordering::Relaxed) != sequence {
            parts.taken = 0;
            return false;
        }
        parts.taken = parts.taken.wrapping_add(most);
        if parts.taken < N {
            return false;
        }
        parts.taken = 0;
        self.seen = sequence;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Sixteen([u32; 16]);
    impl Words<16> for Sixteen {
        fn to_words(&self) -> [u32; 16] {
            self.0
        }
        fn from_words(words: &[u32; 16]) -> Self {
            Self(*words)
        }
    }

    #[test]
    fn an_empty_mailbox_gives_nothing_and_a_value_is_given_once() {
        let mut mailbox = Mailbox::<Sixteen, 16>::new();
        let (mut writer, mut reader) = mailbox.split();
        assert_eq!(reader.take(), None);
        writer.post(&Sixteen([1; 16]));
        writer.post(&Sixteen([2; 16]));
        assert_eq!(reader.take(), Some(Sixteen([2; 16])), "the newest wins");
        assert_eq!(reader.take(), None, "and is news once");
    }

    #[test]
    fn a_value_taken_in_parts_is_whole_or_begins_anew() {
        let mut mailbox = Mailbox::<Sixteen, 16>::new();
        let (mut writer, mut reader) = mailbox.split();
        let mut parts = Parts::default();
        assert!(!reader.take_part(&mut parts, 6));
        writer.post(&Sixteen([1; 16]));
        assert!(!reader.take_part(&mut parts, 6));
        writer.post(&Sixteen([2; 16]));
        assert!(!reader.take_part(&mut parts, 6) && !reader.take_part(&mut parts, 6));
        assert!(reader.take_part(&mut parts, 6));
        assert_eq!(parts.words(), &[2; 16]);
        assert!(!reader.take_part(&mut parts, 6), "and is news once");
    }

    #[test]
    fn no_value_is_ever_torn_or_older_than_the_last_between_two_threads() {
        let mut mailbox = Mailbox::<Sixteen, 16>::new();
        let (mut writer, mut reader) = mailbox.split();
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for n in 1..=400_000u32 {
                    writer.post(&Sixteen([n; 16]));
                }
            });
            let mut last = 0;
            while last < 400_000 {
                if let Some(Sixteen(words)) = reader.take_once() {
                    assert!(words.iter().all(|w| *w == words[0]), "torn: {words:?}");
                    assert!(words[0] > last, "{} after {last}", words[0]);
                    last = words[0];
                }
            }
        });
    }
}
