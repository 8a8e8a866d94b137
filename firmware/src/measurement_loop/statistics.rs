//! Running mean, standard deviation and extremes in constant memory (Welford 1962).

/// Statistics of all values so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Number of values.
    pub count: u32,
    /// Mean; 0 without values.
    pub mean: f64,
    squares: f64,
    /// Smallest; 0 without values.
    pub min: f64,
    /// Largest; 0 without values.
    pub max: f64,
}

impl Statistics {
    /// Adds a value.
    pub fn add(&mut self, value: f64) {
        if self.count == 0 {
            (self.min, self.max) = (value, value);
        }
        self.count = self.count.saturating_add(1);
        let deviation = value - self.mean;
        self.mean += deviation / f64::from(self.count);
        self.squares += deviation * (value - self.mean);
        self.min = f64::min(self.min, value);
        self.max = f64::max(self.max, value);
    }

    /// Standard deviation; `None` before the second value.
    pub fn sigma(&self) -> Option<f64> {
        (self.count > 1).then(|| libm::sqrt(f64::max(self.squares, 0.0) / (f64::from(self.count) - 1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_deviation_and_extremes_are_exact() {
        let mut statistics = Statistics::default();
        assert_eq!((statistics.sigma(), statistics.count), (None, 0));
        let values = [1e6 + 3.0, 1e6 - 1.0, 1e6 + 2.0, 1e6];
        values.iter().for_each(|v| statistics.add(*v));
        assert_eq!((statistics.mean, statistics.min, statistics.max), (1e6 + 1.0, 1e6 - 1.0, 1e6 + 3.0));
        assert!((statistics.sigma().unwrap() - (10.0_f64 / 3.0).sqrt()).abs() < 1e-12);
    }
}
