//! `stand explain LOG… --model M`: which physical effect is missing.

use std::path::{Path, PathBuf};

use clap::Args;

use super::error::CliError;
use super::output::{ReportOutput, check_place, is_terminal, working};
use crate::identify::explain::{self, ExplainError, Explanation};
use crate::log::Log;
use crate::model::Model;
use crate::report::{self, Style};

/// Find the effect that a model lacks, with the evidence for it.
#[derive(Debug, Args)]
pub(super) struct Explain {
    /// Logs, .csv or .parquet: several are fitted together, as one measurement; a folder instead: each of its logs by itself
    #[arg(required = true)]
    log: Vec<PathBuf>,
    /// The model, .toml: its numbers are where the fit starts
    #[arg(long)]
    model: PathBuf,
    /// Write what is missing, with fitted values, into the model file
    #[arg(long)]
    apply: bool,
    /// Write the model with what is missing to this file instead
    #[arg(long, value_name = "MODEL")]
    out: Option<PathBuf>,
    #[command(flatten)]
    output: ReportOutput,
}

impl Explain {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        self.out.as_deref().map_or(Ok(()), check_place)?;
        if let Some(folder) = self.log.iter().find(|p| p.is_dir()) {
            self.alone(folder)?;
            let model = Model::read(&self.model)?;
            return super::explain_folder::run(folder, &model, &self.output);
        }
        let model = Model::read(&self.model)?;
        match explained(&self.log, &model)? {
            Answer::BadLog(log, findings) => {
                let style = Style { colour: is_terminal(), width: 80 };
                self.output.text(&report::bad_log_text(&log, &findings, style))?;
                self.output.json(|| report::explain_bad_log_json(&log, &findings))?;
                self.output.html(|| report::bad_log_html(&log, &findings))
            }
            Answer::Explained(e) => self.report(&e, &model),
        }
    }

    /// A folder stands alone, and only its table and its JSON can be asked for.
    fn alone(&self, folder: &Path) -> Result<(), CliError> {
        let folder = folder.display();
        let refuse = |says: String| Err(CliError::Input(says));
        if self.log.len() > 1 {
            refuse(format!("{folder}: a folder stands alone, each of its logs is explained by itself; to fit logs together, name them"))
        } else if self.apply || self.out.is_some() {
            refuse(format!("{folder}: --apply and --out write one model, and each log of a folder has its own answer; name the log"))
        } else if self.output.html.is_some() {
            refuse(format!("{folder}: --html tells of one answer, and each log of a folder has its own; name the log"))
        } else {
            Ok(())
        }
    }

    fn report(&self, e: &Explanation, given: &Model) -> Result<(), CliError> {
        self.output.text(&report::explain_text(e, Style { colour: is_terminal(), width: 80 }))?;
        // The files last: an answer that cannot be told has changed nothing.
        self.output.json(|| report::explain_json(e))?;
        self.output.html(|| report::explain_html(e))?;
        if let Some(place) = self.out.as_deref().or(self.apply.then_some(self.model.as_path())) {
            let text = if e.missing.is_empty() && self.out.is_none() {
                format!("\nNothing to add: {} stays as it is.\n", place.display())
            } else {
                e.model.write(place)?;
                format!("\n{}\n", changes(e, given, place))
            };
            self.output.text(&text)?;
        } else if !e.missing.is_empty() {
            self.output.text(&format!("\n`stand explain … --apply` writes that into {}.\n", self.model.display()))?;
        }
        Ok(())
    }
}

/// What was written, and what is new in it.
fn changes(e: &Explanation, given: &Model, place: &Path) -> String {
    let mut text = format!("{}: ", place.display());
    text += &match e.missing.as_slice() {
        [] => "written with its parameters fitted; no effect was added.".to_owned(),
        names => format!("{} added, and all its free parameters fitted.", names.join(", ")),
    };
    for p in e.model.parameters() {
        let before = given.value(&p.name);
        let line = match before {
            None => format!("new: {}", report::plain(p.value, 5)),
            Some(before) if before != p.value => format!("{}, was {}", report::plain(p.value, 5), report::plain(before, 5)),
            Some(_) => continue,
        };
        text += &format!("\n  {:<24}  {line}", p.name);
    }
    text
}

/// What came of it.
pub(super) enum Answer {
    /// An explanation.
    Explained(Box<Explanation>),
    /// The log is no record of a drive.
    BadLog(Box<Log>, Vec<crate::log::plausible::Finding>),
}

/// Reads logs and explains them together, with a sign of life on a terminal.
pub(super) fn explained(paths: &[PathBuf], model: &Model) -> Result<Answer, CliError> {
    let bar = working("reading");
    let answer = quietly(paths, model, &|says| bar.set_message(says.to_owned()));
    bar.finish_and_clear();
    answer
}

/// Explains a log that is there already.
pub(super) fn explained_log(log: Log, model: &Model) -> Result<Explanation, CliError> {
    let bar = working("explaining");
    let found = explain::explain(vec![log], model, &|says| bar.set_message(says.to_owned()));
    bar.finish_and_clear();
    found.map_err(|error| CliError::Input(error.to_string()))
}

/// Reads logs and explains them together; `progress` is told what is being done.
pub(super) fn quietly(paths: &[PathBuf], model: &Model, progress: &(dyn Fn(&str) + Sync)) -> Result<Answer, CliError> {
    let logs = paths.iter().map(Log::read).collect::<Result<Vec<_>, _>>()?;
    match explain::explain(logs, model, progress) {
        Ok(e) => Ok(Answer::Explained(Box::new(e))),
        Err(ExplainError::BadLog { log, findings }) => Ok(Answer::BadLog(Box::new(Log::read(log)?), findings)),
        Err(error) => Err(CliError::Input(error.to_string())),
    }
}
