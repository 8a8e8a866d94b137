//! Finds the quantization step (least significant bit) of a channel from its values.
//!
//! For a quantized channel the spacings of the sorted distinct values are whole multiples of the step; for a continuous channel they are
//! not.

use crate::statistics::Extremes;

/// Number of successive rows that are examined, at most.
const MAX_ROWS: usize = 40_000;
/// Number of levels below which the values are those of a setpoint and not of a converter.
const MIN_LEVELS: usize = 16;
/// Spacings above this number of steps are not used: their rounding errors add up.
const MAX_SPACING_STEPS: f64 = 40.0;
/// Fraction of the spacings that must be multiples of the step.
const MIN_FITTING_FRACTION: f64 = 0.95;
/// Largest deviation from a multiple, in steps.
const MAX_DEVIATION: f64 = 0.06;
/// Relative spacing below which the step is that of the number format, for single and double precision.
const SINGLE_PRECISION: f64 = 1e-6;
const DOUBLE_PRECISION: f64 = 1e-12;

/// The quantization step of `values`, in their unit; `None` if they are continuous or too few.
pub(in crate::log) fn step(values: &[f64]) -> Option<f64> {
    let rows = values.len();
    if rows <= MAX_ROWS {
        return of_rows(values);
    }
    // The stand may be at rest at the beginning.
    let middle = (rows - MAX_ROWS) / 2;
    of_rows(&values[..MAX_ROWS]).or_else(|| of_rows(&values[middle..middle + MAX_ROWS]))
}

/// The step from the values; if they are many steps apart (an angle that increases), from the differences of successive rows.
fn of_rows(values: &[f64]) -> Option<f64> {
    let largest = values.iter().copied().max_abs();
    let is_single = values.iter().all(|&v| f64::from(v as f32) == v);
    let finest = largest * if is_single { SINGLE_PRECISION } else { DOUBLE_PRECISION };
    let spacings = spacings(values.to_vec(), finest);
    if spacings.len() + 1 < MIN_LEVELS {
        return None;
    }
    if let Some(lsb) = of_spacings(&spacings, finest, MIN_LEVELS) {
        return Some(lsb);
    }
    let many = spacings.len() > values.len() / 4;
    many.then(|| of_spacings(&self::spacings(values.windows(2).map(|w| w[1] - w[0]).collect(), finest), finest, 3)).flatten()
}

/// Spacings between the distinct values, in increasing order.
fn spacings(mut values: Vec<f64>, finest: f64) -> Vec<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let mut spacings: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).filter(|&d| d > 0.1 * finest).collect();
    spacings.sort_unstable_by(f64::total_cmp);
    spacings
}

fn of_spacings(spacings: &[f64], finest: f64, min_levels: usize) -> Option<f64> {
    // The smallest spacings may be rounding errors of the text.
    [0.0, 0.01, 0.05, 0.2].iter().find_map(|fraction| {
        let candidate = *spacings.get((fraction * spacings.len().saturating_sub(1) as f64) as usize)?;
        if candidate < finest { None } else { refined(spacings, candidate, min_levels) }
    })
}

/// Refines the candidate by the spacings of a few steps; `None` if the spacings are not multiples of it.
fn refined(spacings: &[f64], candidate: f64, min_levels: usize) -> Option<f64> {
    let mut lsb = candidate;
    for widest in [2.5, 8.5, MAX_SPACING_STEPS] {
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
    let near = spacings.partition_point(|s| *s < MAX_SPACING_STEPS * lsb);
    let fitting = spacings[..near].iter().filter(|s| {
        let count = (*s / lsb).round();
        count >= 1.0 && (*s / lsb - count).abs() < MAX_DEVIATION
    });
    (near + 1 >= min_levels && fitting.count() as f64 >= MIN_FITTING_FRACTION * near as f64).then_some(lsb)
}
