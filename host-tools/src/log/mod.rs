//! Logs: read, written, and asked what their columns mean.
//!
//! In and out: CSV (`.csv`) or Parquet (`.parquet`), told by the ending; columns of `f64` in SI units, `t_s` always, rising; notes
//! `# key: value` in their order. A [`Log`] holds what is known ([`KNOWN`]) and lists the rest; every number in it is finite and every
//! time later than the one before, so that nothing after the reader has to ask again. What a note says of a column (window, filter,
//! least significant bit) is understood here; a note about a known column that is not understood is a warning, never silence.
//!
//! * a *row* is a sample, counted from 1; a *segment* is a run of rows without a gap (a step above 1.5 × the median interval);
//! * a *quantum* is the least significant bit of a channel, in the channel's unit.

mod columns;
mod csv;
mod csv_write;
mod error;
mod notes;
mod one_column;
mod parquet;
pub mod plausible;
mod quantum;

use crate::statistics::robust::median;
use std::ops::Range;
use std::path::{Path, PathBuf};

pub use columns::{KNOWN, KnownColumn, known};
pub use csv_write::CsvWriter;
pub use error::{LogError, Trouble};
pub use notes::{HowMade, Source, Voltage};
pub use one_column::{OneColumn, times};

/// A step longer than this many median intervals is a gap (interfaces.md).
pub const GAP_INTERVALS: f64 = 1.5;

/// One column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name with its unit, e.g. `omega_rad_s`.
    pub name: String,
    /// One number a row, all finite.
    pub values: Vec<f64>,
}

/// One log in memory: columns of equal length, at least one row, `t_s` rising.
#[derive(Debug, Clone)]
pub struct Log {
    path: PathBuf,
    columns: Vec<Column>,
    ignored: Vec<String>,
    notes: Vec<(String, String)>,
    warnings: Vec<String>,
    median_dt_s: f64,
}

/// The two forms of a log's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Text, `.csv`
    Csv,
    /// Columns, `.parquet`
    Parquet,
}

impl Format {
    /// The form that the ending of `path` names.
    pub fn of(path: &Path) -> Result<Format, LogError> {
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("csv") => Ok(Format::Csv),
            Some("parquet") => Ok(Format::Parquet),
            _ => Err(LogError::new(path, Trouble::Ending)),
        }
    }
}

impl Log {
    /// Reads the log at `path`; columns of unknown name are listed in [`Log::ignored`] and not read.
    ///
    /// # Errors
    /// One line that names file, row and column, for a file that cannot be opened or is no log (interfaces.md, "Logs").
    pub fn read(path: impl AsRef<Path>) -> Result<Log, LogError> {
        Log::read_also(path, &[])
    }

    /// The same, with columns that interfaces.md does not know but this caller does.
    ///
    /// # Errors
    /// As [`Log::read`]; a name of `also` that the file lacks is no error.
    pub fn read_also(path: impl AsRef<Path>, also: &[&str]) -> Result<Log, LogError> {
        let path = path.as_ref();
        let wanted = |name: &str| known(name).is_some() || also.contains(&name);
        Log::assemble(path, read_parts(path, &mut Wanted { column: &wanted, times: None })?)
    }

    /// A log from what a program holds; `path` is the name it goes by in messages.
    ///
    /// # Errors
    /// Columns of different length, doubled names, no `t_s`, no row, a number that is not finite, a time that does not rise.
    pub fn new(path: impl AsRef<Path>, columns: Vec<Column>, notes: Vec<(String, String)>) -> Result<Log, LogError> {
        let path = path.as_ref();
        let rows = columns.first().map_or(0, |c| c.values.len());
        for (k, column) in columns.iter().enumerate() {
            if columns[..k].iter().any(|c| c.name == column.name) {
                return Err(LogError::new(path, Trouble::Doubled).column(&column.name));
            }
            if column.values.len() != rows {
                return Err(LogError::new(path, Trouble::Length { length: column.values.len(), other: rows }).column(&column.name));
            }
            if let Some(row) = column.values.iter().position(|v| !v.is_finite()) {
                return Err(LogError::new(path, Trouble::NotFinite(column.values[row].to_string())).row(row + 1).column(&column.name));
            }
        }
        if let Some(t_s) = columns.iter().find(|c| c.name == "t_s")
            && let Some(k) = t_s.values.windows(2).position(|w| w[1] <= w[0])
        {
            return Err(LogError::new(path, Trouble::time(t_s.values[k], t_s.values[k + 1])).row(k + 2).column("t_s"));
        }
        Log::assemble(path, Parts { columns, notes, ..Parts::default() })
    }

    /// The last checks, common to both forms: `t_s` is there, so is a row. The readers have checked each number.
    fn assemble(path: &Path, parts: Parts) -> Result<Log, LogError> {
        let Parts { columns, ignored, notes, mut warnings } = parts;
        let Some(t_s) = columns.iter().find(|c| c.name == "t_s") else {
            return Err(LogError::new(path, Trouble::NoTime { has: names(&columns, &ignored) }));
        };
        if t_s.values.is_empty() {
            return Err(LogError::new(path, Trouble::NoRows));
        }
        let median_dt_s = median_interval(&t_s.values);
        warnings.extend(notes::warnings(&notes));
        Ok(Log { path: path.to_owned(), columns, ignored, notes, warnings, median_dt_s })
    }

