//! Time of the last encoder edge: the capture of a timer, computed from the motion within the tick.
//!
//! Input: angle (counts) and rate at the ends of a step. Output: steps of the edge timer since the last edge. Within a step the motion is
//! the parabola through both angles with the mean acceleration of both rates; a changing acceleration adds less than 10⁻³ of a count in 0.1
//! ms on the default stand. A reversal within the step that crosses an edge and returns is an edge too.

use stand_firmware::board::{Hardware, TICKS_PER_S};

/// The edge timer.
#[derive(Clone, Copy, Debug)]
pub struct Edges {
    counts_per_rad: f64,
    timer_Hz: f64,
    /// Angle at the last update, counts, and its integer part.
    exact: f64,
    count: f64,
    rate_rad_s: f64,
    age_s: f64,
}

impl Edges {
    /// The edge timer of this hardware; the disc is at `exact` counts, without an edge so far.
    pub fn new(exact: f64, rate_rad_s: f64, hardware: &Hardware) -> Self {
        let counts_per_rad = 1.0 / hardware.rad_per_count();
        Self { counts_per_rad, timer_Hz: hardware.edge_timer_Hz, exact, count: exact.floor(), rate_rad_s, age_s: f64::INFINITY }
    }

    /// Advances by `dt_s` to `exact` counts at the rate `rate_rad_s`.
    #[inline]
    pub fn advance(&mut self, exact: f64, rate_rad_s: f64, dt_s: f64) {
        let before = *self;
        self.exact = exact;
        self.rate_rad_s = rate_rad_s;
        self.count = exact.floor();
        let turns_on = before.rate_rad_s * rate_rad_s > 0.0;
        self.age_s = match before.last_edge(self, dt_s) {
            // The usual case of slow motion: neither an edge nor a reversal.
            _ if turns_on && self.count == before.count => self.age_s + dt_s,
            Some(at) => (1.0 - at) * dt_s,
            None => self.age_s + dt_s,
        };
    }

    /// Timer steps since the last edge; the largest number without an edge.
    #[inline]
    pub fn age(&self) -> u32 {
        (self.age_s * self.timer_Hz) as u32
    }

    /// Timer steps since an edge that was this number of board clock steps ago, after which none came.
    #[cold]
    pub fn age_after(&self, steps: u64) -> u32 {
        (steps as f64 / TICKS_PER_S as f64 * self.timer_Hz) as u32
    }

    /// Fraction of the step at which the last edge was crossed, 0 … 1.
    fn last_edge(&self, end: &Self, dt_s: f64) -> Option<f64> {
        let motion = end.exact - self.exact;
        // θ(s) = start + motion s + bend s (s − 1)
        let bend = 0.5 * (end.rate_rad_s - self.rate_rad_s) * self.counts_per_rad * dt_s;
        let at = |s: f64| self.exact + motion * s + bend * s * (s - 1.0);
        let turn = 0.5 - 0.5 * motion / bend;
        let turns = turn > 0.0 && turn < 1.0;
        if !turns {
            return (end.count != self.count).then(|| crossing(self.exact, motion, bend, edge_behind(end.count, motion), motion));
        }
        let extreme = at(turn);
        let out = extreme - self.exact;
        let back = end.exact - extreme;
        if extreme.floor() != end.count {
            return Some(crossing(self.exact, motion, bend, edge_behind(end.count, back), back));
        }
        (self.count != end.count).then(|| crossing(self.exact, motion, bend, edge_behind(end.count, out), out))
    }
}

/// The edge by which one comes into a count, in this direction.
#[inline]
fn edge_behind(count: f64, motion: f64) -> f64 {
    if motion >= 0.0 { count } else { count + 1.0 }
}

/// Where the parabola crosses `edge` in this direction.
#[inline]
fn crossing(start: f64, motion: f64, bend: f64, edge: f64, direction: f64) -> f64 {
    // bend s² + (motion − bend) s − (edge − start) = 0, without cancellation; the slope at the root is ± the square root.
    let (b, c) = (motion - bend, start - edge);
    let root = (b * b - 4.0 * bend * c).max(0.0).sqrt().copysign(direction);
    let s = if b * root >= 0.0 { -2.0 * c / (b + root) } else { (root - b) / (2.0 * bend) };
    if s.is_finite() { s.clamp(0.0, 1.0) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of 0.1 ms with the acceleration `a` (counts/s²) and an update at each end; the age at the end by the timer and by search.
    fn ages(start: f64, rate: f64, a: f64, steps: u32) -> Vec<(f64, f64)> {
        let hardware = Hardware::default();
        let per_rad = 1.0 / hardware.rad_per_count();
        let mut edges = Edges::new(start, rate / per_rad, &hardware);
        let at = |t: f64| start + rate * t + 0.5 * a * t * t;
        (1..=steps)
            .map(|n| {
                let t = f64::from(n) * 1e-4;
                edges.advance(at(t), (rate + a * t) / per_rad, 1e-4);
                // Backwards in steps of a tenth of a microsecond.
                let found = (1..n * 1000).find(|k| at(t - f64::from(*k) * 1e-7).floor() != at(t).floor());
                (f64::from(edges.age()) / hardware.edge_timer_Hz, found.map_or(f64::INFINITY, |k| f64::from(k) * 1e-7))
            })
            .collect()
    }

    #[test]
    fn the_age_is_the_time_since_the_crossing_at_any_rate_and_through_reversals() {
        for start in [0.3, -7.9, 1e6 + 0.6] {
            for (rate, a) in [(5e3, 0.0), (-5e3, 0.0), (170.0, 900.0), (2e4, -1e7), (-900.0, 1e6), (1e5, -1e5), (-3.0, 0.0), (4e3, -2e6)] {
                for (n, (age, found)) in ages(start, rate, a, 60).into_iter().enumerate() {
                    // The search has steps of 0.1 µs, the timer of 11 ns.
                    let same = (found - age).abs() < 1.5e-7 || (found.is_infinite() && age > 40.0);
                    assert!(same, "start {start}, rate {rate}, acceleration {a}, step {n}: {age} {found}");
                }
            }
        }
    }

    #[test]
    fn without_an_edge_the_age_saturates() {
        let hardware = Hardware::default();
        let mut edges = Edges::new(0.5, 0.0, &hardware);
        edges.advance(0.5, 0.0, 1e-4);
        assert_eq!(edges.age(), u32::MAX);
        edges.advance(1.5, 1.0, 1e-4);
        assert!(edges.age() < 9_000);
        for _ in 0..10 {
            edges.advance(1.6, 0.0, 1e-4);
        }
        assert!((90_000..99_000).contains(&edges.age()));
    }
}
