//! Steps and slow motions of a record: what is no stationary noise, and would be taken for random walk.
//!
//! Input: the values of the rows (rates, or angles whose change is the rate) and the segments without a gap. Output: [`Disturbances`], the
//! rows at which the level steps, and its slow motions: transients at the beginning, such as a warm-up, and periodic motions, such as that
//! of a room's temperature.
//!
//! Two searches. Over the whole record, the increments between the means of 64 blocks: a step is one increment (or two halves, if it lies
//! within a block), a transient a decaying exponential and a periodic motion a sinusoid in all of them. Each is tested against white noise,
//! flicker noise, random walk and a constant slope, all of unknown strength ([`super::block_increments`]); the ramp R is therefore no
//! transient and a random walk no step. The one with the most evidence is accepted first, and the search is repeated. For steps that are
//! large only beside the noise of short times: the differences of two short blocks with one between them, against their robust scatter. All
//! probabilities are for one record and any place in it (Bonferroni).

use std::ops::Range;

use nalgebra::DVector;

use super::answer::Interpretation;
use super::block_increments::{Candidate, Increments, Tested, probability_of_two};
use super::curve::{Curve, Shape};
use identification::statistics::distributions::student_quantile;
use identification::statistics::robust::{MEDIAN_ABS_PER_SIGMA, median_abs};

/// Blocks of the whole record.
const BLOCKS: usize = 64;
/// Fewest increments of a test.
const MIN_INCREMENTS: usize = 16;
/// Numbers of short blocks.
const SHORT_BLOCKS: [usize; 2] = [512, 2048];
/// Fewest differences of short blocks: the Student quantile of their robust scatter is then near that of the normal distribution.
const MIN_DIFFERENCES: usize = 256;
/// Degrees of freedom of the robust scatter for each difference: the efficiency of the median of the magnitudes is 0.37, and the overlap of
/// the differences leaves 1/1.74 of them independent.
const DOF_PER_DIFFERENCE: f64 = 0.37 / 1.74;
/// Probability with which noise is called a step, in one record; for each of the three searches a third of it.
const STEP_PROBABILITY: f64 = 1e-4;
/// Probability with which noise is called a transient, and a periodic motion, in one record.
const CURVE_PROBABILITY: f64 = 1e-3;
/// Significance level of a slope, alone and beside the slow motions.
const SLOPE_PROBABILITY: f64 = 0.01;
/// Most periodic motions.
const MAX_PERIODIC: usize = 3;
/// Most steps that are cut out; with more the level is no level.
pub const MAX_STEPS: usize = 8;
/// Blocks on both sides over which a step must persist, and its remaining part.
const PERSISTENCE_BLOCKS: usize = 4;
const MIN_PERSISTENCE: f64 = 0.5;
/// Most candidates that are tried for persistence: an outlier is strong in its neighbours.
const MAX_TRIES: usize = 12;
/// Sub-blocks of a block in the search for the row of a step.
const LOCATION_PARTS: usize = 64;
/// Time constants of the transients, relative to the record.
const TIME_CONSTANTS: [f64; 9] = [0.02, 0.03, 0.045, 0.07, 0.1, 0.15, 0.22, 0.33, 0.5];

/// Numbers of periods in the record of the periodic motions, up to twelve, so that a block is a fifth of a period at most: below one and a
/// half in quarters, above in halves, of which [`STRETCHES`] reach what is between.
const PERIODS: [f64; 25] =
    [0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 6.5, 7.0, 7.5, 8.0, 8.5, 9.0, 9.5, 10.0, 10.5, 11.0, 11.5, 12.0];
/// Least number of periods beside a transient, of which it could be a part.
const MIN_PERIODS_BESIDE_TRANSIENT: f64 = 1.5;
/// Factors by which time constants and periods are refined, and sweeps over all of them.
const STRETCHES: [[f64; 5]; 4] =
    [[0.8, 0.9, 1.0, 1.12, 1.25], [0.94, 0.97, 1.0, 1.03, 1.06], [0.98, 0.99, 1.0, 1.01, 1.02], [0.996, 0.998, 1.0, 1.002, 1.004]];
