//! `stand lab`: the works of the laboratory course.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};
use embassy_futures::block_on;
use hal_sim::gyro::Orientation;
use indicatif::ProgressBar;

use super::calibrate::ConsoleOperator;
use super::drift_run::confirm_turn;
use super::error::CliError;
use super::output::{JsonOutput, check_writable, progress_bar, write};
use super::signals::Interrupts;
use stand_acquire::link::SerialLink;
use stand_lab::LabError;
use stand_lab::archive::{own_files, write_archive};
use stand_lab::check::{check, read_answers};
use stand_lab::course::{Lab, Language, works};
use stand_lab::grade::{files_of, grade, grade_on_real_stand};
use stand_lab::journal::Journal;
use stand_lab::measurement::Hidden;
use stand_lab::seal::Key;
use stand_lab::stand_recording::WorkOperator;
use stand_lab::start::{RealStandStart, Started, start};
use stand_lab::teacher_reference::TeacherReference;
use stand_lab::work::Work;
use stand_report::lab as report;

/// Language of the texts.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum LanguageName {
    /// English
    En,
    /// Ukrainian
    Uk,
}

impl From<LanguageName> for Language {
    fn from(name: LanguageName) -> Self {
        match name {
            LanguageName::En => Language::En,
            LanguageName::Uk => Language::Uk,
        }
    }
}

/// The works of the laboratory course: start, check, report, grade
#[derive(Debug, Subcommand)]
pub(super) enum LabCommand {
    /// List the works
    List(List),
    /// Write a new key of a teacher, from which the sealed true values are derived
    Key(NewKey),
    /// Start a work: a folder with logs, instructions and the table of answers
    Start(Start),
    /// Check the answers for format, units and completeness, without the true values, and record their hash
    Check(Check),
    /// Write the report of a work for print, and an archive of its files
    Report(Report),
    /// Judge a work: origin of its logs, journal, values with their uncertainties. It shows the true values: answers changed later do not
    /// count
    Grade(Grade),
}

/// List the works
#[derive(Debug, Args)]
pub(super) struct List {
    /// Language of the titles
    #[arg(long, value_enum, default_value_t = LanguageName::En)]
    language: LanguageName,
    #[command(flatten)]
    json: JsonOutput,
}

/// Write a new key of a teacher, from which the sealed true values are derived
#[derive(Debug, Args)]
pub(super) struct NewKey {
    /// The key file to create; whoever has it has the true values
    file: PathBuf,
    #[command(flatten)]
    json: JsonOutput,
}

/// Start a work: a folder with logs, instructions and the table of answers
#[derive(Debug, Args)]
pub(super) struct Start {
    /// The work, by name or number
    lab: String,
    /// Name or number of the student
    #[arg(long, value_name = "NAME")]
    student: String,
    /// Number of the attempt; each has another device
    #[arg(long, default_value_t = 1)]
    attempt: u32,
    /// The teacher's key that seals the true values [default: a practice work, whose true values are public]
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Language of the texts
    #[arg(long, value_enum, default_value_t = LanguageName::En)]
    language: LanguageName,
    /// Serial port of a real stand, from which the logs are recorded [default: the simulated stand]
    #[arg(long, value_name = "P", requires_all = ["reference", "key"])]
    port: Option<PathBuf>,
    /// The teacher's reference of a real stand: a TOML file with the values and their uncertainties, or record.json of `stand calibrate`.
    /// Keep it from the student; the work folder has only a code of it
    #[arg(long, value_name = "FILE", requires = "port")]
    reference: Option<PathBuf>,
    /// A hunt on a real stand: model of the drive with nothing hidden
    #[arg(long, value_name = "M", requires = "port")]
    model: Option<PathBuf>,
    /// The folder to write
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    #[command(flatten)]
    json: JsonOutput,
}

