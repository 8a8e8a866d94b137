//! The row of one log: the only place where an answer becomes a row.

use std::path::Path;
use std::time::Instant;

use crate::explanation::words;
use crate::{column, defect, unit};
use identification::deadline::Deadline;
use identification::identify::explain::{Criteria, ExplainError, Explanation, Options, explain_with};
use identification::identify::explain_logs::read_for;
use identification::log::Log;
use identification::model::Model;
use stand_analysis::fleet::row::{microseconds_of, stand_of};
use stand_analysis::fleet::{Alternative, FileHash, OutputError, ParameterValue, Row};

/// What is asked about a log.
#[derive(Clone, Copy)]
pub struct RowRequest<'a> {
    /// The model.
    pub model: &'a Model,
    /// The criteria.
    pub criteria: &'a Criteria,
    /// The end of the search.
    pub deadline: Deadline,
}

/// Explains the log at `path`, whose hash is `hash`. Settings, build and limits are left to the session that keeps the row.
pub fn row(path: &Path, hash: &FileHash, request: RowRequest<'_>) -> Row {
    let begin = Instant::now();
    let mut row = Row { path: path.display().to_string(), sha256: Some(hash.sha256.clone()), bytes: Some(hash.bytes), ..Row::default() };
    match read_for(path, request.model) {
        Ok(log) => {
            identify(&mut row, &log);
            explain(&mut row, log, request);
        }
        Err(error) => fail(&mut row, error.to_string()),
    }
    row.seconds = begin.elapsed().as_secs_f64();
    row
}

fn fail(row: &mut Row, error: String) {
    row.verdict = stand_analysis::fleet::row::ERROR.to_owned();
    row.error = Some(error);
}

/// What the log says about itself.
fn identify(row: &mut Row, log: &Log) {
    row.samples = i64::try_from(log.len()).ok();
    row.duration_s = finite(log.duration_s());
    row.began_us = log.note("date").and_then(microseconds_of);
    row.stand = log.note("stand").map(stand_of);
    let device: Vec<&str> = ["sensor", "serial"].into_iter().filter_map(|key| log.note(key)).collect();
    row.device = (!device.is_empty()).then(|| device.join(" "));
    row.batch = log.note("batch").map(str::to_owned);
}

fn explain(row: &mut Row, log: Log, request: RowRequest<'_>) {
    match explain_with(
        Options { criteria: request.criteria.clone(), deadline: request.deadline, state: None },
        vec![log],
        request.model,
        &|_| (),
    ) {
        Ok(explanation) => describe(row, &explanation),
        Err(ExplainError::BadLog { findings, .. }) => {
            row.verdict = "bad-log".to_owned();
            row.error = Some(findings.iter().map(defect).collect::<Vec<_>>().join(" "));
        }
        Err(error) => fail(row, error.to_string()),
    }
}

fn describe(row: &mut Row, e: &Explanation) {
    let axis = e.model.axis();
    row.verdict = e.verdict.name().to_owned();
    row.effort_passes = finite(e.effort_passes);
    row.effects.clone_from(&e.missing);
    for effect in &e.missing {
        let alternative = |other: &String| Alternative { effect: effect.clone(), alternative: other.clone() };
        row.not_distinguishable.extend(words::alternatives(e, effect).iter().map(alternative));
    }
    let Some(last) = e.stages.last() else { return };
    row.uncertainty_is_lower_bound = Some(last.sigma_is_lower_bound());
    row.parameters = (last.parameters.iter().filter(|p| p.value.is_finite()))
        .map(|p| ParameterValue {
            name: axis.parameter(&p.name),
            value: p.value,
            standard_uncertainty: finite(p.sigma).filter(|sigma| *sigma > 0.0),
            unit: axis.unit(p.unit).to_owned(),
        })
        .collect();
    for output in &last.outputs {
        let given = e.stages.first().and_then(|stage| stage.outputs.iter().find(|o| o.channel == output.channel));
        let (Some(ratio_given), Some(ratio), Some(noise)) =
            (given.and_then(|o| finite(o.ratio())), finite(output.ratio()), finite(output.noise))
        else {
            continue;
        };
        let (output, unit) = (column(axis, output.channel).to_owned(), unit(axis, output.channel).to_owned());
        row.outputs.push(OutputError { output, unit, noise, ratio_given, ratio });
    }
}

fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}
