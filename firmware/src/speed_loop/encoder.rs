//! Encoder: position between counts and rate, from the times of the edges.
//!
//! In: the counter and the age of its last edge, each tick. Out: the position in counts with the fraction of a count since the last edge,
//! and the rate over the last four milliseconds in which an edge came. At slow rates these are four edges, one line of the disc, so that
//! the phase error between the two channels cancels. At fast rates they are two captured times 4 ms apart, resolved to 11 ns.
//!
//! The rate is held until the next edge is due; from then on |rate| ≤ 1 count / age. After a reversal no rate is known until the next edge.
//! Times wrap after 47 s; edges older than a quarter of that are forgotten.

use crate::board::EncoderCount;

/// Edges over which the rate is taken; a power of two.
const EDGES: usize = 4;
/// Timer steps without an edge after which the earlier edges are forgotten.
const MAX_AGE: u32 = 1 << 30;

/// One edge: time in timer steps, and the boundary between counts.
#[derive(Clone, Copy, Debug, Default)]
struct Edge {
    at: u32,
    boundary: i32,
}

/// Direction of the last edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Direction {
    #[default]
    Unknown,
    Up,
    Down,
}

/// State of the encoder.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Encoder {
    /// Whole counts from the counter's zero, wrapping.
    pub counts: i32,
    /// The boundary between counts that was crossed last.
    pub boundary: i32,
    /// Timer steps since the last edge, wrapping; held at [`MAX_AGE`].
    pub age: u32,
    direction: Direction,
    /// Rate over the last edges, counts per timer step; 0 if unknown.
    rate_per_step: f32,
    /// Timer steps from edge to edge at this rate.
    steps_per_count: u32,
    next: usize,
    edges: [Edge; EDGES],
}

impl Encoder {
    /// Starts at this count, within half a wrap of zero, with no edge known; `now` is the time of the tick before, in timer steps.
    pub fn start(&mut self, count: EncoderCount, now: u32) {
        let counts = i32::from(count.since(EncoderCount(0)));
        *self = Self { counts, boundary: counts, edges: [Edge { at: now, boundary: counts }; EDGES], ..Self::default() };
    }

    /// Ticks were lost: this many timer steps have passed without a reading.
    pub fn skip(&mut self, steps: u32) {
        self.age = self.age.wrapping_add(steps);
    }

    /// One tick further: the counter, the age of its last edge, the time of the tick and its length, both in timer steps.
    #[inline]
    pub fn update(&mut self, count: EncoderCount, age: u32, now: u32, period: u32) {
        self.age = self.age.wrapping_add(period);
        let step = i32::from(count.since(EncoderCount(self.counts as u16)));
        if step == 0 {
            return;
        }
        self.counts = self.counts.wrapping_add(step);
        self.age = age;
        // Upwards the last edge is the count's lower boundary, downwards the upper one.
        let (direction, boundary) = if step > 0 { (Direction::Up, self.counts) } else { (Direction::Down, self.counts.wrapping_add(1)) };
        self.boundary = boundary;
        if direction != self.direction {
            self.restart(direction, now);
        }
    }

    /// From the boundary to the platform's position now, counts, −1 … 1.
    #[inline]
    pub fn fraction(&self) -> f32 {
        // Signed: an edge between the beginning of the tick and the reading of the counter has a negative age.
        (self.age as i32).min(self.steps_per_count as i32) as f32 * self.rate_per_step
    }

    /// The edges before the last one are not used any more: a new direction, or too old.
    #[cold]
    fn restart(&mut self, direction: Direction, now: u32) {
        self.direction = direction;
        self.rate_per_step = 0.0;
        self.steps_per_count = 0;
        self.edges = [Edge { at: now.wrapping_sub(self.age), boundary: self.boundary }; EDGES];
    }

    /// Once in a millisecond: the rate over the last edges; `now` in timer steps, wrapping.
    #[inline]
    pub fn update_rate(&mut self, now: u32) {
        let edge = Edge { at: now.wrapping_sub(self.age), boundary: self.boundary };
        let last = self.edges.get(self.next.wrapping_sub(1) & (EDGES - 1)).map_or(0, |edge| edge.at);
        if edge.at == last {
            if self.age as i32 > MAX_AGE as i32 {
                self.age = MAX_AGE;
                self.restart(Direction::Unknown, now);
            }
            return;
        }
        let Some(oldest) = self.edges.get_mut(self.next & (EDGES - 1)) else { return };
        let steps = edge.at.wrapping_sub(oldest.at) as i32;
        let counts = edge.boundary.wrapping_sub(oldest.boundary);
        *oldest = edge;
        self.next = self.next.wrapping_add(1);
        // An implausible capture is ignored.
        if steps > 0 && counts != 0 {
            self.rate_per_step = counts as f32 / steps as f32;
            self.steps_per_count = (steps as u32).checked_div(counts.unsigned_abs()).unwrap_or(0);
        }
    }