/// Check the answers for format, units and completeness, without the true values, and record their hash
#[derive(Debug, Args)]
pub(super) struct Check {
    /// The work folder
    folder: PathBuf,
    #[command(flatten)]
    json: JsonOutput,
}

/// Write the report of a work for print, and an archive of its files
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("what").required(true).multiple(true).args(["html", "zip", "json"]))]
pub(super) struct Report {
    /// The work folder
    folder: PathBuf,
    /// Write the report: one HTML file that prints
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Write an archive of logs, journal, answers, report, and own files of the folder (up to 2 MiB each, 20 MiB in all)
    #[arg(long, value_name = "FILE")]
    zip: Option<PathBuf>,
    #[command(flatten)]
    json: JsonOutput,
}

/// Judge a work: origin of its logs, journal, values with their uncertainties. It shows the true values: answers changed later do not count
#[derive(Debug, Args)]
pub(super) struct Grade {
    /// The work folder
    folder: PathBuf,
    /// The teacher's key, with which the work was started
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// The teacher's reference of a work on a real stand: the file with which it was started
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Code that the student got from `stand lab check`, as the teacher noted it: 12 digits or more
    #[arg(long, value_name = "CODE")]
    code: Option<String>,
    /// Write the judgement: one HTML file
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    #[command(flatten)]
    json: JsonOutput,
}

impl From<LabError> for CliError {
    fn from(error: LabError) -> Self {
        match error {
            LabError::File { path, action, source } => CliError::file(&path, action, &source),
            LabError::Run(error) => error.into(),
            LabError::Simulation(error) => error.into(),
            LabError::Log(error) => error.into(),
            LabError::DriftSession(error) => error.into(),
            LabError::ProfileRecording(error) => error.into(),
            LabError::Definition { .. }
            | LabError::Plan(_)
            | LabError::Hide(_)
            | LabError::FrictionReference
            | LabError::Reference(_)
            | LabError::DriftReference(_)
            | LabError::OncePerTurnReference
            | LabError::Observer(_)
            | LabError::NoReferenceValue { .. }
            | LabError::EndedEarly { .. }
            | LabError::ObserverReference(_) => CliError::Other(error.to_string()),
            LabError::Unknown { .. }
            | LabError::Invalid { .. }
            | LabError::Argument(_)
            | LabError::NotOnRealStand { .. }
            | LabError::NotPrepared { .. }
            | LabError::AnswersChanged { .. }
            | LabError::ExplainedTooEarly { .. } => CliError::Input(error.to_string()),
        }
    }
}

impl LabCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        match self {
            LabCommand::List(list) => list.run(),
            LabCommand::Key(key) => key.run(),
            LabCommand::Start(start) => start.run(),
            LabCommand::Check(check) => check.run(),
            LabCommand::Report(report) => report.run(),
            LabCommand::Grade(grade) => grade.run(),
        }
    }
}

fn read_key(path: Option<&Path>) -> Result<Option<Key>, CliError> {
    Ok(path.map(Key::read).transpose()?)
}

/// Steps of the progress bar.
const PROGRESS_STEPS: u64 = 1000;

/// Runs `work` with a progress bar that Ctrl-C ends.
fn with_progress<T>(work: impl FnOnce(&mut dyn FnMut(f64) -> bool) -> Result<T, LabError>) -> Result<T, CliError> {
    let interrupted = Interrupts::install()?;
    let bar: ProgressBar = progress_bar(PROGRESS_STEPS, "{wide_bar} {elapsed}");
    let result = work(&mut |part| {
        bar.set_position((part * PROGRESS_STEPS as f64) as u64);
        !interrupted.any()
    });
    bar.finish_and_clear();
    Ok(result?)
}

impl List {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let works = works()?;
        self.json.text(&report::list_text(&works, self.language.into()))?;
        self.json.json(|| report::list_json(&works))
    }
}

impl NewKey {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        Key::create(&self.file)?;
        let file = self.file.display().to_string();
        self.json
            .text(&format!("{file}: new key; keep it from students, and keep a copy: without it no work that it sealed can be graded\n"))?;
        self.json.json(|| serde_json::json!({ "key": file }))
    }
}