const SWEEPS: usize = 3;

/// What a record contains besides stationary noise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Disturbances {
    /// Steps in the order of their rows; at most [`MAX_STEPS`].
    pub steps: Vec<Step>,
    /// Slow motions of the level.
    pub curves: Vec<Curve>,
    /// The level has a constant slope that is significant; `None` where the record is too short for a test.
    pub has_slope: Option<bool>,
}

/// A step of the level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// First row behind it.
    pub row: usize,
    /// Level behind minus level before, in the unit of the rate per interval of the rows for angles.
    pub size: f64,
}

/// Rows with their meaning.
#[derive(Clone, Copy)]
pub struct Rows<'a> {
    values: &'a [f64],
    interpretation: Interpretation,
    /// Slow motions that are subtracted from the means.
    curves: &'a [Curve],
}

/// Mean over a block, the index of its segment, and its first row.
#[derive(Clone, Copy)]
struct Block {
    mean: f64,
    segment: usize,
    row: usize,
}

/// A possible step: the row in its middle, and its size.
#[derive(Clone, Copy)]
struct Disturbance {
    row: usize,
    segment: usize,
    size: f64,
}

impl<'a> Rows<'a> {
    /// Values of the rows.
    pub fn new(values: &'a [f64], interpretation: Interpretation) -> Self {
        Self { values, interpretation, curves: &[] }
    }

    /// Mean rate over rows; an angle's change per row.
    fn mean(&self, rows: Range<usize>) -> f64 {
        let mean = match self.interpretation {
            Interpretation::Value => self.values[rows.clone()].iter().sum::<f64>() / rows.len() as f64,
            Interpretation::Integral => {
                let to = rows.end.min(self.values.len() - 1);
                (self.values[to] - self.values[rows.start]) / (to - rows.start).max(1) as f64
            }
        };
        mean - self.curves.iter().map(|curve| curve.mean(&rows)).sum::<f64>()
    }

    /// Rows of a segment that have a rate: of angles all but the last.
    fn with_rates(&self, segment: &Range<usize>) -> Range<usize> {
        let more = usize::from(self.interpretation == Interpretation::Integral);
        segment.start..segment.end.saturating_sub(more).max(segment.start)
    }

    fn blocks(&self, segments: &[Range<usize>], length: usize) -> Vec<Block> {
        let of_segment = |(segment, rows): (usize, &Range<usize>)| {
            let count = self.with_rates(rows).len() / length;
            let start = rows.start;
            (0..count).map(move |k| Block { mean: 0.0, segment, row: start + k * length }).collect::<Vec<_>>()
        };
        let blocks = segments.iter().enumerate().flat_map(of_segment);
        blocks.map(|block| Block { mean: self.mean(block.row..block.row + length), ..block }).collect()
    }
}

/// The disturbances of a record.
pub fn disturbances(rows: Rows<'_>, segments: &[Range<usize>]) -> Disturbances {
    let (mut steps, mut curves): (Vec<Step>, Vec<Curve>) = (Vec::new(), Vec::new());
    while steps.len() < MAX_STEPS {
        let cut = without_steps(segments, &steps);
        let next = match LongSearch::new(rows, &cut).and_then(|search| search.strongest(&curves)) {
            Some(found @ (Strongest::Curve(_) | Strongest::TwoTransients(_))) => {
                match found {
                    Strongest::Curve(curve) => curves.push(curve),
                    Strongest::TwoTransients(both) => {
                        curves.retain(|curve| !is_transient(curve));
                        curves.extend(both);
                    }
                    Strongest::Step(_) => {}
                }
                if let Some(search) = LongSearch::new(rows, &cut) {
                    search.refine(&mut curves);
                }
                continue;
            }
            Some(Strongest::Step(step)) => Some(step),
            None => {
                let rows = Rows { curves: &curves, ..rows };
                SHORT_BLOCKS.into_iter().find_map(|count| short_search(rows, &cut, count))
            }
        };
        let Some(step) = next else { break };
        if !cut.iter().any(|segment| segment.start < step.row && step.row < segment.end) {
            break;
        }
        steps.push(step);
        steps.sort_by_key(|step| step.row);
    }
    let cut = without_steps(segments, &steps);
    let search = LongSearch::new(rows, &cut);
    if let Some(search) = &search {
        search.refine(&mut curves);
        // One that was found before another may only have stood for a part of it.
        let all = curves.clone();
        curves.retain(|curve| is_transient(curve) || search.is_needed(curve, &all));
        search.refine(&mut curves);
    }
    let has_slope = search.and_then(|search| search.needs_slope(&search.columns_of(&curves)));
    Disturbances { steps, curves, has_slope }
}

