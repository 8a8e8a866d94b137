//! The least significant bit of a channel, found from its numbers.
//!
//! Spacings of the sorted distinct values are whole multiples of the LSB where the channel is quantised; where it is continuous the
//! smallest spacing is chance and the others do not fit it.

use crate::statistics::Extremes;

/// Most rows that are looked at.
const MOST: usize = 40_000;
/// Fewer levels than this are a command's, not a converter's.
const FEWEST_LEVELS: usize = 16;
/// Spacings above this many LSB say nothing: rounding adds up.
const WIDEST: f64 = 40.0;
/// Share of the spacings that must fit, and how well.
const SHARE: f64 = 0.95;
const FIT: f64 = 0.06;
/// Finer than this part of the largest value is the number format, not a converter: single and double precision.
const FORMAT_SINGLE: f64 = 1e-6;
const FORMAT_DOUBLE: f64 = 1e-12;

/// The LSB of `values`, in their unit; `None` where they are continuous or too few.
pub(super) fn found(values: &[f64]) -> Option<f64> {
    let rows = values.len();
    if rows <= MOST {
        return of_stretch(values);
    }
    // The begin may be at rest.
    let middle = (rows - MOST) / 2;
    of_stretch(&values[..MOST]).or_else(|| of_stretch(&values[middle..middle + MOST]))
}

/// By the values, or where they lie many LSB apart (an angle that goes on and on) by their steps from row to row.
fn of_stretch(values: &[f64]) -> Option<f64> {
    let largest = values.iter().copied().max_abs();
    let is_single = values.iter().all(|&v| f64::from(v as f32) == v);
    let finest = largest * if is_single { FORMAT_SINGLE } else { FORMAT_DOUBLE };
    let spacings = spacings(values.to_vec(), finest);
    if spacings.len() + 1 < FEWEST_LEVELS {
        return None;
    }
    if let Some(lsb) = of_spacings(&spacings, finest, FEWEST_LEVELS) {
        return Some(lsb);
    }
    let many = spacings.len() > values.len() / 4;
    many.then(|| of_spacings(&self::spacings(values.windows(2).map(|w| w[1] - w[0]).collect(), finest), finest, 3)).flatten()
}

/// Spacings between the distinct values, rising.
fn spacings(mut values: Vec<f64>, finest: f64) -> Vec<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let mut spacings: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).filter(|&d| d > 0.1 * finest).collect();
    spacings.sort_unstable_by(f64::total_cmp);
    spacings
}

fn of_spacings(spacings: &[f64], finest: f64, fewest_levels: usize) -> Option<f64> {
    // The smallest may be a rounding of the text; a few further up as well.
    [0.0, 0.01, 0.05, 0.2].iter().find_map(|share| {
        let candidate = *spacings.get((share * spacings.len().saturating_sub(1) as f64) as usize)?;
        if candidate < finest { None } else { refined(spacings, candidate, fewest_levels) }
    })
}

/// The candidate, made exact by the spacings of a few LSB; `None` where the spacings do not fit it.
fn refined(spacings: &[f64], candidate: f64, fewest_levels: usize) -> Option<f64> {
    let mut lsb = candidate;
    for widest in [2.5, 8.5, WIDEST] {
        let (mut sum, mut weight) = (0.0, 0.0);
        for spacing in spacings.iter().take_while(|s| **s < widest * lsb) {
            let count = (spacing / lsb).round();
            sum += count * spacing;
            weight += count * count;
        }
        if weight == 0.0 {
            return None;
        }
        lsb = sum / weight;
    }
    let near = spacings.partition_point(|s| *s < WIDEST * lsb);
    let fitting = spacings[..near].iter().filter(|s| {
        let count = (*s / lsb).round();
        count >= 1.0 && (*s / lsb - count).abs() < FIT
    });
    (near + 1 >= fewest_levels && fitting.count() as f64 >= SHARE * near as f64).then_some(lsb)
}