impl Start {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let (lab, key) = (Lab::find(&self.lab)?, read_key(self.key.as_deref())?);
        let started = match (&self.port, &self.reference, key) {
            (Some(port), Some(reference), Some(key)) => self.on_real_stand(&lab, key, port, reference)?,
            (_, _, key) => {
                with_progress(|progress| start(&lab, (&self.student, self.attempt), key, self.language.into(), &self.out, progress))?
            }
        };
        self.json.text(&report::started_text(&started, &self.out.display().to_string()))?;
        self.json.json(|| report::started_json(&started))
    }

    fn on_real_stand(&self, lab: &Lab, key: Key, port: &Path, reference: &Path) -> Result<Started, CliError> {
        let reference = TeacherReference::read(reference, lab)?;
        let read = |path: &PathBuf| std::fs::read_to_string(path).map_err(|e| CliError::file(path, "read", &e));
        let model = self.model.as_ref().map(read).transpose()?;
        let student = (self.student.as_str(), self.attempt);
        let prepared = RealStandStart::new(lab, student, key, (&reference, model.as_deref()), self.language.into(), &self.out)?;
        let mut link = SerialLink::open(port)?;
        with_progress(|progress| block_on(prepared.run(&mut link, &mut ConsoleOperator, progress)))
    }
}

impl WorkOperator for ConsoleOperator {
    fn turn_gyroscope(&mut self, place: &Orientation) -> bool {
        confirm_turn(place).is_ok()
    }

    fn prepare_log(&mut self, hidden: &Hidden) -> bool {
        let present: Vec<&str> = hidden.present.iter().map(String::as_str).collect();
        self.confirm(&format!("Log {}: prepare the stand: {} ({}).", hidden.log, hidden.description, present.join(", "))).is_some()
    }
}

impl Check {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let work = Work::read(&self.folder)?;
        let checked = check(&self.folder)?;
        self.json.text(&report::checked_text(&checked, &work.lab()?, &work))?;
        self.json.json(|| report::checked_json(&checked, &work))
    }
}

impl Report {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        self.html.iter().chain(&self.zip).try_for_each(|path| check_writable(path))?;
        let work = Work::read(&self.folder)?;
        let (lab, answers, journal) = (work.lab()?, read_answers(&self.folder)?, Journal::read(&self.folder)?);
        let page = report::report_html(&work, &lab, &answers, &journal);
        let json = report::report_json(&work, &answers, &journal);
        if let Some(path) = &self.html {
            write(path, &page)?;
        }
        if let Some(path) = &self.zip {
            let whole = journal.as_ref().map_err(|error| CliError::in_file(&self.folder, error))?;
            let text = serde_json::to_string_pretty(&json).map_err(|e| CliError::Other(e.to_string()))?;
            let further = [("report.html", page), ("report.json", format!("{text}\n"))];
            let mut names = files_of(&self.folder, whole);
            let own = own_files(&self.folder, &names)?;
            self.json.text(&report::archive_text(&own, work.language))?;
            names.extend(own.names);
            write_archive(path, &self.folder, &names, &further)?;
        }
        self.json.json(|| json)
    }
}

impl Grade {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        self.html.as_deref().map_or(Ok(()), check_writable)?;
        let key = read_key(self.key.as_deref())?;
        let graded = match &self.reference {
            Some(reference) => grade_on_real_stand(&self.folder, key, reference, self.code.as_deref())?,
            None => with_progress(|progress| grade(&self.folder, key, self.code.as_deref(), progress))?,
        };
        self.json.text(&report::grade_text(&graded))?;
        if let Some(path) = &self.html {
            write(path, &report::grade_html(&graded, &graded.work.lab()?, &read_answers(&self.folder)?))?;
        }
        self.json.json(|| report::grade_json(&graded))
    }
}