    /// Rate over the last edges, counts per tick of `period` timer steps; at most as much as the age of the last edge allows.
    #[inline]
    pub fn rate(&self, period: u32) -> f32 {
        let per_step = if self.age as i32 <= self.steps_per_count as i32 {
            self.rate_per_step
        } else if self.rate_per_step == 0.0 {
            0.0
        } else {
            1.0_f32.copysign(self.rate_per_step) / self.age as f32
        };
        per_step * period as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: u32 = 9_000;
    const HZ: f64 = 90e6;
    const CPR: f64 = 20_000.0;

    /// Runs the encoder on a motion `theta` (counts over seconds) and shows its state to `check` at each tick.
    fn run(ticks: u32, theta: impl Fn(f64) -> f64, mut check: impl FnMut(u32, &Encoder)) {
        let mut encoder = Encoder::default();
        encoder.start(EncoderCount(theta(0.0).floor() as i64 as u16), 0);
        let mut last_edge_s = f64::NEG_INFINITY;
        for n in 1..=ticks {
            let (before, now) = (f64::from(n - 1) * 1e-4, f64::from(n) * 1e-4);
            let count = theta(now).floor();
            if theta(before).floor() != count {
                let rising = theta(now) > theta(before);
                let boundary = if rising { count } else { count + 1.0 };
                let (mut lo, mut hi) = (before, now);
                for _ in 0..60 {
                    let mid = 0.5 * (lo + hi);
                    if (theta(mid) >= boundary) == rising { hi = mid } else { lo = mid }
                }
                last_edge_s = hi;
            }
            // The timer captures whole steps.
            let captured = (last_edge_s * HZ).floor();
            let age = ((now * HZ).round() - captured).min(f64::from(u32::MAX)) as u32;
            encoder.update(EncoderCount(count as i64 as u16), age, n.wrapping_mul(PERIOD), PERIOD);
            if n % 10 == 3 {
                encoder.update_rate(n.wrapping_mul(PERIOD));
            }
            check(n, &encoder);
        }
    }

    /// Standard error relative to the rate, after four edges, over phases of the disc to the ticks.
    fn standard_error(deg_s: f64) -> f64 {
        let rate = deg_s / 360.0 * CPR;
        let ticks = ((10.0 / f64::abs(rate) * 1e4) as u32).clamp(400, 30_000_000);
        let (mut sum, mut n) = (0.0, 0_u32);
        for phase in 0..7 {
            let start = f64::from(phase) * 0.137 + 0.01;
            let mut changes = 0;
            let mut last = None;
            run(
                ticks,
                |t| start + rate * t,
                |tick, encoder| {
                    changes += u32::from(last.is_some_and(|last| last != encoder.counts));
                    last = Some(encoder.counts);
                    if changes > 4 && tick % 10 == 3 {
                        let off = f64::from(encoder.rate(PERIOD)) * 1e4 / rate - 1.0;
                        sum += off * off;
                        n += 1;
                    }
                },
            );
        }
        assert!(n > 30, "{deg_s}: {n}");
        (sum / f64::from(n)).sqrt()
    }

    #[test]
    fn standard_error_after_four_edges_is_below_1_percent_and_above_10_deg_s_below_0_1_percent() {
        println!("| rate, °/s | standard error |");
        for rate in [0.1, 0.3, 1.0, 3.0, 10.0, 11.7, 30.0, 55.5, 100.0, 180.0, 181.0, 300.0, 720.0, 1000.0, 1414.0, 2000.0] {
            for sign in [1.0, -1.0] {
                let error = standard_error(sign * rate);
                println!("| {} | {error:.1e} |", sign * rate);
                assert!(error <= if rate >= 10.0 { 1e-3 } else { 1e-2 }, "{rate}: {error}");
            }
        }
    }

    #[test]
    fn position_between_edges_is_known_to_0_01_count() {
        for rate in [5.0, 137.0, 2_000.0, 31_000.0, -5.0, -2_000.0, -31_000.0] {
            let mut worst = 0.0_f64;
            let at = |t: f64| 0.4 + rate * t;
            run((20.0 / f64::abs(rate) * 1e4) as u32 + 400, at, |n, encoder| {
                let t = f64::from(n) * 1e-4;
                if f64::abs(at(t) - at(0.0)) > 6.0 && n > 25 {
                    worst = worst.max((f64::from(encoder.boundary) + f64::from(encoder.fraction()) - at(t)).abs());
                }
            });
            assert!(worst < 0.01, "{rate}: {worst}");
        }
    }

    #[test]
    fn without_edges_the_rate_is_at_most_one_count_per_age() {
        // 0.1 s at 1000 counts/s, then at rest.
        let at = |t: f64| 0.5 + 1_000.0 * t.min(0.1);
        run(200_000, at, |n, encoder| {
            let (rate, since_s) = (f64::from(encoder.rate(PERIOD)) * 1e4, f64::from(n) * 1e-4 - 0.0995);
            if (103..=1_000).contains(&n) {
                assert!((rate / 1_000.0 - 1.0).abs() < 1e-4, "{n}: {rate}");
            } else if n > 1_010 {
                assert!((rate * since_s - 1.0).abs() < 0.02 || (n > 119_000 && rate <= 1.0 / 11.9), "{n}: {rate} after {since_s}");
            }
        });
    }

    #[test]
    fn after_a_reversal_the_rate_is_right_one_edge_later() {
        // Up for 0.05 s, then down at the same rate.
        let at = |t: f64| 0.5 + 3_000.0 * (0.05 - (t - 0.05).abs());
        let mut right = None;
        run(1_000, at, |n, encoder| {
            let rate = f64::from(encoder.rate(PERIOD)) * 1e4;
            assert!((-3_001.0..=3_001.0).contains(&rate));
            if n > 500 && right.is_none() && (rate / -3_000.0 - 1.0).abs() < 1e-3 {
                right = Some(n);
            }
        });
        // An edge each 3.3 ticks: the first one after the turn repeats its boundary, the next millisecond gives the rate.
        assert!(right.is_some_and(|n| n <= 520), "{right:?}");
    }
}
