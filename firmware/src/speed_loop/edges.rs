//! The encoder as time: where the last edge was, when, and the rate between edges.
//!
//! In: the counter and the age of its last edge, each tick. Out: the position in counts with the part of a count since the last edge,
//! and the rate over the last four milliseconds in which an edge came. At slow rates that is four edges, one line of the disc: what the two
//! channels are not exactly square to each other cancels. At fast rates it is 4 ms between two captured times, 11 ns each.
//!
//! Between edges the rate holds for as long as it takes to the next edge; from then on |rate| ≤ 1 count / age. After a reversal
//! nothing is known but that; the first edge that follows it begins anew. Times wrap after 47 s; what is older than a quarter of that is forgotten.

use crate::board::EncoderCount;

/// Edges between which the rate is taken.
const SPAN: usize = 4;
/// Timer steps without an edge after which the edges before are forgotten.
const STALE: u32 = 1 << 30;

/// A way that no edge has.
const UNKNOWN: i32 = 1;

/// One edge: time in timer steps, and the boundary between counts.
#[derive(Clone, Copy, Debug, Default)]
struct Edge {
    at: u32,
    boundary: i32,
}

/// What is known of the encoder.
#[derive(Clone, Copy, Debug, Default)]
pub struct Edges {
    /// Whole counts from the counter's zero, wrapping.
    pub counts: i32,
    /// The boundary between counts that was crossed last.
    pub boundary: i32,
    /// Rate over the span, counts per timer step; 0 where it is not known.
    per_step: f32,
    /// Timer steps to the next edge at this rate.
    reach: u32,
    /// 0 up, −1 down, else not known.
    way: i32,
    /// Timer steps since the last edge, wrapping; stays at a quarter of the timer's width.
    pub age: u32,
    next: usize,
    edges: [Edge; SPAN],
}

impl Edges {
    /// Begins once, at this count, within half a wrap of zero, with no edge known; `now` is the time of the tick before.
    pub fn begin(&mut self, count: EncoderCount, now: u32) {
        let counts = i32::from(count.since(EncoderCount(0)));
        self.counts = counts;
        self.boundary = counts;
        self.way = UNKNOWN;
        self.edges = [Edge { at: now, boundary: counts }; SPAN];
    }

    /// Ticks were lost: so many timer steps have passed unseen.
    pub fn pass(&mut self, steps: u32) {
        self.age = self.age.wrapping_add(steps);
    }

    /// One tick further, number `tick`, `period` timer steps.
    #[inline]
    pub fn take(&mut self, count: EncoderCount, age: u32, tick: u32, period: u32) {
        self.age = self.age.wrapping_add(period);
        let step = i32::from(count.since(EncoderCount(self.counts as u16)));
        if step != 0 {
            self.counts = self.counts.wrapping_add(step);
            self.age = age;
            // Upwards the last edge is the count's lower boundary, downwards the upper one.
            let way = step >> 31;
            self.boundary = self.counts.wrapping_sub(way);
            if way != self.way {
                self.turn(way, tick.wrapping_mul(period));
            }
        }
    }

    /// From the boundary to where the platform is by now, counts, −1 … 1.
    #[inline]
    pub fn part(&self) -> f32 {
        self.age.min(self.reach) as i32 as f32 * self.per_step
    }

    /// The first edge of a new direction; `now` in timer steps, wrapping.
    #[cold]
    #[inline(never)]
    fn turn(&mut self, way: i32, now: u32) {
        self.way = way;
        self.per_step = 0.0;
        self.reach = 0;
        let edge = Edge { at: now.wrapping_sub(self.age), boundary: self.boundary };
        // Written out: a loop takes twice as long.
        let [a, b, c, d] = &mut self.edges;
        (*a, *b, *c, *d) = (edge, edge, edge, edge);
    }

    /// Once in a millisecond: the rate over the last edges; `now` in timer steps, wrapping.
    #[inline]
    pub fn measure(&mut self, now: u32) {
        let edge = Edge { at: now.wrapping_sub(self.age), boundary: self.boundary };
        let last = self.edges.get(self.next.wrapping_sub(1) & (SPAN - 1)).map_or(0, |edge| edge.at);
        if edge.at == last {
            return self.forget_old(now);
        }
        if let Some(oldest) = self.edges.get_mut(self.next & (SPAN - 1)) {
            let time = edge.at.wrapping_sub(oldest.at) as i32;
            let counts = edge.boundary.wrapping_sub(oldest.boundary);
            *oldest = edge;
            self.next = self.next.wrapping_add(1);
            // A capture that makes no sense is not taken, nor a way that is none.
            if time > 0 && counts != 0 {
                self.per_step = counts as f32 / time as f32;
                self.reach = (time as u32).checked_div(counts.unsigned_abs()).unwrap_or(0);
            }
        }
    }

