//! Periodic signals of a record, such as a vibration or the cycle of a heater: lines of its spectrum that no noise has.
//!
//! Input: the rates of the rows, or the angles whose changes they are. Output: the lines, with an amplitude and a phase for each stretch of
//! rows; [`SpectralLine::remove`] subtracts them.
//!
//! The power of a line (Hann window) is compared with the mean power of the lines beside it: under noise with a smooth spectrum the ratio is
//! that of two χ², of 2 and of [`BESIDE_DEGREES`] degrees of freedom. The search is in the longest stretch without a gap: first in its rows,
//! up to [`STRETCH`] of them, then, where it is longer, in means over blocks of them. Periods longer than a twelfth of the record are those of
//! [`super::disturbances`], which knows the spectra of the noise there; between a twelfth of the longest stretch and a twelfth of a record with
//! gaps no period is searched.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use super::answer::Interpretation;
use super::curve::{Curve, Shape};
use identification::statistics::fourier::transform;

/// Periods in a stretch, at least.
const MIN_PERIODS: usize = 12;
/// Lines on each side that are compared, and those next to the line that are not: the window spreads a line over them.
const BESIDE: usize = 10;
const NEXT: usize = 2;
/// Degrees of freedom of their mean: two for each line, of which the window leaves two thirds independent.
const BESIDE_DEGREES: f64 = 4.0 * (BESIDE - NEXT) as f64 * 2.0 / 3.0;
/// Probability with which noise has a line, in one record.
const PROBABILITY: f64 = 1e-4;
/// Most lines that are removed.
const MAX_LINES: usize = 8;
/// Rows of a stretch at most.
const STRETCH: usize = 1 << 17;
/// Rows of a stretch at least.
const MIN_STRETCH: usize = 4 * MIN_PERIODS;
/// Steps of the search for the frequency between two lines.
const FREQUENCY_STEPS: usize = 30;

/// A periodic signal.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralLine {
    /// Period, rows.
    pub rows: f64,
    /// Amplitude of the rows in the stretch in which it was found, in the unit of the rate per interval of the rows for angles.
    pub amplitude: f64,
    stretches: Vec<(Range<usize>, Curve)>,
}

/// Finds the lines, the strongest first, and removes them from the values.
pub fn remove_lines(values: &mut [f64], interpretation: Interpretation, segments: &[Range<usize>]) -> Vec<SpectralLine> {
    let Some(longest) = segments.iter().max_by_key(|segment| segment.len()).filter(|segment| segment.len() >= MIN_STRETCH) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    // Rows of a block.
    for block in if longest.len() > STRETCH { vec![1, longest.len().div_ceil(STRETCH)] } else { vec![1] } {
        let length = block * STRETCH;
        let stretches: Vec<Range<usize>> =
            segments.iter().flat_map(|s| s.clone().step_by(length).map(move |row| row..s.end.min(row + length))).collect();
        let Some(searched) = stretches.iter().max_by_key(|stretch| stretch.len()) else { continue };
        while found.len() < MAX_LINES {
            let Some(period) = strongest(&rates(values, interpretation, searched, block)).map(|blocks| blocks * block as f64) else {
                break;
            };
            let shape = Shape::Sinusoid { rows: period };
            let fitted: Vec<(Range<usize>, Curve)> = stretches
                .iter()
                .filter(|stretch| stretch.len() as f64 >= MIN_PERIODS as f64 * period)
                .filter_map(|stretch| Some((stretch.clone(), fitted(shape, &rates(values, interpretation, stretch, 1))?)))
                .collect();
            let amplitude = fitted.iter().find(|(stretch, _)| stretch == searched).map_or(0.0, |(_, curve)| curve.size());
            // A row is the mean over its interval: its amplitude is smaller.
            let half = PI / period;
            let line = SpectralLine { rows: period, amplitude: amplitude * half.sin() / half, stretches: fitted };
            line.remove(values, interpretation, segments);
            found.push(line);
        }
    }
    found
}

impl SpectralLine {
    fn remove(&self, values: &mut [f64], interpretation: Interpretation, segments: &[Range<usize>]) {
        for (stretch, curve) in &self.stretches {
            let rows = &mut values[stretch.clone()];
            match interpretation {
                Interpretation::Value => rows.iter_mut().enumerate().for_each(|(k, rate)| *rate -= curve.mean(&(k..k + 1))),
                Interpretation::Integral => {
                    rows.iter_mut().enumerate().for_each(|(k, angle)| *angle -= curve.integral(k));
                    // The next stretch of a segment continues from here.
                    let end = segments.iter().find(|segment| segment.contains(&stretch.start)).map_or(stretch.end, |segment| segment.end);
                    let moved = curve.integral(stretch.len());
                    values[stretch.end..end].iter_mut().for_each(|angle| *angle -= moved);
                }
            }
        }
    }
}

/// Mean rates of whole blocks of rows of a stretch.
fn rates(values: &[f64], interpretation: Interpretation, stretch: &Range<usize>, block: usize) -> Vec<f64> {
    let rows = &values[stretch.clone()];
    match interpretation {
        Interpretation::Value => rows.chunks_exact(block).map(|rows| rows.iter().sum::<f64>() / block as f64).collect(),
        Interpretation::Integral => {
            let ends: Vec<f64> = rows.iter().step_by(block).copied().collect();
            ends.windows(2).map(|pair| (pair[1] - pair[0]) / block as f64).collect()
        }
    }
}