impl Disturbances {
    /// Subtracts the slow motions.
    pub fn remove_curves(&self, values: &mut [f64], interpretation: Interpretation) {
        for curve in &self.curves {
            let motion = |row: usize| match interpretation {
                Interpretation::Value => curve.mean(&(row..row + 1)),
                Interpretation::Integral => curve.integral(row),
            };
            values.iter_mut().enumerate().for_each(|(row, value)| *value -= motion(row));
        }
    }
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

enum Strongest {
    Step(Step),
    Curve(Curve),
    /// In place of the one that is known.
    TwoTransients([Curve; 2]),
}

fn is_transient(curve: &Curve) -> bool {
    matches!(curve.shape, Shape::Exponential { .. })
}

/// The search in the blocks of the whole record.
struct LongSearch<'a> {
    rows: Rows<'a>,
    segments: &'a [Range<usize>],
    /// Rows of a block.
    length: usize,
    /// Neighbouring blocks of one segment.
    pairs: Vec<[Block; 2]>,
    increments: Increments,
}

impl<'a> LongSearch<'a> {
    /// `None` for too short records.
    fn new(rows: Rows<'a>, segments: &'a [Range<usize>]) -> Option<Self> {
        let all: usize = segments.iter().map(ExactSizeIterator::len).sum();
        let length = all / BLOCKS;
        if length == 0 {
            return None;
        }
        let blocks = rows.blocks(segments, length);
        let pairs: Vec<[Block; 2]> =
            blocks.windows(2).filter(|pair| pair[0].segment == pair[1].segment).map(|pair| [pair[0], pair[1]]).collect();
        if pairs.len() < MIN_INCREMENTS {
            return None;
        }
        let places: Vec<f64> = pairs.iter().map(|pair| pair[0].row as f64 / length as f64).collect();
        let values: Vec<f64> = pairs.iter().map(|pair| pair[1].mean - pair[0].mean).collect();
        Some(LongSearch { rows, segments, length, pairs, increments: Increments::new(&places, &values) })
    }

    fn column(&self, of: impl Fn(usize) -> f64) -> DVector<f64> {
        DVector::from_fn(self.pairs.len(), |k, _| of(k))
    }

    fn slope(&self) -> DVector<f64> {
        self.column(|_| 1.0)
    }

    /// The columns of a shape.
    fn shape(&self, shape: Shape) -> Candidate {
        let mean = |column: usize, block: &Block| shape.mean(column, &(block.row..block.row + self.length));
        (0..shape.columns()).map(|column| self.column(|k| mean(column, &self.pairs[k][1]) - mean(column, &self.pairs[k][0]))).collect()
    }

