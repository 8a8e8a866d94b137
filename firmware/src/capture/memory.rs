//! Memory of a capture, shared between interrupt and tasks.

use super::Sample;
use crate::board::{CurrentCode, EncoderCount};
use crate::status::Fault;
use core::sync::atomic::{AtomicU32, Ordering};

/// Capacity in samples: 0.2 s of ticks.
pub const SAMPLES: usize = 2048;
/// Words of a sample.
const WORDS: usize = 4;
/// Bit of `request` beside the number of samples before the trigger: restart.
const ARM: u32 = 1 << 31;
/// Bit of `request`: trigger now.
const TRIGGER: u32 = 1 << 30;

/// 32 KiB of samples and their description. Samples are read only while the memory is frozen.
pub struct Memory {
    samples: [[AtomicU32; WORDS]; SAMPLES],
    /// Request of the tasks.
    pub(super) request: AtomicU32,
    /// 1 while the recording is valid.
    frozen: AtomicU32,
    /// Ring index of the oldest sample, number of samples, and index of the trigger among them.
    first: AtomicU32,
    len: AtomicU32,
    trigger: AtomicU32,
    fault: AtomicU32,
    tick: AtomicU32,
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

impl Memory {
    /// An empty memory.
    pub const fn new() -> Self {
        Self {
            samples: [const { [const { AtomicU32::new(0) }; WORDS] }; SAMPLES],
            request: AtomicU32::new(0),
            frozen: AtomicU32::new(0),
            first: AtomicU32::new(0),
            len: AtomicU32::new(0),
            trigger: AtomicU32::new(0),
            fault: AtomicU32::new(0),
            tick: AtomicU32::new(0),
        }
    }

    /// Restarts the recording, with `before` samples before the trigger (at most all but two). Deletes the last recording.
    pub fn arm(&self, before: usize) {
        self.frozen.store(0, Ordering::Release);
        self.request.store(ARM | clamped(before), Ordering::Release);
    }

    /// Triggers now, unless it is triggered already.
    pub fn trigger(&self) {
        self.request.fetch_or(TRIGGER, Ordering::AcqRel);
    }

    /// The recording, once it is complete.
    pub fn record(&self) -> Option<Recording<'_>> {
        (self.frozen.load(Ordering::Acquire) == 1).then(|| Recording {
            memory: self,
            first: self.first.load(Ordering::Relaxed),
            len: self.len.load(Ordering::Relaxed),
            trigger: self.trigger.load(Ordering::Relaxed),
            fault: Fault::of_code(self.fault.load(Ordering::Relaxed)),
            tick: self.tick.load(Ordering::Relaxed),
        })
    }

    #[inline]
    pub(super) fn write(&self, at: u32, sample: &Sample) {
        if let Some([a, b, c, d]) = self.samples.get(at as usize & (SAMPLES - 1)) {
            a.store(u32::from(sample.count.0) | u32::from(sample.duty as u16) << 16, Ordering::Relaxed);
            b.store(sample.current.0 as u32, Ordering::Relaxed);
            c.store(sample.rate.to_bits(), Ordering::Relaxed);
            d.store(sample.command as u32, Ordering::Relaxed);
        }
    }

    /// Requests since the last call: restart with this number of samples before the trigger; trigger.
    #[inline]
    pub(super) fn take_request(&self) -> (Option<u32>, bool) {
        if self.request.load(Ordering::Relaxed) == 0 {
            return (None, false);
        }
        let request = self.request.swap(0, Ordering::AcqRel);
        ((request & ARM != 0).then_some(request & !(ARM | TRIGGER)), request & TRIGGER != 0)
    }

    #[cold]
    pub(super) fn freeze(&self, next: u32, len: u32, trigger_at: u32, fault: Fault, tick: u32) {
        let first = next.wrapping_sub(len);
        self.first.store(first, Ordering::Relaxed);
        self.len.store(len, Ordering::Relaxed);
        self.trigger.store(trigger_at.wrapping_sub(first), Ordering::Relaxed);
        self.fault.store(fault.code(), Ordering::Relaxed);
        self.tick.store(tick, Ordering::Relaxed);
        self.frozen.store(1, Ordering::Release);
    }

    pub(super) fn thaw(&self) {
        self.frozen.store(0, Ordering::Release);
    }
}

/// At least one sample follows the trigger.
pub(super) fn clamped(before: usize) -> u32 {
    before.min(SAMPLES - 2) as u32
}

/// A complete recording, oldest sample first.
#[derive(Clone, Copy)]
pub struct Recording<'a> {
    memory: &'a Memory,
    first: u32,
    len: u32,
    trigger: u32,
    fault: Fault,
    tick: u32,
}

impl Recording<'_> {
    /// Number of samples, one per tick.
    pub fn len(&self) -> usize {
        self.len as usize
    }

    /// Whether it is empty.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Index of the trigger's sample.
    pub fn trigger(&self) -> usize {
        self.trigger as usize
    }

    /// The fault that triggered it; `Fault::None` for a request.
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// Tick of the trigger, low word.
    pub fn trigger_tick(&self) -> u32 {
        self.tick
    }

    /// Sample `k`, from the oldest; `None` after the last.
    pub fn sample(&self, k: usize) -> Option<Sample> {
        if k >= self.len() {
            return None;
        }
        let at = self.first.wrapping_add(k as u32) as usize & (SAMPLES - 1);
        let [a, b, c, d] = self.memory.samples.get(at)?.each_ref().map(|word| word.load(Ordering::Relaxed));
        Some(Sample {
            count: EncoderCount(a as u16),
            duty: (a >> 16) as u16 as i16,
            current: CurrentCode(b as i32),
            rate: f32::from_bits(c),
            command: d as i32,
        })
    }
}
