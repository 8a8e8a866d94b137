//! The interrupt's end of a capture: some fifteen instructions in a tick.

use super::{Memory, SAMPLES, Sample};
use crate::safety::Fault;

/// Writes the samples.
pub struct Recorder<'a> {
    memory: &'a Memory,
    /// Where the next sample goes, round and round.
    next: u32,
    /// Samples until it freezes, and what of them a tick takes: 0 before the trigger.
    left: u32,
    takes: u32,
    /// Samples since it was armed, as seen once in a millisecond.
    armed_at: u32,
    before: u32,
    triggered_at: u32,
    fault: Fault,
    tick: u32,
    /// The fault that was latched at the last look.
    latched: Fault,
    frozen: bool,
}

impl<'a> Recorder<'a> {
    pub(super) fn new(memory: &'a Memory, before: u32) -> Self {
        Self {
            memory,
            next: 0,
            left: 1,
            takes: 0,
            armed_at: 0,
            before,
            triggered_at: 0,
            fault: Fault::None,
            tick: 0,
            latched: Fault::None,
            frozen: false,
        }
    }

    /// In each tick.
    #[inline]
    pub fn take(&mut self, sample: &Sample) {
        if self.left != 0 {
            self.memory.write(self.next, sample);
            self.next = self.next.wrapping_add(1);
            self.left = self.left.wrapping_sub(self.takes);
        }
    }

    /// Once in a millisecond, after [`Recorder::take`] of the tick `tick`: what is asked for, whether a fault has come (and in which tick).
    #[inline]
    pub fn look(&mut self, tick: u32, (fault, fault_tick): (Fault, u32)) {
        let (arm, trigger) = self.memory.asked();
        if arm.is_some() || fault != self.latched {
            self.change(arm, fault, fault_tick, tick);
        }
        if trigger && self.takes == 0 {
            self.trigger(0, Fault::None, tick);
        }
        if self.left == 0 && !self.frozen {
            self.frozen = true;
            let len = self.next.wrapping_sub(self.armed_at).min(SAMPLES as u32);
            self.memory.freeze(self.next, len, self.triggered_at, self.fault, self.tick);
        } else if self.takes == 0 && self.next.wrapping_sub(self.armed_at) > SAMPLES as u32 {
            // Full, and no fuller: so that the difference does not wrap.
            self.armed_at = self.next.wrapping_sub(SAMPLES as u32);
        }
    }

    #[cold]
    #[inline(never)]
    fn change(&mut self, arm: Option<u32>, fault: Fault, fault_tick: u32, tick: u32) {
        let cleared = fault == Fault::None && self.latched != Fault::None;
        if let Some(before) = arm.or(cleared.then_some(self.before)) {
            self.memory.thaw();
            *self = Self { next: self.next, armed_at: self.next, latched: self.latched, ..Self::new(self.memory, before) };
        }
        let came = fault != self.latched && fault != Fault::None;
        self.latched = fault;
        if came && self.takes == 0 {
            self.trigger(tick.wrapping_sub(fault_tick), fault, fault_tick);
        }
    }

    /// The trigger was `ago` ticks before the newest sample.
    #[cold]
    #[inline(never)]
    fn trigger(&mut self, ago: u32, fault: Fault, tick: u32) {
        self.triggered_at = self.next.wrapping_sub(1).wrapping_sub(ago);
        self.takes = 1;
        self.left = (SAMPLES as u32).wrapping_sub(self.before).wrapping_sub(1).saturating_sub(ago).max(1);
        self.fault = fault;
        self.tick = tick;
    }
}
