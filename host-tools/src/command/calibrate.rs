//! `stand calibrate`: a session on a stand, its record, and what is done with the result.

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
use crate::calibrate::record::{self, Record, RecordError};
use crate::calibrate::session::journal::{self, Journal, JournalError};
use crate::calibrate::session::run::{self, Person, Progress, RunError};
use crate::calibrate::session::simulated::simulate;
use crate::calibrate::session::{Session, What};
use crate::calibrate::{Mounted, part};
use crate::model::Model;
use crate::report::calibration as page;

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
    /// The session that is run; without it the usual one (--write-session shows it)
    #[arg(long, value_name = "FILE")]
    session: Option<PathBuf>,
    /// The folder for raw logs, journal and record
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Go on with the session in --out where it was broken off
    #[arg(long, requires = "out", conflicts_with_all = ["session", "serial", "from"])]
    resume: bool,
    /// Run nothing: compute again from the raw logs in this folder
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["port", "session", "out", "serial"])]
    from: Option<PathBuf>,
    /// Write the usual session to this file, to be changed, and end
    #[arg(long, value_name = "FILE", conflicts_with_all = ["port", "session", "out", "from"])]
    write_session: Option<PathBuf>,
    /// Serial number of the part
    #[arg(long, value_name = "S")]
    serial: Option<String>,
    /// Who runs it
    #[arg(long, value_name = "NAME")]
    operator: Option<String>,
    /// The simulated stand, described in TOML; without it a part or drive that --seed draws
    #[arg(long, value_name = "FILE", conflicts_with = "port")]
    stand: Option<PathBuf>,
    /// What is drawn, and the noise, of the simulated stand
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Write what was found into this model file: the drive's parameters, or the rate sensor's effects
    #[arg(long, value_name = "M")]
    into_model: Option<PathBuf>,
    /// Write what was found into the stand's settings, and keep them there (with --port)
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
        CliError::Input(error.to_string())
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
    fn what(&self) -> What {
        match self.what {
            Which::Gyro => What::Gyro,
            Which::Accel => What::Accel,
            Which::Drive => What::Drive,
        }
    }

    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        if let Some(path) = &self.write_session {
            write(path, self.what().usual())?;
            return self.output.text(&format!("{}: the usual session of {}\n", path.display(), self.what().name()));
        }
        let mut model = self.into_model.as_deref().map(Model::read).transpose()?;
        let folder = match &self.from {
            Some(folder) => folder.clone(),
            None => self.measure()?,
        };
        let record = record::compute(&folder)?;
        if record.session.what != self.what() {
            let says =
                format!("{}: the session there is of {}, not of {}", folder.display(), record.session.what.name(), self.what().name());
            return Err(CliError::Input(says));
        }
        if self.from.is_none() {
            let text = serde_json::to_string_pretty(&record.json()).map_err(|e| CliError::Other(e.to_string()))?;
            journal::write_whole(&folder.join(record::FILE), &format!("{text}\n"))?;
            journal::write_whole(&folder.join("record.html"), &page::html(&record))?;
        }
        if let (Some(model), Some(path)) = (&mut model, &self.into_model) {
            super::calibrate_into::model(&record, model)?;
            model.write(path)?;
        }
        self.output.text(&page::text(&record))?;
        if self.from.is_none() {
            self.output.text(&format!("{}: raw logs, journal.json, record.json, record.html\n", folder.display()))?;
        }
        if self.into_stand {
            self.settings(&record)?;
        }
        self.output.html(|| page::html(&record))?;
        self.output.json(|| record.json())
    }

    /// The session that is run, its text, and the folder's journal where it goes on.
    fn planned(&self, folder: &Path) -> Result<(Session, String, Option<Journal>), CliError> {
        if self.resume {
            let (journal, session) = Journal::read(folder)?;
            return Ok((session, String::new(), Some(journal)));
        }
        let (text, name) = match &self.session {
            Some(path) => (std::fs::read_to_string(path).map_err(|e| CliError::file(path, "read", &e))?, path.display().to_string()),
            None => (self.what().usual().to_owned(), "the usual session".to_owned()),
        };
        let mut session = Session::parse(&text).map_err(|e| CliError::Input(format!("{name}: {e}")))?;
        if session.what != self.what() {
            return Err(CliError::Input(format!("{name}: what = \"{}\", and not {}", session.what.name(), self.what().name())));
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

    /// Runs the session and gives its folder.
    fn measure(&self) -> Result<PathBuf, CliError> {
        let name = |serial: &str| format!("calibration-{}{}{serial}", self.what().name(), if serial.is_empty() { "" } else { "-" });
        let folder = self.out.clone().unwrap_or_else(|| PathBuf::from(name(self.serial.as_deref().unwrap_or(""))));
        let (session, text, begun) = self.planned(&folder)?;
        let interrupted = Interrupts::install()?;
        let bar = progress_bar((session.seconds() * 10.0) as u64, "{wide_bar} {msg}");
        let goes = |p: Progress| {
            bar.set_position(((session.seconds() - p.left_s) * 10.0).max(0.0) as u64);
            let (minutes, seconds) = ((p.left_s / 60.0) as u64, p.left_s as u64 % 60);
            bar.set_message(format!("{} of {} {}, {minutes}:{seconds:02} left, {:+.3} rad/s", p.number, p.of, p.step, p.rate_rad_s));
            !interrupted.any()
        };
        let done = match &self.port {
            Some(port) => {
                let mut link = SerialLink::open(port)?;
                block_on(run::whole(&mut link, &session, &text, begun, &folder, &mut AtHand, goes))
            }
            None => simulate(&self.simulated_stand(&session)?, self.seed, &session, &text, begun, &folder, goes),
        };
        bar.finish_and_clear();
        done.map_err(|error| {
            let resumes = format!("; what was recorded is in {}, and --resume goes on there", folder.display());
            let is_begun = folder.join(journal::FILE).exists();
            match (matches!(error, RunError::NotDone { .. }), CliError::from(error)) {
                (_, CliError::Other(says)) if is_begun => CliError::Other(says + &resumes),
                (true, CliError::Input(says)) if is_begun => CliError::Input(says + &resumes),
                (_, other) => other,
            }
        })?;
        Ok(folder)
    }

    /// The stand of a file, or the default one with what the seed draws.
    fn simulated_stand(&self, session: &Session) -> Result<Described, CliError> {
        let mut stand = read_stand(self.stand.as_deref())?;
        if self.stand.is_none() && session.what == What::Drive {
            stand = part::drive(self.seed, &session.known).0;
        }
        if stand.imu.is_none() && session.what != What::Drive {
            stand.imu = Some(part::sensor(self.seed, &session.known, session.full_scale_rad_s.unwrap_or(10.0)).0);
        }
        Ok(stand)
    }

    /// Says what was found to the stand, which keeps it.
    fn settings(&self, record: &Record) -> Result<(), CliError> {
        let Some(port) = &self.port else { return Ok(()) };
        let mut link = SerialLink::open(port)?;
        let mut told = Vec::new();
        for (setting, value) in super::calibrate_into::settings(record) {
            let value = match value {
                super::calibrate_into::Setting::Is(value) => value,
                super::calibrate_into::Setting::Over(by) => {
                    let says = link.query(&format!("SETTings:{setting}?"))?;
                    let now: f64 = says
                        .split([' ', ','])
                        .next()
                        .unwrap_or_default()
                        .parse()
                        .map_err(|_| CliError::Other(format!("SETTings:{setting}? says {says}")))?;
                    now / by
                }
            };
            link.command(&format!("SETTings:{setting} {value:e}"))?;
            told.push(format!("{setting} {}", crate::report::significant(value, 6)));
        }
        if told.is_empty() {
            return self.output.text("no setting of the stand is of what was calibrated\n");
        }
        link.command("SETTings:SAVE")?;
        self.output.text(&format!("kept by the stand: {}\n", told.join(", ")))
    }
}

/// A person at the keyboard.
struct AtHand;

impl Person for AtHand {
    fn does(&mut self, ask: &str, _: &Mounted, _: f64) -> Option<String> {
        let hint = if std::io::stdin().is_terminal() { " Press Enter when it is done, or say what you saw." } else { "" };
        eprintln!("{ask}{hint}");
        let mut line = String::new();
        match std::io::stdin().lock().read_line(&mut line) {
            Ok(count) if count > 0 => Some(line.trim().to_owned()),
            _ => None,
        }
    }
}
