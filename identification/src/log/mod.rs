//! Reads and writes logs: recorded columns with their notes.
//!
//! In and out: CSV (`.csv`) or Parquet (`.parquet`), selected by the ending of the name; columns of `f64` in SI units, among them `t_s`,
//! which increases; [`Notes`] `# key: value` in their order. A [`Log`] contains the columns of defined meaning ([`KNOWN`]) and lists the
//! names of the others. The readers check that every value is finite and that time increases.
//!
//! A *row* is a sample, counted from 1. A *segment* is a sequence of rows without a gap (a step above 1.5 × the median interval, or above
//! what is usual for a logger with irregular steps).

pub mod axis;
mod block_writer;
mod caught;
mod columns;
mod csv;
mod csv_write;
mod error;
pub mod import;
mod limits;
mod notes;
mod one_column;
mod parquet;
pub mod plausible;
mod quantization;
mod saturation;
mod time_base;
mod unwrap;
mod warning;

use crate::files;
use crate::statistics::robust::{self, MEDIAN_ABS_PER_SIGMA, median_in_place};
use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};

pub use axis::Axis;
pub use block_writer::BlockWriter;
pub use columns::{KNOWN, KnownColumn, known};
pub use csv_write::CsvWriter;
pub use error::{LogError, LogErrorKind};
pub use notes::{FaultNote, Note, Notes, Provenance, RateSource, VoltageSource, microseconds, timestamp};
pub use one_column::{OneColumn, times};
pub(crate) use saturation::rows_at_limits;
pub use warning::{LogWarning, WordForm};

/// A step in time above this number of median intervals is a gap, if the jitter of the time is small.
pub const GAP_INTERVALS: f64 = 1.5;
/// Rows that determine the initial states of a segment; a shorter one is not compared.
pub const MIN_SEGMENT_ROWS: usize = 20;
/// Part of the rows that gaps may leave in segments that are too short. Lost rows are rare: where long steps would cost more, they are the
/// usual steps of a logger that writes at events or when it has time, and each row is integrated over its own length.
const MAX_SHORT_FRACTION: f64 = 0.1;
/// Quantiles of the steps of such a logger, of which the first suffices that leaves enough rows.
const IRREGULAR_QUANTILES: [f64; 4] = [0.9, 0.95, 0.99, 0.999];
/// Robust standard deviations of the steps by which a gap exceeds the median interval: jitter is no gap.
const GAP_SIGMAS: f64 = 6.0;

/// One column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name with its unit, e.g. `omega_rad_s`.
    pub name: String,
    /// One finite value for each row.
    pub values: Vec<f64>,
}

/// A log in memory: columns of equal length, at least one row, increasing `t_s`.
#[derive(Debug, Clone)]
pub struct Log {
    path: PathBuf,
    columns: Vec<Column>,
    ignored: Vec<String>,
    notes: Notes,
    warnings: Vec<LogWarning>,
    median_dt_s: f64,
    longest_step_s: f64,
    runs: Vec<Run>,
}

/// A recording of its own within a log: one of several logs that were joined, or of several runs in one file.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Its rows.
    pub rows: Range<usize>,
    /// Time of the log less the run's own time, s.
    pub shift_s: f64,
}

/// Format of a log file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Text, `.csv`
    Csv,
    /// Columns, `.parquet`
    Parquet,
}

impl Format {
    /// The format that the ending of `path` selects.
    pub fn of(path: &Path) -> Result<Format, LogError> {
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("csv") => Ok(Format::Csv),
            Some("parquet") => Ok(Format::Parquet),
            _ => Err(LogError::new(path, LogErrorKind::Ending)),
        }
    }
}

/// Rate of the sensor under test, the age of its samples, and that of the compared rate.
const DUT_RATE: &str = "gyro_rad_s";
const DUT_AGE: &str = "sensor_age_s";
const RATE_AGE: &str = "rate_age_s";

impl Log {
    /// Reads the log at `path`. Columns of unknown name are not read; [`Log::ignored`] lists them.
    ///
    /// # Errors
    /// The file cannot be opened, or is not a log; the text names file, row and column.
    pub fn read(path: impl AsRef<Path>) -> Result<Log, LogError> {
        Log::read_also(path, &[])
    }

