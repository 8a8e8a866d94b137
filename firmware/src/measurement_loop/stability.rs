//! Rate stability: standard deviation of the mean rate over windows of 1°, 10° and 360°.
//!
//! In: captured times of the encoder's edges, and whole turns by the index. Out: mean and 1 σ of the rate over consecutive windows since
//! the last restart, in constant memory. Between the edges of two rows (1 ms) the rate is taken as constant, which only shifts the windows'
//! boundaries. The small windows contain the disc's errors (a line misplaced by 1 % of its width is 0.02 % of 1°), the window of a whole
//! turn does not. A reversal restarts all windows.

use super::statistics::Statistics;
use super::turn::Turn;
use crate::board::{EdgeTime, Hardware};
use core::f64::consts::TAU;

/// Widths of the windows, degrees.
pub const WINDOWS_DEG: [f64; 3] = [1.0, 10.0, 360.0];
/// Most windows between two rows: more are a lost reading.
const MAX_WINDOWS_PER_ROW: u32 = 64;

/// Statistics of one window width.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StabilityReading {
    /// Width, degrees.
    pub window_deg: f64,
    /// Mean rate, rad/s.
    pub rate_rad_s: f64,
    /// Standard deviation of the rate over such windows, rad/s; `None` before the second window.
    pub sigma_rad_s: Option<f64>,
    /// Number of windows.
    pub windows: u32,
}

impl StabilityReading {
    /// Standard deviation relative to the rate.
    pub fn relative(&self) -> Option<f64> {
        self.sigma_rad_s.map(|sigma| sigma / libm::fabs(self.rate_rad_s))
    }
}

/// A position and its time: counts, and steps of the edge timer.
#[derive(Clone, Copy, Debug)]
struct PositionTime {
    counts: f64,
    steps: f64,
}

/// Windows of one width.
#[derive(Clone, Copy, Debug)]
struct Windows {
    width_counts: f64,
    /// Beginning of the current window.
    begin: Option<PositionTime>,
    rates: Statistics,
}

impl Windows {
    fn advance(&mut self, from: PositionTime, to: PositionTime, rad_steps_s: f64) {
        let way = if to.counts >= from.counts { 1.0 } else { -1.0 };
        let mut begin = *self.begin.get_or_insert(from);
        let mut ended = 0;
        while (to.counts - begin.counts) * way >= self.width_counts {
            let counts = begin.counts + way * self.width_counts;
            let part = (counts - from.counts) / (to.counts - from.counts);
            let end = PositionTime { counts, steps: from.steps + part * (to.steps - from.steps) };
            let steps = end.steps - begin.steps;
            if steps > 0.0 {
                self.rates.add(way * self.width_counts / steps * rad_steps_s);
            }
            begin = end;
            ended += 1;
            if ended > MAX_WINDOWS_PER_ROW {
                begin = to;
                break;
            }
        }
        self.begin = Some(begin);
    }
}

/// All windows.
#[derive(Clone, Copy, Debug)]
pub struct Stability {
    /// rad/s for one count per step of the edge timer.
    rad_steps_s: f64,
    last: Option<(i64, EdgeTime)>,
    /// Direction; 0 if unknown.
    way: i64,
    place: Option<PositionTime>,
    within_turn: [Windows; 2],
    turns: Statistics,
    /// End of the last turn used; turns before the restart are ignored.
    turn: Option<EdgeTime>,
    since: Option<EdgeTime>,
}

impl Stability {
    /// No edge yet.
    pub fn new(hardware: &Hardware) -> Self {
        let [one, ten, _] = WINDOWS_DEG;
        let windows =
            |degrees: f64| Windows { width_counts: degrees / 360.0 * hardware.counts_per_turn, begin: None, rates: Statistics::default() };
        Self {
            rad_steps_s: TAU / hardware.counts_per_turn * hardware.edge_timer_Hz,
            last: None,
            way: 0,
            place: None,
            within_turn: [windows(one), windows(ten)],
            turns: Statistics::default(),
            turn: None,
            since: None,
        }
    }

    /// Forgets all windows, for a new rate.
    pub fn restart(&mut self) {
        self.place = None;
        for windows in &mut self.within_turn {
            windows.begin = None;
            windows.rates = Statistics::default();
        }
        self.turns = Statistics::default();
        self.since = self.last.map(|(_, at)| at);
    }

    /// The newest edge: the counter right after it, and its time.
    pub fn edge(&mut self, counts: i64, at: EdgeTime) {
        let Some((before, then)) = self.last else {
            self.last = Some((counts, at));
            self.since = Some(at);
            return;
        };
        let way = counts.wrapping_sub(before).signum();
        if way == 0 || at <= then {
            // No new edge, or jitter on one edge.
            return;
        }
        self.last = Some((counts, at));
        if way != self.way {
            self.way = way;
            self.restart();
        }
        // Going up, the edge lies at the count that follows it; going down, one above.
        let to = PositionTime { counts: counts as f64 + if way < 0 { 1.0 } else { 0.0 }, steps: at.0 as f64 };
        if let Some(from) = self.place {
            for windows in &mut self.within_turn {
                windows.advance(from, to, self.rad_steps_s);
            }
        }
        self.place = Some(to);
    }

