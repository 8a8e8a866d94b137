//! Wild rows: single readings that the noise of the rows beside them does not explain, such as a disturbed transmission.
//!
//! Input: the rates of the rows, or the angles whose changes they are. Output: the wild rows with their excess over the median of the rows
//! beside them; [`WildRows::remove`] subtracts it. Where the noise itself has wide tails no row is wild: then many rows lie just below the
//! limit, too.

use std::ops::Range;

use rayon::prelude::*;

use super::answer::Interpretation;
use identification::statistics::distributions::{normal_quantile, normal_tail};
use identification::statistics::robust::{MEDIAN_ABS_PER_SIGMA, median_abs};

/// Rows on each side whose median is the level of a row.
const BESIDE: usize = 4;
/// Probability with which normal noise has a wild row, in one record.
const PROBABILITY: f64 = 1e-4;
/// Most wild rows: a half per cent. The noise of so many that are replaced by their level changes N by 0.25 %.
const MAX_SHARE: f64 = 0.005;
/// Deviations, in standard deviations, from which on the tails of the noise are counted.
const TAIL: f64 = 4.0;
/// Rows in the tails, relative to normal noise, with which the noise has wide tails; as many more are permitted as there are wild rows, or as
/// this part of all rows.
const MAX_TAIL_RATIO: f64 = 3.0;
const MAX_MORE_IN_TAIL: f64 = 5e-4;
/// Rows from which the standard deviation is estimated at most.
const SAMPLE: usize = 20_000;

/// Wild rows of a record.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WildRows {
    /// Row, and its excess over the level beside it; of angles the change to the next row.
    excesses: Vec<(usize, f64)>,
}

impl WildRows {
    /// The wild rows of a record with this least significant bit.
    pub fn of(values: &[f64], interpretation: Interpretation, segments: &[Range<usize>], quantum: Option<f64>) -> Self {
        let rates = Rates { values, interpretation };
        let segments: Vec<Range<usize>> = segments.iter().map(|segment| rates.rows(segment)).filter(|s| s.len() > 2 * BESIDE).collect();
        let all: usize = segments.iter().map(ExactSizeIterator::len).sum();
        if all == 0 {
            return Self::default();
        }
        let every = all / SAMPLE + 1;
        let sample: Vec<f64> =
            segments.iter().flat_map(|segment| segment.clone().step_by(every).map(|row| rates.excess(row, segment))).collect();
        let sigma = (median_abs(&sample).unwrap_or(0.0) / MEDIAN_ABS_PER_SIGMA).max(quantum.unwrap_or(0.0));
        if sigma <= 0.0 {
            return Self::default();
        }
        let limit = -normal_quantile(PROBABILITY / all as f64 / 2.0) * sigma;
        let in_tail = |segment: &Range<usize>| {
            let excesses = segment.clone().into_par_iter().map(|row| (row, rates.excess(row, segment)));
            excesses.filter(|(_, excess)| excess.abs() > TAIL * sigma).collect::<Vec<_>>()
        };
        let (wild, below): (Vec<_>, Vec<_>) = segments.iter().flat_map(in_tail).partition(|(_, excess)| excess.abs() > limit);
        let normal = 2.0 * normal_tail(TAIL) * all as f64;
        let has_wide_tails = below.len() as f64 > MAX_TAIL_RATIO * normal + f64::max(wild.len() as f64, MAX_MORE_IN_TAIL * all as f64);
        if has_wide_tails || wild.len() as f64 > MAX_SHARE * all as f64 { Self::default() } else { Self { excesses: wild } }
    }

    /// Number of wild rows.
    pub fn count(&self) -> usize {
        self.excesses.len()
    }

    /// The largest excess, as a magnitude.
    pub fn largest(&self) -> f64 {
        self.excesses.iter().fold(0.0, |largest, (_, excess)| f64::max(largest, excess.abs()))
    }

    /// Subtracts the excesses; a single wild angle, whose two changes are off by opposite amounts, becomes the mean of its neighbours.
    pub fn remove(&self, values: &mut [f64], interpretation: Interpretation, segments: &[Range<usize>]) {
        let mut rest = self.excesses.as_slice();
        while let [(row, excess), later @ ..] = rest {
            rest = later;
            match (interpretation, later.first()) {
                (Interpretation::Value, _) => values[*row] -= excess,
                (Interpretation::Integral, Some((next, back))) if *next == row + 1 && (excess + back).abs() < 0.5 * excess.abs() => {
                    values[*next] = 0.5 * (values[*row] + values[next + 1]);
                    rest = &later[1..];
                }
                (Interpretation::Integral, _) => {
                    let end = segments.iter().find(|segment| segment.contains(row)).map_or(*row, |segment| segment.end);
                    values[row + 1..end.max(row + 1)].iter_mut().for_each(|angle| *angle -= excess);
                }
            }
        }
    }
}