    /// Reads the log at `path` with the additional columns `also`.
    ///
    /// # Errors
    /// As [`Log::read`]. A column of `also` that the file lacks is not an error.
    pub fn read_also(path: impl AsRef<Path>, also: &[&str]) -> Result<Log, LogError> {
        let path = path.as_ref();
        let selection = |name: &str| known(name).is_some() || also.contains(&name);
        Log::assemble(path, read_contents(path, &mut Selection { column: &selection, times: None, lenient: false })?)
    }

    /// Reads the log at `path` with all its columns, as the file has them: a wrapped angle stays wrapped.
    ///
    /// # Errors
    /// As [`Log::read`]; a column that is not numeric is an error too.
    pub fn read_all(path: impl AsRef<Path>) -> Result<Log, LogError> {
        let path = path.as_ref();
        Log::assemble(path, read_file(path, &mut Selection { column: &|_| true, times: None, lenient: false })?)
    }

    /// A log of given columns and notes; `path` is its name in messages.
    ///
    /// # Errors
    /// Columns of different length, duplicate names, no `t_s`, no row, a value that is not finite, or a time that does not increase.
    pub fn new(path: impl AsRef<Path>, columns: Vec<Column>, notes: impl Into<Notes>) -> Result<Log, LogError> {
        Log::checked(path.as_ref(), FileContents { columns, notes: notes.into(), ..FileContents::default() })
    }

    /// Checks contents that no reader has checked.
    fn checked(path: &Path, contents: FileContents) -> Result<Log, LogError> {
        let columns = &contents.columns;
        let rows = columns.first().map_or(0, |c| c.values.len());
        for (k, column) in columns.iter().enumerate() {
            if columns[..k].iter().any(|c| c.name == column.name) {
                return Err(LogError::new(path, LogErrorKind::DuplicateName).column(&column.name));
            }
            if column.values.len() != rows {
                return Err(LogError::new(path, LogErrorKind::Length { length: column.values.len(), expected: rows }).column(&column.name));
            }
            if let Some(row) = column.values.iter().position(|v| !v.is_finite()) {
                return Err(LogError::new(path, LogErrorKind::NotFinite(column.values[row].to_string())).row(row + 1).column(&column.name));
            }
        }
        if let Some(t_s) = columns.iter().find(|c| c.name == "t_s")
            && let Some(k) = t_s.values.windows(2).position(|w| w[1] <= w[0])
        {
            return Err(LogError::new(path, LogErrorKind::time(t_s.values[k], t_s.values[k + 1])).row(k + 2).column("t_s"));
        }
        Log::assemble(path, contents)
    }

    /// Checks that there is a column `t_s` and a row. The readers have checked each value.
    fn assemble(path: &Path, contents: FileContents) -> Result<Log, LogError> {
        let FileContents { columns, ignored, notes, mut warnings, runs } = contents;
        let Some(t_s) = columns.iter().find(|c| c.name == "t_s") else {
            return Err(LogError::new(path, LogErrorKind::NoTime { has: names(&columns, &ignored) }));
        };
        if t_s.values.is_empty() {
            return Err(LogError::new(path, LogErrorKind::NoRows));
        }
        let Intervals { median_s: median_dt_s, longest_s: longest_step_s, is_irregular } = Intervals::of(&t_s.values);
        warnings.extend(is_irregular.then_some(LogWarning::IrregularRows { longest_us: (longest_step_s * 1e6).round() as u64 }));
        warnings.extend(notes.not_understood());
        let mut begins = runs;
        begins.insert(0, 0);
        let ends = begins.iter().skip(1).copied().chain([t_s.values.len()]);
        // The second run of a file begins where the first did.
        let shift = |begin: usize| t_s.values[begin] - t_s.values[0];
        let runs = begins.iter().zip(ends).map(|(&begin, end)| Run { rows: begin..end, shift_s: shift(begin) }).collect();
        Ok(Log { path: path.to_owned(), columns, ignored, notes, warnings, median_dt_s, longest_step_s, runs })
    }

