//! `stand compare` and `stand fit`: a model held against a log.

mod equation_error;

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::error::CliError;
use super::output::{ReportOutput, check_place, is_terminal, working};
use crate::identify::fit::{self, FitResult, PreparedLog};
use crate::identify::residual;
use crate::log::plausible;
use crate::log::{Log, Source};
use crate::model::{Channel, Model};
use crate::report::{self, Comparison, Style};

/// Hold a model against a log, unchanged.
#[derive(Debug, Args)]
pub(super) struct Compare {
    /// The log, .csv or .parquet
    log: PathBuf,
    /// The model, .toml
    #[arg(long)]
    model: PathBuf,
    #[command(flatten)]
    output: ReportOutput,
}

/// Fit a model's parameters to a log.
#[derive(Debug, Args)]
pub(super) struct Fit {
    /// The log, .csv or .parquet
    log: PathBuf,
    /// The model, .toml: its numbers are where the fit starts
    #[arg(long)]
    model: PathBuf,
    /// Write the fitted model to this file
    #[arg(long, value_name = "MODEL")]
    out: Option<PathBuf>,
    /// Fit all rows; otherwise every fourth block of 2 s is held out, to judge the fit by
    #[arg(long)]
    all_rows: bool,
    /// Fit row by row along the measured motion (inverse model, least squares); the free run's values stand beside
    #[arg(long, conflicts_with = "html")]
    equation_error: bool,
    /// Cutoff before the angle is differentiated; usually 100 Hz, or a fifth of the rows' rate
    #[arg(long, value_name = "HZ", requires = "equation_error")]
    cutoff_hz: Option<f64>,
    #[command(flatten)]
    output: ReportOutput,
}

impl Compare {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let (log, model) = read(&self.log, &self.model)?;
        hold(&log, &model, Manner::Compared, &self.output).map(|_| ())
    }
}

impl Fit {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        self.out.as_deref().map_or(Ok(()), check_place)?;
        let (log, model) = read(&self.log, &self.model)?;
        let parameters = if self.equation_error {
            let style = Style { colour: is_terminal(), width: 80 };
            equation_error::hold(&log, &model, self.cutoff_hz, self.all_rows, &self.output, style)?.map(|e| e.parameters)
        } else {
            let manner = if self.all_rows { Manner::FittedToAll } else { Manner::Fitted };
            hold(&log, &model, manner, &self.output)?.map(|held| held.parameters)
        };
        let (Some(parameters), Some(out)) = (parameters, &self.out) else { return Ok(()) };
        let mut fitted = model.clone();
        fitted.set_all(parameters.list.iter().map(|p| (p.name.as_str(), p.value)))?;
        fitted.write(out)?;
        self.output.text(&format!("\nThe fitted model is in {}.\n", out.display()))
    }
}

/// What is done with the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Manner {
    /// Nothing: only the initial states are fitted.
    Compared,
    /// They are fitted, with blocks held out.
    Fitted,
    /// They are fitted to every row.
    FittedToAll,
}

/// Reads a log, with the columns that the model asks for, and a model.
pub(super) fn read(log: &Path, model: &Path) -> Result<(Log, Model), CliError> {
    let model = Model::read(model)?;
    let working = working(&format!("reading {}", log.display()));
    let log = Log::read(log)?;
    working.finish_and_clear();
    Ok((log, model))
}

/// Holds the model against the log and says what came of it; `None` where the log is not plausible.
pub(super) fn hold(log: &Log, model: &Model, manner: Manner, output: &ReportOutput) -> Result<Option<FitResult>, CliError> {
    let begin = Instant::now();
    let (mut record, mut remarks) = fit::prepare::prepare(log, model, manner != Manner::FittedToAll)?;
    let problems = plausible::check(log, model.input().column());
    if !problems.is_empty() {
        let style = Style { colour: is_terminal(), width: 80 };
        output.text(&report::bad_log_text(log, &problems, style))?;
        output.json(|| report::bad_log_json(log, &problems))?;
        output.html(|| report::bad_log_html(log, &problems))?;
        return Ok(None);
    }
    let working = working(if manner == Manner::Compared { "simulating" } else { "fitting" });
    let held = run(model, &mut record, log, manner, &mut remarks)?;
    working.finish_and_clear();
    let comparison = Comparison {
        title: format!("{} held against {}", model.name(), log.path().display()),
        log,
        model,
        record: &record,
        held: &held,
        fitted: manner != Manner::Compared,
        seconds: begin.elapsed().as_secs_f64(),
        remarks,
        failures: residual::misfits(log, &record, &held),
    };
    output.text(&report::comparison_text(&comparison, Style { colour: is_terminal(), width: 80 }))?;
    output.json(|| if comparison.fitted { report::fit_json(&comparison) } else { report::compare_json(&comparison) })?;
    output.html(|| report::comparison_html(&comparison))?;
    Ok(Some(held))
}

/// Fits or compares; where nobody said what the rate was measured with and the encoder is off its centre, both are tried.
fn run(model: &Model, record: &mut PreparedLog, log: &Log, manner: Manner, remarks: &mut Vec<String>) -> Result<FitResult, CliError> {
    let (system, parameters) = fit::build::system(model, record.temp_C.is_some());
    let once = |record: &PreparedLog| match manner {
        Manner::Compared => fit::compare(&system, &parameters, record),
        Manner::Fitted | Manner::FittedToAll => fit::fit(&system, &parameters, record),
    };
    let eccentric = model.effects().iter().any(|e| e.card.id == "encoder-eccentricity");
    let rate = record.channels.iter().any(|c| c.channel == Channel::Rate);
    let unsaid = log.column_made(Channel::Rate.column()).source == Source::Unknown;
    let apart = once(record)?;
    if !(eccentric && rate && unsaid) {
        return Ok(apart);
    }
    record.rate_from_encoder = true;
    let derived = once(record)?;
    let says = |made: &str| format!("the log does not say what omega_rad_s was measured with; it fits as {made}");
    if derived.chi2 < apart.chi2 {
        remarks.push(says("made from the encoder"));
        Ok(derived)
    } else {
        record.rate_from_encoder = false;
        remarks.push(says("a rate sensor of its own"));
        Ok(apart)
    }
}
