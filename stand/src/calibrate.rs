//! `stand calibrate`: runs a session on a stand, computes its record, and passes the result on to a model or to the stand.

use std::io::{BufRead, IsTerminal};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use embassy_futures::block_on;

use super::error::CliError;
use super::import::ImportOptions;
use super::output::{Overwrite, ReportOutput, UnitOptions, progress_bar, write};
use super::signals::Interrupts;
use super::stand_file::read_stand;
use identification::deadline::Deadline;
use identification::model::Model;
use stand_acquire::calibration_session::error::RunError;
use stand_acquire::calibration_session::journal::{JOURNAL_FILE, Journal, JournalError, write_atomically};
use stand_acquire::calibration_session::run::{Operator, Progress, run_session};
use stand_acquire::calibration_session::simulated::{simulate, stand_with_dut};
use stand_acquire::calibration_session::{
    DutKind, Instruction, Mounting, PreparedSession, SessionChanges, default_folder, default_session,
};
use stand_acquire::link::SerialLink;
use stand_analysis::calibrate::by_hand::{self, HandAssumptions};
use stand_analysis::calibrate::step_table;
use stand_records::apply::{apply_to_model, apply_to_stand};
use stand_records::record::{self, CalibrationRecord, ForeignSession, RecordError};
use stand_records::store::RecordStore;
use stand_records::stored_record::RECORD_FILE;
use stand_report::calibration as report;

/// What is calibrated.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Which {
    /// A rate gyro: scale, bias, nonlinearity, hysteresis, bandwidth …
    Gyro,
    /// An accelerometer as a rate sensor at a radius
    Accel,
    /// The stand's own drive: friction, inertia, winding, frequency response …
    Drive,
    /// An inertial unit of three axes, laid on its sides and turned by hand (with --from and --steps)
    Hand,
}

/// Calibrate a sensor on the platform, or the drive itself
#[derive(Debug, Args)]
pub(super) struct Calibrate {
    /// What is calibrated
    what: Which,
    /// The serial port of the stand; without it the simulated one, in virtual time
    #[arg(long, value_name = "P")]
    port: Option<PathBuf>,
    /// The session to run [default: the default session, see --write-session]
    #[arg(long, value_name = "FILE")]
    session: Option<PathBuf>,
    /// The folder for raw logs, journal and record
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Continue the interrupted session in --out
    #[arg(long, requires = "out", conflicts_with_all = ["session", "serial", "from"])]
    resume: bool,
    /// Run nothing: compute again from the raw logs in this folder
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["port", "session", "out", "serial"])]
    from: Option<PathBuf>,
    /// The logs in --from are of another program: a table of their steps (CSV: file, from, to, rate_rad_s or rate_deg_s, temperature_C)
    #[arg(long, value_name = "TABLE", requires = "from")]
    steps: Option<PathBuf>,
    /// What is known of these logs (TOML: sensor, serial, operator, column, settle_s, [known])
    #[arg(long, value_name = "FILE", requires = "steps")]
    known: Option<PathBuf>,
    /// Also add the session to this record store
    #[arg(long, value_name = "FOLDER", conflicts_with = "from")]
    store: Option<PathBuf>,
    /// Write the default session to this file for editing, and exit
    #[arg(long, value_name = "FILE", conflicts_with_all = ["port", "session", "out", "from"])]
    write_session: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
    /// Serial number of the device under test
    #[arg(long, value_name = "S")]
    serial: Option<String>,
    /// The operator's name
    #[arg(long, value_name = "NAME")]
    operator: Option<String>,
    /// The simulated stand, described in TOML [default: a random device by --seed]
    #[arg(long, value_name = "FILE", conflicts_with = "port")]
    stand: Option<PathBuf>,
    /// Seed of the simulated device under test and of all noise [default: 1; with --resume that of the session]
    #[arg(long, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Write the results into this model file: parameters of the drive, or effects of the rate sensor
    #[arg(long, value_name = "M")]
    into_model: Option<PathBuf>,
    /// Write the results into the settings of the stand and save them (with --port)
    #[arg(long, requires = "port")]
    into_stand: bool,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    units: UnitOptions,
    #[command(flatten)]
    output: ReportOutput,
}

impl From<JournalError> for CliError {
    fn from(error: JournalError) -> Self {
        match error {
            JournalError::Write { .. } => CliError::Other(error.to_string()),
            other => CliError::Input(other.to_string()),
        }
    }
}