    /// The log with these runs, which follow each other and together have all its rows, and with the warnings about their files.
    pub fn with_runs(mut self, runs: Vec<Run>, warnings: Vec<LogWarning>) -> Log {
        self.runs = runs;
        self.warnings = warnings;
        self
    }

    /// The recordings of which the log consists; one, unless several logs were joined or the clock of the file restarts.
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// Time of each row by the clock of its run, s.
    pub fn own_times_s(&self) -> Cow<'_, [f64]> {
        let t_s = self.t_s();
        match &self.runs[..] {
            [] | [_] => Cow::Borrowed(t_s),
            runs => runs.iter().flat_map(|run| t_s[run.rows.clone()].iter().map(|t| t - run.shift_s)).collect(),
        }
    }

    /// Writes columns and notes to `path`, in the format that its ending selects.
    ///
    /// # Errors
    /// The ending is unknown, or the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), LogError> {
        let path = path.as_ref();
        let format = Format::of(path)?;
        let written = files::replace(path, |file| BlockWriter::new(format, file, self)?.finish());
        written.map_err(|e| LogError::new(path, LogErrorKind::Write(e)))
    }

    /// As [`Log::write`], into a file that does not exist.
    ///
    /// # Errors
    /// As [`Log::write`]; the file exists.
    pub fn write_new(&self, path: impl AsRef<Path>) -> Result<(), LogError> {
        let path = path.as_ref();
        let format = Format::of(path)?;
        let written = files::create_new(path, |file| BlockWriter::new(format, file, self)?.finish());
        written.map_err(|e| LogError::new(path, LogErrorKind::Write(e)))
    }

    /// Path that the log was read from, or its given name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The columns, in the order of the file.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The values of a column; `None` if the log has no such column.
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

    /// The notes, in the order of the file.
    pub fn notes(&self) -> &Notes {
        &self.notes
    }

    /// Replaces scattered time stamps of evenly spaced readings by even times, with a warning.
    pub fn even_out_times(&mut self) {
        let columns = ["theta_rad", "omega_rad_s", "i_A"].into_iter().filter_map(|name| self.column(name)).collect::<Vec<_>>();
        let Some((even, scatter_s)) = time_base::even_times(self.t_s(), &self.segments(), &columns) else { return };
        let intervals = Intervals::of(&even);
        (self.median_dt_s, self.longest_step_s) = (intervals.median_s, intervals.longest_s);
        if let Some(time) = self.columns.iter_mut().find(|c| c.name == "t_s") {
            time.values = even;
        }
        self.warnings.push(LogWarning::EvenTimes { scatter_us: (scatter_s * 1e6).round() as u64 });
    }

    /// Age at t_k of the reading of the rate, s, where the log has it.
    pub fn rate_age_s(&self) -> Option<&[f64]> {
        self.column(RATE_AGE)
    }

    /// The log with the column `name` in place of `omega_rad_s`, and with its notes: another sensor of the rate. The former rate is
    /// dropped.
    ///
    /// # Errors
    /// The log has no such column.
    pub fn with_rate(mut self, name: &str) -> Result<Log, LogError> {
        const RATE: &str = "omega_rad_s";
        if !self.columns.iter().any(|c| c.name == name) {
            let has = names(&self.columns, &self.ignored);
            return Err(LogError::new(&self.path, LogErrorKind::NoColumn { has }).column(name));
        }
        self.columns.retain(|c| c.name != RATE);
        self.columns.iter_mut().filter(|c| c.name == name).for_each(|c| c.name = RATE.to_owned());
        if name == DUT_RATE {
            self.columns.iter_mut().filter(|c| c.name == DUT_AGE).for_each(|c| c.name = RATE_AGE.to_owned());
        }
        self.notes.replace_subject(name, RATE);
        self.warnings.push(LogWarning::OtherRate { column: name.to_owned() });
        Ok(self)
    }

    /// Adds a note.
    pub fn add_note(&mut self, note: Note) {
        self.notes.push(note);
    }

    /// The value of the first note with that key.
    pub fn note(&self, key: &str) -> Option<&str> {
        self.notes.text(key)
    }

    /// Warnings about the file, for example notes that were not understood.
    pub fn warnings(&self) -> &[LogWarning] {
        &self.warnings
    }

    /// Number of rows, at least one.
    pub fn len(&self) -> usize {
        self.t_s().len()
    }

    /// Always false: the readers reject a log without rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Median interval between rows, s; 0 if there is one row only.
    pub fn median_dt_s(&self) -> f64 {
        self.median_dt_s
    }

    /// Time from the first to the last row plus one median interval, s: 30 000 rows at 1 kHz are 30 s.
    pub fn duration_s(&self) -> f64 {
        let t_s = self.t_s();
        t_s.last().zip(t_s.first()).map_or(0.0, |(last, first)| last - first) + self.median_dt_s
    }

    /// Sequences of rows without a gap, in order; together all rows.
    pub fn segments(&self) -> Vec<Range<usize>> {
        let t_s = self.t_s();
        let longest = self.longest_step_s;
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

    /// Quantization step of a column in its unit, from a note or else from the values; `None` if they are continuous.
    pub fn quantization_step(&self, column: &str) -> Option<f64> {
        let values = self.column(column)?;
        self.notes.quantization_step(column).or_else(|| quantization::step(values))
    }

    /// How a column was made: the convention, and what the notes state otherwise.
    pub fn provenance(&self, column: &str) -> Provenance {
        self.notes.provenance(column)
    }

    /// What `u_V` is: the command (the default) or the voltage at the terminals.
    pub fn voltage(&self) -> VoltageSource {
        self.notes.voltage()
    }

    /// The axis that the log is of.
    pub fn axis(&self) -> Axis {
        self.notes.axis()
    }

    /// The zero of the angle is the index of the encoder; otherwise it is arbitrary.
    pub fn theta_zero_is_index(&self) -> bool {
        self.notes.theta_zero_is_index()
    }
}

