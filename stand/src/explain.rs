//! `stand explain`: the physical effect that a model lacks.

use std::path::{Path, PathBuf};

use clap::Args;

use super::compare::implausible_log;
use super::error::CliError;
use super::import::ImportOptions;
use super::output::{Overwrite, ReportOutput, SeriesOutput, TimeLimit, check_writable, progress_bar, spinner, style};
use super::signals::Interrupts;
use identification::deadline::Deadline;
use identification::files;
use identification::identify::explain::{Criteria, ExplainError, Explanation, Options, SearchState};
use identification::identify::explain_logs::{ExplainLogsError, FolderEntry, LogExplanation, explain_folder, explain_together, logs_in};
use identification::model::Model;
use stand_analysis::fleet::run::{Callbacks, run};
use stand_analysis::fleet::session::logs_of;
use stand_analysis::fleet::{IdentityTable, Session, Settings};
use stand_lab::check::begin_explain;
use stand_report as report;
use stand_report::explanation::sentences::progress;
use stand_report::explanation::{folder_json, folder_text, folder_verdict};
use stand_report::fleet::{RowRequest, row, run_json, run_text};

/// Identify the physical effect that a model lacks, with the evidence.
#[derive(Debug, Args)]
pub(super) struct Explain {
    /// Logs, .csv or .parquet, fitted together with one set of parameters; or one folder, whose logs are explained separately
    #[arg(required = true)]
    log: Vec<PathBuf>,
    /// The model, .toml; its values are the start of the fit
    #[arg(long)]
    model: PathBuf,
    /// Write the missing effects, with fitted values, into the model file
    #[arg(long)]
    apply: bool,
    /// Write the model with the missing effects to this file instead
    #[arg(long, value_name = "MODEL")]
    out: Option<PathBuf>,
    /// Write the answers about the logs of a folder and its subfolders as a table to this file, .parquet, one row a log; continues an
    /// interrupted run
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Table of the stands of the logs for --table, .csv with the columns path, stand, date, batch, where the logs do not state them
    #[arg(long, value_name = "FILE", requires = "table")]
    stands: Option<PathBuf>,
    /// Effort after which the search ends with the verdict not-finished: rows simulated × (1 + derivatives), over the rows of the logs; 0:
    /// none. Usual logs need a tenth of it or less
    #[arg(long, value_name = "PASSES", default_value_t = DEFAULT_EFFORT)]
    effort: u64,
    /// Continue a search that was not finished, from the state that it has written
    #[arg(long = "continue", value_name = "STATE")]
    from_state: Option<PathBuf>,
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

/// As [`identification::identify::explain::criteria::SearchCriteria::max_passes`].
const DEFAULT_EFFORT: u64 = 400_000;

impl From<ExplainLogsError> for CliError {
    fn from(error: ExplainLogsError) -> Self {
        match error {
            ExplainLogsError::Folder { folder, source } => CliError::file(&folder, "read the folder", &source),
            ExplainLogsError::Log(error) => error.into(),
            ExplainLogsError::Explain(ExplainError::Prepare(error)) => error.into(),
            other => CliError::Input(other.to_string()),
        }
    }
}

impl Explain {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        self.series.check()?;
        let time_limit_s = self.time_limit.seconds()?;
        let options = || self.options(time_limit_s);
        self.out.as_deref().map_or(Ok(()), |out| self.overwrite.check(out))?;
        self.import.apply(self.log.iter().map(PathBuf::as_path))?;
        let folder = self.log.iter().find(|p| p.is_dir());
        folder.map_or(Ok(()), |folder| self.check_folder_options(folder))?;
        match (folder, &self.table) {
            (Some(folder), Some(table)) => self.write_table(folder, table, options()),
            (Some(folder), None) => {
                let model = Model::read(&self.model)?;
                begin_explain(&logs_in(folder)?)?;
                self.explain_folder(folder, &model, &options)
            }
            (None, Some(table)) => {
                Err(CliError::in_file(table, "--table has one row for each log of a folder; name a folder instead of logs"))
            }
            (None, None) => {
                let model = Model::read(&self.model)?;
                begin_explain(&self.log)?;
                self.explain_together(&model, options())
            }
        }
    }

