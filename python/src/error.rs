//! Errors of the library as exceptions of `rotary_stand.errors`.

use std::fmt::Display;
use std::path::Path;

use identification::log;
use identification::model;
use pyo3::prelude::*;

mod exceptions {
    pyo3::import_exception!(rotary_stand.errors, AnalysisError);
    pyo3::import_exception!(rotary_stand.errors, ImplausibleLogError);
    pyo3::import_exception!(rotary_stand.errors, LogError);
    pyo3::import_exception!(rotary_stand.errors, ModelError);
    pyo3::import_exception!(rotary_stand.errors, StandError);
}

/// A log cannot be read or written.
pub fn log_error(error: &log::LogError) -> PyErr {
    log_error_at(&error.to_string(), &error.path, error.row, error.column.as_deref())
}

/// An error of a log in these words, at a row (from 1) and a column.
pub fn log_error_at(message: &str, path: &Path, row: Option<usize>, column: Option<&str>) -> PyErr {
    exceptions::LogError::new_err((message.to_owned(), path.display().to_string(), row, column.map(str::to_owned)))
}

/// A model is invalid.
pub fn model_error(error: &model::ModelError) -> PyErr {
    let (line, column) = error.position.unzip();
    exceptions::ModelError::new_err((error.to_string(), error.file.clone(), line, column, error.key.clone()))
}

/// An analysis is not possible with this log, model or argument.
pub fn analysis_error(error: impl Display) -> PyErr {
    exceptions::AnalysisError::new_err(error.to_string())
}

/// The log is not a plausible record of a drive: the report in words, as JSON and as HTML.
pub fn implausible_log(text: String, json: String, html: String) -> PyErr {
    exceptions::ImplausibleLogError::new_err((text, json, html))
}

/// The stand, its line or a session on it failed.
pub fn stand_error(error: impl Display) -> PyErr {
    exceptions::StandError::new_err(error.to_string())
}
