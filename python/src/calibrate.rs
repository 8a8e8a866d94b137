//! `calibrate`: the record of a session's folder, and a session on the simulated stand.

use std::path::PathBuf;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stand_acquire::calibration_session::journal::JournalError;
use stand_acquire::calibration_session::run::Progress;
use stand_acquire::calibration_session::simulated::{simulate, stand_with_dut};
use stand_acquire::calibration_session::{DutKind, PreparedSession, SessionChanges};
use stand_records::record::{self, CalibrationRecord, ForeignSession, RecordError};
use stand_report::calibration as report;
use stand_report::json::value;

use crate::answer::Answer;
use crate::error::{analysis_error, log_error_at, stand_error};
use crate::noise::units;
use crate::task;

fn kind_of(word: &str) -> PyResult<DutKind> {
    let known = [DutKind::Gyro, DutKind::Accel, DutKind::Drive];
    let names = known.map(DutKind::name).join(", ");
    known
        .into_iter()
        .find(|kind| kind.name() == word)
        .ok_or_else(|| PyValueError::new_err(format!("kind {word:?}: must be one of {names}")))
}

fn record_error(error: &RecordError) -> PyErr {
    match error {
        RecordError::Calibrate(error) => analysis_error(report::calibrate_error(error)),
        RecordError::StepTable(_) | RecordError::Read { .. } | RecordError::Invalid { .. } | RecordError::Journal(_) => {
            analysis_error(error)
        }
    }
}

fn answer(record: &CalibrationRecord, units: &stand_report::units::Units) -> Answer {
    let stored = report::stored(record);
    Answer::new(&value(&stored), report::text(&report::displayed_record(&stored, units)), report::html(record))
}

/// The record of the session in a folder, or of logs of another program with a table of their steps.
#[pyfunction]
pub fn calibrate(
    py: Python<'_>,
    folder: PathBuf,
    kind: &str,
    steps: Option<PathBuf>,
    known: Option<&str>,
    units_of_answer: Option<&str>,
) -> PyResult<Answer> {
    let (kind, units) = (kind_of(kind)?, units(units_of_answer)?);
    let known: ForeignSession = match known {
        Some(text) => toml::from_str(text).map_err(|error| PyValueError::new_err(format!("known: {}", error.to_string().trim_end())))?,
        None => ForeignSession::default(),
    };
    task::run(py, None, move |task| {
        let record = match &steps {
            Some(table) => record::compute_foreign(table, &folder, kind, known),
            None => record::compute_until(&folder, task.deadline(None)),
        };
        let record = record.map_err(|error| match &error {
            RecordError::Journal(JournalError::Log(cause)) => {
                log_error_at(&error.to_string(), &cause.path, cause.row, cause.column.as_deref())
            }
            _ => record_error(&error),
        })?;
        if record.session.dut_kind != kind {
            let (found, wanted) = (record.session.dut_kind.name(), kind.name());
            return Err(analysis_error(format!("{}: the session is for {found}, not for {wanted}", folder.display())));
        }
        Ok(answer(&record, &units))
    })
}

/// Runs a session on the simulated stand in virtual time; its raw logs and journal are in the folder, from which [`calibrate`] computes the
/// record.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "arguments of the Python function")]
pub fn calibrate_simulated(
    py: Python<'_>,
    kind: &str,
    folder: PathBuf,
    seed: u64,
    session: Option<&str>,
    serial: Option<&str>,
    operator: Option<&str>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<()> {
    let changes = SessionChanges { serial, operator };
    let prepared = PreparedSession::new(session, kind_of(kind)?, changes).map_err(analysis_error)?;
    task::run(py, progress.as_ref(), move |task| {
        let seconds = prepared.session.seconds();
        let on_progress = |p: Progress| {
            task.progress(format!("{} of {}: {}", p.number, p.of, p.step), Some((1.0 - p.left_s / seconds).clamp(0.0, 1.0)));
            !task.is_cancelled()
        };
        let stand = stand_with_dut(None, seed, &prepared.session);
        simulate(&stand, seed, &prepared, &folder, task.deadline(None), on_progress).map_err(stand_error)
    })
}
