//! Logs: from files, NumPy and Arrow, and to them.

use std::path::PathBuf;
use std::sync::Arc;

use identification::log;
use identification::log::import;
use numpy::ndarray::ArrayView1;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use stand_report as report;

use crate::arrow;
use crate::error::log_error;
use crate::table::{ColumnOfPython, Pairs, Stated, log_of, log_of_inspected, statements, table_of};
use crate::task;

/// A log: columns of numbers in SI units, notes and warnings. It does not change.
#[pyclass(frozen, module = "rotary_stand._native")]
pub struct Log {
    log: Arc<log::Log>,
}

impl From<log::Log> for Log {
    fn from(log: log::Log) -> Self {
        Log { log: Arc::new(log) }
    }
}

impl Log {
    /// The log of the library.
    pub fn shared(&self) -> Arc<log::Log> {
        self.log.clone()
    }
}

#[pymethods]
impl Log {
    /// Reads a file; `also` are columns of other names to read. What is stated about a file of another program holds for this call.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf, also: Vec<String>, stated: Stated) -> PyResult<Log> {
        let stated = statements(&path, stated)?;
        task::run(py, None, move |_| {
            if stated.is_empty() {
                let also: Vec<&str> = also.iter().map(String::as_str).collect();
                return log::Log::read_also(&path, &also).map(Log::from).map_err(|error| log_error(&error));
            }
            let (inspection, table) = import::inspect_with_table(&path, &stated).map_err(|error| log_error(&error))?;
            Ok(log_of_inspected(&inspection, &table)?.into())
        })
    }

    /// The log of NumPy columns; `path` is its name in messages.
    #[staticmethod]
    fn of_columns(path: PathBuf, data: Vec<ColumnOfPython<'_>>, data_notes: Pairs, stated: Stated) -> PyResult<Log> {
        let stated = statements(&path, stated)?;
        log_of(&path, table_of(data, data_notes), &stated).map(Log::from)
    }

    /// The log of an object with `__arrow_c_stream__`.
    #[staticmethod]
    fn of_arrow(path: PathBuf, stream: &Bound<'_, PyCapsule>, stated: Stated) -> PyResult<Log> {
        let stated = statements(&path, stated)?;
        log_of(&path, arrow::table_of(&path, stream)?, &stated).map(Log::from)
    }

    /// Writes the log, as CSV or Parquet by the ending of the name.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let log = self.shared();
        task::run(py, None, move |_| log.write(&path).map_err(|error| log_error(&error)))
    }

    /// Name of the file, or the name that was given.
    #[getter]
    fn path(&self) -> String {
        self.log.path().display().to_string()
    }

    /// Names of the columns, as files of its axis have them.
    #[getter]
    fn columns(&self) -> Vec<String> {
        let axis = self.log.axis();
        self.log.columns().iter().map(|column| axis.file_column(&column.name).to_owned()).collect()
    }

    /// Names of the columns that were not read.
    #[getter]
    fn ignored(&self) -> Vec<String> {
        self.log.ignored().to_vec()
    }

    /// Notes in their order; a key may occur more than once.
    #[getter]
    fn notes(&self) -> Pairs {
        self.log.notes().to_vec()
    }

    /// Warnings about the log, one sentence each.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.log.warnings().iter().map(report::log_warning).collect()
    }

    /// Median interval of the rows, s.
    #[getter]
    fn interval_s(&self) -> f64 {
        self.log.median_dt_s()
    }

    /// Time from the first to the last row plus one interval, s.
    #[getter]
    fn duration_s(&self) -> f64 {
        self.log.duration_s()
    }

    /// First row and end of each sequence of rows without a gap.
    #[getter]
    fn segments(&self) -> Vec<(usize, usize)> {
        self.log.segments().into_iter().map(|rows| (rows.start, rows.end)).collect()
    }

    fn __len__(&self) -> usize {
        self.log.len()
    }

    /// The column as an array that shares the memory of the log and cannot be written; None if the log has no such column.
    fn column<'py>(this: &Bound<'py, Self>, name: &str) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let log = &this.get().log;
        let axis = log.axis();
        let Some(column) = log.columns().iter().find(|column| axis.file_column(&column.name) == name) else { return Ok(None) };
        // SAFETY: the log does not change and lives as long as the array, whose base is `this`.
        let array = unsafe { PyArray1::borrow_from_array(&ArrayView1::from(&column.values), this.clone().into_any()) };
        array.readwrite().make_nonwriteable();
        Ok(Some(array))
    }

    /// The log as an Arrow stream that shares its memory.
    fn arrow_stream<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        arrow::stream_of(py, &self.log)
    }
}
