//! The shared part of a capture.

use super::{Recorder, Sample};
use crate::board::{CurrentCode, EncoderCount};
use crate::status::Fault;
use core::sync::atomic::{AtomicU32, Ordering};

/// Samples that the memory holds: 0.2 s of ticks.
pub const SAMPLES: usize = 2048;
/// Words of a sample.
const WORDS: usize = 4;
/// Set in `request` beside a part in samples: begin anew.
const ARM: u32 = 1 << 31;
/// Set in `request`: trigger now.
const TRIGGER: u32 = 1 << 30;

/// 32 KiB of samples, and how they are to be read. `Sync`, and never torn: it is read while nobody writes.
pub struct Memory {
    samples: [[AtomicU32; WORDS]; SAMPLES],
    /// What the tasks ask for.
    pub(super) request: AtomicU32,
    /// 1 once the rest is valid.
    frozen: AtomicU32,
    /// Ring index of the oldest sample, how many there are, and which of them the trigger is.
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

    /// The interrupt's end, with `before` samples before the trigger; one for each memory.
    pub fn recorder(&self, before: usize) -> Recorder<'_> {
        Recorder::new(self, clamped(before))
    }

    /// Begins anew, with `before` samples before the trigger (at most all but one); what was recorded is gone.
    pub fn arm(&self, before: usize) {
        self.frozen.store(0, Ordering::Release);
        self.request.store(ARM | clamped(before), Ordering::Release);
    }

    /// Triggers now; nothing happens where it has been triggered already.
    pub fn trigger(&self) {
        self.request.fetch_or(TRIGGER, Ordering::AcqRel);
    }

    /// What was recorded, once it is frozen.
    pub fn record(&self) -> Option<Record<'_>> {
        (self.frozen.load(Ordering::Acquire) == 1).then(|| Record {
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

    /// What the tasks ask for since the last call: to begin anew with so many samples before, to trigger.
    #[inline]
    pub(super) fn asked(&self) -> (Option<u32>, bool) {
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

/// At least one sample lies after the trigger's own.
fn clamped(before: usize) -> u32 {
    before.min(SAMPLES - 2) as u32
}

/// A frozen memory, oldest sample first.
#[derive(Clone, Copy)]
pub struct Record<'a> {
    memory: &'a Memory,
    first: u32,
    len: u32,
    trigger: u32,
    fault: Fault,
    tick: u32,
}

impl Record<'_> {
    /// How many samples there are, a tick each.
    pub fn len(&self) -> usize {
        self.len as usize
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Which sample is the trigger's tick.
    pub fn trigger(&self) -> usize {
        self.trigger as usize
    }

    /// The fault that triggered it; `None` where it was asked for.
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// Number of the trigger's tick, low word.
    pub fn trigger_tick(&self) -> u32 {
        self.tick
    }

    /// Sample `k`, from the oldest on; `None` behind the last.
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
