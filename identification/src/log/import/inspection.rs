//! What a file of any program contains: rows, rate, gaps, and for each column its range, resolution, saturation and what it is believed to
//! be.

use std::path::{Path, PathBuf};

use super::guess::{Belief, Evidence};
use super::mapping::{self, ImportMapping, Statements, file_of};
use super::questions::{self, Question};
use super::table::{Dialect, Table, TableColumn};
use super::{read, read_table};
use crate::files;
use crate::log::error::LogError;
use crate::log::warning::LogWarning;
use crate::log::{Intervals, Log, Selection, known, quantization, saturation};
use crate::statistics::Extremes;

/// One column.
#[derive(Debug, Clone)]
pub struct ColumnInspection {
    /// Its position in the file, from 1.
    pub position: usize,
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
#[derive(Debug)]
pub struct Inspection {
    /// The file.
    pub path: PathBuf,
    /// Number of rows.
    pub rows: usize,
    /// Lines before the header that are not notes.
    pub preamble: usize,
    /// How the text is separated; `None` for other formats.
    pub dialect: Option<Dialect>,
    /// A line of words before the rows that does not fit their columns.
    pub unmatched_header: Option<String>,
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
    /// What the user must decide before the mapping can be accepted.
    pub questions: Vec<Question>,
    /// What the reader says about the file when it reads it by this mapping.
    pub warnings: Vec<LogWarning>,
    /// Why the file cannot be read by this mapping.
    pub refusal: Option<LogError>,
    /// Ratio of the rate to the derivative of the angle in their units, where it is not 1.
    pub rate_over_derivative: Option<f64>,
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
}

/// Inspects the file at `path`, with what the import file and the user state about it.
///
/// # Errors
/// The file cannot be read, or a statement does not fit it.
pub fn inspect(path: &Path, stated: &Statements) -> Result<Inspection, LogError> {
    inspect_with_table(path, stated).map(|(inspection, _)| inspection)
}

/// As [`inspect`], with the table that the file contains.
///
/// # Errors
/// As [`inspect`].
pub fn inspect_with_table(path: &Path, stated: &Statements) -> Result<(Inspection, Table), LogError> {
    let stored = ImportMapping::beside(path)?;
    let table = read_table(path, stored.as_ref().and_then(|m| m.text.as_ref()))?;
    let mut inspection = inspect_table(path, &table, stored.as_ref(), stated)?;
    inspection.is_own &= Log::read(path).is_ok_and(|log| log.columns().len() > 1);
    inspection.is_mapped = file_of(path).is_file();
    Ok((inspection, table))
}

/// Inspects a table, with what an import file (`stored`) and the user state about it; `path` is its name in messages.
///
/// # Errors
/// A statement does not fit the table.
pub fn inspect_table(path: &Path, table: &Table, stored: Option<&ImportMapping>, stated: &Statements) -> Result<Inspection, LogError> {
    let (beliefs, questions) = mapping::beliefs(path, table, stored, stated)?;
    let mut made = ImportMapping::of(&beliefs, table);
    made.sample_rate_Hz = stated.sample_rate_Hz.or(stored.and_then(|m| m.sample_rate_Hz));
    made.notes = stored.map(|m| m.notes.clone()).unwrap_or_default();
    for (key, text) in &stated.notes {
        if text.is_empty() {
            made.notes.remove(key);
        } else {
            made.notes.insert(key.clone(), text.clone());
        }
    }
    // A log of the project whose other columns would be something, under other names, is to be imported.
    let renamed = beliefs.iter().any(|b| b.evidence != Evidence::OwnName && b.target.as_deref().is_some_and(|t| known(t).is_some()));
    let is_own = stored.is_none() && stated.is_empty() && !renamed;
    // The file is read as the other commands will read it: what is said about it is what they do.
    let is_read = |name: &str| known(name).is_some();
    let read = read::contents(path, table, &made, &mut Selection { column: &is_read, times: None, lenient: false });
    let (timing, warnings, refusal) = match read {
        Ok(contents) => {
            let times = contents.columns.iter().find(|c| c.name == "t_s");
            let timing = times.filter(|c| c.values.len() > 1).map(|c| TimingInspection::of(&c.values));
            let said = contents.warnings.into_iter().filter(|w| !matches!(w, LogWarning::Imported { .. }));
            (timing, said.collect(), None)
        }
        Err(error) => (None, Vec::new(), Some(error)),
    };
    let rate_over_derivative = questions::rate_over_derivative(table, &beliefs).filter(|_| questions.is_empty());
    let columns = beliefs.iter().zip(&table.columns).map(|(belief, column)| column_inspection(belief.clone(), column)).collect();
    Ok(Inspection {
        path: path.to_owned(),
        rows: table.rows(),
        preamble: table.preamble,
        dialect: table.dialect,
        unmatched_header: table.unmatched_header.clone(),
        timing,
        columns,
        is_own,
        is_mapped: stored.is_some(),
        mapping: made,
        questions,
        warnings,
        refusal,
        rate_over_derivative,
    })
}

impl Inspection {
    /// Writes the import file, by which [`Log::read`] reads the log from then on; its path. The log is read once, so that what cannot be
    /// read is found now.
    ///
    /// # Errors
    /// The file system fails, or the log cannot be read by the mapping: an earlier import file then stays.
    pub fn accept(&self) -> Result<PathBuf, LogError> {
        let file = file_of(&self.path);
        let before = std::fs::read_to_string(&file).ok();
        let written = self.mapping.write_beside(&self.path)?;
        if let Err(error) = Log::read(&self.path) {
            // The reading failed; that is what the user must know, whatever the file system says now.
            let _ = match before {
                Some(text) => files::replace_text(&file, &text),
                None => std::fs::remove_file(&file),
            };
            return Err(error);
        }
        Ok(written)
    }
}

impl TimingInspection {
    fn of(t: &[f64]) -> TimingInspection {
        let Intervals { median_s: interval_s, longest_s: longest, .. } = Intervals::of(t);
        let steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
        let regular: Vec<f64> = steps.iter().copied().filter(|s| *s > 0.0 && *s <= longest).collect();
        let square = regular.iter().map(|s| (s / interval_s - 1.0).powi(2)).sum::<f64>() / regular.len().max(1) as f64;
        TimingInspection {
            duration_s: t[t.len() - 1] - t[0],
            interval_s,
            jitter: square.sqrt(),
            gaps: steps.iter().filter(|s| **s > longest).count(),
            longest_s: steps.iter().copied().fold(0.0, f64::max),
        }
    }
}

fn column_inspection(belief: Belief, column: &TableColumn) -> ColumnInspection {
    let values: Vec<f64> = column.values.iter().map(|v| v + column.origin).filter(|v| v.is_finite()).collect();
    let range = (!values.is_empty()).then(|| values.iter().copied().min_max());
    let is_constant = range.is_some_and(|(low, high)| low == high);
    let is_time = belief.target.as_deref() == Some("t_s");
    let saturated_rows = if is_time { 0 } else { saturation::rows_at_limits(&values).len() };
    ColumnInspection {
        range,
        missing: column.missing(),
        quantization_step: if is_constant || is_time { None } else { quantization::step(&values) },
        saturated_rows,
        is_constant,
        text: column.text.clone(),
        position: column.position,
        belief,
    }
}
