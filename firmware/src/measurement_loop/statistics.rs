//! Running mean and spread, in constant memory (Welford 1962).

/// What has come so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// How many.
    pub count: u32,
    /// Their mean; 0 if there was none.
    pub mean: f64,
    squares: f64,
    /// The least; 0 if there was none.
    pub least: f64,
    /// The greatest; 0 if there was none.
    pub greatest: f64,
}

impl Statistics {
    /// One more.
    pub fn take(&mut self, value: f64) {
        if self.count == 0 {
            (self.least, self.greatest) = (value, value);
        }
        self.count = self.count.saturating_add(1);
        let off = value - self.mean;
        self.mean += off / f64::from(self.count);
        self.squares += off * (value - self.mean);
        self.least = f64::min(self.least, value);
        self.greatest = f64::max(self.greatest, value);
    }

    /// Standard deviation of one of them; `None` before the second.
    pub fn sigma(&self) -> Option<f64> {
        (self.count > 1).then(|| libm::sqrt(f64::max(self.squares, 0.0) / (f64::from(self.count) - 1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_spread_and_extremes_are_those_of_all_that_came() {
        let mut statistics = Statistics::default();
        assert_eq!((statistics.sigma(), statistics.count), (None, 0));
        let values = [1e6 + 3.0, 1e6 - 1.0, 1e6 + 2.0, 1e6];
        values.iter().for_each(|v| statistics.take(*v));
        assert_eq!((statistics.mean, statistics.least, statistics.greatest), (1e6 + 1.0, 1e6 - 1.0, 1e6 + 3.0));
        assert!((statistics.sigma().unwrap() - (10.0_f64 / 3.0).sqrt()).abs() < 1e-12);
    }
}
