//! `stand calibrate`: a session on a stand, its record, and what is done with the result.

use std::cell::RefCell;
use std::io::{BufRead, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::{Args, ValueEnum};
use embassy_futures::block_on;
use hal_sim::board::PlantPort;
use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::peripherals::imu as chip;
use hal_sim::plant::{Plant, Stand as Described};
use indicatif::{ProgressBar, ProgressStyle};

use super::error::Trouble;
use super::output::{Output, write};
use super::record::interrupts;
use super::sim;
use crate::calibrate::record::{self, Record, RecordError};
use crate::calibrate::session::check::Able;
use crate::calibrate::session::journal::{self, Journal, JournalError};
use crate::calibrate::session::run::{self, Person, Progress, RunError};
use crate::calibrate::session::{Session, What, check};
use crate::calibrate::{Lying, Mounted, page, part};
use crate::link::Link;
use crate::model::Model;
use crate::stand::{Simulated, Stand};

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
    output: Output,
}

impl From<JournalError> for Trouble {
    fn from(error: JournalError) -> Self {
        Trouble::Input(error.to_string())
    }
}

impl From<RecordError> for Trouble {
    fn from(error: RecordError) -> Self {
        Trouble::Input(error.to_string())
    }
}

impl From<RunError> for Trouble {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Stand(error) => error.into(),
            RunError::Journal(error) => error.into(),
            RunError::NotDone { .. } => Trouble::Input(error.to_string()),
            other => Trouble::Other(other.to_string()),
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

