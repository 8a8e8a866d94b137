//! The index of the encoder: a pulse once per turn that captures a counter and the edge timer.
//!
//! The pulse is one count wide (as channel I of the HEDS-9040), the first count of the turn, so that both directions capture the same
//! count; the two ends of the pulse are one count apart, and so are the positions at which it begins. The bench checks once per tick; at
//! most one pulse occurs in between, because no stand rotates a whole turn per tick.

use super::task_edge::Passed;
use stand_firmware::board::{Edge, Hardware};

/// Detects the index.
#[derive(Clone, Copy, Debug)]
pub struct Index {
    counts_per_turn: i64,
    /// Last count, relative to the first count of its turn.
    within: i64,
    last: i64,
}

impl Index {
    /// The index of the encoder of this hardware, at the count `count`.
    pub fn new(hardware: &Hardware, count: i64) -> Self {
        let counts_per_turn = (hardware.counts_per_turn + 0.5) as i64;
        Self { counts_per_turn, within: count.rem_euclid(counts_per_turn), last: count }
    }

    /// The disc has moved to `count` as described by `passed`; returns the capture if the pulse began.
    #[inline]
    pub fn pass(&mut self, count: i64, passed: &Passed) -> Option<Edge> {
        let before = self.within;
        let mut now = before + count - self.last;
        self.last = count;
        let captured = if now >= self.counts_per_turn {
            now -= self.counts_per_turn;
            Some(count - now)
        } else {
            let at = count - now;
            if now < 0 {
                now += self.counts_per_turn;
            }
            (before > 0 && at >= count).then_some(at)
        };
        self.within = now;
        captured.map(|captured| passed.edge(captured))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peripherals::TaskEdge;
    use stand_firmware::board::EncoderCount;

    #[test]
    fn the_pulse_captures_one_count_from_both_sides_and_not_at_power_on() {
        let hardware = Hardware::default();
        let passed = TaskEdge::new(&hardware, 0.5).pass(0.5, 0, 1);
        let pass = |index: &mut Index, count: i64| index.pass(count, &passed).map(|edge| edge.count);
        let mut index = Index::new(&hardware, 0);
        assert_eq!(pass(&mut index, 5), None, "in the pulse at power-on: no capture");
        assert_eq!(pass(&mut index, -3), Some(EncoderCount(0)), "backwards through it");
        assert_eq!(pass(&mut index, 2), Some(EncoderCount(0)), "and forwards again");
        assert_eq!(pass(&mut index, 0), Some(EncoderCount(0)), "backwards into it");
        assert_eq!(pass(&mut index, 3), None, "no capture when the pulse ends");
        assert_eq!(pass(&mut index, 19_999), None);
        assert_eq!(pass(&mut index, 20_001), Some(EncoderCount(20_000)));
        assert_eq!(pass(&mut index, 19_990), Some(EncoderCount(20_000)));
        assert_eq!(pass(&mut index, 19_000), None);
        let mut behind = Index::new(&hardware, -320);
        assert_eq!(pass(&mut behind, -2), None);
        assert_eq!(pass(&mut behind, 0), Some(EncoderCount(0)));
    }
}