    fn columns_of<'c>(&self, curves: impl IntoIterator<Item = &'c Curve>) -> Vec<DVector<f64>> {
        curves.into_iter().flat_map(|curve| self.shape(curve.shape)).collect()
    }

    /// The most significant step or slow motion beside those that are known.
    fn strongest(&self, known: &[Curve]) -> Option<Strongest> {
        // A known motion is fitted again: its first amplitude contains what the others left in it.
        let known_columns = self.columns_of(known);
        let fitted: Vec<DVector<f64>> = std::iter::once(self.slope()).chain(known_columns.iter().cloned()).collect();
        let span = self.span();
        let transients = known.iter().filter(|curve| is_transient(curve)).count();
        let kinds: [Vec<Shape>; 2] = [
            if transients == 0 {
                TIME_CONSTANTS.iter().map(|share| Shape::Exponential { rows: share * span }).collect()
            } else {
                Vec::new()
            },
            if known.len() - transients < MAX_PERIODIC {
                let least = if transients > 0 { MIN_PERIODS_BESIDE_TRANSIENT } else { 0.0 };
                let tried = PERIODS.iter().filter(|periods| **periods >= least);
                tried.map(|periods| Shape::Sinusoid { rows: span / periods }).collect()
            } else {
                Vec::new()
            },
        ];
        let curve = |shapes: &Vec<Shape>| -> Option<(Tested, Curve)> {
            let columns: Vec<Candidate> = shapes.iter().map(|shape| self.shape(*shape)).collect();
            let tested = self.increments.strongest(&fitted, &columns)?;
            is_significant(&tested, shapes.len(), CURVE_PROBABILITY).then_some(())?;
            // A slope and a slow exponential replace each other: without need of a slope, size and time constant are those without it.
            let alone = self.increments.strongest(&known_columns, &columns)?;
            let beside: Vec<DVector<f64>> = known_columns.iter().chain(&columns[alone.candidate]).cloned().collect();
            let Tested { candidate, coefficients, .. } = if self.needs_slope(&beside)? { tested } else { alone };
            Some((tested, Curve { shape: shapes[candidate], coefficients }))
        };
        let curve = kinds.iter().filter_map(curve).max_by(|a, b| a.0.evidence.total_cmp(&b.0.evidence));
        let found = [
            curve.map(|(tested, curve)| (tested.evidence, Strongest::Curve(curve))),
            self.two_transients(known).map(|(evidence, both)| (evidence, Strongest::TwoTransients(both))),
            self.step(&fitted).map(|(tested, step)| (tested.evidence, Strongest::Step(step))),
        ];
        found.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, strongest)| strongest)
    }

    /// Two transients in place of the one that is known, and their evidence beside it: the first time constant changes with the second.
    fn two_transients(&self, known: &[Curve]) -> Option<(f64, [Curve; 2])> {
        let [one] = known.iter().filter(|curve| is_transient(curve)).collect::<Vec<_>>()[..] else { return None };
        let others = self.columns_of(known.iter().filter(|curve| !is_transient(curve)));
        let fitted: Vec<DVector<f64>> = std::iter::once(self.slope()).chain(others).collect();
        let shapes = TIME_CONSTANTS.map(|share| Shape::Exponential { rows: share * self.span() });
        let pairs: Vec<[Shape; 2]> = (0..shapes.len()).flat_map(|j| (0..j).map(move |i| [shapes[i], shapes[j]])).collect();
        let columns: Vec<Candidate> = pairs.iter().map(|pair| pair.iter().flat_map(|shape| self.shape(*shape)).collect()).collect();
        let alone = self.increments.strongest(&fitted, &[self.shape(one.shape)])?;
        let both = self.increments.strongest(&fitted, &columns)?;
        // One more size and one more time constant.
        let gain = both.decrease - alone.decrease;
        let probability = pairs.len() as f64 * probability_of_two(gain.max(0.0), both.relative_dof);
        let curve = |k: usize| Curve { shape: pairs[both.candidate][k], coefficients: [both.coefficients[k], 0.0] };
        (probability < CURVE_PROBABILITY).then(|| (gain - 4.0, [curve(0), curve(1)]))
    }

    /// A slope is significant beside these columns.
    fn needs_slope(&self, beside: &[DVector<f64>]) -> Option<bool> {
        let slope = self.increments.strongest(beside, &[vec![self.slope()]])?;
        Some(is_significant(&slope, 1, SLOPE_PROBABILITY))
    }

    /// A time constant or period that is not longer than the longest that is tried: a longer one would be a slope or a parabola.
    fn is_within(&self, shape: Shape) -> bool {
        match shape {
            Shape::Exponential { rows } => rows <= TIME_CONSTANTS[TIME_CONSTANTS.len() - 1] * self.span(),
            Shape::Sinusoid { rows } => rows <= self.span() / PERIODS[0],
        }
    }

    /// Rows from the first block to the last.
    fn span(&self) -> f64 {
        let ends = |segments: &[Range<usize>]| Some(segments.last()?.end - segments.first()?.start);
        ends(self.segments).unwrap_or(0) as f64
    }

    /// A periodic motion is significant beside a slope and all other motions.
    fn is_needed(&self, curve: &Curve, all: &[Curve]) -> bool {
        let others = self.columns_of(all.iter().filter(|other| *other != curve));
        let fitted: Vec<DVector<f64>> = std::iter::once(self.slope()).chain(others).collect();
        let tested = self.increments.strongest(&fitted, &[self.shape(curve.shape)]);
        tested.is_none_or(|tested| is_significant(&tested, PERIODS.len(), CURVE_PROBABILITY))
    }

    /// Time constants, periods and sizes of the known motions, fitted together.
    fn refine(&self, curves: &mut [Curve]) {
        let slope = match self.needs_slope(&self.columns_of(curves.iter())) {
            Some(true) => Some(self.slope()),
            _ => None,
        };
        for stretches in (0..SWEEPS * usize::from(!curves.is_empty())).flat_map(|_| STRETCHES) {
            for k in 0..curves.len() {
                let others = curves.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, curve)| curve);
                let fitted: Vec<DVector<f64>> = slope.iter().cloned().chain(self.columns_of(others)).collect();
                let all = stretches.map(|factor| curves[k].shape.stretched(factor));
                let shapes: Vec<Shape> = all.into_iter().filter(|shape| self.is_within(*shape)).collect();
                let columns: Vec<Candidate> = shapes.iter().map(|shape| self.shape(*shape)).collect();
                if let Some(found) = self.increments.strongest(&fitted, &columns) {
                    curves[k] = Curve { shape: shapes[found.candidate], coefficients: found.coefficients };
                }
            }
        }
    }

    /// The strongest step, where it is significant and persists.
    fn step(&self, fitted: &[DVector<f64>]) -> Option<(Tested, Step)> {
        let Self { rows, segments, pairs, length, .. } = self;
        let mut candidates: Vec<Disturbance> = Vec::new();
        let mut columns: Vec<Candidate> = Vec::new();
        for (k, [before, after]) in pairs.iter().enumerate() {
            let candidate = Disturbance { row: after.row, segment: before.segment, size: 0.0 };
            candidates.push(candidate);
            columns.push(vec![self.column(|j| f64::from(u8::from(j == k)))]);
            if pairs.get(k + 1).is_some_and(|next| next[0].row == after.row) {
                candidates.push(Disturbance { row: after.row + length / 2, ..candidate });
                columns.push(vec![self.column(|j| if j == k || j == k + 1 { 0.5 } else { 0.0 })]);
            }
        }
        let count = candidates.len();
        // A single outlier is strong, too: the next ones are tried.
        for _ in 0..MAX_TRIES {
            let tested = self.increments.strongest(fitted, &columns)?;
            if !is_significant(&tested, count, STEP_PROBABILITY / 3.0) {
                return None;
            }
            columns.swap_remove(tested.candidate);
            let candidate = Disturbance { size: tested.coefficients[0], ..candidates.swap_remove(tested.candidate) };
            let segment = &segments[candidate.segment];
            if persists(*rows, segment, candidate, *length) {
                let located = located(*rows, segment, candidate.row, *length);
                return Some((tested, Step { size: candidate.size, ..located }));
            }
        }
        None
    }
}

