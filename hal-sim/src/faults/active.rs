//! The active faults: queried at each tick, updated only when one starts or ends.

use super::{Fault, FaultKind, Faults};
use stand_firmware::board::CONTROL_HZ;

/// The active faults.
#[derive(Clone, Copy, Debug)]
pub struct ActiveFaults {
    faults: Faults,
    /// The active kinds, one bit each.
    now: u32,
    /// Tick of the next change.
    changes_at: u64,
    tick: u64,
}

impl ActiveFaults {
    /// The faults of this list, from tick 0.
    pub fn new(faults: Faults) -> Self {
        Self { faults, now: 0, changes_at: 0, tick: 0 }
    }

    /// Starts tick `n`. Returns whether a fault has started or ended.
    #[inline]
    pub fn begin(&mut self, n: u64) -> bool {
        self.tick = n;
        n >= self.changes_at && self.look()
    }

    /// Whether a fault of this kind is active.
    #[inline]
    pub fn is_active(&self, kind: FaultKind) -> bool {
        self.now & kind.bit() != 0
    }

    /// Whether any fault is active.
    #[inline]
    pub fn any(&self) -> bool {
        self.now != 0
    }

    /// Magnitude of the active fault of this kind; 0 where there is none.
    pub fn magnitude(&self, kind: FaultKind) -> f64 {
        let at_s = self.at_s();
        self.faults.iter().filter(|fault| fault.kind == kind && fault.is_at(at_s)).map(Fault::magnitude).next_back().unwrap_or(0.0)
    }

    /// Adds a fault that starts now. `None` where the list is full.
    pub fn inject(&mut self, kind: FaultKind, for_s: f64, size: Option<f64>) -> Option<()> {
        self.changes_at = 0;
        self.faults.push(Fault { kind, from_s: self.at_s(), for_s, size })
    }

    /// Removes all faults of a kind.
    pub fn clear(&mut self, kind: FaultKind) {
        self.changes_at = 0;
        self.faults.remove(kind);
    }

    /// The list.
    pub fn faults(&self) -> &Faults {
        &self.faults
    }

    /// The middle of the tick, so that a fault of one tick lasts one tick regardless of rounding.
    fn at_s(&self) -> f64 {
        (self.tick as f64 + 0.5) / CONTROL_HZ as f64
    }

    #[cold]
    fn look(&mut self) -> bool {
        let at_s = self.at_s();
        let before = self.now;
        self.now = self.faults.iter().filter(|fault| fault.is_at(at_s)).fold(0, |set, fault| set | fault.kind.bit());
        let changes = self.faults.iter().flat_map(|fault| [fault.from_s, fault.until_s()]);
        let next_s = changes.filter(|change| *change > at_s).fold(f64::INFINITY, f64::min);
        // The cast saturates: never.
        self.changes_at = ((next_s * CONTROL_HZ as f64 - 0.5).ceil() as u64).max(self.tick + 1);
        self.now != before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_active_from_its_start_tick_to_its_end_tick() {
        let faults = [Fault::new(FaultKind::LostTicks, 0.01, 1e-4), Fault::new(FaultKind::SupplyDip, 0.005, 0.02).with_magnitude(3.0)];
        let mut broken = ActiveFaults::new(Faults::of(faults).unwrap());
        let mut lost = Vec::new();
        let mut dips = Vec::new();
        for n in 0..1000 {
            broken.begin(n);
            lost.extend(broken.is_active(FaultKind::LostTicks).then_some(n));
            dips.extend(broken.is_active(FaultKind::SupplyDip).then_some(n));
            assert_eq!(broken.magnitude(FaultKind::SupplyDip), if broken.is_active(FaultKind::SupplyDip) { 3.0 } else { 0.0 });
        }
        assert_eq!(lost, [100]);
        assert_eq!(dips, (50..250).collect::<Vec<_>>());
    }

    #[test]
    fn a_fault_of_three_ticks_ends_at_any_start_time() {
        let mut broken = ActiveFaults::new(Faults::default());
        for begin in (0..200_000).step_by(97) {
            broken.begin(begin);
            broken.inject(FaultKind::LostTicks, 3e-4, None).unwrap();
            let lost = (begin + 1..begin + 10).filter(|n| {
                broken.begin(*n);
                broken.is_active(FaultKind::LostTicks)
            });
            let lost = lost.count();
            // The active tick is the first of three; a fourth by rounding.
            assert!((2..=3).contains(&lost), "{lost} ticks from {begin} on");
            assert!(!broken.any(), "still active, start {begin}");
            broken.clear(FaultKind::LostTicks);
        }
    }

    #[test]
    fn a_test_injects_and_clears_faults() {
        let mut broken = ActiveFaults::new(Faults::default());
        broken.begin(0);
        broken.begin(77);
        assert!(!broken.any());
        broken.inject(FaultKind::IndexOff, f64::INFINITY, None).unwrap();
        assert!(broken.begin(78) && broken.is_active(FaultKind::IndexOff));
        assert!(!broken.begin(1_000_000) && broken.is_active(FaultKind::IndexOff));
        broken.clear(FaultKind::IndexOff);
        assert!(broken.begin(1_000_001) && !broken.any());
    }
}
