//! Compare, fit and explain on files of the session: the library's functions, their answers as files that the command line writes too. And
//! the signature of an effect in a log, for its page.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use serde::Deserialize;
use serde_json::{Value, json};

use super::jobs::{CANCELLED, Job, JobError, message};
use super::parts::Panel;
use super::stage::Stage;
use identification::deadline::Deadline;
use identification::files;
use identification::identify::evaluation::{Evaluated, Evaluation, ParameterTreatment, evaluate};
use identification::identify::explain::{ExplainError, Explanation, Options, Verdict, explain_with};
use identification::identify::explain_logs::read_for;
use identification::identify::series::series;
use identification::log::{Column, Log};
use identification::model::Model;
use stand_report::Comparison;

/// The command that does the same in a shell.
///
/// # Errors
/// A name is not one of the session.
pub fn command(panel: &Panel, kind: &str, log: &str, model: &str) -> Result<String, String> {
    for name in [log, model] {
        panel.session.existing(name).map_err(message)?;
    }
    let out = if kind == "fit" { format!(" --out {model} --force") } else { String::new() };
    Ok(format!("stand {kind} {log} --model {model}{out}"))
}

fn read(panel: &Panel, log: &str, model: &str, job: &Job) -> Result<(Log, Model), JobError> {
    job.stage(Stage::Reading, None);
    let model = Model::read(panel.session.existing(model).map_err(message)?).map_err(message)?;
    let (path, read_model) = (panel.session.existing(log).map_err(message)?, model.clone());
    let mut log = job.while_reading(move || read_for(&path, &read_model))?.map_err(message)?;
    log.even_out_times();
    Ok((log, model))
}

/// Writes an answer.
pub fn write_json(path: &Path, answer: &Value) -> Result<(), String> {
    let text = serde_json::to_string_pretty(answer).map_err(message)?;
    files::replace_text(path, &format!("{text}\n")).map_err(|error| format!("{}: {error}", path.display()))
}

/// Name of the series of an answer.
fn series_name(answer: &str) -> String {
    format!("{}-series.parquet", answer.trim_end_matches(".json"))
}

/// Text of a log that is no plausible record of a drive.
fn bad_log(log: &Log, findings: &[identification::log::plausible::Defect]) -> String {
    let text = stand_report::bad_log_text(log, findings, stand_report::Style { colour: false, width: 10_000 });
    text.lines().filter(|line| !line.trim().is_empty()).collect::<Vec<_>>().join(" ")
}

/// Compares the model with the log; `fits`: with its parameters fitted, which are then written into the model. The name of the answer.
///
/// # Errors
/// In words.
pub fn compare(panel: &Arc<Panel>, log_name: &str, model_name: &str, fits: bool, job: &Job) -> Result<String, JobError> {
    let (log, model) = read(panel, log_name, model_name, job)?;
    job.stage(if fits { Stage::Fitting } else { Stage::Simulating }, None);
    let treatment = if fits { ParameterTreatment::Fitted } else { ParameterTreatment::Kept };
    let deadline = Deadline::NEVER.or_when(&CANCELLED);
    let evaluated = match evaluate(&log, &model, treatment, deadline).map_err(message)? {
        Evaluation::ImplausibleLog(findings) => return Err(bad_log(&log, &findings).into()),
        Evaluation::Evaluated(evaluated) => *evaluated,
    };
    if job.is_cancelled() {
        return Err(JobError::Cancelled);
    }
    let kind = if fits { "fit" } else { "compare" };
    let answer = panel.session.free_name(kind, "json");
    let comparison = Comparison::of(&log, &model, &evaluated, fits);
    let mut json = if fits { stand_report::fit_json(&comparison) } else { stand_report::compare_json(&comparison) };
    let rows = series(&log, &evaluated.data, &evaluated.result).map_err(message)?;
    rows.write(panel.session.new_file(&series_name(&answer)).map_err(message)?).map_err(message)?;
    if fits {
        write_values(panel, model_name, &model, &evaluated.result)?;
    }
    describe(&mut json, log_name, model_name, &answer, &model);
    json["profiles"] = stand_report::profiles_json(&log, &evaluated.data, &evaluated.result);
    write_json(&panel.session.new_file(&answer).map_err(message)?, &json)?;
    Ok(answer)
}

/// An effect whose signature in a log is asked for.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignatureRequest {
    log: String,
    model: String,
    effect: String,
    /// Values at which its fit starts.
    #[serde(default)]
    parameters: BTreeMap<String, f64>,
}

impl SignatureRequest {
    /// No command of the shell does the same: a comment in the list of commands.
    ///
    /// # Errors
    /// A name is not one of the session or of the catalogue.
    pub fn command(&self, panel: &Panel) -> Result<String, String> {
        for name in [&self.log, &self.model] {
            panel.session.existing(name).map_err(message)?;
        }
        let is_known = drive_model::card(self.effect.split('#').next().unwrap_or_default()).is_some();
        if !is_known || !self.effect.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '#')) {
            return Err(format!("{}: no effect of the catalogue", self.effect.escape_default()));
        }
        Ok(format!("# signature of {} in {}, beside {}", self.effect, self.log, self.model))
    }
}