    pub(super) fn run(self) -> Result<(), Trouble> {
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
            return Err(Trouble::Input(says));
        }
        if self.from.is_none() {
            let text = serde_json::to_string_pretty(&record.json()).map_err(|e| Trouble::Other(e.to_string()))?;
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
    fn planned(&self, folder: &Path) -> Result<(Session, String, Option<Journal>), Trouble> {
        if self.resume {
            let (journal, session) = Journal::read(folder)?;
            return Ok((session, String::new(), Some(journal)));
        }
        let (text, name) = match &self.session {
            Some(path) => (std::fs::read_to_string(path).map_err(|e| Trouble::file(path, "read", &e))?, path.display().to_string()),
            None => (self.what().usual().to_owned(), "the usual session".to_owned()),
        };
        let mut session = Session::parse(&text).map_err(|e| Trouble::Input(format!("{name}: {e}")))?;
        if session.what != self.what() {
            return Err(Trouble::Input(format!("{name}: what = \"{}\", and not {}", session.what.name(), self.what().name())));
        }
        let mut document: toml_edit::DocumentMut =
            text.parse().map_err(|e: toml_edit::TomlError| Trouble::Input(format!("{name}: {e}")))?;
        for (key, value, kept) in [("serial", &self.serial, &mut session.serial), ("operator", &self.operator, &mut session.operator)] {
            if let Some(value) = value {
                document[key] = toml_edit::value(value.as_str());
                kept.clone_from(value);
            }
        }
        Ok((session, document.to_string(), None))
    }

    /// Runs the session and gives its folder.
    fn measure(&self) -> Result<PathBuf, Trouble> {
        let name = |serial: &str| format!("calibration-{}{}{serial}", self.what().name(), if serial.is_empty() { "" } else { "-" });
        let folder = self.out.clone().unwrap_or_else(|| PathBuf::from(name(self.serial.as_deref().unwrap_or(""))));
        let (session, text, begun) = self.planned(&folder)?;
        let interrupted = interrupts()?;
        let bar = ProgressBar::new((session.seconds() * 10.0) as u64);
        if let Ok(style) = ProgressStyle::with_template("{wide_bar} {msg}") {
            bar.set_style(style);
        }
        let goes = |p: Progress| {
            bar.set_position(((session.seconds() - p.left_s) * 10.0).max(0.0) as u64);
            let (minutes, seconds) = ((p.left_s / 60.0) as u64, p.left_s as u64 % 60);
            bar.set_message(format!("{} of {} {}, {minutes}:{seconds:02} left, {:+.3} rad/s", p.number, p.of, p.step, p.rate_rad_s));
            interrupted.load(Ordering::Relaxed) == 0
        };
        let done = match &self.port {
            Some(port) => {
                let mut link = Link::open(port)?;
                block_on(whole(&mut link, &session, &text, begun, &folder, &mut AtHand, goes))
            }
            None => self.simulated(&session, &text, begun, &folder, goes),
        };
        bar.finish_and_clear();
        done.map_err(|trouble| match trouble {
            Trouble::Other(says) if folder.join(journal::FILE).exists() => {
                Trouble::Other(format!("{says}; what was recorded is in {}, --resume goes on", folder.display()))
            }
            other => other,
        })?;
        Ok(folder)
    }

    fn simulated(
        &self,
        session: &Session,
        text: &str,
        begun: Option<Journal>,
        folder: &Path,
        goes: impl FnMut(Progress) -> bool,
    ) -> Result<(), Trouble> {
        let stand = self.simulated_stand(session)?;
        let other = |e: hal_sim::controller::ControllerError| Trouble::Other(e.to_string());
        let clock = VirtualClock::default();
        let controller = Controller::new(&clock, &stand.setup(), Plant::new(&stand, 0.0)?, flash(self.seed), self.seed).map_err(other)?;
        let done = RefCell::new(None);
        let host = async {
            let mut line = Simulated::new(&controller);
            // The sensor under test wants a moment after power-on.
            let ended = match line.wait_s(0.3).await {
                Ok(_) => whole(&mut line, session, text, begun, folder, &mut Robot::new(&controller, session), goes).await,
                Err(error) => Err(error.into()),
            };
            done.replace(Some(ended));
        };
        controller.run(host, |_| ()).map_err(other)?;
        done.into_inner().unwrap_or_else(|| Err(Trouble::Other("the simulated stand did not end".to_owned())))
    }

    /// The stand of a file, or the default one with what the seed draws.
    fn simulated_stand(&self, session: &Session) -> Result<Described, Trouble> {
        let mut stand = sim::stand(self.stand.as_ref())?;
        if self.stand.is_none() && session.what == What::Drive {
            stand = part::drive(self.seed, &session.known).0;
        }
        if stand.imu.is_none() && session.what != What::Drive {
            stand.imu = Some(part::sensor(self.seed, &session.known, session.full_scale_rad_s.unwrap_or(10.0)).0);
        }
        Ok(stand)
    }

    /// Says what was found to the stand, which keeps it.
    fn settings(&self, record: &Record) -> Result<(), Trouble> {
        let Some(port) = &self.port else { return Ok(()) };
        let mut link = Link::open(port)?;
        let mut told = Vec::new();
        for (setting, value) in super::calibrate_into::settings(record) {
            let value = match value {
                super::calibrate_into::Setting::Is(value) => value,
                super::calibrate_into::Setting::Over(by) => {
                    let says = link.ask(&format!("SETTings:{setting}?"))?;
                    let now: f64 = says
                        .split([' ', ','])
                        .next()
                        .unwrap_or_default()
                        .parse()
                        .map_err(|_| Trouble::Other(format!("SETTings:{setting}? says {says}")))?;
                    now / by
                }
            };
            link.tell(&format!("SETTings:{setting} {value:e}"))?;
            told.push(format!("{setting} {}", crate::report::significant(value, 6)));
        }
        if told.is_empty() {
            return self.output.text("no setting of the stand is of what was calibrated\n");
        }
        link.tell("SETTings:SAVE")?;
        self.output.text(&format!("kept by the stand: {}\n", told.join(", ")))
    }
}

/// Asks what the stand can, refuses what it cannot, and runs the rest.
async fn whole(
    stand: &mut impl Stand,
    session: &Session,
    text: &str,
    begun: Option<Journal>,
    folder: &Path,
    person: &mut impl Person,
    goes: impl FnMut(Progress) -> bool,
) -> Result<(), Trouble> {
    stand.tell("STReam OFF").await?;
    let fault = stand.ask("FAULt?").await?;
    if !fault.starts_with("0,") {
        return Err(Trouble::Input(format!("the drive is off by a fault: {fault}; FAULt:CLEar in `stand console` first")));
    }
    let able = Able::of(stand).await?;
    check(session, &able).map_err(|e| Trouble::Input(e.to_string()))?;
    let identity = stand.ask("*IDN?").await?;
    let mut journal = match begun {
        Some(journal) => journal,
        None => {
            let journal = Journal::new(session.what, identity);
            run::begin(folder, text, &journal)?;
            journal
        }
    };
    Ok(run::run(stand, session, &mut journal, folder, person, goes).await?)
}

/// A person at the keyboard.
struct AtHand;

impl Person for AtHand {
    fn does(&mut self, ask: &str, _: &Mounted) -> Option<String> {
        let hint = if std::io::stdin().is_terminal() { " Press Enter when it is done, or say what you saw." } else { "" };
        eprintln!("{ask}{hint}");
        let mut line = String::new();
        match std::io::stdin().lock().read_line(&mut line) {
            Ok(count) if count > 0 => Some(line.trim().to_owned()),
            _ => None,
        }
    }
}

/// The simulated stand does it by itself; the part stays off by what it is off from where it is believed to be.
struct Robot<'h, 'c, P> {
    controller: &'h Controller<'c, P>,
    off_m: f64,
}

impl<'h, 'c, P: PlantPort> Robot<'h, 'c, P> {
    fn new(controller: &'h Controller<'c, P>, session: &Session) -> Self {
        let believed_m = session.mounted().first().map_or(0.0, |m| m.radius_m);
        let off_m = controller.bench().borrow_mut().imu().map_or(0.0, |imu| imu.mounted().radius_m - believed_m);
        Self { controller, off_m }
    }
}

impl<P: PlantPort> Person for Robot<'_, '_, P> {
    fn does(&mut self, _: &str, m: &Mounted) -> Option<String> {
        let lying = match m.lying {
            Lying::Flat => chip::Lying::Flat,
            Lying::Side => chip::Lying::Side,
            Lying::OtherSide => chip::Lying::OtherSide,
        };
        if let Some(imu) = self.controller.bench().borrow_mut().imu() {
            let chi_rad = imu.mounted().chi_rad;
            imu.mount(chip::Mounted { radius_m: m.radius_m + self.off_m, chi_rad, tilt_rad: m.tilt_deg.to_radians(), lying });
        }
        Some("done by the simulated stand".to_owned())
    }
}