/// What a reader reads.
struct Selection<'a> {
    /// Selects columns by name.
    column: &'a dyn Fn(&str) -> bool,
    /// Callback for the time of each row; the times are then not stored.
    times: Option<&'a mut dyn FnMut(f64)>,
    /// A file of another program: a missing value is NaN, a column that is not numeric is ignored, and no column is a time.
    lenient: bool,
}

impl Selection<'_> {
    fn keeps(&self, name: &str) -> bool {
        name != "t_s" || self.times.is_none()
    }
}

/// Reads a file of either format, or of another program if it has an import file.
fn read_file(path: &Path, selection: &mut Selection<'_>) -> Result<FileContents, LogError> {
    if let Some(mapping) = import::ImportMapping::beside(path)? {
        return import::contents(path, &mapping, selection);
    }
    // Columns of a linear axis have the names of the rotary one inside the program.
    let inside = |name: &str| (selection.column)(axis::of_linear_column(name).unwrap_or(name));
    let times: Option<&mut dyn FnMut(f64)> = match &mut selection.times {
        Some(times) => Some(&mut **times),
        None => None,
    };
    let mut renamed = Selection { column: &inside, times, lenient: selection.lenient };
    let format = Format::of(path).map_err(|error| if import::is_foreign(path) { not_imported(path) } else { error })?;
    let mut contents = match format {
        Format::Csv => csv::read(path, &mut renamed)?,
        Format::Parquet => parquet::read(path, &mut renamed)?,
    };
    name_as_rotary(path, &mut contents)?;
    Ok(contents)
}

fn not_imported(path: &Path) -> LogError {
    let import_file = import::file_of(path).file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    LogError::new(path, LogErrorKind::NotImported(import_file))
}

/// Gives the columns and notes of a linear axis the names of a rotary one, which they have inside the program.
fn name_as_rotary(path: &Path, contents: &mut FileContents) -> Result<(), LogError> {
    let mut is_linear = false;
    for column in &mut contents.columns {
        if let Some(rotary) = axis::of_linear_column(&column.name) {
            column.name = rotary.to_owned();
            is_linear = true;
        }
    }
    if let Some(twice) = contents.columns.iter().enumerate().find(|(k, c)| contents.columns[..*k].iter().any(|o| o.name == c.name)) {
        return Err(LogError::new(path, LogErrorKind::BothAxes).column(&twice.1.name));
    }
    contents.notes.rename(axis::rotary_note);
    if is_linear && contents.notes.text("axis").is_none() {
        contents.notes.push_text("axis", Axis::Linear.name());
    }
    Ok(())
}