/// Probability of so much evidence or more for any of the candidates by noise.
fn is_significant(tested: &Tested, candidates: usize, probability: f64) -> bool {
    candidates as f64 * tested.probability < probability
}

/// The strongest significant step between short blocks.
fn short_search(rows: Rows<'_>, segments: &[Range<usize>], count: usize) -> Option<Step> {
    let all: usize = segments.iter().map(ExactSizeIterator::len).sum();
    let length = all / count;
    if length == 0 {
        return None;
    }
    let blocks = rows.blocks(segments, length);
    let mut differences: Vec<Disturbance> = blocks
        .windows(3)
        .filter(|three| three[0].segment == three[2].segment)
        .map(|three| Disturbance { row: three[1].row + length / 2, segment: three[0].segment, size: three[2].mean - three[0].mean })
        .collect();
    if differences.len() < MIN_DIFFERENCES {
        return None;
    }
    let sizes: Vec<f64> = differences.iter().map(|difference| difference.size).collect();
    let sigma = median_abs(&sizes).unwrap_or(0.0) / MEDIAN_ABS_PER_SIGMA;
    let tail = STEP_PROBABILITY / (3 * differences.len()) as f64;
    let threshold = student_quantile(1.0 - 0.5 * tail, DOF_PER_DIFFERENCE * differences.len() as f64) * sigma;
    differences.retain(|difference| sigma > 0.0 && difference.size.abs() > threshold);
    differences.sort_by(|a, b| b.size.abs().total_cmp(&a.size.abs()));
    let found = differences.into_iter().find(|difference| persists(rows, &segments[difference.segment], *difference, length))?;
    Some(located(rows, &segments[found.segment], found.row, length))
}

