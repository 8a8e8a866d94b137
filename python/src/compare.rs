//! `compare`, `fit` and `simulate`.

use identification::deadline::Deadline;
use identification::identify::evaluation::{Evaluation, ParameterTreatment, evaluate};
use identification::identify::explain::criteria::JoiningCriteria;
use identification::identify::explain::join;
use identification::identify::sensitivities::with_sensitivities;
use identification::identify::series::series;
use identification::log;
use identification::log::plausible::Defect;
use identification::model;
use pyo3::prelude::*;
use stand_report::Comparison;
use std::sync::Arc;

use crate::answer::{Answer, STYLE};
use crate::error::{analysis_error, implausible_log, log_error, model_error};
use crate::log::Log;
use crate::model::Model;
use crate::task::{self, Task};

/// Logs with the rate that the model compares.
///
/// # Errors
/// `LogError`: a log lacks the column of the rate.
pub fn logs_for(logs: &[Arc<log::Log>], model: &model::Model) -> PyResult<Vec<log::Log>> {
    let with_rate = |log: &Arc<log::Log>| {
        let log = log::Log::clone(log);
        match model.rate_column() {
            Some(column) => log.with_rate(column),
            None => Ok(log),
        }
    };
    logs.iter().map(with_rate).collect::<Result<_, _>>().map_err(|error| log_error(&error))
}

/// What makes a log implausible as a record of a drive, as an exception.
pub fn implausible(log: &log::Log, findings: &[Defect], json: &serde_json::Value) -> PyErr {
    implausible_log(stand_report::bad_log_text(log, findings, STYLE), json.to_string(), stand_report::bad_log_html(log, findings))
}

/// The logs as one, with even times.
fn joined(logs: &[Arc<log::Log>], model: &model::Model) -> PyResult<log::Log> {
    let mut logs = logs_for(logs, model)?;
    logs.iter_mut().for_each(log::Log::even_out_times);
    join(logs, &JoiningCriteria::default()).map(|(log, _)| log).map_err(analysis_error)
}

/// What is made of an evaluated model.
#[derive(Clone, Copy, PartialEq)]
enum Wanted {
    Comparison,
    Fit { all_rows: bool },
    Simulation,
}

fn evaluated(log: &log::Log, model: &model::Model, wanted: Wanted, deadline: Deadline) -> PyResult<Answer> {
    let treatment = match wanted {
        Wanted::Comparison | Wanted::Simulation => ParameterTreatment::Kept,
        Wanted::Fit { all_rows: false } => ParameterTreatment::Fitted,
        Wanted::Fit { all_rows: true } => ParameterTreatment::FittedToAllRows,
    };
    let evaluated = match evaluate(log, model, treatment, deadline).map_err(analysis_error)? {
        Evaluation::ImplausibleLog(findings) => return Err(implausible(log, &findings, &stand_report::bad_log_json(log, &findings))),
        Evaluation::Evaluated(evaluated) => *evaluated,
    };
    let fitted = matches!(wanted, Wanted::Fit { .. });
    if fitted && !evaluated.result.converged && deadline.has_passed() {
        return Err(analysis_error("the time limit has ended the fit before it converged; time_limit_s sets another one, None is none"));
    }
    let rows = match wanted {
        Wanted::Simulation => with_sensitivities(log, model, &evaluated.data, &evaluated.result),
        Wanted::Comparison | Wanted::Fit { .. } => series(log, &evaluated.data, &evaluated.result),
    };
    let rows = rows.map_err(|error| log_error(&error))?;
    let comparison = Comparison::of(log, model, &evaluated, fitted);
    let json = if fitted { stand_report::fit_json(&comparison) } else { stand_report::compare_json(&comparison) };
    let answer =
        Answer::new(&json, stand_report::comparison_text(&comparison, STYLE), stand_report::comparison_html(&comparison)).with_series(rows);
    if !fitted {
        return Ok(answer);
    }
    let mut better = model.clone();
    let values = evaluated.result.parameters.list.iter().map(|p| (p.name.as_str(), p.value));
    better.set_all(values).map_err(|error| model_error(&error))?;
    Ok(answer.with_model(better))
}

fn on_task(
    py: Python<'_>,
    logs: &[PyRef<'_, Log>],
    model: &Model,
    wanted: Wanted,
    time_limit_s: Option<f64>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Answer> {
    let (logs, model): (Vec<_>, _) = (logs.iter().map(|log| log.shared()).collect(), model.copy());
    task::run(py, progress, move |task: &Task| {
        task.progress(if matches!(wanted, Wanted::Fit { .. }) { "fitting" } else { "simulating" }.to_owned(), None);
        evaluated(&joined(&logs, &model)?, &model, wanted, task.deadline(time_limit_s))
    })
}

/// The model compared with the logs, or fitted to them.
#[pyfunction]
pub fn compare(
    py: Python<'_>,
    logs: Vec<PyRef<'_, Log>>,
    model: &Model,
    fits: bool,
    all_rows: bool,
    time_limit_s: Option<f64>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Answer> {
    let wanted = if fits { Wanted::Fit { all_rows } } else { Wanted::Comparison };
    on_task(py, &logs, model, wanted, time_limit_s, progress.as_ref())
}

/// The model simulated along the logs, with sensitivities.
#[pyfunction]
pub fn simulate(py: Python<'_>, logs: Vec<PyRef<'_, Log>>, model: &Model, progress: Option<Bound<'_, PyAny>>) -> PyResult<Answer> {
    on_task(py, &logs, model, Wanted::Simulation, None, progress.as_ref())
}
