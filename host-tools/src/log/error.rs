//! What can be wrong with a log's file: one line that says what, where, and what to do.

use std::fmt;
use std::path::{Path, PathBuf};

/// A log that cannot be used; its text is one line with file, row and column.
#[derive(Debug)]
pub struct LogError {
    /// The file.
    pub path: PathBuf,
    /// Sample, counted from 1.
    pub row: Option<usize>,
    /// Line of a CSV, counted from 1, header and notes included.
    pub line: Option<usize>,
    /// Column by name.
    pub column: Option<String>,
    /// What is wrong. In a box: readers return this by the million rows.
    pub trouble: Box<Trouble>,
}

impl LogError {
    pub(super) fn new(path: &Path, trouble: Trouble) -> Self {
        LogError { path: path.to_owned(), row: None, line: None, column: None, trouble: Box::new(trouble) }
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
        let mut mark = ": ";
        match (self.row, self.line) {
            (Some(row), Some(line)) => write!(f, "{mark}row {row} (line {line})")?,
            (Some(row), None) => write!(f, "{mark}row {row}")?,
            (None, Some(line)) => write!(f, "{mark}line {line}")?,
            (None, None) => mark = "",
        }
        if let Some(column) = &self.column {
            mark = if mark.is_empty() { ": " } else { ", " };
            write!(f, "{mark}column {}", column.escape_debug())?;
        }
        // Names and cells of a broken file may hold line breaks; an error is one line.
        write!(f, ": {}", self.trouble.to_string().replace(['\n', '\r'], " "))
    }
}

impl std::error::Error for LogError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.trouble.source()
    }
}

/// What is wrong.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Trouble {
    /// Neither `.csv` nor `.parquet`.
    #[error("a log ends in .csv or .parquet; the ending says how it is read and written")]
    Ending,
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Read(#[source] std::io::Error),
    /// The file cannot be made or written.
    #[error("cannot be written: {0}")]
    Write(#[source] std::io::Error),
    /// No byte in it.
    #[error("the file is empty")]
    Empty,
    /// A header or notes, but no sample.
    #[error("the file has a header but no rows")]
    NoRows,
    /// Notes, but no header.
    #[error("the file has notes but no header and no rows")]
    NotesOnly,
    /// The first row is of numbers.
    #[error("the header is missing: the first row must name the columns, for instance t_s,u_V,omega_rad_s")]
    NoHeader,
    /// Separated by something else than commas.
    #[error("columns seem to be separated by {0}; separate them by commas and write decimal points")]
    Separator(&'static str),
    /// No time.
    #[error("there is no column t_s, the time of each row in seconds; the file has {has}")]
    NoTime {
        /// The columns that are there.
        has: String,
    },
    /// The column that was asked for.
    #[error("there is no such column; the file has {has}")]
    NoColumn {
        /// The columns that are there.
        has: String,
    },
    /// A name twice.
    #[error("this name stands twice in the header; each column needs its own")]
    Doubled,
    /// A header cell without text.
    #[error("the header's column {0} has no name")]
    Nameless(usize),
    /// A row with too few or too many cells.
    #[error("{has} cells where the header names {wants} columns{}", if *.comma { "; decimal commas? write decimal points" } else { "" })]
    Cells {
        /// Cells found.
        has: usize,
        /// Columns named.
        wants: usize,
        /// It looks like decimal commas.
        comma: bool,
    },
    /// The last row stops early.
    #[error("the last row is cut short ({has} of {wants} cells): the recording broke off here; delete this row and the rest can be read")]
    CutShort {
        /// Cells found.
        has: usize,
        /// Columns named.
        wants: usize,
    },
    /// Text for a number.
    #[error("“{}” is not a number{hint}", text.escape_debug())]
    NotANumber {
        /// The cell.
        text: String,
        /// What it may be, or nothing.
        hint: &'static str,
    },
    /// Nothing for a number.
    #[error("the cell is empty where a number is needed")]
    EmptyCell,
    /// Not a number, or infinite.
    #[error("{0} is no measurement: every cell must be a finite number")]
    NotFinite(String),
    /// Time goes back.
    #[error("time steps back from {before} s to {now} s")]
    StepsBack {
        /// Time of the row before.
        before: f64,
        /// Time of this row.
        now: f64,
    },
    /// Time stands.
    #[error("time {0} s repeats; each row needs a later one")]
    Repeats(f64),
    /// Columns of different length (programs only).
    #[error("{length} numbers where the first column has {other}")]
    Length {
        /// Of this column.
        length: usize,
        /// Of the first.
        other: usize,
    },
    /// Bytes that are no text.
    #[error("this is no text in UTF-8{0}")]
    NotText(&'static str),
    /// Not the format that the ending says.
    #[error("this is not a Parquet file{0}")]
    NotParquet(&'static str),
    /// A Parquet file that its library cannot read.
    #[error("the Parquet file is damaged or of a kind that cannot be read: {0}")]
    Parquet(String),
    /// A column of another type.
    #[error("the column holds {0}, not numbers")]
    NotNumeric(String),
    /// A missing value.
    #[error("the value is missing (null)")]
    Null,
}

impl Trouble {
    /// Of two times that do not rise.
    pub(super) fn time(before: f64, now: f64) -> Trouble {
        if before == now { Trouble::Repeats(now) } else { Trouble::StepsBack { before, now } }
    }
}
