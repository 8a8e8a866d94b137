//! Whole turns by the index pulse and the crystal: the reference that owes nothing to the speed loop or to the encoder's lines.
//!
//! In: at each look the own counter, and the index edge that was caught since the last. Out: [`Turn`]s. A turn is whole if the platform
//! went from the index to the index without turning back, so that both edges are the same side of the same pulse; what lies between is
//! the time of one turn to a step of the edge timer (11 ns), however the disc's lines are spaced.

use crate::board::{EdgeTime, Hardware};
use core::f64::consts::TAU;

/// How far the counter may step back before the platform is taken to have turned back, counts: a line at rest on its edge shakes by one.
const SHAKES_COUNTS: i64 = 2;
/// How far the counter may be off over a turn before the two edges are no neighbours, as a part of the turn.
const MISCOUNT: f64 = 0.05;
/// Most turns of a mean.
const KEPT: usize = 64;

/// One whole turn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turn {
    /// Its duration, s.
    pub seconds: f64,
    /// When it was over.
    pub at: EdgeTime,
    /// Counts of the own encoder within it: ± the counts of a turn, unless the counter lost some.
    pub counts: i64,
    /// Number of the turn among those that followed each other without a break; the first is 1.
    pub number: u32,
}

impl Turn {
    /// Its mean rate, rad/s.
    pub fn rate_rad_s(&self) -> f64 {
        TAU / self.seconds * if self.counts < 0 { -1.0 } else { 1.0 }
    }
}

/// Where the index was met.
#[derive(Clone, Copy, Debug)]
struct Met {
    counts: i64,
    at: EdgeTime,
    /// The turn that ended here.
    number: u32,
    /// Which way that turn went; 0 if none ended here.
    way: i64,
}

/// Watches the index.
#[derive(Clone, Copy, Debug)]
pub struct TurnTimer {
    hardware: Hardware,
    met: Option<Met>,
    /// Furthest from the last edge, counts, and whether it came back since.
    furthest: i64,
    turned_back: bool,
    newest: Option<Turn>,
}

impl TurnTimer {
    /// A timer for this encoder.
    pub fn new(hardware: Hardware) -> Self {
        Self { hardware, met: None, furthest: 0, turned_back: false, newest: None }
    }

    /// Takes a look: the own counter, and counter and time of the index edge since the last look. Returns the newest whole turn.
    pub fn look(&mut self, counts: i64, index: Option<(i64, EdgeTime)>) -> Option<Turn> {
        if let Some((at_index, at)) = index {
            self.follow(at_index);
            self.meet(at_index, at);
        }
        self.follow(counts);
        self.newest
    }

    fn follow(&mut self, counts: i64) {
        let Some(met) = self.met else { return };
        let from = counts.wrapping_sub(met.counts);
        if from.saturating_mul(self.furthest) >= 0 && from.saturating_abs() > self.furthest.saturating_abs() {
            self.furthest = from;
        } else if self.furthest.saturating_sub(from).saturating_abs() > SHAKES_COUNTS {
            self.turned_back = true;
        }
    }

    fn meet(&mut self, counts: i64, at: EdgeTime) {
        let mut here = Met { counts, at, number: 0, way: 0 };
        if let Some(before) = self.met {
            let went = counts.wrapping_sub(before.counts);
            let seconds = at.since_s(before.at, &self.hardware);
            let near = libm::fabs(went.saturating_abs() as f64 / self.hardware.counts_per_turn - 1.0) < MISCOUNT;
            if near && !self.turned_back && seconds > 0.0 {
                here.way = went.signum();
                here.number = if before.way == here.way { before.number.saturating_add(1) } else { 1 };
                self.newest = Some(Turn { seconds, at, counts: went, number: here.number });
            }
        }
        self.met = Some(here);
        self.furthest = 0;
        self.turned_back = false;
    }
}

/// What is said of the last turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnReading {
    /// Duration of the last whole turn, s.
    pub turn_s: f64,
    /// Mean rate over the last `turns` turns, rad/s.
    pub rate_rad_s: f64,
    /// Over how many: as many as were asked for, or as there were without a break.
    pub turns: u32,
    /// How long ago the last one ended, s.
    pub age_s: f64,
}

/// The ends of the last turns that followed each other without a break.
#[derive(Clone, Copy, Debug)]
pub struct Turns {
    hardware: Hardware,
    newest: Option<Turn>,
    /// Ends, in steps of the edge timer, in a ring; the next goes to `place`.
    ends: [u64; KEPT],
    place: usize,
    kept: usize,
}

