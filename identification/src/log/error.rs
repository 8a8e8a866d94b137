//! Errors of log files: each is one line that states file, row, column, the defect and the remedy.

use crate::parameters::NamesParameters;
use std::fmt;
use std::path::{Path, PathBuf};

/// A log that cannot be used. Its text is one line with file, row and column.
#[derive(Debug)]
pub struct LogError {
    /// The file.
    pub path: PathBuf,
    /// Row, counted from 1 without the header.
    pub row: Option<usize>,
    /// Line of a CSV file, counted from 1 with header and notes.
    pub line: Option<usize>,
    /// Name of the column.
    pub column: Option<String>,
    /// The defect. Boxed, because readers return this type for each row.
    pub kind: Box<LogErrorKind>,
}

impl LogError {
    /// A defect of the file as a whole.
    pub fn new(path: &Path, kind: LogErrorKind) -> Self {
        LogError { path: path.to_owned(), row: None, line: None, column: None, kind: Box::new(kind) }
    }

    pub(super) fn row(mut self, row: usize) -> Self {
        self.row = Some(row);
        self
    }

    pub(super) fn line(mut self, line: usize) -> Self {
        self.line = Some(line);
        self
    }

    pub(super) fn column(mut self, column: &str) -> Self {
        self.column = Some(column.to_owned());
        self
    }
}

impl fmt::Display for LogError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        let mut separator = ": ";
        match (self.row, self.line) {
            (Some(row), Some(line)) => write!(f, "{separator}row {row} (line {line})")?,
            (Some(row), None) => write!(f, "{separator}row {row}")?,
            (None, Some(line)) => write!(f, "{separator}line {line}")?,
            (None, None) => separator = "",
        }
        if let Some(column) = &self.column {
            separator = if separator.is_empty() { ": " } else { ", " };
            write!(f, "{separator}column {}", column.escape_debug())?;
        }
        // Names and cells of a damaged file may contain line breaks; an error is one line.
        write!(f, ": {}", self.kind.to_string().replace(['\n', '\r'], " "))
    }
}

impl std::error::Error for LogError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.kind.source()
    }
}