impl From<RecordError> for CliError {
    fn from(error: RecordError) -> Self {
        match error {
            RecordError::Calibrate(error) => CliError::Input(report::calibrate_error(&error)),
            other => CliError::Input(other.to_string()),
        }
    }
}

impl From<RunError> for CliError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Stand(error) => error.into(),
            RunError::Journal(error) => error.into(),
            RunError::NotDone { .. } | RunError::Plan(_) => CliError::Input(error.to_string()),
            other => CliError::Other(other.to_string()),
        }
    }
}

impl Calibrate {
    fn what(&self) -> DutKind {
        match self.what {
            Which::Gyro | Which::Hand => DutKind::Gyro,
            Which::Accel => DutKind::Accel,
            Which::Drive => DutKind::Drive,
        }
    }

    /// A unit that was turned by hand: logs of another program with a table of positions and turns.
    fn by_hand(&self) -> Result<(), CliError> {
        let (Some(folder), Some(table)) = (&self.from, &self.steps) else {
            return Err(CliError::Input(
                "calibrate hand: --from FOLDER with the logs and --steps TABLE with positions and turns are needed".into(),
            ));
        };
        let known: HandAssumptions = match &self.known {
            Some(path) => {
                let text = std::fs::read_to_string(path).map_err(|e| CliError::file(path, "read", &e))?;
                toml::from_str(&text).map_err(|e| CliError::in_file(path, e.to_string().trim_end()))?
            }
            None => HandAssumptions::default(),
        };
        let quantities = by_hand::calibrate(table, folder, &known).map_err(|e| CliError::Input(e.to_string()))?;
        self.output.text(&report::by_hand_text(&quantities))?;
        self.output.json(|| report::by_hand_json(&quantities))
    }

    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        if matches!(self.what, Which::Hand) {
            return self.by_hand();
        }
        if let Some(path) = &self.write_session {
            self.overwrite.check(path)?;
            write(path, default_session(self.what()))?;
            return self.output.text(&format!("{}: default session for {}\n", path.display(), self.what().name()));
        }
        let mut model = self.into_model.as_deref().map(Model::read).transpose()?;
        let folder = match &self.from {
            Some(folder) => {
                self.import_logs(folder)?;
                folder.clone()
            }
            None if self.import.is_empty() => self.measure()?,
            None => {
                return Err(CliError::Input(
                    "--map, --unit, --sample-rate and --note are about raw logs of another program: name their folder with --from"
                        .to_owned(),
                ));
            }
        };
        let record = match &self.steps {
            Some(table) => record::compute_foreign(table, &folder, self.what(), self.foreign_session()?)?,
            None => record::compute(&folder)?,
        };
        if record.session.dut_kind != self.what() {
            let (found, wanted) = (record.session.dut_kind.name(), self.what().name());
            return Err(CliError::Input(format!("{}: the session is for {found}, not for {wanted}", folder.display())));
        }
        let stored = report::stored(&record);
        let json = stand_report::json::value(&stored);
        if self.from.is_none() {
            let text = serde_json::to_string_pretty(&json).map_err(|e| CliError::Other(e.to_string()))?;
            write_atomically(&folder.join(RECORD_FILE), &format!("{text}\n"))?;
            write_atomically(&folder.join("record.html"), &report::html(&record))?;
        }
        if let (Some(model), Some(path)) = (&mut model, &self.into_model) {
            apply_to_model(&record, model)?;
            model.write(path)?;
        }
        let units = self.units.units.unwrap_or_default();
        self.output.text(&report::text(&report::displayed_record(&stored, &units)))?;
        if self.from.is_none() {
            self.output.text(&format!("{}: raw logs, journal.json, record.json, record.html\n", folder.display()))?;
        }
        if let Some(store) = &self.store {
            let number = RecordStore::open(store)?.add(&folder)?;
            self.output.text(&format!("{}: session {number}\n", store.display()))?;
        }
        if self.into_stand {
            self.settings(&record)?;
        }
        self.output.html(|| report::html(&record))?;
        self.output.json(|| json)
    }

    /// Writes what is stated about the raw logs of a folder into their import files.
    fn import_logs(&self, folder: &Path) -> Result<(), CliError> {
        if self.import.is_empty() {
            return Ok(());
        }
        let logs: Vec<PathBuf> = match &self.steps {
            Some(table) => step_table::files(table).map_err(RecordError::from)?.iter().map(|file| folder.join(file)).collect(),
            None => Journal::read(folder)?.0.steps.iter().map(|step| folder.join(&step.log)).collect(),
        };
        self.import.apply(logs.iter().map(PathBuf::as_path))
    }

    /// What is known of logs of another program.
    fn foreign_session(&self) -> Result<ForeignSession, CliError> {
        let Some(path) = &self.known else { return Ok(ForeignSession::default()) };
        let text = std::fs::read_to_string(path).map_err(|e| CliError::file(path, "read", &e))?;
        toml::from_str(&text).map_err(|e| CliError::in_file(path, e.to_string().trim_end()))
    }

    /// The session to run, or the rest of an interrupted one.
    fn prepared(&self, folder: &Path) -> Result<PreparedSession, CliError> {
        if self.resume {
            return Ok(PreparedSession::resume(folder)?);
        }
        let read = |path: &PathBuf| std::fs::read_to_string(path).map_err(|e| CliError::file(path, "read", &e));
        let text = self.session.as_ref().map(read).transpose()?;
        let changes = SessionChanges { serial: self.serial.as_deref(), operator: self.operator.as_deref() };
        let name = || self.session.as_ref().map_or("the default session".to_owned(), |path| path.display().to_string());
        PreparedSession::new(text.as_deref(), self.what(), changes).map_err(|e| CliError::Input(format!("{}: {e}", name())))
    }

    /// Runs the session; returns its folder.
    fn measure(&self) -> Result<PathBuf, CliError> {
        let folder = self.out.clone().unwrap_or_else(|| default_folder(self.what(), self.serial.as_deref()));
        let prepared = self.prepared(&folder)?;
        let session = &prepared.session;
        let interrupted = Interrupts::install()?;
        let bar = progress_bar((session.seconds() * 10.0) as u64, "{wide_bar} {msg}");
        let on_progress = |p: Progress| {
            bar.set_position(((session.seconds() - p.left_s) * 10.0).max(0.0) as u64);
            let (minutes, seconds) = ((p.left_s / 60.0) as u64, p.left_s as u64 % 60);
            bar.set_message(format!("{} of {} {}, {minutes}:{seconds:02} left, {:+.3} rad/s", p.number, p.of, p.step, p.rate_rad_s));
            !interrupted.any()
        };
        let done = match &self.port {
            Some(port) => {
                let mut link = SerialLink::open(port)?;
                block_on(run_session(&mut link, &prepared, &folder, &mut ConsoleOperator, on_progress))
            }
            None => {
                let described = self.stand.as_deref().map(|path| read_stand(Some(path))).transpose()?;
                let of_session = prepared.begun.as_ref().and_then(|journal| journal.simulated_seed);
                let seed = self.seed.or(of_session).unwrap_or(1);
                simulate(&stand_with_dut(described, seed, session), seed, &prepared, &folder, Deadline::NEVER, on_progress)
            }
        };
        bar.finish_and_clear();
        done.map_err(|error| {
            let resume = format!("; the recorded rows are in {}, --resume continues the session", folder.display());
            let is_begun = folder.join(JOURNAL_FILE).exists();
            match (matches!(error, RunError::NotDone { .. }), CliError::from(error)) {
                (_, CliError::Other(message)) if is_begun => CliError::Other(message + &resume),
                (true, CliError::Input(message)) if is_begun => CliError::Input(message + &resume),
                (_, other) => other,
            }
        })?;
        Ok(folder)
    }

    /// Writes the results into the settings of the stand and saves them.
    fn settings(&self, record: &CalibrationRecord) -> Result<(), CliError> {
        let Some(port) = &self.port else { return Ok(()) };
        let written = block_on(apply_to_stand(record, &mut SerialLink::open(port)?))?;
        self.output.text(&report::settings_text(&written))
    }
}

/// The operator at the terminal.
pub(super) struct ConsoleOperator;

impl ConsoleOperator {
    /// Prints an instruction and waits for the Enter key: the line before it, or `None` at the end of standard input.
    pub(super) fn confirm(&self, instruction: &str) -> Option<String> {
        let hint = if std::io::stdin().is_terminal() { " Press Enter when done, or type a remark." } else { "" };
        eprintln!("{instruction}{hint}");
        let mut line = String::new();
        match std::io::stdin().lock().read_line(&mut line) {
            Ok(count) if count > 0 => Some(line.trim().to_owned()),
            _ => None,
        }
    }
}

impl Operator for ConsoleOperator {
    fn perform(&mut self, instruction: &Instruction, _: &Mounting, _: f64) -> Option<String> {
        self.confirm(&instruction.to_string())
    }
}