impl Turns {
    /// None yet.
    pub fn new(hardware: Hardware) -> Self {
        Self { hardware, newest: None, ends: [0; KEPT], place: 0, kept: 0 }
    }

    /// Takes the newest turn; true if it was not known yet.
    pub fn take(&mut self, turn: Turn) -> bool {
        if self.newest.is_some_and(|known| known.at == turn.at) {
            return false;
        }
        let follows = turn.number > 1 && self.newest.is_some_and(|known| known.number.saturating_add(1) == turn.number);
        if !follows {
            self.kept = 0;
            let begin = turn.at.0.wrapping_sub(libm::round(turn.seconds * self.hardware.edge_timer_Hz) as u64);
            self.put(begin);
        }
        self.put(turn.at.0);
        self.newest = Some(turn);
        true
    }

    fn put(&mut self, end: u64) {
        if let Some(place) = self.ends.get_mut(self.place) {
            *place = end;
        }
        self.place = if self.place + 1 < KEPT { self.place + 1 } else { 0 };
        self.kept = self.kept.saturating_add(1).min(KEPT);
    }

    /// The last turn and the mean over the last `over` at the time `now_s` since power-on; `None` before the first turn.
    pub fn reading(&self, over: u32, now_s: f64) -> Option<TurnReading> {
        let newest = self.newest?;
        let turns = (over.max(1) as usize).min(self.kept.saturating_sub(1));
        let back = turns.saturating_add(1);
        let place = if self.place >= back { self.place - back } else { self.place.saturating_add(KEPT).saturating_sub(back) };
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
    fn turns_are_timed_from_index_to_index_and_their_mean_is_over_those_that_were_asked() {
        let hardware = Hardware::default();
        let (mut timer, mut turns) = (TurnTimer::new(hardware), Turns::new(hardware));
        assert_eq!(timer.look(-50, None), None);
        assert_eq!(timer.look(10, Some((0, at_s(1.0)))), None, "an edge alone is no turn");
        let mut end_s = 1.0;
        for n in 1..=100_i64 {
            end_s += 0.5 + 1e-3 * n as f64;
            timer.look(n * 20_000 - 9_000, None);
            let turn = timer.look(n * 20_000 + 5, Some((n * 20_000, at_s(end_s)))).unwrap();
            assert!((turn.seconds - (0.5 + 1e-3 * n as f64)).abs() < 3e-8 && turn.number == n as u32);
            assert!(turns.take(turn) && !turns.take(turn));
        }
        let reading = turns.reading(10, end_s + 0.25).unwrap();
        let ten_s: f64 = (91..=100).map(|n| 0.5 + 1e-3 * f64::from(n)).sum();
        assert!((reading.rate_rad_s - 10.0 * TAU / ten_s).abs() < 1e-6, "{reading:?}");
        assert!(reading.turns == 10 && (reading.age_s - 0.25).abs() < 1e-7);
        assert_eq!(turns.reading(1000, end_s).map(|r| r.turns), Some(63), "as many as are kept");
    }

    #[test]
    fn who_turns_back_on_the_way_has_made_no_turn() {
        let mut timer = TurnTimer::new(Hardware::default());
        timer.look(5, Some((0, at_s(1.0))));
        timer.look(12_000, None);
        timer.look(11_999, None);
        assert!(timer.look(20_001, Some((20_000, at_s(2.0)))).is_some(), "a line that shakes is no turning back");
        timer.look(30_000, None);
        timer.look(29_000, None);
        assert_eq!(timer.look(40_010, Some((40_000, at_s(4.0)))).map(|t| t.at), Some(at_s(2.0)), "the last whole turn stays");
        let next = timer.look(60_010, Some((60_000, at_s(5.0)))).unwrap();
        assert_eq!((next.number, next.at), (1, at_s(5.0)), "after a break it counts anew");
        // Over the index and back through it: the same edge twice is no turn, and neither is the way back.
        timer.look(59_990, Some((60_000, at_s(5.5))));
        assert_eq!(timer.look(39_990, Some((40_000, at_s(6.5)))).map(|t| (t.counts, t.number)), Some((-20_000, 1)));
        assert!(timer.look(39_990, None).unwrap().rate_rad_s() < 0.0);
    }
}