    /// The newest whole turn.
    pub fn turn(&mut self, turn: &Turn, hardware: &Hardware) {
        let is_complete = self.since.is_some_and(|since| turn.at.since_s(since, hardware) >= turn.seconds);
        if self.turn != Some(turn.at) && is_complete {
            self.turns.add(turn.rate_rad_s());
        }
        self.turn = Some(turn.at);
    }

    /// The statistics of each width, in the sequence of [`WINDOWS_DEG`].
    pub fn readings(&self) -> [StabilityReading; 3] {
        let [one, ten] = &self.within_turn;
        let [a, b, c] = WINDOWS_DEG;
        [(a, &one.rates), (b, &ten.rates), (c, &self.turns)].map(|(window_deg, rates)| StabilityReading {
            window_deg,
            rate_rad_s: rates.mean,
            sigma_rad_s: rates.sigma(),
            windows: rates.count,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Feeds the motion `angle(t)` in counts, read each millisecond; the times of the edges are found by bisection.
    fn feed(stability: &mut Stability, hardware: &Hardware, rows: std::ops::Range<u32>, angle: impl Fn(f64) -> f64) {
        for k in rows {
            let t = f64::from(k) * 1e-3;
            let counts = angle(t).floor();
            // Rising angles only: the edge is where the angle passed `counts`.
            let (mut low, mut high) = (0.0, t);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if angle(middle) < counts { low = middle } else { high = middle }
            }
            stability.edge(counts as i64, EdgeTime((high * hardware.edge_timer_Hz) as u64));
        }
    }

    #[test]
    fn a_constant_rate_is_stable_to_the_timer_and_ripple_has_its_amplitude() {
        let hardware = Hardware::default();
        let rate_counts = 0.5 / hardware.rad_per_count();
        let mut even = Stability::new(&hardware);
        feed(&mut even, &hardware, 1..20_000, |t| rate_counts * t);
        let [one, ten, whole] = even.readings();
        // Each end of 35 ms is known to 11 ns: 0.2 ppm.
        assert!(one.windows > 500 && one.relative().unwrap() < 0.4e-6 && (one.rate_rad_s - 0.5).abs() < 1e-8, "{one:?}");
        assert!(ten.windows > 50 && ten.relative().unwrap() < 0.1e-6 && whole.windows == 0, "{ten:?}");
        // A ripple of 0.1 % of the rate, one period in 40°: a window of 1° keeps sinc(1/40) of it, one of 10° sinc(1/4) = 0.900.
        let (depth, per_count) = (1e-3, TAU * 9.0 / hardware.counts_per_turn);
        let mut rippled = Stability::new(&hardware);
        feed(&mut rippled, &hardware, 1..25_134, |t| rate_counts * t + depth / per_count * (per_count * rate_counts * t).sin());
        let [one, ten, _] = rippled.readings();
        let rms = depth / 2_f64.sqrt();
        assert!((one.relative().unwrap() / rms - 0.999).abs() < 5e-3, "{}", one.relative().unwrap() / rms);
        assert!((ten.relative().unwrap() / rms - 0.900).abs() < 2e-2, "{}", ten.relative().unwrap() / rms);
        rippled.restart();
        assert_eq!(rippled.readings().map(|r| r.windows), [0; 3]);
    }

    #[test]
    fn a_reversal_restarts_and_earlier_turns_are_ignored() {
        let hardware = Hardware::default();
        let mut stability = Stability::new(&hardware);
        feed(&mut stability, &hardware, 1..2_000, |t| 3_000.0 * t);
        assert!(stability.readings()[0].windows > 90);
        stability.edge(5_900, EdgeTime(180_100_000));
        assert_eq!(stability.readings()[0].windows, 0);
        let steps = |seconds: f64| EdgeTime((seconds * hardware.edge_timer_Hz) as u64);
        let turn = |at_s: f64, seconds: f64| Turn { seconds, at: steps(at_s), counts: -20_000, number: 1 };
        stability.turn(&turn(2.5, 1.0), &hardware);
        assert_eq!(stability.readings()[2].windows, 0, "it began before the reversal");
        stability.turn(&turn(3.5, 1.0), &hardware);
        stability.turn(&turn(3.5, 1.0), &hardware);
        stability.turn(&turn(4.5, 1.0 + 1e-6), &hardware);
        let whole = stability.readings()[2];
        assert!(whole.windows == 2 && (whole.relative().unwrap() - 1e-6 / 2_f64.sqrt()).abs() < 1e-9, "{whole:?}");
        assert!(whole.rate_rad_s < 0.0);
    }
}
