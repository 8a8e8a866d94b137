//! `stand fit`: the parameters of a model fitted to a log.

use std::path::PathBuf;

use clap::Args;

use super::compare::{evaluate_and_report, implausible_log, read_log_and_model};
use super::error::CliError;
use super::import::ImportOptions;
use super::output::{Overwrite, ReportOutput, SeriesOutput, TimeLimit, spinner, style};
use identification::deadline::Deadline;
use identification::identify::equation_error::{self, EquationErrorFailure, EquationErrorResult};
use identification::identify::evaluation::ParameterTreatment;
use identification::identify::fit::parameters::Parameters;
use identification::log::Log;
use identification::model::Model;
use stand_report as report;

/// Fit the parameters of a model to a log.
#[derive(Debug, Args)]
pub(super) struct Fit {
    /// The log, .csv or .parquet; several are fitted together with one set of parameters
    #[arg(required = true)]
    log: Vec<PathBuf>,
    /// The model, .toml; its values are the start of the fit
    #[arg(long)]
    model: PathBuf,
    /// Write the fitted model to this file
    #[arg(long, value_name = "MODEL")]
    out: Option<PathBuf>,
    /// Fit to every row; by default blocks of rows are held out for validation
    #[arg(long)]
    all_rows: bool,
    /// Fit by equation error (inverse model, linear least squares) and show the output-error fit beside it
    #[arg(long, conflicts_with = "html")]
    equation_error: bool,
    /// Cutoff of the low-pass before the angle is differentiated; default 100 Hz, or a fifth of the row rate if that is lower
    #[arg(long, value_name = "HZ", requires = "equation_error")]
    cutoff_hz: Option<f64>,
    #[command(flatten)]
    time_limit: TimeLimit,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    series: SeriesOutput,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    output: ReportOutput,
}

impl Fit {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        self.series.check()?;
        let deadline = Deadline::after_s(self.time_limit.seconds()?);
        self.out.as_deref().map_or(Ok(()), |out| self.overwrite.check(out))?;
        self.import.apply(self.log.iter().map(PathBuf::as_path))?;
        let (log, model) = read_log_and_model(&self.log, &self.model)?;
        let parameters = if self.equation_error {
            self.by_equation_error(&log, &model)?
        } else {
            let treatment = if self.all_rows { ParameterTreatment::FittedToAllRows } else { ParameterTreatment::Fitted };
            let result = evaluate_and_report(&log, &model, treatment, deadline, (&self.output, &self.series))?;
            if deadline.has_passed() && !result.converged {
                return Err(self.time_limit.error("fit before it converged; no model is written"));
            }
            result.parameters
        };
        let Some(out) = &self.out else { return Ok(()) };
        let mut fitted = model.clone();
        fitted.set_all(parameters.list.iter().map(|p| (p.name.as_str(), p.value)))?;
        fitted.write(out)?;
        self.output.text(&format!("\nFitted model written to {}.\n", out.display()))
    }

    /// Fits by equation error. An implausible log is reported and an error.
    fn by_equation_error(&self, log: &Log, model: &Model) -> Result<Parameters, CliError> {
        let spinner = spinner("fitting");
        let result = equation_error::fit(log, model, self.cutoff_hz, self.all_rows);
        spinner.finish_and_clear();
        match result? {
            EquationErrorResult::ImplausibleLog(findings) => {
                Err(implausible_log(log, &findings, &self.output, || report::bad_log_json(log, &findings)))
            }
            EquationErrorResult::Fitted(fit) => {
                self.output.text(&report::equation_error::text(log, model, &fit, style()))?;
                self.output.json(|| report::equation_error::json(log, model, &fit))?;
                Ok(fit.equation.parameters)
            }
        }
    }
}

impl From<EquationErrorFailure> for CliError {
    fn from(error: EquationErrorFailure) -> Self {
        CliError::Input(error.to_string())
    }
}
