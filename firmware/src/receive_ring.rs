//! Ring of received bytes, written by DMA and read by one task.
//!
//! The interrupt of the line passes new bytes on by the position of DMA ([`ReceiveRing::update`]). The position tells nothing about whole rounds. A
//! late update therefore counts as a loss of bytes, except after an announced stall of the core: [`ReceiveRing::announce_stall`] replaces the
//! newest byte, the last one that a whole round overwrites, by a mark that no line of text contains. A mark that is still there shows that all
//! bytes of the stall are in the ring. (Without it each erase of the flash reported a loss, and the command received next was discarded.)

use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU16, AtomicU32, Ordering};

/// Not ASCII, so that no command contains it.
const MARK: u8 = 0xff;
/// No byte is marked.
const NO_MARK: u16 = 0x100;

/// A ring of `N` bytes.
pub struct ReceiveRing<const N: usize> {
    bytes: [AtomicU8; N],
    /// Bytes received since power-on, wrapping.
    received: AtomicU32,
    /// The byte that the mark replaces.
    marked: AtomicU16,
    is_lost: AtomicBool,
}

impl<const N: usize> Default for ReceiveRing<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> ReceiveRing<N> {
    /// An empty ring.
    pub const fn new() -> Self {
        const { assert!(N.is_power_of_two(), "the count of received bytes wraps") };
        Self {
            bytes: [const { AtomicU8::new(0) }; N],
            received: AtomicU32::new(0),
            marked: AtomicU16::new(NO_MARK),
            is_lost: AtomicBool::new(false),
        }
    }

    /// The bytes, for DMA.
    pub fn bytes(&self) -> &[AtomicU8; N] {
        &self.bytes
    }

    /// Bytes received since power-on, wrapping.
    #[inline]
    pub fn received(&self) -> u32 {
        self.received.load(Ordering::Acquire)
    }

    /// The byte at a count of received bytes.
    #[inline]
    pub fn byte(&self, count: u32) -> u8 {
        self.slot(count).map_or(0, |byte| byte.load(Ordering::Relaxed))
    }

    /// Whether bytes were lost since the last call.
    pub fn take_lost(&self) -> bool {
        self.is_lost.swap(false, Ordering::Relaxed)
    }

    /// Bytes were lost before they reached the ring.
    pub fn set_lost(&self) {
        self.is_lost.store(true, Ordering::Relaxed);
    }

    /// Interrupt: `written` is the index that DMA writes next; `is_late`: DMA may have gone round since the last update. Returns the counts of the new
    /// bytes: from the first one up to the one after the last. They become readable with [`ReceiveRing::publish`].
    #[inline]
    pub fn update(&self, written: usize, is_late: bool) -> (u32, u32) {
        let before = self.received.load(Ordering::Relaxed);
        let is_intact = match self.marked.swap(NO_MARK, Ordering::Relaxed) {
            NO_MARK => !is_late,
            marked => self.take_mark(before, marked as u8),
        };
        if !is_intact {
            self.set_lost();
        }
        let new = (written as u32).wrapping_sub(before) & (N as u32 - 1);
        (before, before.wrapping_add(new))
    }

    /// Interrupt: the bytes up to this count may be read.
    #[inline]
    pub fn publish(&self, end: u32) {
        self.received.store(end, Ordering::Release);
    }

    /// The core stalls from here to the next update. To be called after an update, with the interrupt held off until the end of the stall.
    pub fn announce_stall(&self) {
        if let Some(newest) = self.slot(self.received().wrapping_sub(1)) {
            self.marked.store(u16::from(newest.swap(MARK, Ordering::Relaxed)), Ordering::Relaxed);
        }
    }

    /// Whether the mark is still there; then its byte comes back.
    #[cold]
    fn take_mark(&self, received: u32, marked: u8) -> bool {
        let restored = |newest: &AtomicU8| newest.compare_exchange(MARK, marked, Ordering::Relaxed, Ordering::Relaxed).is_ok();
        self.slot(received.wrapping_sub(1)).is_some_and(restored)
    }

    #[inline]
    fn slot(&self, count: u32) -> Option<&AtomicU8> {
        self.bytes.get(count as usize & (N - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENGTH: usize = 16;

    /// The line's DMA, and the interrupt.
    struct Line {
        ring: ReceiveRing<LENGTH>,
        written: usize,
        passed: Vec<u8>,
    }

    impl Line {
        fn new() -> Self {
            Self { ring: ReceiveRing::new(), written: 0, passed: Vec::new() }
        }

        fn receive(&mut self, bytes: &[u8]) {
            for byte in bytes {
                self.ring.bytes()[self.written].store(*byte, Ordering::Relaxed);
                self.written = (self.written + 1) % LENGTH;
            }
        }

        fn interrupt(&mut self, is_late: bool) {
            let (from, end) = self.ring.update(self.written, is_late);
            let new = end.wrapping_sub(from);
            self.passed.extend((0..new).map(|offset| self.ring.byte(from.wrapping_add(offset))));
            self.ring.publish(end);
        }
    }

    #[test]
    fn bytes_of_a_stall_are_kept_or_reported_as_lost() {
        for before in 0..2 * LENGTH {
            for count in 0..5 * LENGTH {
                let mut line = Line::new();
                let first: Vec<u8> = (0..before).map(|n| b'a' + n as u8 % 26).collect();
                for byte in &first {
                    line.receive(&[*byte]);
                    line.interrupt(false);
                }
                line.ring.announce_stall();
                let during: Vec<u8> = (0..count).map(|n| b'A' + n as u8 % 26).collect();
                line.receive(&during);
                line.interrupt(true);
                assert_eq!(line.ring.take_lost(), count >= LENGTH, "{before} bytes, then {count} in the stall");
                if count < LENGTH {
                    assert_eq!(line.passed, [first.clone(), during].concat());
                    assert!(before == 0 || line.ring.byte(before as u32 - 1) == first[before - 1], "the marked byte is back");
                }
                // The stall is over: the usual rule again.
                line.interrupt(true);
                assert!(line.ring.take_lost(), "late without an announcement");
            }
        }
    }

    #[test]
    fn bytes_pass_once_and_in_sequence_over_many_rounds() {
        let mut line = Line::new();
        let sent: Vec<u8> = (0..1000).map(|n| n as u8).collect();
        for piece in sent.chunks(7) {
            line.receive(piece);
            line.interrupt(false);
        }
        assert!(line.passed == sent && !line.ring.take_lost());
    }
}
