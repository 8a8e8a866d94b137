//! `explain`.

use host_tools::identify::explain::{Criteria, Engine, ExplainError, explain_until};
use host_tools::identify::series::series;
use host_tools::report;
use host_tools::report::explanation::sentences;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::answer::{Answer, STYLE};
use crate::compare::{implausible, logs_for};
use crate::error::{analysis_error, log_error};
use crate::log::Log;
use crate::model::Model;
use crate::task;

/// The engine of this name.
pub fn engine_of(name: &str) -> PyResult<Engine> {
    match name {
        "whitened" => Ok(Engine::Whitened),
        "prediction-error" => Ok(Engine::PredictionError),
        other => Err(PyValueError::new_err(format!("engine {other:?}: must be \"whitened\" or \"prediction-error\""))),
    }
}

/// The effect that the model lacks in the logs together. After the time limit the verdict is `not-finished`.
#[pyfunction]
pub fn explain(
    py: Python<'_>,
    logs: Vec<PyRef<'_, Log>>,
    model: &Model,
    engine: &str,
    time_limit_s: Option<f64>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Answer> {
    let mut criteria = Criteria::default();
    criteria.search.engine = engine_of(engine)?;
    criteria.search.time_limit_s = time_limit_s;
    let (logs, model): (Vec<_>, _) = (logs.iter().map(|log| log.shared()).collect(), model.copy());
    task::run(py, progress.as_ref(), move |task| {
        let stage = |stage: &_| task.progress(sentences::progress(stage), None);
        match explain_until(task.deadline(time_limit_s), criteria, logs_for(&logs, &model)?, &model, &stage) {
            Ok(e) => {
                let rows = series(&e.log, &e.data(), &e.explained).map_err(|error| log_error(&error))?;
                let answer = Answer::new(&report::explain_json(&e), report::explain_text(&e, STYLE), report::explain_html(&e));
                Ok(answer.with_series(rows).with_model(e.model.clone()))
            }
            Err(ExplainError::BadLog { log, findings }) => {
                Err(implausible(&log, &findings, &report::explain_bad_log_json(&log, &findings)))
            }
            Err(error) => Err(analysis_error(error)),
        }
    })
}
