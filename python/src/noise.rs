//! `allan`: the noise of a sensor at rest.

use std::path::PathBuf;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stand_analysis::allan::{AllanError, Interpretation, Request, Taus};
use stand_report::allan as report;
use stand_report::units::Units;

use crate::answer::Answer;
use crate::error::{analysis_error, log_error};
use crate::log::Log;
use crate::task;

/// Units by their names as of `--units`.
///
/// # Errors
/// `ValueError`: a word is not a unit.
pub fn units(words: Option<&str>) -> PyResult<Units> {
    words.map_or(Ok(Units::default()), |words| words.parse().map_err(|e| PyValueError::new_err(format!("units: {e}"))))
}

/// The Allan deviation of a column of a log, or of a file, of which then only this column is read.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "arguments of the Python function")]
pub fn allan(
    py: Python<'_>,
    log: Option<PyRef<'_, Log>>,
    path: PathBuf,
    column: String,
    from_s: Option<f64>,
    to_s: Option<f64>,
    taus: &str,
    interpretation: Option<&str>,
    units_of_answer: Option<&str>,
) -> PyResult<Answer> {
    let taus = match taus {
        "octave" => Taus::Octave,
        "decade" => Taus::Decade,
        "fine" => Taus::Fine,
        other => return Err(PyValueError::new_err(format!("taus {other:?}: must be \"octave\", \"decade\" or \"fine\""))),
    };
    let interpretation = match interpretation {
        None => None,
        Some("value") => Some(Interpretation::Value),
        Some("integral") => Some(Interpretation::Integral),
        Some(other) => return Err(PyValueError::new_err(format!("interpretation {other:?}: must be \"value\" or \"integral\""))),
    };
    let units = units(units_of_answer)?;
    let request = Request { log: path, column, from_s, to_s, taus, interpretation };
    let log = log.map(|log| log.shared());
    task::run(py, None, move |task| {
        let failed = |error| match error {
            AllanError::Log(error) => log_error(&error),
            other => analysis_error(other),
        };
        let recorded = match &log {
            Some(log) => request.take(log),
            None => request.read(),
        };
        let answer = request.analyse(recorded.map_err(failed)?, task.deadline(None)).map_err(failed)?;
        let display = report::Display::new(&answer, units);
        Ok(Answer::new(&report::json(&answer, &display), report::text(&answer, &display), report::html(&answer, &display)))
    })
}
