//! What a file of any program contains: rows, rate, gaps, and for each column its range, resolution, saturation and what it is believed to be.

use std::path::{Path, PathBuf};

use super::guess::Belief;
use super::mapping::{self, ImportMapping, Statements, file_of};
use super::read_table;
use super::table::{Dialect, TableColumn};
use crate::log::error::LogError;
use crate::log::{Log, intervals, quantization};
use crate::statistics::Extremes;

/// Rows in a row at the largest or smallest value that make a flat top.
const FLAT_TOP_ROWS: usize = 3;
/// Flat tops from which on a column is believed to be limited.
const MIN_FLAT_TOPS: usize = 2;
/// Distinct values from which on a column is a measurement: a setpoint rests at its ends.
const MIN_LEVELS: usize = 16;

/// One column.
#[derive(Debug, Clone)]
pub struct ColumnInspection {
    /// What it is believed to be.
    pub belief: Belief,
    /// Smallest and largest number, in the unit of the file; `None` where no cell is a number.
    pub range: Option<(f64, f64)>,
    /// Cells without a number.
    pub missing: usize,
    /// Smallest step of the numbers, in the unit of the file; `None`: continuous.
    pub quantization_step: Option<f64>,
    /// Rows at the largest or smallest value, where these are flat tops.
    pub saturated_rows: usize,
    /// All numbers are equal.
    pub is_constant: bool,
    /// The first cell that is no number.
    pub text: Option<(usize, String)>,
}

/// What a file contains.
#[derive(Debug, Clone)]
pub struct Inspection {
    /// The file.
    pub path: PathBuf,
    /// Number of rows.
    pub rows: usize,
    /// Lines before the header that are not notes.
    pub preamble: usize,
    /// How the text is separated; `None` for other formats.
    pub dialect: Option<Dialect>,
    /// Times of the rows; `None` where no column is a time.
    pub timing: Option<TimingInspection>,
    /// The columns, in the order of the file.
    pub columns: Vec<ColumnInspection>,
    /// The log is one of the project's own and needs no import.
    pub is_own: bool,
    /// The import file exists.
    pub is_mapped: bool,
    /// The mapping that the beliefs make.
    pub mapping: ImportMapping,
}

/// Times of the rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimingInspection {
    /// From the first to the last row, s.
    pub duration_s: f64,
    /// Median interval, s.
    pub interval_s: f64,
    /// Rms deviation of the intervals from their median without gaps, part of it.
    pub jitter: f64,
    /// Steps that are gaps.
    pub gaps: usize,
    /// The longest step, s.
    pub longest_s: f64,
    /// Steps back or repeated times.
    pub disorder: usize,
}

/// Inspects the file at `path`, with what the import file and the user state about it.
///
/// # Errors
/// The file cannot be read, or a statement does not fit it.
pub fn inspect(path: &Path, stated: &Statements) -> Result<Inspection, LogError> {
    let stored = ImportMapping::beside(path)?;
    let table = read_table(path, stored.as_ref().and_then(|m| m.text.as_ref()))?;
    let beliefs = mapping::beliefs(path, &table, stored.as_ref(), stated)?;
    let mut made = ImportMapping::of(&beliefs, &table);
    made.sample_rate_Hz = stated.sample_rate_Hz.or(stored.as_ref().and_then(|m| m.sample_rate_Hz));
    made.notes = stored.as_ref().map(|m| m.notes.clone()).unwrap_or_default();
    made.notes.extend(stated.notes.iter().cloned());
    let is_own = stored.is_none() && stated.is_empty() && Log::read(path).is_ok_and(|log| log.ignored().len() < log.columns().len());
    let time = beliefs.iter().position(|b| b.target.as_deref() == Some("t_s"));
    let timing = match (time, made.sample_rate_Hz) {
        (_, Some(rate_Hz)) => Some(TimingInspection {
            duration_s: table.rows() as f64 / rate_Hz,
            interval_s: 1.0 / rate_Hz,
            jitter: 0.0,
            gaps: 0,
            longest_s: 1.0 / rate_Hz,
            disorder: 0,
        }),
        (Some(k), None) => {
            let scale = beliefs[k].unit.as_ref().map_or(1.0, |u| u.scale);
            let t: Vec<f64> = table.columns[k].values.iter().filter(|v| v.is_finite()).map(|v| v * scale).collect();
            (t.len() > 2).then(|| TimingInspection::of(&t))
        }
        _ => None,
    };
    let columns = beliefs.iter().zip(&table.columns).map(|(belief, column)| column_inspection(belief.clone(), column)).collect();
    Ok(Inspection {
        path: path.to_owned(),
        rows: table.rows(),
        preamble: table.preamble,
        dialect: table.dialect,
        timing,
        columns,
        is_own,
        is_mapped: file_of(path).is_file(),
        mapping: made,
    })
}

impl TimingInspection {
    fn of(t: &[f64]) -> TimingInspection {
        let (interval_s, longest) = intervals(t);
        let steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
        let regular: Vec<f64> = steps.iter().copied().filter(|s| *s > 0.0 && *s <= longest).collect();
        let square = regular.iter().map(|s| (s / interval_s - 1.0).powi(2)).sum::<f64>() / regular.len().max(1) as f64;
        TimingInspection {
            duration_s: t[t.len() - 1] - t[0],
            interval_s,
            jitter: square.sqrt(),
            gaps: steps.iter().filter(|s| **s > longest).count(),
            longest_s: steps.iter().copied().fold(0.0, f64::max),
            disorder: steps.iter().filter(|s| **s <= 0.0).count(),
        }
    }
}

fn column_inspection(belief: Belief, column: &TableColumn) -> ColumnInspection {
    let values: Vec<f64> = column.values.iter().copied().filter(|v| v.is_finite()).collect();
    let range = (!values.is_empty()).then(|| values.iter().copied().min_max());
    let is_constant = range.is_some_and(|(low, high)| low == high);
    let is_time = belief.target.as_deref() == Some("t_s");
    let saturated_rows = match range {
        Some((low, high)) if !is_constant && !is_time && has_levels(&values) => {
            let at = |end: f64| {
                let tops = values.chunk_by(|a, b| (*a == end) == (*b == end)).filter(|run| run[0] == end && run.len() >= FLAT_TOP_ROWS);
                tops.fold((0, 0), |(runs, rows), run| (runs + 1, rows + run.len()))
            };
            let (low, high) = (at(low), at(high));
            let limited = |(runs, rows): (usize, usize)| if runs >= MIN_FLAT_TOPS { rows } else { 0 };
            limited(low) + limited(high)
        }
        _ => 0,
    };
    ColumnInspection {
        range,
        missing: column.missing(),
        quantization_step: if is_constant || is_time { None } else { quantization::step(&values) },
        saturated_rows,
        is_constant,
        text: column.text.clone(),
        belief,
    }
}

fn has_levels(values: &[f64]) -> bool {
    let mut levels: Vec<f64> = Vec::new();
    for value in values {
        if !levels.contains(value) {
            levels.push(*value);
            if levels.len() >= MIN_LEVELS {
                return true;
            }
        }
    }
    false
}
