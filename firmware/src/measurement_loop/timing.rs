//! Timing of the rows.

use super::statistics::Statistics;
use crate::board::{TICKS_PER_S, Ticks};

/// Time between rows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TimingReading {
    /// Number of rows.
    pub rows: u32,
    /// Lost rows: gaps in the sequence numbers.
    pub missed: u32,
    /// Shortest time, s.
    pub min_s: f64,
    /// Longest time, s.
    pub max_s: f64,
    /// Mean, s.
    pub mean_s: f64,
    /// Standard deviation, s; `None` before the third row.
    pub sigma_s: Option<f64>,
}

/// Statistics of the rows' times.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timing {
    last: Option<(u32, Ticks)>,
    between_s: Statistics,
    rows: u32,
    missed: u32,
}

impl Timing {
    /// Adds the sequence number and time of a row.
    pub fn add(&mut self, sequence: u32, at: Ticks) {
        if let Some((before, then)) = self.last {
            self.missed = self.missed.saturating_add(sequence.wrapping_sub(before).saturating_sub(1));
            self.between_s.add((at - then) as f64 / TICKS_PER_S as f64);
        }
        self.rows = self.rows.saturating_add(1);
        self.last = Some((sequence, at));
    }

    /// Forgets all rows but the last.
    pub fn restart(&mut self) {
        *self = Self { last: self.last, ..Self::default() };
    }

    /// The statistics so far.
    pub fn reading(&self) -> TimingReading {
        TimingReading {
            rows: self.rows,
            missed: self.missed,
            min_s: self.between_s.min,
            max_s: self.between_s.max,
            mean_s: self.between_s.mean,
            sigma_s: self.between_s.sigma(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_rows_widen_the_range_and_lost_rows_are_counted() {
        let mut timing = Timing::default();
        for (sequence, at) in [(7, 10_000), (8, 20_000), (9, 30_200), (12, 60_000), (13, 70_000)] {
            timing.add(sequence, Ticks(at));
        }
        let reading = timing.reading();
        assert_eq!((reading.rows, reading.missed), (5, 2));
        assert!((reading.min_s - 1e-3).abs() < 1e-12 && (reading.max_s - 2.98e-3).abs() < 1e-12);
        timing.restart();
        timing.add(14, Ticks(80_000));
        assert_eq!((timing.reading().rows, timing.reading().missed, timing.reading().max_s), (1, 0, 1e-3));
    }
}
