//! How evenly the rows come.

use super::statistics::Statistics;
use crate::board::{TICKS_PER_S, Ticks};

/// What is said of the time between rows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TimingReading {
    /// Rows taken.
    pub rows: u32,
    /// Rows that did not come: gaps in their numbers.
    pub missed: u32,
    /// Shortest time between two looks, s.
    pub least_s: f64,
    /// Longest.
    pub greatest_s: f64,
    /// Mean.
    pub mean_s: f64,
    /// Spread, 1 σ, s; `None` before the third look.
    pub sigma_s: Option<f64>,
}

/// Watches the rows' times.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timing {
    last: Option<(u32, Ticks)>,
    between_s: Statistics,
    rows: u32,
    missed: u32,
}

impl Timing {
    /// Takes number and time of a row.
    pub fn take(&mut self, sequence: u32, at: Ticks) {
        if let Some((before, then)) = self.last {
            self.missed = self.missed.saturating_add(sequence.wrapping_sub(before).saturating_sub(1));
            self.between_s.take((at - then) as f64 / TICKS_PER_S as f64);
        }
        self.rows = self.rows.saturating_add(1);
        self.last = Some((sequence, at));
    }

    /// Forgets what was.
    pub fn restart(&mut self) {
        *self = Self { last: self.last, ..Self::default() };
    }

    /// What is said of them.
    pub fn reading(&self) -> TimingReading {
        TimingReading {
            rows: self.rows,
            missed: self.missed,
            least_s: self.between_s.least,
            greatest_s: self.between_s.greatest,
            mean_s: self.between_s.mean,
            sigma_s: self.between_s.sigma(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_rows_widen_the_spread_and_lost_ones_are_counted() {
        let mut timing = Timing::default();
        for (sequence, at) in [(7, 10_000), (8, 20_000), (9, 30_200), (12, 60_000), (13, 70_000)] {
            timing.take(sequence, Ticks(at));
        }
        let reading = timing.reading();
        assert_eq!((reading.rows, reading.missed), (5, 2));
        assert!((reading.least_s - 1e-3).abs() < 1e-12 && (reading.greatest_s - 2.98e-3).abs() < 1e-12);
        timing.restart();
        timing.take(14, Ticks(80_000));
        assert_eq!((timing.reading().rows, timing.reading().missed, timing.reading().greatest_s), (1, 0, 1e-3));
    }
}
