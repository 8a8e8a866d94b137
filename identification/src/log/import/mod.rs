//! Import of logs that other programs wrote: their columns, units and separators.
//!
//! In: a text file, a Parquet file, a MATLAB file or an HDF5 file. [`inspect`] returns what its columns are believed to be ([`guess`]); an
//! [`ImportMapping`], stored beside the file as `NAME.import.toml`, is the user's consent. [`contents`] reads the file by that mapping, in
//! SI units. Without a mapping, a file that is not in the project's own format is refused.

mod arrays;
mod clock;
pub mod guess;
mod hdf5;
mod inspection;
pub mod mapping;
mod mat;
mod names;
mod programs;
pub mod questions;
mod read;
pub mod table;
mod text;
pub mod units;

use std::path::Path;

use super::error::{LogError, LogErrorKind};
use super::{Column, FileContents, Log, Notes, Selection, known, parquet};
use table::{Dialect, Table, TableColumn};

pub use guess::{Belief, Evidence};
pub use inspection::{ColumnInspection, Inspection, TimingInspection, inspect, inspect_table, inspect_with_table};
pub use mapping::{ImportMapping, MappedColumn, Statements, file_of};
pub use questions::Question;

/// Endings of the files that can be imported.
pub const ENDINGS: [&str; 11] = ["csv", "txt", "tsv", "dat", "asc", "lvm", "log", "parquet", "mat", "h5", "hdf5"];

/// The ending is that of a file that can be imported.
pub(super) fn is_foreign(path: &Path) -> bool {
    path.is_file()
        && path.extension().and_then(|e| e.to_str()).is_some_and(|ending| ENDINGS.contains(&ending.to_ascii_lowercase().as_str()))
}

/// The table of a file of another program.
///
/// # Errors
/// The file cannot be read, or its ending names no format.
pub fn read_table(path: &Path, text: Option<&mapping::TextFormat>) -> Result<Table, LogError> {
    let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match ending.as_deref() {
        Some("csv" | "txt" | "tsv" | "dat" | "asc" | "lvm" | "log") => text::read(path, text.map(dialect)),
        Some("parquet") => parquet_table(path),
        // `save -ascii`, and Octave's own format, are text.
        Some("mat") if !mat::is_text(path)? => mat::read(path),
        Some("mat") => text::read(path, text.map(dialect)),
        Some("h5" | "hdf5") => hdf5::read(path),
        _ => Err(LogError::new(path, LogErrorKind::ForeignEnding)),
    }
}

fn dialect(text: &mapping::TextFormat) -> Dialect {
    Dialect { separator: text.separator, decimal: text.decimal, has_header: true }
}

fn parquet_table(path: &Path) -> Result<Table, LogError> {
    let contents = parquet::read(path, &mut Selection { column: &|_| true, times: None, lenient: true })?;
    let column = |c: Column| TableColumn { name: c.name, values: c.values, ..TableColumn::default() };
    let mut columns: Vec<TableColumn> = contents.columns.into_iter().map(column).collect();
    let rows = columns.first().map_or(0, |c| c.values.len());
    columns.extend(contents.ignored.into_iter().map(|name| TableColumn {
        name,
        values: vec![f64::NAN; rows],
        text: Some((1, "not a number".to_owned())),
        ..TableColumn::default()
    }));
    columns.iter_mut().enumerate().for_each(|(k, c)| c.position = k + 1);
    Ok(Table { columns, notes: contents.notes.to_vec(), ..Table::default() })
}

/// Reads a file by its mapping, in SI units.
pub(super) fn contents(path: &Path, mapping: &ImportMapping, selection: &mut Selection<'_>) -> Result<FileContents, LogError> {
    read::contents(path, &read_table(path, mapping.text.as_ref())?, mapping, selection)
}

/// The log of a table by its mapping, in SI units, with all mapped columns; `path` is its name in messages.
///
/// # Errors
/// As [`Log::read`] of a file with an import file.
pub fn log_of_table(path: &Path, table: &Table, mapping: &ImportMapping) -> Result<Log, LogError> {
    let mut selection = Selection { column: &|_| true, times: None, lenient: false };
    Log::assemble(path, super::with_continued_angles(read::contents(path, table, mapping, &mut selection)?))
}

/// The log of a table whose columns have the names and units of the project. As in a file of the project, every value must be a finite
/// number; a column of another name without such values is ignored.
///
/// # Errors
/// As [`Log::new`]; a column of the project has text or lacks a value.
pub fn own_log_of_table(path: &Path, table: Table) -> Result<Log, LogError> {
    let (mut columns, mut ignored) = (Vec::new(), Vec::new());
    for column in table.columns {
        let is_known = known(super::axis::of_linear_column(&column.name).unwrap_or(&column.name)).is_some();
        if column.missing() == 0 && column.text.is_none() {
            let values = column.values.iter().map(|value| value + column.origin).collect();
            columns.push(Column { name: column.name, values });
        } else if is_known {
            let missing = column.values.iter().position(|value| !value.is_finite()).map(|k| (k + 1, column.values[k].to_string()));
            let (row, kind) = match (column.text, missing) {
                (Some((row, text)), _) => (row, LogErrorKind::NotANumber { text, hint: "" }),
                (None, missing) => {
                    let (row, value) = missing.unwrap_or_default();
                    (row, LogErrorKind::NotFinite(value))
                }
            };
            return Err(LogError::new(path, kind).row(row).column(&column.name));
        } else {
            ignored.push(column.name);
        }
    }
    let mut contents = FileContents { columns, ignored, notes: Notes::from(table.notes), ..FileContents::default() };
    super::name_as_rotary(path, &mut contents)?;
    Log::checked(path, super::with_continued_angles(contents))
}