/// The signature of an effect in a log: the model is fitted without and with it, and the difference of the two is what the effect explains
/// of the residual. The files are unchanged. The name of the answer.
///
/// # Errors
/// In words.
pub fn signature(panel: &Arc<Panel>, request: &SignatureRequest, job: &Job) -> Result<String, JobError> {
    let SignatureRequest { log: log_name, model: model_name, effect, parameters } = request;
    let (log, mut without) = read(panel, log_name, model_name, job)?;
    let mut with = without.clone();
    if without.effect_names().contains(effect) {
        without.remove(effect).map_err(message)?;
    } else {
        with.add(effect).map_err(message)?;
        with.set_all(parameters.iter().map(|(name, value)| (name.as_str(), *value))).map_err(message)?;
    }
    job.stage(Stage::Fitting, None);
    let before = fitted(&log, &without, job)?;
    job.stage(Stage::FittingWith { effect: effect.clone() }, None);
    let after = fitted(&log, &with, job)?;
    let rows = series(&log, &before.data, &before.result).map_err(message)?;
    let with_rows = series(&log, &after.data, &after.result).map_err(message)?;
    if rows.t_s() != with_rows.t_s() {
        return Err(
            format!("{effect}: the model with it does not describe all rows of {log_name} that the model without it describes").into()
        );
    }
    let modelled = |column: &&Column| column.name.ends_with("_model");
    let predicted = with_rows
        .columns()
        .iter()
        .filter(modelled)
        .map(|column| Column { name: format!("{}_with", column.name), values: column.values.clone() });
    let columns = rows.columns().iter().cloned().chain(predicted).collect();
    let all = Log::new(rows.path(), columns, rows.notes().clone()).map_err(message)?;
    let answer = panel.session.free_name("signature", "json");
    all.write(panel.session.new_file(&series_name(&answer)).map_err(message)?).map_err(message)?;
    let mut json = json!({
        "effect": effect,
        "converged": before.result.converged && after.result.converged,
        "coordinate": drive_model::card(effect.split('#').next().unwrap_or_default()).map(|card| card.coordinate.name()),
        "profiles": stand_report::profiles_json(&log, &before.data, &before.result),
        "profiles_with": stand_report::profiles_json(&log, &after.data, &after.result),
    });
    describe(&mut json, log_name, model_name, &answer, &without);
    write_json(&panel.session.new_file(&answer).map_err(message)?, &json)?;
    Ok(answer)
}

/// The model fitted to the log.
fn fitted<'a>(log: &'a Log, model: &Model, job: &Job) -> Result<Evaluated<'a>, JobError> {
    let deadline = Deadline::NEVER.or_when(&CANCELLED);
    let evaluated = match evaluate(log, model, ParameterTreatment::Fitted, deadline).map_err(message)? {
        Evaluation::ImplausibleLog(findings) => return Err(bad_log(log, &findings).into()),
        Evaluation::Evaluated(evaluated) => *evaluated,
    };
    if job.is_cancelled() { Err(JobError::Cancelled) } else { Ok(evaluated) }
}

/// What the answer belongs to, for the staircase and the plots.
fn describe(json: &mut Value, log: &str, model: &str, answer: &str, given: &Model) {
    json["log"] = log.into();
    json["model"] = model.into();
    json["series"] = series_name(answer).into();
    json["model_effects"] = given.effect_names().into();
}

fn write_values(panel: &Panel, name: &str, model: &Model, fit: &identification::identify::fit::FitResult) -> Result<(), String> {
    let path = panel.session.existing(name).map_err(message)?;
    let _locked = files::lock(&path).map_err(message)?;
    if Model::read(&path).map_err(message)?.to_toml() != model.to_toml() {
        return Err(format!("{name} was edited during the fit; nothing was written"));
    }
    let mut fitted = model.clone();
    let values: Vec<(&str, f64)> = fit.parameters.list.iter().map(|p| (p.name.as_str(), p.value)).collect();
    fitted.set_all(values).map_err(message)?;
    fitted.write(&path).map_err(message)
}

/// Finds the effect that the model lacks. The name of the answer; the model is unchanged.
///
/// # Errors
/// In words.
pub fn explain(panel: &Arc<Panel>, log_name: &str, model_name: &str, job: &Job) -> Result<String, JobError> {
    let (log, model) = read(panel, log_name, model_name, job)?;
    let deadline = Deadline::NEVER.or_when(&CANCELLED);
    let progress = |stage: &identification::identify::explain::Progress| job.stage(stage.into(), None);
    let explanation: Explanation = match explain_with(Options { deadline, ..Options::default() }, vec![log], &model, &progress) {
        Ok(explanation) => explanation,
        Err(ExplainError::BadLog { log, findings }) => return Err(bad_log(&log, &findings).into()),
        Err(error) => return Err(error.to_string().into()),
    };
    if job.is_cancelled() {
        return Err(JobError::Cancelled);
    }
    if explanation.verdict == Verdict::NotFinished {
        return Err("the limit of effort has ended the search; `stand explain --effort` on the command line goes further"
            .to_owned()
            .into());
    }
    let answer = panel.session.free_name("explain", "json");
    let mut json = stand_report::explain_json(&explanation);
    let rows = series(&explanation.log, &explanation.data(), &explanation.explained).map_err(message)?;
    rows.write(panel.session.new_file(&series_name(&answer)).map_err(message)?).map_err(message)?;
    describe(&mut json, log_name, model_name, &answer, &model);
    json["profiles"] = stand_report::profiles_json(&explanation.log, &explanation.data(), &explanation.explained);
    json["text"] = stand_report::explain_text(&explanation, stand_report::Style { colour: false, width: 100 }).into();
    write_json(&panel.session.new_file(&answer).map_err(message)?, &json)?;
    Ok(answer)
}
