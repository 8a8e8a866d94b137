//! Whole turns by the index pulse and the crystal: a reference independent of the speed loop and of the encoder's lines.
//!
//! In, each row: the counter, and the index edge captured since the last row. Out: [`Turn`]s. A turn is whole if the platform moved from
//! index to index without a reversal, so that both edges are the same side of the same pulse; its duration is exact to a step of the edge
//! timer (11 ns), whatever the spacing of the lines.

use crate::board::{EdgeTime, Hardware};
use core::f64::consts::TAU;

/// Steps back that are not a reversal, counts: an edge at rest jitters by one.
const JITTER_COUNTS: i64 = 2;
/// Count error over a turn, as a fraction, up to which two index edges are consecutive.
const MAX_COUNT_ERROR: f64 = 0.05;
/// Stored ends of turns.
const MAX_TURNS: usize = 64;

/// One whole turn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turn {
    /// Duration, s.
    pub seconds: f64,
    /// Its end.
    pub at: EdgeTime,
    /// Counts within it: ± the counts of a turn, unless the counter lost some.
    pub counts: i64,
    /// Number in an uninterrupted sequence of turns; the first is 1.
    pub number: u32,
}

impl Turn {
    /// Mean rate, rad/s.
    pub fn rate_rad_s(&self) -> f64 {
        TAU / self.seconds * if self.counts < 0 { -1.0 } else { 1.0 }
    }
}

/// A passage of the index.
#[derive(Clone, Copy, Debug)]
struct IndexPassage {
    counts: i64,
    at: EdgeTime,
    /// Number of the turn that ended here.
    number: u32,
    /// Direction of that turn; 0 if none ended here.
    direction: i64,
}

/// Finds whole turns.
#[derive(Clone, Copy, Debug)]
pub struct TurnTimer {
    hardware: Hardware,
    last: Option<IndexPassage>,
    /// Largest distance from the last passage, counts, and whether the platform has reversed since.
    max_distance: i64,
    reversed: bool,
    newest: Option<Turn>,
}

impl TurnTimer {
    /// A timer for this encoder.
    pub fn new(hardware: Hardware) -> Self {
        Self { hardware, last: None, max_distance: 0, reversed: false, newest: None }
    }

    /// The counter, and counter and time of an index edge since the last call. Returns the newest whole turn.
    pub fn update(&mut self, counts: i64, index: Option<(i64, EdgeTime)>) -> Option<Turn> {
        if let Some((at_index, at)) = index {
            self.follow(at_index);
            self.pass_index(at_index, at);
        }
        self.follow(counts);
        self.newest
    }

    fn follow(&mut self, counts: i64) {
        let Some(last) = self.last else { return };
        let from = counts.wrapping_sub(last.counts);
        if from.saturating_mul(self.max_distance) >= 0 && from.saturating_abs() > self.max_distance.saturating_abs() {
            self.max_distance = from;
        } else if self.max_distance.saturating_sub(from).saturating_abs() > JITTER_COUNTS {
            self.reversed = true;
        }
    }

    fn pass_index(&mut self, counts: i64, at: EdgeTime) {
        let mut here = IndexPassage { counts, at, number: 0, direction: 0 };
        if let Some(before) = self.last {
            let moved = counts.wrapping_sub(before.counts);
            let seconds = at.since_s(before.at, &self.hardware);
            let is_one_turn = libm::fabs(moved.saturating_abs() as f64 / self.hardware.counts_per_turn - 1.0) < MAX_COUNT_ERROR;
            if is_one_turn && !self.reversed && seconds > 0.0 {
                here.direction = moved.signum();
                here.number = if before.direction == here.direction { before.number.saturating_add(1) } else { 1 };
                self.newest = Some(Turn { seconds, at, counts: moved, number: here.number });
            }
        }
        self.last = Some(here);
        self.max_distance = 0;
        self.reversed = false;
    }
}

/// The last turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnReading {
    /// Duration of the last whole turn, s.
    pub turn_s: f64,
    /// Mean rate over the last `turns` turns, rad/s.
    pub rate_rad_s: f64,
    /// Number of turns of the mean: as requested, or as many as are stored without a break.
    pub turns: u32,
    /// Time since the end of the last turn, s.
    pub age_s: f64,
}

/// Ends of the last turns of an uninterrupted sequence.
#[derive(Clone, Copy, Debug)]
pub struct Turns {
    hardware: Hardware,
    newest: Option<Turn>,
    /// Ring of ends, in steps of the edge timer; the next one goes to `next`.
    ends: [u64; MAX_TURNS],
    next: usize,
    count: usize,
}

