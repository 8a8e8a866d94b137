//! `explain`.

use identification::identify::explain::SearchState;
use identification::identify::explain::{Criteria, ExplainError, Options, explain_with};
use identification::identify::series::series;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stand_report as report;
use stand_report::explanation::sentences;

use crate::answer::{Answer, STYLE};
use crate::compare::{implausible, logs_for};
use crate::error::{analysis_error, log_error};
use crate::log::Log;
use crate::model::Model;
use crate::task;

/// The effect that the model lacks in the logs together. After the limit of effort (passes) or time the verdict is `not-finished`, and the
/// answer has the state to continue from.
#[pyfunction]
pub fn explain(
    py: Python<'_>,
    logs: Vec<PyRef<'_, Log>>,
    model: &Model,
    effort: Option<u64>,
    state: Option<&str>,
    time_limit_s: Option<f64>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Answer> {
    let mut criteria = Criteria::default();
    criteria.search.max_passes = effort;
    let state = state.map(SearchState::parse).transpose().map_err(|error| PyValueError::new_err(format!("state: {error}")))?;
    let (logs, model): (Vec<_>, _) = (logs.iter().map(|log| log.shared()).collect(), model.copy());
    task::run(py, progress.as_ref(), move |task| {
        let stage = |stage: &_| task.progress(sentences::progress(stage), None);
        let options = Options { criteria, deadline: task.deadline(time_limit_s), state: state.as_ref() };
        match explain_with(options, logs_for(&logs, &model)?, &model, &stage) {
            Ok(e) => {
                let rows = series(&e.log, &e.data(), &e.explained).map_err(|error| log_error(&error))?;
                let answer = Answer::new(&report::explain_json(&e), report::explain_text(&e, STYLE), report::explain_html(&e));
                Ok(answer.with_series(rows).with_model(e.model.clone()).with_state(e.unfinished.map(|unfinished| unfinished.state)))
            }
            Err(ExplainError::BadLog { log, findings }) => {
                Err(implausible(&log, &findings, &report::explain_bad_log_json(&log, &findings)))
            }
            Err(error) => Err(analysis_error(error)),
        }
    })
}
