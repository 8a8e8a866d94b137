//! Recorder: the interrupt's end of a capture.

use super::memory::clamped;
use super::{Memory, SAMPLES, Sample};
use crate::status::Fault;

/// Writes the samples.
pub struct Recorder<'a> {
    memory: &'a Memory,
    /// Position of the next sample, and the position at which recording ends (never reached before a trigger).
    next: u32,
    end: u32,
    triggered: bool,
    /// Position of the first sample since it was armed.
    armed_at: u32,
    before: u32,
    triggered_at: u32,
    fault: Fault,
    tick: u32,
    /// The latched fault at the last update.
    latched: Fault,
    frozen: bool,
}

impl Memory {
    /// The interrupt's end: it keeps `before` samples of what comes before a trigger.
    pub fn recorder(&self, before: usize) -> Recorder<'_> {
        Recorder::new(self, clamped(before))
    }
}

impl<'a> Recorder<'a> {
    pub(super) fn new(memory: &'a Memory, before: u32) -> Self {
        Self {
            memory,
            next: 0,
            end: u32::MAX,
            triggered: false,
            armed_at: 0,
            before,
            triggered_at: 0,
            fault: Fault::None,
            tick: 0,
            latched: Fault::None,
            frozen: false,
        }
    }

    /// Records a sample, each tick.
    #[inline]
    pub fn record(&mut self, sample: &Sample) {
        if self.next != self.end {
            self.memory.write(self.next, sample);
            self.next = self.next.wrapping_add(1);
        }
    }

    /// Each tick, after [`Recorder::record`]: requests of the tasks, and the latched fault with its tick.
    #[inline]
    pub fn update(&mut self, tick: u32, (fault, fault_tick): (Fault, u32)) {
        let (arm, trigger) = self.memory.take_request();
        if arm.is_some() || fault != self.latched {
            self.change(arm, fault, fault_tick, tick);
        }
        if trigger && !self.triggered {
            self.trigger(0, Fault::None, tick);
        }
        if !self.triggered {
            self.end = self.next.wrapping_sub(1);
            if self.next.wrapping_sub(self.armed_at) > SAMPLES as u32 {
                // The ring is full; kept so that the difference does not wrap.
                self.armed_at = self.next.wrapping_sub(SAMPLES as u32);
            }
        } else if self.next == self.end && !self.frozen {
            self.frozen = true;
            let len = self.next.wrapping_sub(self.armed_at).min(SAMPLES as u32);
            self.memory.freeze(self.next, len, self.triggered_at, self.fault, self.tick);
        }
    }

    #[cold]
    #[inline(never)]
    fn change(&mut self, arm: Option<u32>, fault: Fault, fault_tick: u32, tick: u32) {
        let cleared = fault == Fault::None && self.latched != Fault::None;
        if let Some(before) = arm.or(cleared.then_some(self.before)) {
            self.memory.thaw();
            let next = self.next;
            *self = Self { next, end: next.wrapping_sub(1), armed_at: next, latched: self.latched, ..Self::new(self.memory, before) };
        }
        let is_new = fault != self.latched && fault != Fault::None;
        self.latched = fault;
        if is_new && !self.triggered {
            self.trigger(tick.wrapping_sub(fault_tick), fault, fault_tick);
        }
    }

    /// The trigger was `ago` ticks before the newest sample.
    #[cold]
    #[inline(never)]
    fn trigger(&mut self, ago: u32, fault: Fault, tick: u32) {
        self.triggered_at = self.next.wrapping_sub(1).wrapping_sub(ago);
        self.triggered = true;
        self.end = self.next.wrapping_add((SAMPLES as u32).wrapping_sub(self.before).wrapping_sub(1).saturating_sub(ago).max(1));
        self.fault = fault;
        self.tick = tick;
    }
}
