//! Steps and transients of a record: what is no stationary noise, and would be taken for random walk.
//!
//! Input: the values of the rows (rates, or angles whose change is the rate) and the segments without a gap. Output: rows at which the level steps
//! ([`steps`]), and a transient at the beginning, such as a warm-up ([`transient`]).
//!
//! Steps: means over blocks of several lengths; the difference of two blocks with one between them contains a step as a whole wherever it lies in the middle
//! one. A random walk and all other processes have normally distributed differences; a step is one that chance gives once in 10⁴ records, and that persists.
//! Transients: under a random walk the increments of block means are independent; a decaying exponential in them is tested against their scatter. For
//! the other processes the test is conservative, because their increments are negatively correlated. A constant slope is no transient but the ramp R.

use std::ops::Range;

use super::answer::Interpretation;
use crate::statistics::distributions::{normal_quantile, student_tail};
use crate::statistics::least_squares::least_squares;
use crate::statistics::robust::{MEDIAN_ABS_PER_SIGMA, median_abs};

/// Numbers of blocks into which the record is divided.
const BLOCKS: [usize; 4] = [32, 128, 512, 2048];
/// Fewest differences of a scale.
const MIN_DIFFERENCES: usize = 16;
/// Probability with which noise is called a step, in one record.
const STEP_PROBABILITY: f64 = 1e-4;
/// Most steps that are cut out; with more the level is no level.
pub const MAX_STEPS: usize = 8;
/// Blocks on both sides over which a step must persist, and its remaining part.
const PERSISTENCE_BLOCKS: usize = 4;
const MIN_PERSISTENCE: f64 = 0.5;
/// Sub-blocks of a block in the search for the row of a step.
const LOCATION_PARTS: usize = 64;
/// Blocks of the test for a transient.
const TRANSIENT_BLOCKS: usize = 64;
/// Time constants of the transients, relative to the record.
const TIME_CONSTANTS: [f64; 6] = [0.02, 0.04, 0.08, 0.15, 0.3, 0.6];
/// Probability with which noise is called a transient, in one record.
const TRANSIENT_PROBABILITY: f64 = 1e-3;

/// A step of the level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// First row behind it.
    pub row: usize,
    /// Level behind minus level before, in the unit of the rate per interval of the rows for angles.
    pub size: f64,
}

/// A transient at the beginning of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transient {
    /// Time constant, rows.
    pub rows: f64,
    /// Initial deviation that decays, in the unit of a step.
    pub size: f64,
}

/// Rows with their meaning.
#[derive(Clone, Copy)]
pub struct Rows<'a> {
    values: &'a [f64],
    interpretation: Interpretation,
}

/// Mean over a block, the index of its segment, and its first row.
#[derive(Clone, Copy)]
struct Block {
    mean: f64,
    segment: usize,
    row: usize,
}

impl<'a> Rows<'a> {
    /// Values of the rows.
    pub fn new(values: &'a [f64], interpretation: Interpretation) -> Self {
        Self { values, interpretation }
    }

    /// Mean rate over rows; an angle's change per row.
    fn mean(&self, rows: Range<usize>) -> f64 {
        match self.interpretation {
            Interpretation::Value => self.values[rows.clone()].iter().sum::<f64>() / rows.len() as f64,
            Interpretation::Integral => {
                let to = rows.end.min(self.values.len() - 1);
                (self.values[to] - self.values[rows.start]) / (to - rows.start).max(1) as f64
            }
        }
    }

    fn blocks(&self, segments: &[Range<usize>], length: usize) -> Vec<Block> {
        let of_segment = |(segment, rows): (usize, &Range<usize>)| {
            let count = rows.len() / length;
            let start = rows.start;
            (0..count).map(move |k| Block { mean: 0.0, segment, row: start + k * length }).collect::<Vec<_>>()
        };
        let blocks = segments.iter().enumerate().flat_map(of_segment);
        blocks.map(|block| Block { mean: self.mean(block.row..block.row + length), ..block }).collect()
    }
}

/// The steps of a record, in the order of their rows; at most [`MAX_STEPS`].
pub fn steps(rows: Rows<'_>, segments: &[Range<usize>]) -> Vec<Step> {
    let mut cut = segments.to_vec();
    let mut found: Vec<Step> = Vec::new();
    while found.len() < MAX_STEPS {
        let Some(step) = strongest(rows, &cut) else { break };
        let Some(place) = cut.iter().position(|segment| segment.start < step.row && step.row < segment.end) else { break };
        let segment = cut[place].clone();
        cut.splice(place..=place, [segment.start..step.row, step.row..segment.end]);
        found.push(step);
    }
    found.sort_by_key(|step| step.row);
    found
}