    /// Writes the log to `path`, in the form that its ending names; the columns that were read, the notes, nothing else.
    ///
    /// # Errors
    /// The ending is unknown, or the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), LogError> {
        let path = path.as_ref();
        match Format::of(path)? {
            Format::Csv => csv_write::write(self, path),
            Format::Parquet => parquet::write(self, path),
        }
    }

    /// Where the log was read from, or the name it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The columns in the file's order.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The numbers of a column; `None` where the log has no such column.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }

    /// Time of each row, s.
    pub fn t_s(&self) -> &[f64] {
        self.column("t_s").unwrap_or(&[])
    }

    /// Names of the columns that were not read.
    pub fn ignored(&self) -> &[String] {
        &self.ignored
    }

    /// The notes in the file's order; a `#` line without a key is here as `comment`.
    pub fn notes(&self) -> &[(String, String)] {
        &self.notes
    }

    /// The first note of that key.
    pub fn note(&self, key: &str) -> Option<&str> {
        self.notes.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }

    /// What the person should hear about the file: notes that were not understood, and the like; a line each.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Number of rows, at least one.
    pub fn len(&self) -> usize {
        self.t_s().len()
    }

    /// Always false: a log without rows is an error of the reader.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Median interval between rows, s; 0 where there is one row only.
    pub fn median_dt_s(&self) -> f64 {
        self.median_dt_s
    }

    /// Time from the first row to the last and one median interval more, s: 30 000 rows at 1 kHz are 30 s.
    pub fn duration_s(&self) -> f64 {
        let t_s = self.t_s();
        t_s.last().zip(t_s.first()).map_or(0.0, |(last, first)| last - first) + self.median_dt_s
    }

    /// Runs of rows without a gap, in order; they cover all rows.
    pub fn segments(&self) -> Vec<Range<usize>> {
        let t_s = self.t_s();
        let longest = GAP_INTERVALS * self.median_dt_s;
        let mut segments = Vec::new();
        let mut from = 0;
        for k in 1..t_s.len() {
            if t_s[k] - t_s[k - 1] > longest {
                segments.push(from..k);
                from = k;
            }
        }
        segments.push(from..t_s.len());
        segments
    }

    /// Least significant bit of a column in its own unit: from a note, else from the numbers; `None` where they are continuous.
    pub fn quantum(&self, column: &str) -> Option<f64> {
        let values = self.column(column)?;
        notes::quantum(&self.notes, column).or_else(|| quantum::found(values))
    }

    /// How a column was made: the convention of interfaces.md, and what the notes say otherwise.
    pub fn column_made(&self, column: &str) -> HowMade {
        notes::column_made(&self.notes, column).0
    }

    /// What `u_V` is: asked for (the default) or measured at the terminals.
    pub fn voltage(&self) -> Voltage {
        notes::voltage(&self.notes)
    }

    /// The angle's zero is the index (`# theta_zero: index`); else it is arbitrary.
    pub fn theta_zero_is_index(&self) -> bool {
        self.note("theta_zero").is_some_and(|v| v.trim().eq_ignore_ascii_case("index"))
    }
}

/// What a reader is asked for.
struct Wanted<'a> {
    /// The columns by name.
    column: &'a dyn Fn(&str) -> bool,
    /// Who is told the times, row by row; they are then not kept.
    times: Option<&'a mut dyn FnMut(f64)>,
}

impl Wanted<'_> {
    fn keeps(&self, name: &str) -> bool {
        name != "t_s" || self.times.is_none()
    }
}

/// The parts of the file, in either form.
fn read_parts(path: &Path, wanted: &mut Wanted<'_>) -> Result<Parts, LogError> {
    match Format::of(path)? {
        Format::Csv => csv::read(path, wanted),
        Format::Parquet => parquet::read(path, wanted),
    }
}

/// What a reader hands over.
#[derive(Debug, Default)]
struct Parts {
    columns: Vec<Column>,
    ignored: Vec<String>,
    notes: Vec<(String, String)>,
    warnings: Vec<String>,
}

/// All columns that a file has, for a message.
fn names(read: &[Column], ignored: &[String]) -> String {
    read.iter().map(|c| c.name.as_str()).chain(ignored.iter().map(String::as_str)).collect::<Vec<_>>().join(", ")
}

/// Median of the steps; of at most some hundred thousand of them, taken evenly, so that an hour's log needs no second column.
fn median_interval(t_s: &[f64]) -> f64 {
    const MOST: usize = 200_000;
    let stride = t_s.len().div_ceil(MOST).max(1);
    median((1..t_s.len()).step_by(stride).map(|k| t_s[k] - t_s[k - 1])).unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