/// The defect of a log.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogErrorKind {
    /// The name of the file ends neither in `.csv` nor in `.parquet`.
    #[error("the name of a log must end in .csv or .parquet; the ending selects the format")]
    Ending,
    /// A file of another program without an import file, which says what its columns are.
    #[error("a file of another program needs an import file beside it; {0} does not exist, or belongs to another file")]
    NotImported(String),
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Read(#[source] std::io::Error),
    /// The file cannot be created or written.
    #[error("cannot be written: {0}")]
    Write(#[source] std::io::Error),
    /// The file has no bytes.
    #[error("the file is empty")]
    Empty,
    /// The file has a header but no rows.
    #[error("the file has a header but no rows")]
    NoRows,
    /// The file has notes but no header.
    #[error("the file has notes but no header and no rows")]
    NotesOnly,
    /// The first row consists of numbers.
    #[error("the header is missing: the first row must name the columns, for example t_s,u_V,omega_rad_s")]
    NoHeader,
    /// The columns are not separated by commas.
    #[error("the columns seem to be separated by {0}; use commas between columns and decimal points in numbers")]
    Separator(&'static str),
    /// The column `t_s` is missing.
    #[error("there is no column t_s (time of each row in seconds); the file has {has}")]
    NoTime {
        /// The columns of the file.
        has: String,
    },
    /// The requested column is missing.
    #[error("there is no such column; the file has {has}")]
    NoColumn {
        /// The columns of the file.
        has: String,
    },
    /// Two columns have the same name.
    #[error("this name is used twice in the header; each column needs a name of its own")]
    DuplicateName,
    /// A header cell has no text.
    #[error("column {0} of the header has no name")]
    EmptyName(usize),
    /// A row has too few or too many cells.
    #[error("{has} cells where the header names {expected} columns{}", if *.comma { "; decimal commas? Use decimal points" } else { "" })]
    CellCount {
        /// Cells of the row.
        has: usize,
        /// Columns of the header.
        expected: usize,
        /// The row seems to contain decimal commas.
        comma: bool,
    },
    /// A column of a rotary and the same of a linear axis.
    #[error("the file has this column and the same of a linear axis; leave one out")]
    BothAxes,
    /// The last row is incomplete.
    #[error(
        "the last row is cut short ({has} of {expected} cells) because the recording was interrupted; delete this row to read the rest"
    )]
    CutShort {
        /// Cells of the row.
        has: usize,
        /// Columns of the header.
        expected: usize,
    },
    /// A cell is not a number.
    #[error("“{}” is not a number{hint}", text.escape_debug())]
    NotANumber {
        /// Text of the cell.
        text: String,
        /// Likely cause, or nothing.
        hint: &'static str,
    },
    /// A cell is empty.
    #[error("the cell is empty; a number is required")]
    EmptyCell,
    /// A cell is NaN or infinite.
    #[error("{0} is not a measured value; every cell must be a finite number")]
    NotFinite(String),
    /// Time decreases.
    #[error("time steps back from {before} s to {now} s")]
    StepsBack {
        /// Time of the previous row, s.
        before: f64,
        /// Time of this row, s.
        now: f64,
    },
    /// Two rows have the same time.
    #[error("time {0} s repeats; the time must increase from row to row")]
    Repeats(f64),
    /// Columns have different lengths (only for logs made by a program).
    #[error("{length} numbers where the first column has {expected}")]
    Length {
        /// Length of this column.
        length: usize,
        /// Length of the first column.
        expected: usize,
    },
    /// The rows have twice as many cells as the header has names.
    #[error(
        "the rows have {cells} cells for {names} names: commas seem to separate the columns and the decimals; export with semicolons between columns, or with decimal points"
    )]
    CommasBetweenAndInNumbers {
        /// Names of the header.
        names: usize,
        /// Cells of a row.
        cells: usize,
    },
    /// Many lines among the rows are no rows.
    #[error("{lines} lines among {rows} rows are no rows, the first is line {line}: “{}”; this is no table, or a damaged one", text.escape_debug())]
    NoRowsBetween {
        /// Number of lines.
        lines: usize,
        /// Number of rows.
        rows: usize,
        /// The first line, from 1.
        line: usize,
        /// Its text, shortened.
        text: String,
    },
    /// Hexadecimal numbers.
    #[error("“{}” is a hexadecimal number; export decimal numbers", .0.escape_debug())]
    Hexadecimal(String),
    /// The clock is coarser than the rows.
    #[error("the time repeats in {repeats} of {rows} rows: the clock is coarser than the rows. If the rows are evenly spaced, leave the time out (map its column to `-`) and state the sample rate, about {} Hz", rounded(*rate_Hz))]
    CoarseTime {
        /// Rows with the time of the row before.
        repeats: usize,
        /// Rows.
        rows: usize,
        /// Rows per second, Hz.
        rate_Hz: f64,
    },
    /// The bytes are not text.
    #[error("the file is not UTF-8 text{0}")]
    NotText(&'static str),
    /// The file is not a Parquet file.
    #[error("this is not a Parquet file{0}")]
    NotParquet(&'static str),
    /// The Parquet library cannot read the file.
    #[error("the Parquet file is damaged or of an unsupported kind: {0}")]
    Parquet(String),
    /// The column has another type.
    #[error("the column contains {0}, not numbers")]
    NotNumeric(String),
    /// A value is missing.
    #[error("the value is missing (null)")]
    Null,
    /// The ending names no format that can be imported.
    #[error(
        "the name must end in .csv, .txt, .tsv, .dat, .asc, .lvm, .log (text), .parquet, .mat, .h5 or .hdf5; the ending selects the format"
    )]
    ForeignEnding,
    /// The table has more numbers than may be read.
    #[error(
        "{rows} rows of {columns} columns are more than the {limit} numbers that are read at most; the environment variable STAND_MAX_VALUES raises this limit, each number takes 8 bytes"
    )]
    TooLarge {
        /// Rows.
        rows: usize,
        /// Columns that would be read.
        columns: usize,
        /// The limit.
        limit: u64,
    },
    /// The table has more columns than may be read.
    #[error("there are {columns} columns, more than the {limit} that are read at most; are rows and columns exchanged?")]
    TooManyColumns {
        /// Columns.
        columns: usize,
        /// The limit.
        limit: usize,
    },
    /// No line consists of numbers.
    #[error("there is no table in the file: no separator makes numbers of its lines")]
    NoNumbers,
    /// A MATLAB file that is not read.
    #[error("{0}")]
    Matlab(&'static str),
    /// An HDF5 file that is not read.
    #[error("the HDF5 file is damaged or of an unsupported kind: {0}")]
    Hdf5(String),
    /// The import file is no mapping.
    #[error("not an import file: {0}")]
    ImportFile(String),
    /// A unit is unknown.
    #[error("“{}” is not a known unit (for example ms, deg, rpm, deg/s, mA, mN m, counts:8192 per turn, 0.05 V)", .0.escape_debug())]
    UnknownUnit(String),
    /// A unit measures another quantity.
    #[error("{unit} is not a unit of {column}, which is in {example}")]
    WrongUnit {
        /// The unit.
        unit: String,
        /// The column of the project.
        column: String,
        /// Unit of the project for it.
        example: &'static str,
    },
    /// A column is mapped to a name that no column can have.
    #[error("“{}” is not a column of the project{}, and not a name of letters, digits and underscores", name.escape_debug(), near.as_ref().map_or(String::new(), |n| format!(" (did you mean {n}?)")))]
    NoSuchTarget {
        /// The name.
        name: String,
        /// The nearest column of the project.
        near: Option<String>,
    },
    /// Two columns are mapped to the same.
    #[error("another column is mapped to {0} too")]
    MappedTwice(String),
    /// Most rows lack a value.
    #[error("{missing} of {rows} cells are empty or no numbers; map another column, or leave this one out (map it to `-`)")]
    MostlyEmpty {
        /// Cells without a number.
        missing: usize,
        /// Rows.
        rows: usize,
    },
    /// Time and row rate are both stated.
    #[error("there is a time column and a sample rate; leave the time out (map its column to `-`) or state no sample rate")]
    TimeAndRate,
    /// The row rate is no positive number.
    #[error("the sample rate {0} Hz must be positive")]
    SampleRate(f64),
}

impl NamesParameters for LogErrorKind {
    fn parameters(&self) -> Vec<&str> {
        match self {
            LogErrorKind::CoarseTime { .. } | LogErrorKind::TimeAndRate => vec!["columns", "sample_rate_Hz"],
            LogErrorKind::MostlyEmpty { .. } => vec!["columns"],
            _ => Vec::new(),
        }
    }
}

/// A number with four digits, for a message.
fn rounded(value: f64) -> String {
    let digits = (3.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

impl LogErrorKind {
    /// The file may be a log of another program, which can be imported.
    pub fn may_be_of_another_program(&self) -> bool {
        matches!(
            self,
            LogErrorKind::Ending
                | LogErrorKind::NotImported(_)
                | LogErrorKind::NoHeader
                | LogErrorKind::Separator(_)
                | LogErrorKind::NoTime { .. }
                | LogErrorKind::EmptyName(_)
        )
    }

    /// The defect of two successive times that do not increase.
    pub(super) fn time(before: f64, now: f64) -> LogErrorKind {
        if before == now { LogErrorKind::Repeats(now) } else { LogErrorKind::StepsBack { before, now } }
    }
}