/// Segments that end at the steps.
pub fn without_steps(segments: &[Range<usize>], steps: &[Step]) -> Vec<Range<usize>> {
    let mut cut = Vec::new();
    for segment in segments {
        let mut from = segment.start;
        for step in steps.iter().filter(|step| segment.start < step.row && step.row < segment.end) {
            cut.push(from..step.row);
            from = step.row;
        }
        cut.push(from..segment.end);
    }
    cut
}

/// The step that exceeds its threshold most.
fn strongest(rows: Rows<'_>, segments: &[Range<usize>]) -> Option<Step> {
    let all: usize = segments.iter().map(ExactSizeIterator::len).sum();
    let mut best: Option<(f64, usize, Vec<Block>, usize)> = None;
    for count in BLOCKS {
        let length = all / count;
        if length == 0 {
            continue;
        }
        let blocks = rows.blocks(segments, length);
        let pairs: Vec<(usize, f64)> = (0..blocks.len().saturating_sub(2))
            .filter(|k| blocks[*k].segment == blocks[k + 2].segment)
            .map(|k| (k, blocks[k + 2].mean - blocks[k].mean))
            .collect();
        if pairs.len() < MIN_DIFFERENCES {
            continue;
        }
        let differences: Vec<f64> = pairs.iter().map(|(_, difference)| *difference).collect();
        let sigma = median_abs(&differences).unwrap_or(0.0) / MEDIAN_ABS_PER_SIGMA;
        let tail = STEP_PROBABILITY / (BLOCKS.len() * pairs.len()) as f64;
        // The scatter is known to 1.2/√(2 n) of itself only.
        let threshold = normal_quantile(1.0 - 0.5 * tail) * (1.0 + 2.0 / (pairs.len() as f64).sqrt()) * sigma;
        let Some((k, difference)) = pairs.into_iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) else { continue };
        let excess = difference.abs() / threshold;
        if sigma > 0.0 && excess > 1.0 && best.as_ref().is_none_or(|(most, ..)| excess > *most) && persists(&blocks, k, difference) {
            best = Some((excess, k, blocks, length));
        }
    }
    let (_, k, blocks, length) = best?;
    Some(located(rows, blocks[k].row..(blocks[k].row + 3 * length).min(segments[blocks[k].segment].end)))
}

/// The levels of several blocks on both sides differ, too: no single outlier.
fn persists(blocks: &[Block], k: usize, difference: f64) -> bool {
    let segment = blocks[k].segment;
    let mean = |range: Range<usize>| {
        let inside: Vec<f64> =
            range.filter_map(|j| blocks.get(j)).filter(|block| block.segment == segment).map(|block| block.mean).collect();
        inside.iter().sum::<f64>() / inside.len() as f64
    };
    let before = mean((k + 1).saturating_sub(PERSISTENCE_BLOCKS)..k + 1);
    let after = mean(k + 2..k + 2 + PERSISTENCE_BLOCKS);
    (after - before) * difference.signum() > MIN_PERSISTENCE * difference.abs()
}

/// The split of these rows with the greatest difference of both sides, in units of its uncertainty under white noise.
fn located(rows: Rows<'_>, within: Range<usize>) -> Step {
    let part = (within.len() / (3 * LOCATION_PARTS)).max(1);
    let parts: Vec<f64> = (0..within.len() / part).map(|k| rows.mean(within.start + k * part..within.start + (k + 1) * part)).collect();
    let total: f64 = parts.iter().sum();
    let count = parts.len() as f64;
    let mut best = (0.0, within.start + within.len() / 2, 0.0);
    let mut sum = 0.0;
    for (k, mean) in parts.iter().enumerate().take(parts.len().saturating_sub(1)) {
        sum += mean;
        let before = (k + 1) as f64;
        let size = (total - sum) / (count - before) - sum / before;
        let weight = size.abs() * (before * (count - before) / count).sqrt();
        if weight > best.0 {
            best = (weight, within.start + (k + 1) * part, size);
        }
    }
    Step { row: best.1, size: best.2 }
}

