//! `stand calibrate`: runs a session on a stand, computes its record, and passes the result on to a model or to the stand.

use std::io::{BufRead, IsTerminal};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use embassy_futures::block_on;
use hal_sim::plant::Stand as Described;

use super::error::CliError;
use super::output::{ReportOutput, progress_bar, write};
use super::signals::Interrupts;
use super::stand_file::read_stand;
use crate::acquire::link::SerialLink;
use crate::calibrate::record::{self, CalibrationRecord, RecordError};
use crate::calibrate::session::error::RunError;
use crate::calibrate::session::journal::{JOURNAL_FILE, Journal, JournalError, write_atomically};
use crate::calibrate::session::run::{Operator, Progress, run_session};
use crate::calibrate::session::simulated::simulate;
use crate::calibrate::session::{Session, default_session};
use crate::calibrate::stored_record::RECORD_FILE;
use crate::calibrate::{DutKind, Mounting, drawn_dut};
use crate::model::Model;
use crate::report::calibration as report;

/// What is calibrated.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Which {
    /// A rate gyro: scale, bias, nonlinearity, hysteresis, bandwidth …
    Gyro,
    /// An accelerometer as a rate sensor at a radius
    Accel,
    /// The stand's own drive: friction, inertia, winding, frequency response …
    Drive,
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
    /// Write the default session to this file for editing, and exit
    #[arg(long, value_name = "FILE", conflicts_with_all = ["port", "session", "out", "from"])]
    write_session: Option<PathBuf>,
    /// Serial number of the device under test
    #[arg(long, value_name = "S")]
    serial: Option<String>,
    /// The operator's name
    #[arg(long, value_name = "NAME")]
    operator: Option<String>,
    /// The simulated stand, described in TOML [default: a random device by --seed]
    #[arg(long, value_name = "FILE", conflicts_with = "port")]
    stand: Option<PathBuf>,
    /// Seed of the simulated device under test and of all noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Write the results into this model file: parameters of the drive, or effects of the rate sensor
    #[arg(long, value_name = "M")]
    into_model: Option<PathBuf>,
    /// Write the results into the settings of the stand and save them (with --port)
    #[arg(long, requires = "port")]
    into_stand: bool,
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
            Which::Gyro => DutKind::Gyro,
            Which::Accel => DutKind::Accel,
            Which::Drive => DutKind::Drive,
        }
    }

    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        if let Some(path) = &self.write_session {
            write(path, default_session(self.what()))?;
            return self.output.text(&format!("{}: default session for {}\n", path.display(), self.what().name()));
        }
        let mut model = self.into_model.as_deref().map(Model::read).transpose()?;
        let folder = match &self.from {
            Some(folder) => folder.clone(),
            None => self.measure()?,
        };
        let record = record::compute(&folder)?;
        if record.session.dut_kind != self.what() {
            let (found, wanted) = (record.session.dut_kind.name(), self.what().name());
            return Err(CliError::Input(format!("{}: the session is for {found}, not for {wanted}", folder.display())));
        }
        let stored = report::stored(&record);
        let json = crate::report::json::value(&stored);
        if self.from.is_none() {
            let text = serde_json::to_string_pretty(&json).map_err(|e| CliError::Other(e.to_string()))?;
            write_atomically(&folder.join(RECORD_FILE), &format!("{text}\n"))?;
            write_atomically(&folder.join("record.html"), &report::html(&record))?;
        }
        if let (Some(model), Some(path)) = (&mut model, &self.into_model) {
            super::calibrate_into::model(&record, model)?;
            model.write(path)?;
        }
        self.output.text(&report::text(&stored))?;
        if self.from.is_none() {
            self.output.text(&format!("{}: raw logs, journal.json, record.json, record.html\n", folder.display()))?;
        }
        if self.into_stand {
            self.settings(&record)?;
        }
        self.output.html(|| report::html(&record))?;
        self.output.json(|| json)
    }

    /// The session to run, the content of its file, and the journal of a resumed session.
    fn planned(&self, folder: &Path) -> Result<(Session, String, Option<Journal>), CliError> {
        if self.resume {
            let (journal, session) = Journal::read(folder)?;
            return Ok((session, String::new(), Some(journal)));
        }
        let (text, name) = match &self.session {
            Some(path) => (std::fs::read_to_string(path).map_err(|e| CliError::file(path, "read", &e))?, path.display().to_string()),
            None => (default_session(self.what()).to_owned(), "the default session".to_owned()),
        };
        let mut session = Session::parse(&text).map_err(|e| CliError::Input(format!("{name}: {e}")))?;
        if session.dut_kind != self.what() {
            return Err(CliError::Input(format!("{name}: what = \"{}\", expected \"{}\"", session.dut_kind.name(), self.what().name())));
        }
        let mut document: toml_edit::DocumentMut =
            text.parse().map_err(|e: toml_edit::TomlError| CliError::Input(format!("{name}: {e}")))?;
        for (key, value, kept) in [("serial", &self.serial, &mut session.serial), ("operator", &self.operator, &mut session.operator)] {
            if let Some(value) = value {
                document[key] = toml_edit::value(value.as_str());
                kept.clone_from(value);
            }
        }
        Ok((session, document.to_string(), None))
    }

    /// Runs the session; returns its folder.
    fn measure(&self) -> Result<PathBuf, CliError> {
        let name = |serial: &str| format!("calibration-{}{}{serial}", self.what().name(), if serial.is_empty() { "" } else { "-" });
        let folder = self.out.clone().unwrap_or_else(|| PathBuf::from(name(self.serial.as_deref().unwrap_or(""))));
        let (session, text, begun) = self.planned(&folder)?;
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
                block_on(run_session(&mut link, &session, &text, begun, &folder, &mut ConsoleOperator, on_progress))
            }
            None => simulate(&self.simulated_stand(&session)?, self.seed, &session, &text, begun, &folder, on_progress),
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

    /// The stand of a file, or the default stand with a random device under test by the seed.
    fn simulated_stand(&self, session: &Session) -> Result<Described, CliError> {
        let mut stand = read_stand(self.stand.as_deref())?;
        if self.stand.is_none() && session.dut_kind == DutKind::Drive {
            stand = drawn_dut::drawn_drive(self.seed, &session.assumptions).0;
        }
        if stand.imu.is_none() && session.dut_kind != DutKind::Drive {
            stand.imu = Some(drawn_dut::drawn_sensor(self.seed, &session.assumptions, session.full_scale_rad_s.unwrap_or(10.0)).0);
        }
        Ok(stand)
    }

    /// Writes the results into the settings of the stand and saves them.
    fn settings(&self, record: &CalibrationRecord) -> Result<(), CliError> {
        let Some(port) = &self.port else { return Ok(()) };
        let mut link = SerialLink::open(port)?;
        let mut written = Vec::new();
        for (setting, value) in super::calibrate_into::settings(record) {
            let value = match value {
                super::calibrate_into::Setting::Value(value) => value,
                super::calibrate_into::Setting::DividedBy(by) => {
                    let reply = link.query(&format!("SETTings:{setting}?"))?;
                    let now: f64 = reply
                        .split([' ', ','])
                        .next()
                        .unwrap_or_default()
                        .parse()
                        .map_err(|_| CliError::Other(format!("SETTings:{setting}? returned `{reply}` instead of a number")))?;
                    now / by
                }
            };
            link.command(&format!("SETTings:{setting} {value:e}"))?;
            written.push(format!("{setting} {}", crate::report::significant(value, 6)));
        }
        if written.is_empty() {
            return self.output.text("no setting of the stand corresponds to the calibrated quantities\n");
        }
        link.command("SETTings:SAVE")?;
        self.output.text(&format!("saved in the stand: {}\n", written.join(", ")))
    }
}

/// The operator at the terminal.
struct ConsoleOperator;

impl Operator for ConsoleOperator {
    fn perform(&mut self, instruction: &str, _: &Mounting, _: f64) -> Option<String> {
        let hint = if std::io::stdin().is_terminal() { " Press Enter when done, or type a remark." } else { "" };
        eprintln!("{instruction}{hint}");
        let mut line = String::new();
        match std::io::stdin().lock().read_line(&mut line) {
            Ok(count) if count > 0 => Some(line.trim().to_owned()),
            _ => None,
        }
    }
}
