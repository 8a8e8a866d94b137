//! `fleet`: rows of the table of many logs, the journal that keeps them, and the report.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use identification::identify::explain::Criteria;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use stand_analysis::fleet::evaluation::evaluate;
use stand_analysis::fleet::row::microseconds_of;
use stand_analysis::fleet::run::{self, Callbacks, on_one_thread};
use stand_analysis::fleet::session::logs_of;
use stand_analysis::fleet::{FileHash, IdentityTable, Row, Session, Settings, table};
use stand_report::fleet::{self as report, RowRequest};

use crate::answer::Answer;
use crate::error::analysis_error;
use crate::model::Model;
use crate::task;

/// The logs that these paths name: files as they are, of folders all logs. Sorted, each once.
#[pyfunction]
pub fn fleet_logs(py: Python<'_>, paths: Vec<PathBuf>) -> PyResult<Vec<String>> {
    py.detach(|| logs_of(&paths)).map_err(|error| PyOSError::new_err(error.to_string()))
}

/// Hash and size of a log: `(sha256, bytes, None)`, or `(None, None, reason)`.
#[pyfunction]
pub fn fleet_hash(py: Python<'_>, path: &str) -> (Option<String>, Option<i64>, Option<String>) {
    match py.detach(|| FileHash::of(Path::new(path))) {
        Ok(hash) => (Some(hash.sha256), Some(hash.bytes), None),
        Err(error) => (None, None, Some(format!("{path}: cannot read: {error}"))),
    }
}

/// The row of one log as JSON, computed on one thread.
#[pyfunction]
pub fn fleet_row(
    py: Python<'_>,
    path: String,
    sha256: String,
    bytes: i64,
    model: &Model,
    effort: Option<u64>,
    time_limit_s: Option<f64>,
) -> PyResult<String> {
    let criteria = criteria_of(effort);
    let (model, hash) = (model.copy(), FileHash { sha256, bytes });
    task::run(py, None, move |task| {
        let deadline = task.deadline(time_limit_s);
        let row = |path: &Path, hash: &FileHash| report::row(path, hash, RowRequest { model: &model, criteria: &criteria, deadline });
        let row = on_one_thread(|| run::compute(&path, &hash, &row));
        serde_json::to_string(&row).map_err(|error| PyRuntimeError::new_err(error.to_string()))
    })
}

fn criteria_of(effort: Option<u64>) -> Criteria {
    let mut criteria = Criteria::default();
    criteria.search.max_passes = effort;
    criteria
}

fn identities_of(stands: Option<PathBuf>) -> PyResult<IdentityTable> {
    stands.map_or(Ok(IdentityTable::default()), |path| IdentityTable::read(&path)).map_err(analysis_error)
}

/// A table under computation: the journal beside it, which keeps each row as soon as it is there.
#[pyclass(frozen, module = "rotary_stand._native")]
pub struct FleetSession {
    session: Mutex<Option<Session>>,
    identities: IdentityTable,
    failures: Mutex<BTreeMap<String, String>>,
    table: String,
}

/// Path of a log with its hash and size, or with the reason why there is none: as of `fleet_hash`.
type Hashed = (String, Option<String>, Option<i64>, Option<String>);

#[pymethods]
impl FleetSession {
    /// Opens the journal of the table, or creates it.
    #[new]
    fn new(table: PathBuf, model: &Model, effort: Option<u64>, time_limit_s: Option<f64>, stands: Option<PathBuf>) -> PyResult<Self> {
        let model = model.copy();
        let settings = Settings {
            model_name: model.name().to_owned(),
            model: model.to_toml(),
            build: stand_firmware::VERSION.to_owned(),
            effort_limit_passes: effort.and_then(|passes| i64::try_from(passes).ok()),
            time_limit_s,
        };
        let identities = identities_of(stands)?;
        let session = Session::open(&table, settings).map_err(|error| PyOSError::new_err(error.to_string()))?;
        Ok(FleetSession { session: Mutex::new(Some(session)), identities, failures: Mutex::default(), table: table.display().to_string() })
    }

    /// The logs that have no answer yet, each content once; the largest first.
    fn open_logs(&self, logs: Vec<Hashed>) -> PyResult<Vec<(String, String, i64)>> {
        self.with(|session| {
            let (mut seen, mut open) = (std::collections::BTreeSet::new(), Vec::new());
            for (path, sha256, bytes, _) in logs {
                let (Some(sha256), Some(bytes)) = (sha256, bytes) else { continue };
                if session.answer(&sha256).is_none() && seen.insert(sha256.clone()) {
                    open.push((path, sha256, bytes));
                }
            }
            open.sort_by_key(|(_, _, bytes)| std::cmp::Reverse(*bytes));
            Ok(open)
        })
    }