    /// The limits of one search, which begins now.
    fn options(&self, time_limit_s: Option<f64>) -> Options<'static> {
        let mut criteria = Criteria::default();
        criteria.search.max_passes = (self.effort > 0).then_some(self.effort);
        Options { criteria, deadline: Deadline::after_s(time_limit_s), state: None }
    }

    /// Explains the logs together, with one set of parameters.
    fn explain_together(&self, model: &Model, options: Options<'static>) -> Result<(), CliError> {
        let spinner = spinner("reading");
        let state = self.from_state.as_deref().map(read_state).transpose()?;
        let options = Options { state: state.as_ref(), ..options };
        let result = explain_together(&self.log, model, options, &|stage| spinner.set_message(progress(stage)));
        spinner.finish_and_clear();
        match result? {
            LogExplanation::ImplausibleLog(log, findings) => {
                Err(implausible_log(&log, &findings, &self.output, || report::explain_bad_log_json(&log, &findings)))
            }
            LogExplanation::Explained(explanation) => self.report(&explanation, model),
        }
    }

    /// A folder excludes further logs, and the options of a single result.
    fn check_folder_options(&self, folder: &Path) -> Result<(), CliError> {
        let reject = |message: &str| Err(CliError::in_file(folder, message));
        if self.from_state.is_some() {
            reject("--continue continues the search in one log, or in several together; name these logs")
        } else if self.log.len() > 1 {
            reject(
                "a folder must be the only argument, since each of its logs is explained separately; to fit logs together, list the files",
            )
        } else if self.apply || self.out.is_some() {
            reject("--apply and --out write one model, but a folder gives one result for each log; name a single log")
        } else if self.series.out_series.is_some() {
            reject("--out-series writes one series, but a folder gives one result for each log; name a single log")
        } else if self.output.html.is_some() {
            reject("--html reports one result, but a folder gives one result for each log; name a single log")
        } else {
            Ok(())
        }
    }

    /// Explains each log of the folder; the exit status reports logs without an explanation.
    fn explain_folder(&self, folder: &Path, model: &Model, options: &(dyn Fn() -> Options<'static> + Sync)) -> Result<(), CliError> {
        let spinner = spinner("explaining the logs of the folder");
        let finished = |entry: &FolderEntry| spinner.set_message(format!("{}: {}", entry.path.display(), folder_verdict(entry)));
        let entries = explain_folder(folder, model, options, &finished);
        spinner.finish_and_clear();
        let entries = entries?;
        self.output.text(&folder_text(&entries))?;
        self.output.json(|| folder_json(&entries))?;
        let is_cut = |entry: &FolderEntry| matches!(&entry.result, Ok(LogExplanation::Explained(e)) if e.unfinished.is_some());
        match entries.iter().filter(|entry| !matches!(entry.result, Ok(LogExplanation::Explained(_)))).count() {
            0 if entries.iter().any(is_cut) => Err(CliError::Other(
                "a limit has ended the search in the logs with the verdict not-finished; --effort sets another one".to_owned(),
            )),
            0 => Ok(()),
            failed => Err(CliError::in_file(
                folder,
                format!("{failed} of {} logs could not be compared with {}; the table gives the reasons", entries.len(), model.name()),
            )),
        }
    }

    /// Explains each log of the folder and its subfolders into a table; the exit status reports logs without an explanation.
    fn write_table(&self, folder: &Path, table: &Path, Options { criteria, .. }: Options) -> Result<(), CliError> {
        if table.extension().is_none_or(|ending| ending != "parquet") {
            return Err(CliError::in_file(table, "--table writes Parquet: the name of the file must end in .parquet"));
        }
        check_writable(table)?;
        let model = Model::read(&self.model)?;
        let identities = self.stands.as_deref().map_or(Ok(IdentityTable::default()), IdentityTable::read)?;
        // A table in the folder is no log.
        let is_table =
            |path: &String| Path::new(path).canonicalize().ok().is_some_and(|path| table.canonicalize().is_ok_and(|table| table == path));
        let mut paths = logs_of(&[folder.to_owned()]).map_err(|error| CliError::file(folder, "read the folder", &error))?;
        paths.retain(|path| !is_table(path) && self.stands.as_deref() != Some(Path::new(path)));
        if paths.is_empty() {
            return Err(CliError::in_file(
                folder,
                "this folder has no logs (files with the ending .csv or .parquet, or with an import file)",
            ));
        }
        begin_explain(&paths)?;
        let time_limit_s = self.time_limit.seconds()?;
        let settings = Settings {
            model_name: model.name().to_owned(),
            model: model.to_toml(),
            build: stand_firmware::VERSION.to_owned(),
            effort_limit_passes: criteria.search.max_passes.and_then(|passes| i64::try_from(passes).ok()),
            time_limit_s,
        };
        let session = Session::open(table, settings)?;
        let interrupts = Interrupts::install()?;
        let bar = progress_bar(paths.len() as u64, "{elapsed} {wide_bar} {pos} of {len} logs, {eta} left");
        let deadline = || Deadline::after_s(time_limit_s).or_when(Interrupts::switch());
        let callbacks = Callbacks {
            compute: &|path, hash| row(path, hash, RowRequest { model: &model, criteria: &criteria, deadline: deadline() }),
            is_interrupted: &|| interrupts.any(),
            finished: &|_, done| bar.set_position(done as u64),
        };
        let run = run(session, &paths, &identities, rayon::current_num_threads(), &callbacks);
        bar.finish_and_clear();
        let run = run?;
        let name = table.display().to_string();
        self.output.text(&run_text(&name, &run))?;
        self.output.json(|| run_json(&name, &run))?;
        if let Some(stands) = &self.stands {
            let unmatched = identities.unmatched(run.rows.iter().map(|row| row.path.as_str()));
            if let Some(first) = unmatched.first().filter(|_| !run.is_interrupted) {
                let message =
                    format!("{} lines name no log of the folder, the first is line {first}; the table is written", unmatched.len());
                return Err(CliError::in_file(stands, message));
            }
        }
        match run.failed() {
            _ if run.is_interrupted => {
                Err(CliError::Other(format!("interrupted: {} of {} logs are done; the same command continues", run.rows.len(), run.logs)))
            }
            0 => Ok(()),
            failed => Err(CliError::in_file(
                table,
                format!("{failed} of {} logs could not be compared with {}; the column error gives the reasons", run.logs, model.name()),
            )),
        }
    }

    /// Writes the state of an unfinished search, and says how to continue.
    fn keep_state(&self, state: &str) -> CliError {
        let path = self.from_state.clone().unwrap_or_else(|| self.state_file());
        let is_other = self.from_state.is_none() && path.exists() && read_state(&path).is_err();
        let kept = if is_other {
            Err("a file of this name exists".to_owned())
        } else {
            files::replace_text(&path, state).map_err(|e| e.to_string())
        };
        let name = path.display();
        CliError::Other(match kept {
            Ok(()) => format!("the search is not finished, and no model is written; the same command with --continue {name} continues it"),
            Err(reason) => format!("the search is not finished, and no model is written; its state was not written to {name}: {reason}"),
        })
    }

    /// The file of the state, named after the first log, in the present folder.
    fn state_file(&self) -> PathBuf {
        let stem = self.log.first().and_then(|log| log.file_stem()).map_or("explain".into(), |stem| stem.to_string_lossy().into_owned());
        PathBuf::from(format!("{stem}.search.toml"))
    }

    fn report(&self, e: &Explanation, given: &Model) -> Result<(), CliError> {
        self.output.text(&report::explain_text(e, style()))?;
        // The model last: if a report cannot be written, the model is unchanged.
        self.output.json(|| report::explain_json(e))?;
        self.output.html(|| report::explain_html(e))?;
        self.series.write(&e.log, &e.data(), &e.explained)?;
        if let Some(unfinished) = &e.unfinished {
            return Err(self.keep_state(&unfinished.state));
        }
        if let Some(path) = self.out.as_deref().or(self.apply.then_some(self.model.as_path())) {
            let text = if e.missing.is_empty() && self.out.is_none() {
                format!("\nNo effect to add: {} is unchanged.\n", path.display())
            } else {
                write_model(path, e, given, self.out.is_some())?;
                format!("\n{}\n", report::model::changes_text(e, given, path))
            };
            self.output.text(&text)?;
        } else if !e.missing.is_empty() {
            self.output.text(&format!("\nWith --apply, the effects are written into {}.\n", self.model.display()))?;
        }
        Ok(())
    }
}

fn read_state(path: &Path) -> Result<SearchState, CliError> {
    let text = std::fs::read_to_string(path).map_err(|e| CliError::file(path, "read", &e))?;
    SearchState::parse(&text).map_err(|e| CliError::in_file(path, e.to_string()))
}

/// Writes the model of the explanation; with --apply, over the file of `given`, if no other process has edited that meanwhile.
fn write_model(path: &Path, e: &Explanation, given: &Model, is_new: bool) -> Result<(), CliError> {
    let _locked = if is_new { None } else { Some(files::lock(path).map_err(|error| CliError::file(path, "lock", &error))?) };
    if !is_new && Model::read(path)?.to_toml() != given.to_toml() {
        return Err(CliError::Other(format!("{}: the file was edited during the search; nothing was written", path.display())));
    }
    Ok(e.model.write(path)?)
}
