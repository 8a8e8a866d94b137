//! A table of another program, before its columns have a meaning: names and numbers, missing cells as NaN.

/// Fraction of the cells of a measured column that may have text in place of a number.
const MAX_FAILED_FRACTION: f64 = 0.02;

/// One column of a table.
#[derive(Debug, Clone, Default)]
pub struct TableColumn {
    /// Name in the file, or `column_3` where it has none.
    pub name: String,
    /// Position in the file, from 1.
    pub position: usize,
    /// Unit from a row of units below the header; empty where there is none.
    pub unit: String,
    /// One number for each row, less `origin`; NaN where the cell is empty or no number.
    pub values: Vec<f64>,
    /// What is to be added to the values, where the numbers of the file have more digits than an `f64`; else 0.
    pub origin: f64,
    /// First cell that is neither empty nor a number: its row, from 1, and its text.
    pub text: Option<(usize, String)>,
    /// The cells are dates and times; the values are seconds.
    pub is_date: bool,
}

impl TableColumn {
    /// Number of cells without a number.
    pub fn missing(&self) -> usize {
        self.values.iter().filter(|v| !v.is_finite()).count()
    }

    /// No cell is a number.
    pub fn is_text(&self) -> bool {
        self.values.iter().all(|v| !v.is_finite())
    }

    /// Text or nothing is in few cells only: readings that failed.
    pub fn is_mostly_numbers(&self) -> bool {
        self.missing() as f64 <= MAX_FAILED_FRACTION * self.values.len() as f64
    }

    /// All numbers are whole.
    pub fn is_whole(&self) -> bool {
        self.values.iter().all(|v| v.fract() == 0.0 || v.is_nan())
    }
}

/// A table of another program.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// The columns, all of the same length.
    pub columns: Vec<TableColumn>,
    /// Notes of the file, `# key: value`.
    pub notes: Vec<(String, String)>,
    /// Line of each row is this line plus the index of the row, as long as no line was skipped; from 1.
    pub first_line: Option<usize>,
    /// How the text was read; `None` for other formats.
    pub dialect: Option<Dialect>,
    /// A line of words before the rows that does not fit their columns.
    pub unmatched_header: Option<String>,
    /// Lines before the header that are not notes.
    pub preamble: usize,
    /// Lines among the rows that are no rows.
    pub skipped: Vec<SkippedLine>,
    /// Interval of the rows that the lines before the header state, s, and their words for it.
    pub stated_interval: Option<(f64, String)>,
}

impl Table {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |c| c.values.len())
    }
}

/// A line among the rows that is no row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SkippedLine {
    /// Line of the file, from 1.
    pub line: usize,
    /// Its text, shortened.
    pub text: String,
    /// The row that follows it, from 1.
    pub before_row: usize,
    /// Why it is no row.
    pub reason: SkipReason,
}

/// Why a line is no row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SkipReason {
    /// It is the header again.
    RepeatedHeader,
    /// It has too few cells, or ends without a line break at the end of the file.
    Cut,
    /// It is no row of numbers.
    NoNumbers,
}

/// Separators of a text file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dialect {
    /// Between the cells; a space stands for any number of spaces and tabs.
    pub separator: char,
    /// Decimal mark.
    pub decimal: char,
    /// There is a row of names.
    pub has_header: bool,
}
