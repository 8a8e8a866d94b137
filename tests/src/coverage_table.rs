//! Coverage of expanded uncertainties over many simulated measurements: counts, the interval that chance allows, and the misses.
//!
//! Input: for each measurement and quantity whether value ± U contains the truth. Output: rows of a table for docs/metrology-coverage.md.

use std::collections::BTreeMap;

/// Coverage probability that the results state.
pub const STATED: f64 = 0.95;
/// Probability of the interval that chance allows.
const CHANCE: f64 = 0.99;

/// Counts of one quantity.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Count {
    /// Measurements that reported the quantity.
    pub reported: usize,
    /// Of these, intervals that contain the truth.
    pub covered: usize,
    /// Sum of the squared errors in units of U.
    squares: f64,
    /// Descriptions of the misses.
    pub misses: Vec<String>,
}

impl Count {
    /// Fraction of the intervals that contain the truth.
    pub fn fraction(&self) -> f64 {
        self.covered as f64 / self.reported.max(1) as f64
    }
}

/// Counts by quantity, in the order of their names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CoverageTable(pub BTreeMap<String, Count>);

impl CoverageTable {
    /// Adds a result: the value with its expanded uncertainty and the truth; `what` describes the measurement.
    pub fn add(&mut self, quantity: &str, value: f64, expanded: f64, truth: f64, what: &str) {
        let count = self.0.entry(quantity.to_owned()).or_default();
        count.reported += 1;
        count.squares += ((value - truth) / expanded).powi(2);
        if (value - truth).abs() <= expanded {
            count.covered += 1;
        } else {
            count.misses.push(format!("{quantity}, {what}: {value:.6e} ± {expanded:.1e}, truth {truth:.6e}"));
        }
    }

    /// Adds an upper limit, which covers a truth below it.
    pub fn add_limit(&mut self, quantity: &str, limit: f64, truth: f64, what: &str) {
        let count = self.0.entry(quantity.to_owned()).or_default();
        count.reported += 1;
        if truth <= limit {
            count.covered += 1;
        } else {
            count.misses.push(format!("{quantity}, {what}: below {limit:.3e}, truth {truth:.3e}"));
        }
    }

    /// Adds the counts of another table.
    pub fn merge(&mut self, other: Self) {
        for (name, more) in other.0 {
            let count = self.0.entry(name).or_default();
            count.reported += more.reported;
            count.covered += more.covered;
            count.squares += more.squares;
            count.misses.extend(more.misses);
        }
    }

    /// Rows of the table: quantity, number, coverage, the range of chance around 95 %, rms error in units of U.
    pub fn rows(&self, case: &str) -> String {
        let mut text = String::new();
        for (name, count) in &self.0 {
            let (low, high) = chance(count.reported, STATED);
            let percent = 100.0 * count.fraction();
            let verdict = match (percent < 100.0 * low, percent > 100.0 * high) {
                (true, _) => "too low",
                (_, true) => "wider than needed",
                _ => "within",
            };
            let rms = (count.squares / count.reported.max(1) as f64).sqrt();
            text += &format!(
                "| {case} | {name} | {} | {percent:.1} % | {:.1} to {:.1} %: {verdict} | {rms:.2} |\n",
                count.reported,
                100.0 * low,
                100.0 * high
            );
        }
        text
    }

    /// Header of the table.
    pub fn header() -> &'static str {
        "| case | quantity | n | covered by U | chance at this n (99 %) | rms error, U |\n|---|---|---|---|---|---|\n"
    }
}

/// Fractions between which the number of successes of `n` trials of probability `p` lies with 99 %: exact quantiles of the binomial distribution.
pub fn chance(n: usize, p: f64) -> (f64, f64) {
    if n == 0 {
        return (0.0, 1.0);
    }
    let tail = 0.5 * (1.0 - CHANCE);
    let (mut ln_choose, mut sum) = (0.0_f64, 0.0);
    let (mut low, mut high) = (None, n);
    for k in 0..=n {
        if k > 0 {
            ln_choose += ((n - k + 1) as f64 / k as f64).ln();
        }
        sum += (ln_choose + k as f64 * p.ln() + (n - k) as f64 * (1.0 - p).ln()).exp();
        if low.is_none() && sum > tail {
            low = Some(k);
        }
        if sum >= 1.0 - tail {
            high = k;
            break;
        }
    }
    (low.unwrap_or(0) as f64 / n as f64, high as f64 / n as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// R: qbinom(c(0.005, 0.995), 100, 0.95) = 89, 100; for 400: 368, 391 within one.
    #[test]
    fn range_of_chance_is_that_of_the_binomial_distribution() {
        let (low, high) = chance(100, 0.95);
        assert!((low - 0.89).abs() < 1e-9 && (high - 1.0).abs() < 1e-9, "{low} {high}");
        let (low, high) = chance(400, 0.95);
        assert!((400.0 * low - 368.0).abs() < 1.5 && (400.0 * high - 391.0).abs() < 1.5, "{low} {high}");
    }

    #[test]
    fn misses_are_described() {
        let mut table = CoverageTable::default();
        table.add("bias", 1.0, 0.1, 1.05, "seed 1");
        table.add("bias", 1.0, 0.1, 1.25, "seed 2");
        table.add_limit("walk", 0.5, 0.2, "seed 1");
        let count = &table.0["bias"];
        assert_eq!((count.reported, count.covered, count.misses.len()), (2, 1, 1));
        assert!(count.misses[0].contains("seed 2") && table.rows("x").lines().count() == 2);
    }
}
