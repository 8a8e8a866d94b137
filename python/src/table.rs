//! Columns of Python as a table of the library, and the log of a table.

use std::path::Path;

use identification::log::Log;
use identification::log::import::table::{Table, TableColumn};
use identification::log::import::{Inspection, Statements, inspect_table, log_of_table, own_log_of_table};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use stand_report::inspection::{note_not_understood, open_question};

use crate::error::{log_error, log_error_at};

/// Pairs of names, as Python gives a mapping.
pub type Pairs = Vec<(String, String)>;

/// A column as `rotary_stand._convert` prepares it: name, numbers less `origin`, origin, whether the cells are dates, and the first cell
/// that is no number.
pub type ColumnOfPython<'py> = (String, PyReadonlyArray1<'py, f64>, f64, bool, Option<(usize, String)>);

/// The table of these columns with the notes of the log.
pub fn table_of(columns: Vec<ColumnOfPython<'_>>, notes: Pairs) -> Table {
    let column = |(k, (name, values, origin, is_date, text)): (usize, ColumnOfPython<'_>)| TableColumn {
        name,
        position: k + 1,
        values: values.as_array().to_vec(),
        origin,
        text,
        is_date,
        ..TableColumn::default()
    };
    Table { columns: columns.into_iter().enumerate().map(column).collect(), notes, ..Table::default() }
}

/// What the caller states about a log of another program, as `rotary_stand._convert.stated` prepares it: names of the columns, units,
/// sample rate in Hz, notes.
pub type Stated = (Pairs, Pairs, Option<f64>, Pairs);

/// The statements of the library.
///
/// # Errors
/// `LogError`: a note is not understood.
pub fn statements(path: &Path, (columns, units, sample_rate_Hz, notes): Stated) -> PyResult<Statements> {
    match note_not_understood(&notes) {
        Some(message) => Err(log_error_at(&format!("{}: {message}", path.display()), path, None, None)),
        None => Ok(Statements { columns, units, sample_rate_Hz, notes }),
    }
}

/// The mapping of an inspected table, if no question is open.
fn settled(inspection: &Inspection) -> PyResult<()> {
    let path = &inspection.path;
    match (&inspection.refusal, open_question(inspection)) {
        (Some(refusal), Some(message)) if message == refusal.to_string() => Err(log_error(refusal)),
        (_, Some(question)) => {
            let message = format!(
                "{}: {question}. In Python: --map A=B is columns={{\"A\": \"B\"}}, --unit A=U is units={{\"A\": \"U\"}}, --sample-rate HZ is sample_rate_Hz=HZ",
                path.display()
            );
            Err(log_error_at(&message, path, None, None))
        }
        (_, None) => Ok(()),
    }
}

/// The log of a table: of the project's own columns, or by what is stated about others.
///
/// # Errors
/// `LogError`.
pub fn log_of(path: &Path, table: Table, stated: &Statements) -> PyResult<Log> {
    let is_own = stated.columns.is_empty() && stated.units.is_empty() && stated.sample_rate_Hz.is_none();
    if is_own && !table.columns.iter().any(|column| column.is_date) {
        let mut table = table;
        table.notes.extend(stated.notes.iter().cloned());
        return own_log_of_table(path, table).map_err(|error| log_error(&error));
    }
    let inspection = inspect_table(path, &table, None, stated).map_err(|error| log_error(&error))?;
    settled(&inspection)?;
    log_of_table(path, &table, &inspection.mapping).map_err(|error| log_error(&error))
}

/// The log of an inspected file with what is stated about it.
///
/// # Errors
/// `LogError`.
pub fn log_of_inspected(inspection: &Inspection, table: &Table) -> PyResult<Log> {
    settled(inspection)?;
    log_of_table(&inspection.path, table, &inspection.mapping).map_err(|error| log_error(&error))
}