/// A decaying transient at the beginning.
pub fn transient(rows: Rows<'_>, segments: &[Range<usize>]) -> Option<Transient> {
    let (first, last) = (segments.first()?.start, segments.last()?.end);
    let length = segments.iter().map(ExactSizeIterator::len).sum::<usize>() / TRANSIENT_BLOCKS;
    if length == 0 {
        return None;
    }
    let blocks = rows.blocks(segments, length);
    let increments: Vec<(f64, f64)> = blocks
        .windows(2)
        .filter(|pair| pair[0].segment == pair[1].segment)
        .map(|pair| ((pair[1].row - first) as f64 / (last - first) as f64, pair[1].mean - pair[0].mean))
        .collect();
    let values: Vec<f64> = increments.iter().map(|(_, value)| *value).collect();
    let mut best: Option<(f64, Transient)> = None;
    for share in TIME_CONSTANTS {
        let design: Vec<Vec<f64>> = increments.iter().map(|(place, _)| vec![1.0, (-place / share).exp()]).collect();
        let Some(fit) = least_squares(&design, &values) else { continue };
        let t = fit.coefficients[1] / fit.sigma(1);
        let probability = 2.0 * TIME_CONSTANTS.len() as f64 * student_tail(t.abs(), fit.dof);
        if probability < TRANSIENT_PROBABILITY && best.as_ref().is_none_or(|(most, _)| t.abs() > *most) {
            // Increment per block of −A exp(−t/τ): A (block/τ) exp(−t/τ).
            let span = (last - first) as f64;
            let size = -fit.coefficients[1] * share * span / length as f64;
            best = Some((t.abs(), Transient { rows: share * span, size }));
        }
    }
    best.map(|(_, transient)| transient)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::peripherals::{Noise, SlowNoise};

    const ROWS: usize = 60_000;

    /// White noise, flicker noise and random walk at 10 Hz.
    fn record(white: f64, flicker: f64, walk: f64, seed: u64) -> Vec<f64> {
        let (mut noise, mut slow) = (Noise::new(seed, 0, white), SlowNoise::new(seed, 1, flicker, walk));
        (0..ROWS).map(|k| noise.draw() + slow.at(k as f64 * 0.1)).collect()
    }

    fn all() -> Vec<Range<usize>> {
        vec![0..ROWS]
    }

    #[test]
    fn stationary_noise_and_random_walk_have_no_steps_and_no_transients() {
        let (mut stepped, mut transients) = (0, 0);
        for seed in 0..60 {
            for (flicker, walk) in [(0.0, 0.0), (0.1, 0.0), (0.02, 0.01), (0.0, 0.05)] {
                let values = record(1.0, flicker, walk, seed);
                let rows = Rows::new(&values, Interpretation::Value);
                stepped += steps(rows, &all()).len();
                transients += usize::from(transient(rows, &all()).is_some());
            }
        }
        // 240 records: 1e-4 and 1e-3 of them by chance.
        assert!(stepped <= 1 && transients <= 3, "{stepped} {transients}");
    }

    #[test]
    fn a_step_is_found_with_its_row_and_size() {
        for (size, at) in [(0.3, 23_456), (-0.2, 50_000)] {
            let mut values = record(1.0, 0.0, 0.0, 5);
            values[at..].iter_mut().for_each(|value| *value += size);
            let rows = Rows::new(&values, Interpretation::Value);
            let found = steps(rows, &all());
            let [step] = found.as_slice() else { panic!("{found:?}") };
            assert!(step.row.abs_diff(at) < 600 && (step.size / size - 1.0).abs() < 0.3, "{step:?}");
            assert_eq!(without_steps(&all(), &found).len(), 2);
            // As an angle.
            let mut angle = 0.0;
            let angles: Vec<f64> = values
                .iter()
                .map(|rate| {
                    angle += rate;
                    angle
                })
                .collect();
            let of_angles = steps(Rows::new(&angles, Interpretation::Integral), &all());
            assert!(of_angles.len() == 1 && of_angles[0].row.abs_diff(at) < 600, "{of_angles:?}");
        }
    }

    #[test]
    fn one_outlier_is_no_step() {
        let mut values = record(1.0, 0.0, 0.0, 6);
        values[30_000] += 2000.0;
        assert_eq!(steps(Rows::new(&values, Interpretation::Value), &all()), Vec::new());
    }

    #[test]
    fn a_warm_up_is_a_transient_and_a_ramp_is_not() {
        for share in [0.03, 0.1, 0.3] {
            let mut values = record(1.0, 0.0, 0.0, 7);
            values.iter_mut().enumerate().for_each(|(k, value)| *value += (-(k as f64) / (share * ROWS as f64)).exp());
            let found = transient(Rows::new(&values, Interpretation::Value), &all()).unwrap();
            assert!((0.4..2.5).contains(&(found.rows / (share * ROWS as f64))) && (found.size - 1.0).abs() < 0.5, "{share}: {found:?}");
        }
        let mut ramp = record(1.0, 0.0, 0.0, 8);
        ramp.iter_mut().enumerate().for_each(|(k, value)| *value += k as f64 / ROWS as f64);
        assert_eq!(transient(Rows::new(&ramp, Interpretation::Value), &all()), None);
    }
}