impl Turns {
    /// No turn yet.
    pub fn new(hardware: Hardware) -> Self {
        Self { hardware, newest: None, ends: [0; MAX_TURNS], next: 0, count: 0 }
    }

    /// The newest turn; returns whether it is new.
    pub fn update(&mut self, turn: Turn) -> bool {
        if self.newest.is_some_and(|known| known.at == turn.at) {
            return false;
        }
        let follows = turn.number > 1 && self.newest.is_some_and(|known| known.number.saturating_add(1) == turn.number);
        if !follows {
            self.count = 0;
            let begin = turn.at.0.wrapping_sub(libm::round(turn.seconds * self.hardware.edge_timer_Hz) as u64);
            self.put(begin);
        }
        self.put(turn.at.0);
        self.newest = Some(turn);
        true
    }

    fn put(&mut self, end: u64) {
        if let Some(place) = self.ends.get_mut(self.next) {
            *place = end;
        }
        self.next = if self.next + 1 < MAX_TURNS { self.next + 1 } else { 0 };
        self.count = self.count.saturating_add(1).min(MAX_TURNS);
    }

    /// The last turn, and the mean rate over the last `over` turns, at the time `now_s` since power-on; `None` before the first turn.
    pub fn reading(&self, over: u32, now_s: f64) -> Option<TurnReading> {
        let newest = self.newest?;
        let turns = (over.max(1) as usize).min(self.count.saturating_sub(1));
        let back = turns.saturating_add(1);
        let place = if self.next >= back { self.next - back } else { self.next.saturating_add(MAX_TURNS).saturating_sub(back) };
        let begin = EdgeTime(*self.ends.get(place)?);
        let seconds = newest.at.since_s(begin, &self.hardware);
        Some(TurnReading {
            turn_s: newest.seconds,
            rate_rad_s: turns as f64 * TAU / seconds * if newest.counts < 0 { -1.0 } else { 1.0 },
            turns: turns as u32,
            age_s: now_s - newest.at.0 as f64 / self.hardware.edge_timer_Hz,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_s(seconds: f64) -> EdgeTime {
        EdgeTime((seconds * Hardware::default().edge_timer_Hz).round() as u64)
    }

    #[test]
    fn turns_are_timed_by_the_index_and_averaged_over_the_requested_number() {
        let hardware = Hardware::default();
        let (mut timer, mut turns) = (TurnTimer::new(hardware), Turns::new(hardware));
        assert_eq!(timer.update(-50, None), None);
        assert_eq!(timer.update(10, Some((0, at_s(1.0)))), None, "one edge is no turn");
        let mut end_s = 1.0;
        for n in 1..=100_i64 {
            end_s += 0.5 + 1e-3 * n as f64;
            timer.update(n * 20_000 - 9_000, None);
            let turn = timer.update(n * 20_000 + 5, Some((n * 20_000, at_s(end_s)))).unwrap();
            assert!((turn.seconds - (0.5 + 1e-3 * n as f64)).abs() < 3e-8 && turn.number == n as u32);
            assert!(turns.update(turn) && !turns.update(turn));
        }
        let reading = turns.reading(10, end_s + 0.25).unwrap();
        let ten_s: f64 = (91..=100).map(|n| 0.5 + 1e-3 * f64::from(n)).sum();
        assert!((reading.rate_rad_s - 10.0 * TAU / ten_s).abs() < 1e-6, "{reading:?}");
        assert!(reading.turns == 10 && (reading.age_s - 0.25).abs() < 1e-7);
        assert_eq!(turns.reading(1000, end_s).map(|r| r.turns), Some(63), "as many as are stored");
    }

    #[test]
    fn a_reversal_interrupts_a_turn() {
        let mut timer = TurnTimer::new(Hardware::default());
        timer.update(5, Some((0, at_s(1.0))));
        timer.update(12_000, None);
        timer.update(11_999, None);
        assert!(timer.update(20_001, Some((20_000, at_s(2.0)))).is_some(), "jitter is no reversal");
        timer.update(30_000, None);
        timer.update(29_000, None);
        assert_eq!(timer.update(40_010, Some((40_000, at_s(4.0)))).map(|t| t.at), Some(at_s(2.0)), "the last whole turn stays");
        let next = timer.update(60_010, Some((60_000, at_s(5.0)))).unwrap();
        assert_eq!((next.number, next.at), (1, at_s(5.0)), "after a break the sequence restarts");
        // Back through the index: the same edge twice is no turn.
        timer.update(59_990, Some((60_000, at_s(5.5))));
        assert_eq!(timer.update(39_990, Some((40_000, at_s(6.5)))).map(|t| (t.counts, t.number)), Some((-20_000, 1)));
        assert!(timer.update(39_990, None).unwrap().rate_rad_s() < 0.0);
    }
}