    /// Keeps a row; it is on the disk when this returns.
    fn record(&self, py: Python<'_>, row: &str) -> PyResult<()> {
        let row: Row = serde_json::from_str(row).map_err(|error| PyValueError::new_err(error.to_string()))?;
        py.detach(|| self.with(|session| session.record(row).map_err(|error| PyOSError::new_err(error.to_string()))))
    }

    /// Notes why a log has no answer. It is computed again the next time.
    fn fail(&self, sha256: String, reason: String) {
        locked(&self.failures).insert(sha256, reason);
    }

    /// Writes the table of these logs. Returns its summary.
    fn finish(&self, py: Python<'_>, logs: Vec<Hashed>, computed: usize) -> PyResult<Answer> {
        let count = logs.len();
        let hashed = logs.into_iter().map(|(path, sha256, bytes, reason)| match (sha256, bytes) {
            (Some(sha256), Some(bytes)) => (path, Ok(FileHash { sha256, bytes })),
            _ => (path, Err(reason.unwrap_or_default())),
        });
        let hashed: Vec<_> = hashed.collect();
        let rows = py.detach(|| {
            self.with(|session| {
                session
                    .write_table(&hashed, &locked(&self.failures), &self.identities)
                    .map_err(|error| PyOSError::new_err(error.to_string()))
            })
        })?;
        let is_interrupted = rows.len() < count;
        Ok(summary(&self.table, &run::FleetRun { rows, logs: count, computed, is_interrupted }))
    }

    /// Computes the answers that are missing on threads of this process, and writes the table. Closes the session.
    fn run(&self, py: Python<'_>, paths: Vec<String>, threads: usize, progress: Option<Bound<'_, PyAny>>) -> PyResult<Answer> {
        let session = locked(&self.session).take().ok_or_else(closed)?;
        let (identities, table) = (self.identities.clone(), self.table.clone());
        let settings = session.settings().clone();
        let model = identification::model::Model::parse(&settings.model, &settings.model_name)
            .map_err(|error| crate::error::model_error(&error))?;
        let criteria = criteria_of(settings.effort_limit_passes.and_then(|passes| u64::try_from(passes).ok()));
        task::run(py, progress.as_ref(), move |task| {
            let total = paths.len();
            let callbacks = Callbacks {
                compute: &|path, hash| {
                    let deadline = task.deadline(settings.time_limit_s);
                    report::row(path, hash, RowRequest { model: &model, criteria: &criteria, deadline })
                },
                is_interrupted: &|| task.is_cancelled(),
                finished: &|row, done| task.progress(row.path.clone(), Some(done as f64 / total.max(1) as f64)),
            };
            let run = run::run(session, &paths, &identities, threads, &callbacks).map_err(|error| PyOSError::new_err(error.to_string()))?;
            Ok(summary(&table, &run))
        })
    }

    /// Closes the journal, which another process may then open.
    fn close(&self) {
        locked(&self.session).take();
    }
}

impl FleetSession {
    fn with<T>(&self, work: impl FnOnce(&mut Session) -> PyResult<T>) -> PyResult<T> {
        work(locked(&self.session).as_mut().ok_or_else(closed)?)
    }
}

fn closed() -> PyErr {
    PyValueError::new_err("the session is closed")
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn summary(table: &str, run: &run::FleetRun) -> Answer {
    Answer::new(&report::run_json(table, run), report::run_text(table, run), String::new())
}

/// The evaluation of tables.
#[pyfunction]
pub fn fleet_report(py: Python<'_>, tables: Vec<PathBuf>, since: Option<String>, stands: Option<PathBuf>) -> PyResult<Answer> {
    let date = |text: &str| {
        microseconds_of(text).ok_or_else(|| {
            PyValueError::new_err(format!("since {text:?}: must be a date such as \"2026-11-22\" or \"2026-11-22T08:30:00+01:00\""))
        })
    };
    let since_us = since.as_deref().map(date).transpose()?;
    let identities = identities_of(stands)?;
    py.detach(|| {
        let mut rows = table::read(&tables).map_err(analysis_error)?;
        rows.iter_mut().for_each(|row| identities.apply(row));
        let evaluation = evaluate(&rows, since_us);
        let names: Vec<String> = tables.iter().map(|path| path.display().to_string()).collect();
        Ok(Answer::new(&report::json(&evaluation), report::text(&evaluation), report::html(&names.join(", "), &evaluation)))
    })
}