/// The levels of several blocks on both sides differ, too: no single outlier.
fn persists(rows: Rows<'_>, segment: &Range<usize>, candidate: Disturbance, length: usize) -> bool {
    let segment = rows.with_rates(segment);
    let near = length.div_ceil(2);
    let far = near + PERSISTENCE_BLOCKS * length;
    let before = candidate.row.saturating_sub(far).max(segment.start)..candidate.row.saturating_sub(near).max(segment.start);
    let after = (candidate.row + near).min(segment.end)..(candidate.row + far).min(segment.end);
    if before.is_empty() || after.is_empty() {
        return false;
    }
    (rows.mean(after) - rows.mean(before)) * candidate.size.signum() > MIN_PERSISTENCE * candidate.size.abs()
}

/// The split of the rows around a step with the greatest difference of both sides, in units of its uncertainty under white noise.
fn located(rows: Rows<'_>, segment: &Range<usize>, row: usize, length: usize) -> Step {
    let segment = rows.with_rates(segment);
    let reach = length + length.div_ceil(2);
    let within = row.saturating_sub(reach).max(segment.start)..(row + reach).min(segment.end);
    let part = (within.len() / (3 * LOCATION_PARTS)).max(1);
    let parts: Vec<f64> = (0..within.len() / part).map(|k| rows.mean(within.start + k * part..within.start + (k + 1) * part)).collect();
    let total: f64 = parts.iter().sum();
    let count = parts.len() as f64;
    let mut best = (0.0, row, 0.0);
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
        std::iter::once(0..ROWS).collect()
    }

    #[test]
    fn stationary_noise_and_random_walk_have_no_steps_and_no_slow_motions() {
        let (mut stepped, mut curved) = (0, 0);
        for seed in 0..60 {
            for (flicker, walk) in [(0.0, 0.0), (0.1, 0.0), (0.02, 0.01), (0.0, 0.05)] {
                let values = record(1.0, flicker, walk, seed);
                let rows = Rows::new(&values, Interpretation::Value);
                let found = disturbances(rows, &all());
                stepped += found.steps.len();
                curved += usize::from(!found.curves.is_empty());
            }
        }
        // 240 records: 1e-4 of them by chance, and 1e-3 each with a transient or a periodic motion.
        assert!(stepped <= 1 && curved <= 4, "{stepped} {curved}");
    }

    #[test]
    fn a_step_is_found_with_its_row_and_size() {
        for (size, at) in [(0.3, 23_456), (-0.2, 50_000)] {
            let mut values = record(1.0, 0.0, 0.0, 5);
            values[at..].iter_mut().for_each(|value| *value += size);
            let rows = Rows::new(&values, Interpretation::Value);
            let found = disturbances(rows, &all()).steps;
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
            let of_angles = disturbances(Rows::new(&angles, Interpretation::Integral), &all()).steps;
            assert!(of_angles.len() == 1 && of_angles[0].row.abs_diff(at) < 600, "{of_angles:?}");
        }
    }

    #[test]
    fn one_outlier_is_no_step() {
        let mut values = record(1.0, 0.0, 0.0, 6);
        values[30_000] += 2000.0;
        let found = disturbances(Rows::new(&values, Interpretation::Value), &all());
        assert_eq!(found, Disturbances { has_slope: found.has_slope, ..Disturbances::default() });
    }

    #[test]
    fn a_warm_up_is_a_transient_and_a_ramp_is_not() {
        for share in [0.03, 0.1, 0.3] {
            let mut values = record(1.0, 0.0, 0.0, 7);
            values.iter_mut().enumerate().for_each(|(k, value)| *value += (-(k as f64) / (share * ROWS as f64)).exp());
            let found = disturbances(Rows::new(&values, Interpretation::Value), &all());
            let [Curve { shape: Shape::Exponential { rows }, coefficients: [size, _] }] = found.curves[..] else {
                panic!("{share}: {found:?}")
            };
            assert_eq!(found.steps, Vec::new(), "{share}");
            assert!((0.8..1.3).contains(&(rows / (share * ROWS as f64))) && (size - 1.0).abs() < 0.3, "{share}: {found:?}");
        }
        let mut ramp = record(1.0, 0.0, 0.0, 8);
        ramp.iter_mut().enumerate().for_each(|(k, value)| *value += k as f64 / ROWS as f64);
        let found = disturbances(Rows::new(&ramp, Interpretation::Value), &all());
        assert_eq!(found, Disturbances { has_slope: Some(true), ..Disturbances::default() });
    }

    /// Two masses that warm up, and a room whose temperature swings. What is left of the motion beside a slope, which has no Allan deviation,
    /// is of the size of the noise of a block.
    #[test]
    fn two_transients_and_a_periodic_motion_are_told_apart() {
        let mut values = record(0.2, 0.0, 0.0, 9);
        let swing = |k: f64| 0.5 * (std::f64::consts::TAU * k / 17_000.0 + 1.0).sin();
        let warm = |k: f64| 3.0 * (-k / 1_500.0).exp() + 2.0 * (-k / 15_000.0).exp();
        values.iter_mut().enumerate().for_each(|(k, value)| *value += swing(k as f64) + warm(k as f64));
        let found = disturbances(Rows::new(&values, Interpretation::Value), &all());
        assert!(found.steps.is_empty(), "{found:?}");
        let transients: Vec<&Curve> = found.curves.iter().filter(|curve| is_transient(curve)).collect();
        let [Curve { shape: Shape::Sinusoid { rows }, .. }] =
            found.curves.iter().filter(|curve| !is_transient(curve)).collect::<Vec<_>>()[..]
        else {
            panic!("{found:?}")
        };
        assert_eq!(transients.len(), 2, "{found:?}");
        assert!((rows / 17_000.0 - 1.0).abs() < 0.05, "{found:?}");
        let motion = |k: usize| swing(k as f64) + warm(k as f64);
        let left = |k: usize| motion(k) - found.curves.iter().map(|curve| curve.mean(&(k..k + 1))).sum::<f64>();
        let line = |k: usize| left(0) + (left(ROWS) - left(0)) * k as f64 / ROWS as f64;
        let rms = |of: &dyn Fn(usize) -> f64| ((0..ROWS).map(|k| of(k).powi(2)).sum::<f64>() / ROWS as f64).sqrt();
        let (after, of_block) = (rms(&|k| left(k) - line(k)), 0.2 / ((ROWS / BLOCKS) as f64).sqrt());
        assert!(after < 3.0 * of_block, "{after}, {of_block}, {found:?}");
    }
}