/// Rates without their straight line, weighted by a Hann window.
fn windowed(rates: &[f64]) -> Vec<f64> {
    let n = rates.len() as f64;
    let mean = rates.iter().sum::<f64>() / n;
    let centre = 0.5 * (n - 1.0);
    let slope = rates.iter().enumerate().map(|(k, rate)| (k as f64 - centre) * rate).sum::<f64>() * 12.0 / (n * (n * n - 1.0));
    let level = |k: usize| mean + slope * (k as f64 - centre);
    let window = |k: usize| (PI * (k as f64 + 0.5) / n).sin().powi(2);
    rates.iter().enumerate().map(|(k, rate)| window(k) * (rate - level(k))).collect()
}

/// Period of the strongest significant line, rows.
fn strongest(rates: &[f64]) -> Option<f64> {
    let windowed = windowed(rates);
    let powers: Vec<f64> = transform(windowed.clone()).iter().map(|line| line.norm_sqr()).collect();
    let candidates = MIN_PERIODS..powers.len().checked_sub(BESIDE + 1)?.max(MIN_PERIODS);
    let count = candidates.len() as f64;
    let ratio = |line: usize| {
        let beside = powers[line - BESIDE..line - NEXT].iter().chain(&powers[line + NEXT + 1..=line + BESIDE]);
        powers[line] / (beside.sum::<f64>() / (2 * (BESIDE - NEXT)) as f64)
    };
    let (line, ratio) = candidates.map(|line| (line, ratio(line))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    // Tail of the F distribution with 2 degrees of freedom.
    let probability = count * (1.0 + 2.0 * ratio / BESIDE_DEGREES).powf(-0.5 * BESIDE_DEGREES);
    (probability < PROBABILITY).then(|| rates.len() as f64 / frequency(&windowed, line))
}

/// Periods in the stretch with the largest power near a line, by golden sections.
fn frequency(windowed: &[f64], line: usize) -> f64 {
    let power = |periods: f64| {
        let w = TAU * periods / windowed.len() as f64;
        let (mut re, mut im) = (0.0, 0.0);
        for (k, value) in windowed.iter().enumerate() {
            let (sine, cosine) = (w * k as f64).sin_cos();
            re += value * cosine;
            im += value * sine;
        }
        re.hypot(im)
    };
    let section = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (line as f64 - 1.0, line as f64 + 1.0);
    let mut inner = [high - section * (high - low), low + section * (high - low)];
    let mut powers = inner.map(power);
    for _ in 0..FREQUENCY_STEPS {
        if powers[0] > powers[1] {
            (high, inner[1], powers[1]) = (inner[1], inner[0], powers[0]);
            inner[0] = high - section * (high - low);
            powers[0] = power(inner[0]);
        } else {
            (low, inner[0], powers[0]) = (inner[0], inner[1], powers[1]);
            inner[1] = low + section * (high - low);
            powers[1] = power(inner[1]);
        }
    }
    0.5 * (low + high)
}

/// Least-squares sine and cosine beside a constant.
fn fitted(shape: Shape, rates: &[f64]) -> Option<Curve> {
    let mean = rates.iter().sum::<f64>() / rates.len() as f64;
    let mut normal = nalgebra::Matrix3::zeros();
    let mut right = nalgebra::Vector3::zeros();
    for (k, rate) in rates.iter().enumerate() {
        let row = nalgebra::Vector3::new(shape.mean(0, &(k..k + 1)), shape.mean(1, &(k..k + 1)), 1.0);
        normal += row * row.transpose();
        right += row * (rate - mean);
    }
    let solution = normal.cholesky()?.solve(&right);
    Some(Curve { shape, coefficients: [solution[0], solution[1]] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::peripherals::{Noise, SlowNoise};

    const ROWS: usize = 20_000;

    fn whole(rows: usize) -> Vec<Range<usize>> {
        std::iter::once(0..rows).collect()
    }

    fn record(seed: u64, slow: f64) -> Vec<f64> {
        let (mut noise, mut walk) = (Noise::new(seed, 0, 1.0), SlowNoise::new(seed, 1, slow, slow));
        (0..ROWS).map(|k| noise.draw() + walk.at(k as f64 * 0.1)).collect()
    }

    #[test]
    fn noise_has_no_lines() {
        for seed in 0..40 {
            let mut values = record(seed, if seed % 2 == 0 { 0.0 } else { 1.0 });
            assert_eq!(remove_lines(&mut values, Interpretation::Value, &whole(ROWS)), Vec::new(), "{seed}");
        }
    }

    #[test]
    fn a_vibration_is_found_and_removed() {
        for interpretation in [Interpretation::Value, Interpretation::Integral] {
            let (clean, period) = (record(1, 0.3), 37.4);
            let curve = Curve { shape: Shape::Sinusoid { rows: period }, coefficients: [0.3, 0.4] };
            let segments = [0..8000, 8000..ROWS];
            let mut values: Vec<f64> = clean.iter().enumerate().map(|(k, rate)| rate + curve.mean(&(k..k + 1))).collect();
            let mut angles = clean.clone();
            if interpretation == Interpretation::Integral {
                for series in [&mut values, &mut angles] {
                    let mut sum = 0.0;
                    series.iter_mut().for_each(|value| {
                        sum += *value;
                        *value = sum - *value;
                    });
                }
            }
            let found = remove_lines(&mut values, interpretation, &segments);
            let [line] = found.as_slice() else { panic!("{found:?}") };
            assert!((line.rows - period).abs() < 0.01 && (line.amplitude - 0.5).abs() < 0.05, "{line:?}");
            let largest = rates(&values, interpretation, &(8000..ROWS), 1)
                .iter()
                .zip(rates(&angles, interpretation, &(8000..ROWS), 1))
                .fold(0.0, |most, (left, clean)| f64::max(most, (left - clean).abs()));
            // Amplitude and phase are known to 0.02, the frequency to 0.03 of the amplitude at the ends.
            assert!(largest < 0.12, "{largest}");
        }
    }
}
