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

    /// Takes the words from their cells. What passes the interrupt does it one by one ([`one_by_one`]): three instructions a word fewer.
    #[inline]
    fn get(cells: &[AtomicU32; N], words: &mut [u32; N]) {
        for (word, cell) in words.iter_mut().zip(cells) {
            *word = cell.load(Ordering::Relaxed);
        }
    }
}

/// [`Words::get`] written out, by the places of all words.
macro_rules! one_by_one {
    ($n:literal: $($place:literal)+) => {
        #[inline(always)]
        fn get(cells: &[core::sync::atomic::AtomicU32; $n], words: &mut [u32; $n]) {
            $(words[$place] = cells[$place].load(core::sync::atomic::Ordering::Relaxed);)+
        }
    };
}
pub(crate) use one_by_one;

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
        self.post_by(|cells| {
            for (cell, word) in cells.iter().zip(&value.to_words()) {
                cell.store(*word, Ordering::Relaxed);
            }
        });
    }

    /// The same with a value that `put` puts into the cells, word by word: it is nowhere else then.
    #[inline]
    pub fn post_by(&mut self, put: impl FnOnce(&[AtomicU32; N])) {
        let sequence = self.mailbox.sequence.load(Ordering::Relaxed);
        self.mailbox.sequence.store(sequence.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::Release);
        put(&self.mailbox.words);
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
        let mut words = [0; N];
        (self.take_to(&mut words) == Some(true)).then(|| T::from_words(&words))
    }

    /// Its words, into `words`; false where they are torn, `None` where there is nothing new and `words` stays as it was.
    #[inline]
    pub fn take_to(&mut self, words: &mut [u32; N]) -> Option<bool> {
        let before = self.mailbox.sequence.load(Ordering::Acquire);
        if before == self.seen || before & 1 == 1 {
            return None;
        }
        T::get(&self.mailbox.words, words);
        fence(Ordering::Acquire);
        let whole = self.mailbox.sequence.load(Ordering::Relaxed) == before;
        if whole {
            self.seen = before;
        }
        Some(whole)
    }

    /// The same with a few tries. For the tasks: the interrupt writes for less than a microsecond in each 100.
    pub fn take(&mut self) -> Option<T> {
        (0..4).find_map(|_| self.take_once())
    }
}

/// How far a value has come out of a mailbox that is taken a few words at a time: for the interrupt, where a long value would take too long at once.
#[derive(Default)]
pub struct Parts {
    taken: usize,
    sequence: u32,
}

impl<T: Words<N>, const N: usize> Reader<'_, T, N> {
    /// Takes seven more words of what was posted into their place in `words`; true when they are all there. `N` is a multiple of seven. Begins anew
    /// where something else was posted meanwhile.
    #[inline]
    pub fn take_part(&mut self, parts: &mut Parts, words: &mut [u32; N]) -> bool {
        const PART: usize = 7;
        const { assert!(N.is_multiple_of(PART)) };
        let sequence = self.mailbox.sequence.load(Ordering::Acquire);
        if sequence == self.seen || sequence & 1 == 1 {
            return false;
        }
        if sequence != parts.sequence {
            parts.sequence = sequence;
            parts.taken = 0;
        }
        let places = words.as_chunks_mut::<PART>().0.get_mut(parts.taken);
        if let (Some(place), Some([a, b, c, d, e, f, g])) = (places, self.mailbox.words.as_chunks::<PART>().0.get(parts.taken)) {
            let word = |cell: &AtomicU32| cell.load(Ordering::Relaxed);
            *place = [word(a), word(b), word(c), word(d), word(e), word(f), word(g)];
        }
        fence(Ordering::Acquire);
        if self.mailbox.sequence.load(Ordering::Relaxed) != sequence {
            parts.taken = 0;
            return false;
        }
        parts.taken = parts.taken.wrapping_add(1);
        if parts.taken.wrapping_mul(PART) < N {
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

    #[derive(Clone, Copy, Debug, PartialEq)]
    struct TwentyOne([u32; 21]);
    impl Words<21> for TwentyOne {
        fn to_words(&self) -> [u32; 21] {
            self.0
        }
        fn from_words(words: &[u32; 21]) -> Self {
            Self(*words)
        }
    }

    #[test]
    fn a_value_taken_in_parts_is_whole_or_begins_anew() {
        let mut mailbox = Mailbox::<TwentyOne, 21>::new();
        let (mut writer, mut reader) = mailbox.split();
        let (mut parts, mut words) = (Parts::default(), [0; 21]);
        let mut take = || reader.take_part(&mut parts, &mut words);
        assert!(!take());
        writer.post(&TwentyOne([1; 21]));
        assert!(!take());
        let second = core::array::from_fn(|n| n as u32);
        writer.post(&TwentyOne(second));
        assert!(!take() && !take());
        assert!(take());
        assert!(!take(), "and is news once");
        assert_eq!(words, second);
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
