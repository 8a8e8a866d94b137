//! `inspect`: what a file or a table of any program contains.

use std::path::{Path, PathBuf};

use identification::log::import::{self, Inspection};
use pyo3::prelude::*;
use stand_report as report;

use crate::answer::Answer;
use crate::error::log_error;
use crate::table::{ColumnOfPython, Stated, statements, table_of};
use crate::task;

fn inspection_answer(inspection: &Inspection) -> Answer {
    Answer::new(&report::inspection::json(inspection), report::inspection::text(inspection), String::new())
}

/// What a file of any program contains.
#[pyfunction]
pub fn inspect_file(py: Python<'_>, path: PathBuf, stated: Stated) -> PyResult<Answer> {
    let stated = statements(&path, stated)?;
    task::run(py, None, move |_| import::inspect(&path, &stated).map(|i| inspection_answer(&i)).map_err(|error| log_error(&error)))
}

/// What NumPy columns contain.
#[pyfunction]
pub fn inspect_columns(data: Vec<ColumnOfPython<'_>>, stated: Stated) -> PyResult<Answer> {
    let path = Path::new("frame");
    let stated = statements(path, stated)?;
    let inspection = import::inspect_table(path, &table_of(data, Vec::new()), None, &stated);
    inspection.map(|i| inspection_answer(&i)).map_err(|error| log_error(&error))
}
