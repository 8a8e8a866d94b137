//! Edge capture of the tasks: the last edge that the counter of the tasks passed, and its time.
//!
//! Input: the angle of the disc at each tick. Output: [`Edge`]s with the stamp of the edge timer. The time within the tick is where the
//! parabola through the angles of the last three ticks crosses the edge: exact far below a timer step, unless the rotor reverses within the
//! tick. It is computed only when the tasks read it.

use stand_firmware::board::{CONTROL_HZ, Edge, EdgeTime, EncoderCount, Hardware};

/// Motion of the disc in one tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Passed {
    /// Steps of the edge timer per tick.
    steps_per_tick: f64,
    /// Angle at its start, counts.
    start: f64,
    /// Motion from start to end, and half of its change from tick to tick.
    motion: f64,
    bend: f64,
    /// The tick that starts at its end.
    tick: u64,
}

impl Passed {
    /// The edge at which the counter reached `count` in this motion.
    pub fn edge(&self, count: i64) -> Edge {
        let side = count as f64 + if self.motion < 0.0 { 1.0 } else { 0.0 };
        let at = (self.tick as f64 - 1.0 + self.crossing(side - self.start)) * self.steps_per_tick;
        Edge { count: EncoderCount(count as u16), at: EdgeTime(at.max(0.0) as u64) }
    }

    /// The fraction s of the tick at which motion·s + bend·s(s − 1) reaches `reach`.
    fn crossing(&self, reach: f64) -> f64 {
        let (motion, bend) = (self.motion, self.bend);
        let mut s = reach / motion;
        // Newton: the bend is a small correction; where it is not, the rotor reverses, and the time is known to a tick only.
        for _ in 0..3 {
            s -= (motion * s + bend * s * (s - 1.0) - reach) / (motion + bend * (2.0 * s - 1.0));
        }
        if s.is_finite() { s.clamp(0.0, 1.0) } else { 1.0 }
    }
}

/// The counter of the tasks: last position of the disc, and last edge.
#[derive(Clone, Copy, Debug)]
pub struct TaskEdge {
    now: Passed,
    count: i64,
    /// The tick in which the counter last changed.
    changed: Option<Passed>,
}

impl TaskEdge {
    /// The disc is at `exact` counts; no edge yet.
    pub fn new(hardware: &Hardware, exact: f64) -> Self {
        let steps_per_tick = hardware.edge_timer_Hz / CONTROL_HZ as f64;
        Self { now: Passed { steps_per_tick, start: exact, ..Passed::default() }, count: exact.floor() as i64, changed: None }
    }

    /// At the start of `tick` the disc is at `exact` counts, of which `count` are whole; returns its motion.
    #[inline]
    pub fn pass(&mut self, exact: f64, count: i64, tick: u64) -> Passed {
        let start = self.now.start + self.now.motion;
        let motion = exact - start;
        self.now = Passed { start, motion, bend: 0.5 * (motion - self.now.motion), tick, ..self.now };
        if count != self.count {
            self.count = count;
            self.changed = Some(self.now);
        }
        self.now
    }

    /// The newest edge; `None` before the first.
    pub fn newest(&self) -> Option<Edge> {
        self.changed.map(|passed| passed.edge(self.count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_edge_time_is_the_crossing_time_to_one_timer_step() {
        let hardware = Hardware::default();
        for (from, rate, acceleration) in
            [(-40.3, 3e4, 0.0), (-40.3, 3e3, 2e5), (33.3, -3e3, 1e5), (33.3, -900.0, -2e5), (-3.7, 500.0, -3e4), (1e6 + 0.7, -6e4, 1e6)]
        {
            let at = |t: f64| from + rate * t + 0.5 * acceleration * t * t;
            let mut own = TaskEdge::new(&hardware, at(0.0));
            let mut seen = 0;
            for n in 1..100 {
                let exact = at(n as f64 * 1e-4);
                let before = own.newest();
                // The first tick has no previous motion, and so no bend.
                own.pass(exact, exact.floor() as i64, n);
                let Some(edge) = own.newest().filter(|_| n > 2 && own.newest() != before) else { continue };
                let t = edge.at.0 as f64 / hardware.edge_timer_Hz;
                let slope = rate + acceleration * t;
                let side = exact.floor() + if slope < 0.0 { 1.0 } else { 0.0 };
                assert!(((at(t) - side) / slope).abs() < 2.0 / hardware.edge_timer_Hz, "{rate} {acceleration} tick {n}: {t}");
                assert_eq!(edge.count, EncoderCount(exact.floor() as i64 as u16));
                seen += 1;
            }
            assert!(seen > 2, "{rate}");
        }
    }

    #[test]
    fn no_edge_is_reported_before_the_first_and_it_stays_at_rest() {
        let mut own = TaskEdge::new(&Hardware::default(), 0.5);
        own.pass(0.7, 0, 1);
        assert_eq!(own.newest(), None);
        own.pass(1.2, 1, 2);
        let edge = own.newest();
        assert!(edge.is_some());
        own.pass(1.2, 1, 3);
        own.pass(1.2, 1, 4);
        assert_eq!(own.newest(), edge);
    }
}
