//! A table of another program, before its columns have a meaning: names and numbers, missing cells as NaN.

/// One column of a table.
#[derive(Debug, Clone)]
pub struct TableColumn {
    /// Name in the file, or `column_3` where it has none.
    pub name: String,
    /// Unit from a row of units below the header; empty where there is none.
    pub unit: String,
    /// One number for each row; NaN where the cell is empty or no number.
    pub values: Vec<f64>,
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
}

/// A table of another program.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// The columns, all of the same length.
    pub columns: Vec<TableColumn>,
    /// Notes of the file, `# key: value`.
    pub notes: Vec<(String, String)>,
    /// Line of the first row in a text file, from 1.
    pub first_line: Option<usize>,
    /// How the text was read; `None` for other formats.
    pub dialect: Option<Dialect>,
    /// Lines before the header that are not notes.
    pub preamble: usize,
}

impl Table {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |c| c.values.len())
    }
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