/// Angles that are continued over the turns.
const ANGLES: [&str; 2] = ["theta_rad", "theta_sensor_rad"];

/// Reads a file of either format; a wrapped angle is continued over the turns.
fn read_contents(path: &Path, selection: &mut Selection<'_>) -> Result<FileContents, LogError> {
    Ok(with_continued_angles(read_file(path, selection)?))
}

/// Continues a wrapped angle over the turns.
fn with_continued_angles(mut contents: FileContents) -> FileContents {
    let is_linear = contents.notes.axis() == Axis::Linear;
    for angle in contents.columns.iter_mut().filter(|_| !is_linear) {
        let Some(column) = ANGLES.into_iter().find(|name| angle.name == *name) else { continue };
        let jumps = unwrap::unwrap(&mut angle.values);
        contents.warnings.extend((jumps > 0).then_some(LogWarning::UnwrappedAngle { column, jumps }));
    }
    contents
}

/// Contents of a file.
#[derive(Debug, Default)]
struct FileContents {
    columns: Vec<Column>,
    ignored: Vec<String>,
    notes: Notes,
    warnings: Vec<LogWarning>,
    /// First rows (indices) of further runs in the same file.
    runs: Vec<usize>,
}

/// The columns of a file, for a message.
fn names(read: &[Column], ignored: &[String]) -> String {
    read.iter().map(|c| c.name.as_str()).chain(ignored.iter().map(String::as_str)).collect::<Vec<_>>().join(", ")
}

/// A name that a user's column and an expression may have: a letter, then letters, digits, underscores.
pub fn is_own_name(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_') && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// Steps in time.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Intervals {
    /// Median, s.
    median_s: f64,
    /// The longest step that is no gap, s.
    longest_s: f64,
    /// Long steps are usual for this logger.
    is_irregular: bool,
}

impl Intervals {
    /// Of long logs, from an even selection of some hundred thousand steps.
    fn of(t_s: &[f64]) -> Intervals {
        const MAX_STEPS: usize = 200_000;
        let stride = t_s.len().div_ceil(MAX_STEPS).max(1);
        let steps: Vec<f64> = (1..t_s.len()).step_by(stride).map(|k| t_s[k] - t_s[k - 1]).collect();
        let median_s = median_in_place(&mut steps.clone()).unwrap_or(0.0);
        let mut deviations: Vec<f64> = steps.iter().map(|step| (step - median_s).abs()).collect();
        let sigma = median_in_place(&mut deviations).unwrap_or(0.0) / MEDIAN_ABS_PER_SIGMA;
        let usual_s = (GAP_INTERVALS * median_s).max(median_s + GAP_SIGMAS * sigma);
        let mut intervals = Intervals { median_s, longest_s: usual_s, is_irregular: false };
        if rows_in_short_segments(t_s, usual_s) as f64 <= MAX_SHORT_FRACTION * t_s.len() as f64 {
            return intervals;
        }
        for part in IRREGULAR_QUANTILES {
            let longest_s = GAP_INTERVALS * robust::quantile(steps.clone(), part).unwrap_or(0.0);
            if longest_s > usual_s && rows_in_short_segments(t_s, longest_s) as f64 <= MAX_SHORT_FRACTION * t_s.len() as f64 {
                (intervals.longest_s, intervals.is_irregular) = (longest_s, true);
                break;
            }
        }
        intervals
    }
}

/// Rows of the segments of less than [`MIN_SEGMENT_ROWS`] into which steps above `longest_s` cut the rows.
fn rows_in_short_segments(t_s: &[f64], longest_s: f64) -> usize {
    let (mut rows, mut from) = (0, 0);
    for k in 1..=t_s.len() {
        if k == t_s.len() || t_s[k] - t_s[k - 1] > longest_s {
            rows += if k - from < MIN_SEGMENT_ROWS { k - from } else { 0 };
            from = k;
        }
    }
    rows
}

#[cfg(test)]
mod tests;