/// The rates of the rows.
#[derive(Clone, Copy)]
struct Rates<'a> {
    values: &'a [f64],
    interpretation: Interpretation,
}

impl Rates<'_> {
    /// Rows of a segment that have a rate.
    fn rows(self, segment: &Range<usize>) -> Range<usize> {
        match self.interpretation {
            Interpretation::Value => segment.clone(),
            Interpretation::Integral => segment.start..segment.end.saturating_sub(1).max(segment.start),
        }
    }

    fn at(self, row: usize) -> f64 {
        match self.interpretation {
            Interpretation::Value => self.values[row],
            Interpretation::Integral => self.values[row + 1] - self.values[row],
        }
    }

    /// The rate of a row minus the median of the rows beside it.
    fn excess(self, row: usize, segment: &Range<usize>) -> f64 {
        let from = row.saturating_sub(BESIDE).max(segment.start).min(segment.end - 2 * BESIDE - 1);
        let mut beside = [0.0; 2 * BESIDE];
        let others = (from..=from + 2 * BESIDE).filter(|other| *other != row);
        beside.iter_mut().zip(others).for_each(|(value, other)| *value = self.at(other));
        beside.sort_unstable_by(f64::total_cmp);
        self.at(row) - 0.5 * (beside[BESIDE - 1] + beside[BESIDE])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::peripherals::Noise;

    const ROWS: usize = 36_000;

    fn whole(rows: usize) -> Vec<Range<usize>> {
        std::iter::once(0..rows).collect()
    }

    fn noise(seed: u64) -> Vec<f64> {
        let mut noise = Noise::new(seed, 0, 1.0);
        (0..ROWS).map(|_| noise.draw()).collect()
    }

    #[test]
    fn rows_far_outside_the_noise_are_wild_and_are_removed() {
        for interpretation in [Interpretation::Value, Interpretation::Integral] {
            let mut values = noise(1);
            let clean = values.clone();
            let at = [100, 5000, 5001, 20_000, 35_998];
            at.iter().for_each(|row| values[*row] += 30.0);
            if interpretation == Interpretation::Integral {
                let sum = |sum: &mut f64, rate: &f64| {
                    *sum += rate;
                    Some(*sum - rate)
                };
                values = values.iter().scan(0.0, sum).collect();
            }
            let segment = whole(ROWS);
            let found = WildRows::of(&values, interpretation, &segment, None);
            assert_eq!(found.excesses.iter().map(|(row, _)| *row).collect::<Vec<_>>(), at);
            found.remove(&mut values, interpretation, &segment);
            let rates = Rates { values: &values, interpretation };
            assert!((0..ROWS - 1).all(|row| (rates.at(row) - clean[row]).abs() < if at.contains(&row) { 5.0 } else { 1e-9 }));
        }
    }

    #[test]
    fn a_wild_angle_moves_no_other() {
        let mut values = noise(3);
        let clean = values.clone();
        values[700] += 40.0;
        let segment = whole(ROWS);
        WildRows::of(&values, Interpretation::Integral, &segment, None).remove(&mut values, Interpretation::Integral, &segment);
        assert!((0..ROWS).all(|row| row == 700 || values[row] == clean[row]) && (values[700] - clean[700]).abs() < 5.0);
        for short in [[1.0, 1.5, 1.5].as_slice(), &[0.0; 8]] {
            assert_eq!(WildRows::of(short, Interpretation::Value, &whole(short.len()), Some(0.5)), WildRows::default());
        }
    }

    #[test]
    fn noise_has_no_wild_rows_even_with_wide_tails() {
        for seed in 0..20 {
            let normal = noise(seed);
            // Laplace: the exponential tails of two squares of normal deviates.
            let wide: Vec<f64> = normal.iter().zip(noise(seed + 100)).map(|(a, b)| a * b).collect();
            for values in [normal.as_slice(), &wide, &wide[..2000]] {
                let found = WildRows::of(values, Interpretation::Value, &whole(values.len()), None);
                assert_eq!(found, WildRows::default(), "{seed}");
            }
        }
    }
}
