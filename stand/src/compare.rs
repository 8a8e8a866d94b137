//! `stand compare`: a model compared with a log.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::Value;

use super::error::CliError;
use super::import::ImportOptions;
use super::output::{ReportOutput, SeriesOutput, spinner, style};
use identification::deadline::Deadline;
use identification::identify::evaluation::{Evaluation, EvaluationError, ParameterTreatment, evaluate};
use identification::identify::explain::criteria::JoiningCriteria;
use identification::identify::explain::join;
use identification::identify::explain_logs::read_for;
use identification::identify::fit::FitResult;
use identification::log::Log;
use identification::log::plausible::Defect;
use identification::model::Model;
use stand_report::Comparison;

/// Compare a model with a log, without changing its parameters.
#[derive(Debug, Args)]
pub(super) struct Compare {
    /// The log, .csv or .parquet; several are compared together
    #[arg(required = true)]
    log: Vec<PathBuf>,
    /// The model, .toml
    #[arg(long)]
    model: PathBuf,
    #[command(flatten)]
    series: SeriesOutput,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    output: ReportOutput,
}

impl Compare {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        self.series.check()?;
        self.import.apply(self.log.iter().map(PathBuf::as_path))?;
        let (log, model) = read_log_and_model(&self.log, &self.model)?;
        evaluate_and_report(&log, &model, ParameterTreatment::Kept, Deadline::NEVER, (&self.output, &self.series)).map(drop)
    }
}

impl From<EvaluationError> for CliError {
    fn from(error: EvaluationError) -> Self {
        match error {
            EvaluationError::Prepare(error) => error.into(),
            EvaluationError::Fit(error) => error.into(),
        }
    }
}

/// Reads logs, as one, and a model.
pub(super) fn read_log_and_model(logs: &[PathBuf], model: &Path) -> Result<(Log, Model), CliError> {
    let model = Model::read(model)?;
    let spinner = spinner("reading");
    let read = |path: &PathBuf| {
        read_for(path, &model).map(|mut log| {
            log.even_out_times();
            log
        })
    };
    let read = logs.iter().map(read).collect::<Result<Vec<_>, _>>();
    spinner.finish_and_clear();
    let (log, _) = join(read?, &JoiningCriteria::default()).map_err(|e| CliError::Input(e.to_string()))?;
    Ok((log, model))
}

/// Evaluates the model on the log and reports the result. An implausible log is reported and an error.
pub(super) fn evaluate_and_report(
    log: &Log,
    model: &Model,
    treatment: ParameterTreatment,
    deadline: Deadline,
    (output, series): (&ReportOutput, &SeriesOutput),
) -> Result<FitResult, CliError> {
    let fitted = treatment != ParameterTreatment::Kept;
    let spinner = spinner(if fitted { "fitting" } else { "simulating" });
    let evaluation = evaluate(log, model, treatment, deadline);
    spinner.finish_and_clear();
    let evaluated = match evaluation? {
        Evaluation::ImplausibleLog(findings) => {
            return Err(implausible_log(log, &findings, output, || stand_report::bad_log_json(log, &findings)));
        }
        Evaluation::Evaluated(evaluated) => *evaluated,
    };
    let comparison = Comparison::of(log, model, &evaluated, fitted);
    output.text(&stand_report::comparison_text(&comparison, style()))?;
    output.json(|| if fitted { stand_report::fit_json(&comparison) } else { stand_report::compare_json(&comparison) })?;
    output.html(|| stand_report::comparison_html(&comparison))?;
    series.write(log, &evaluated.data, &evaluated.result)?;
    Ok(evaluated.result)
}

/// Reports what makes a log implausible as a record of a drive, and returns the error of the command.
pub(super) fn implausible_log(log: &Log, findings: &[Defect], output: &ReportOutput, json: impl FnOnce() -> Value) -> CliError {
    let reported = output.text(&stand_report::bad_log_text(log, findings, style())).and_then(|()| output.json(json));
    match reported.and_then(|()| output.html(|| stand_report::bad_log_html(log, findings))) {
        Err(error) => error,
        Ok(()) => CliError::in_file(log.path(), "the log is not a plausible record of a drive (verdict bad-log); nothing was fitted"),
    }
}
