//! Detects thermal equilibrium by the slope of a temperature over the last minute.

use std::collections::VecDeque;

/// Time over which the slope is taken, s.
pub(super) const SLOPE_WINDOW_S: f64 = 60.0;

/// Detector of a stable temperature.
#[derive(Debug)]
pub(super) struct StabilityDetector {
    /// Log column of the temperature.
    pub(super) column: &'static str,
    limit_K_min: f64,
    /// Mean time, s, and mean temperature, °C, of each second of the last minute.
    means: VecDeque<(f64, f64)>,
    /// Sums of times and temperatures of the current second, and their number.
    sum: (f64, f64, u32),
}

impl StabilityDetector {
    /// A detector for slopes below `limit_K_min`.
    pub(super) fn new(column: &'static str, limit_K_min: f64) -> Self {
        Self { column, limit_K_min, means: VecDeque::new(), sum: (0.0, 0.0, 0) }
    }

    /// The slope is below the limit.
    pub(super) fn is_reached(&self) -> bool {
        self.slope_K_min().is_some_and(|slope| slope.abs() < self.limit_K_min)
    }

    /// The note in the log.
    pub(super) fn note(&self, after_s: f64) -> String {
        match self.slope_K_min() {
            Some(slope) => {
                format!("after {after_s:.0} s the slope of {} was {slope:+.2} K/min, limit {} K/min", self.column, self.limit_K_min)
            }
            None => format!("after {after_s:.0} s {} had been recorded for less than a minute", self.column),
        }
    }

    /// Adds the temperature of a row; NaN is ignored.
    pub(super) fn add(&mut self, t_s: f64, temp_C: f64) {
        if !temp_C.is_finite() {
            return;
        }
        let (t, y, n) = self.sum;
        self.sum = (t + t_s, y + temp_C, n + 1);
        let n = f64::from(n + 1);
        let second_began_s = self.means.back().map_or(0.0, |(t, _)| t + 0.5);
        if t_s - second_began_s >= 1.0 {
            self.means.push_back((self.sum.0 / n, self.sum.1 / n));
            self.sum = (0.0, 0.0, 0);
            while self.means.front().is_some_and(|(t, _)| t_s - t > SLOPE_WINDOW_S) {
                self.means.pop_front();
            }
        }
    }

    /// Slope over the last minute, K/min; `None` before a minute has passed.
    fn slope_K_min(&self) -> Option<f64> {
        let ((first, _), (last, _)) = (self.means.front()?, self.means.back()?);
        if last - first < SLOPE_WINDOW_S - 3.0 {
            return None;
        }
        let n = self.means.len() as f64;
        let (t, y) = self.means.iter().fold((0.0, 0.0), |(t, y), (a, b)| (t + a / n, y + b / n));
        let square: f64 = self.means.iter().map(|(a, _)| (a - t).powi(2)).sum();
        Some(60.0 * self.means.iter().map(|(a, b)| (a - t) * (b - y)).sum::<f64>() / square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_is_that_of_the_last_minute() {
        let mut stable = StabilityDetector::new("sensor_C", 0.5);
        for row in 0..240_000 {
            let t_s = f64::from(row) * 1e-3;
            // 3 K/min for two minutes, then 0.3 K/min.
            stable.add(t_s, 20.0 + 0.05 * t_s.min(120.0) + 0.005 * (t_s - 120.0).max(0.0));
            match row {
                50_000 => assert_eq!(stable.slope_K_min(), None),
                119_000 => assert!((stable.slope_K_min().unwrap() - 3.0).abs() < 1e-6),
                150_001 => assert!(!stable.is_reached()),
                150_000 => assert!((1.0..2.0).contains(&stable.slope_K_min().unwrap())),
                _ => {}
            }
        }
        assert!((stable.slope_K_min().unwrap() - 0.3).abs() < 1e-6);
        assert!(stable.is_reached());
        assert_eq!(stable.note(240.0), "after 240 s the slope of sensor_C was +0.30 K/min, limit 0.5 K/min");
        let before = stable.slope_K_min();
        stable.add(240.0, f64::NAN);
        assert_eq!(stable.slope_K_min(), before);
    }
}