    /// Forgets edges that are too old for the timer's width.
    #[inline]
    fn forget_old(&mut self, now: u32) {
        if self.age > STALE {
            self.age = STALE;
            self.turn(UNKNOWN, now);
        }
    }

    /// The rate, counts per tick: over the last edges, and no more than the age of the last allows.
    #[inline]
    pub fn rate(&self, period: u32) -> f32 {
        let age = self.age;
        // A reversal leaves a direction, but no rate.
        let per_step = if age <= self.reach { self.per_step } else { self.bound() / age as f32 };
        per_step * period as f32
    }

    /// ± the count that at most has been gone since the last edge; 0 where the direction is not known.
    #[inline]
    fn bound(&self) -> f32 {
        if self.per_step > 0.0 {
            1.0
        } else if self.per_step < 0.0 {
            -1.0
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: u32 = 9_000;
    const HZ: f64 = 90e6;
    const CPR: f64 = 20_000.0;

    /// An encoder on a given motion, theta in counts by time in seconds, and what is made of it at each tick.
    fn follow(ticks: u32, theta: impl Fn(f64) -> f64, mut see: impl FnMut(u32, &Edges)) {
        let mut edges = Edges::default();
        edges.begin(EncoderCount(theta(0.0).floor() as i64 as u16), 0);
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
            // The timer captures in whole steps.
            let captured = (last_edge_s * HZ).floor();
            let age = ((now * HZ).round() - captured).min(f64::from(u32::MAX)) as u32;
            edges.take(EncoderCount(count as i64 as u16), age, n, PERIOD);
            if n % 10 == 3 {
                edges.measure(n.wrapping_mul(PERIOD));
            }
            see(n, &edges);
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
            follow(
                ticks,
                |t| start + rate * t,
                |tick, edges| {
                    changes += u32::from(last.is_some_and(|last| last != edges.counts));
                    last = Some(edges.counts);
                    if changes > 4 && tick % 10 == 3 {
                        let off = f64::from(edges.rate(PERIOD)) * 1e4 / rate - 1.0;
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
    fn the_standard_error_after_four_edges_is_below_a_hundredth_and_above_10_deg_s_below_a_thousandth() {
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
    fn the_position_between_edges_is_known_to_a_hundredth_of_a_count() {
        for rate in [5.0, 137.0, 2_000.0, 31_000.0, -5.0, -2_000.0, -31_000.0] {
            let mut worst = 0.0_f64;
            let at = |t: f64| 0.4 + rate * t;
            follow((20.0 / f64::abs(rate) * 1e4) as u32 + 400, at, |n, edges| {
                let t = f64::from(n) * 1e-4;
                if f64::abs(at(t) - at(0.0)) > 6.0 && n > 25 {
                    worst = worst.max((f64::from(edges.boundary) + f64::from(edges.part()) - at(t)).abs());
                }
            });
            assert!(worst < 0.01, "{rate}: {worst}");
        }
    }

    #[test]
    fn without_edges_the_rate_is_at_most_a_count_in_the_age() {
        // 0.1 s at 1000 counts/s, then it stands still.
        let at = |t: f64| 0.5 + 1_000.0 * t.min(0.1);
        follow(200_000, at, |n, edges| {
            let (rate, since_s) = (f64::from(edges.rate(PERIOD)) * 1e4, f64::from(n) * 1e-4 - 0.0995);
            if (103..=1_000).contains(&n) {
                assert!((rate / 1_000.0 - 1.0).abs() < 1e-4, "{n}: {rate}");
            } else if n > 1_010 {
                assert!((rate * since_s - 1.0).abs() < 0.02 || (n > 119_000 && rate <= 1.0 / 11.9), "{n}: {rate} after {since_s}");
            }
        });
    }

    #[test]
    fn a_reversal_begins_anew_and_is_right_one_edge_later() {
        // Up for 0.05 s, then down at the same rate.
        let at = |t: f64| 0.5 + 3_000.0 * (0.05 - (t - 0.05).abs());
        let mut right = None;
        follow(1_000, at, |n, edges| {
            let rate = f64::from(edges.rate(PERIOD)) * 1e4;
            assert!((-3_001.0..=3_001.0).contains(&rate));
            if n > 500 && right.is_none() && (rate / -3_000.0 - 1.0).abs() < 1e-3 {
                right = Some(n);
            }
        });
        // An edge each 3.3 ticks: the first after the turn has its boundary twice, the next millisecond tells the rate.
        assert!(right.is_some_and(|n| n <= 520), "{right:?}");
    }
}
