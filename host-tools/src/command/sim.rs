//! `stand sim`: the firmware on the simulated stand; a session in virtual time, or the whole controller in real time behind a port.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{self, SessionRequest};
use serde_json::json;
use stand_firmware::speed_loop::{Config, Mode};

use super::error::CliError;
use super::output::{JsonOutput, check_place, working};
use super::profile::{self, ProfileWords};
use crate::acquire::hidden::{self, HiddenEffect};
use crate::log::{Column, Log};

/// With the speed loop, or without.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Drive {
    /// The speed loop holds the rate that the profile asks for
    Rate,
    /// The profile is the voltage itself, without the speed loop
    Voltage,
}

/// What the simulated stand is put behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Served {
    /// A pseudo-terminal that any program opens as a serial port
    Pty,
}

/// Run the firmware on the simulated stand and write its log.
#[derive(Debug, Args)]
#[command(after_help = profile::list(), group = clap::ArgGroup::new("what").required(true).args(["out", "serve"]))]
pub(super) struct Sim {
    /// The log to write, .csv or .parquet
    #[arg(long, value_name = "LOG")]
    out: Option<PathBuf>,
    /// Instead of a log: the stand in real time behind a serial line, whose path is printed
    #[arg(long, value_enum, conflicts_with_all = ["profile", "mode", "amplitude", "json"])]
    pub(super) serve: Option<Served>,
    /// A second name for the served port
    #[arg(long, value_name = "PATH", requires = "serve")]
    pub(super) link: Option<PathBuf>,
    /// Where the served stand's flash is kept from one time to the next
    #[arg(long, value_name = "FILE", requires = "serve")]
    pub(super) flash: Option<PathBuf>,
    /// The served stand carries a gyro on its torquer and angle sensor (`stand drift run --port`): 1.5 °/h at 70° north, or as a TOML file says
    #[arg(long, value_name = "FILE", requires = "serve", num_args = 0..=1)]
    pub(super) gyro: Option<Option<PathBuf>>,
    #[command(flatten)]
    profile: ProfileWords,
    /// Length of the record, s [default: 30]; of a served stand: how long it is there [default: until Ctrl-C]
    #[arg(long, allow_negative_numbers = true)]
    pub(super) seconds: Option<f64>,
    /// With the speed loop (rate) or without it (voltage)
    #[arg(long, value_enum, default_value_t = Drive::Rate)]
    mode: Drive,
    /// Give the stand an effect that its model lacks: one of the catalogue, or a number that draws one
    #[arg(long, value_name = "SEED|EFFECT", allow_negative_numbers = true)]
    pub(super) hidden: Option<String>,
    /// Say which effect was hidden, with its parameters
    #[arg(long)]
    pub(super) reveal: bool,
    /// Another stand, described in TOML
    #[arg(long, value_name = "FILE")]
    pub(super) stand: Option<PathBuf>,
    /// Seed of profile and noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub(super) seed: u64,
    #[command(flatten)]
    json: JsonOutput,
}

/// Length of a record where nobody says it, s.
const USUAL_S: f64 = 30.0;

/// A session by request: what was run, and its log.
pub(super) struct Session {
    pub log: Log,
    pub hidden: Option<HiddenEffect>,
}

/// What a session needs to know.
pub(super) struct Request<'a> {
    pub out: &'a std::path::Path,
    pub profile: &'a ProfileWords,
    pub seconds: f64,
    pub mode: Drive,
    pub hidden: Option<&'a str>,
    pub stand: Stand,
    pub seed: u64,
}

/// Runs a session and gives its log, not yet written.
pub(super) fn session(request: &Request) -> Result<Session, CliError> {
    // The ending is wrong before an hour has been simulated, not after.
    crate::log::Format::of(request.out)?;
    let mut stand = request.stand.clone();
    let hidden = match request.hidden {
        Some(word) => Some(hidden::hide(word, &mut stand).map_err(|e| CliError::Input(format!("--hidden: {e}")))?),
        None => None,
    };
    let mode = match request.mode {
        Drive::Rate => Mode::Rate,
        Drive::Voltage => Mode::Voltage,
    };
    let profile = request.profile.config(mode, request.seed)?;
    let wanted = SessionRequest { mode, profile, seconds: request.seconds, seed: request.seed };
    let plant = Plant::new(&stand, 0.0)?;
    let working = working("the stand runs");
    let record = session::run(stand.setup(), plant, wanted)?;
    working.finish_and_clear();
    let mut notes = vec![("stand".to_owned(), stand.name.clone())];
    notes.extend(record.notes);
    notes.push(("supply_nominal_V".to_owned(), stand.drive.supply_V.to_string()));
    notes.push(("date".to_owned(), jiff::Zoned::now().strftime("%Y-%m-%dT%H:%M:%S%:z").to_string()));
    let columns = record.columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    Ok(Session { log: Log::new(request.out, columns, notes)?, hidden })
}

/// A stand from its file, or the default one.
pub(super) fn stand(path: Option<&PathBuf>) -> Result<Stand, CliError> {
    let Some(path) = path else { return Ok(Stand::default()) };
    let text = std::fs::read_to_string(path).map_err(|e| CliError::file(path, "read", &e))?;
    let of_the_file = |e: &dyn std::fmt::Display| CliError::Input(format!("{}: {e}", path.display()));
    let stand = Stand::parse(&text).map_err(|e| of_the_file(&e))?;
    // What the session would refuse too, but without the file's name.
    stand.sensors.check().map_err(|e| of_the_file(&e))?;
    Config::new(&stand.firmware, &stand.hardware).map_err(|e| of_the_file(&e))?;
    Ok(stand)
}

impl Sim {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let Some(out) = &self.out else { return self.serve() };
        check_place(out)?;
        let request = Request {
            out,
            profile: &self.profile,
            seconds: self.seconds.unwrap_or(USUAL_S),
            mode: self.mode,
            hidden: self.hidden.as_deref(),
            stand: stand(self.stand.as_ref())?,
            seed: self.seed,
        };
        let session = session(&request)?;
        session.log.write(out)?;
        let columns: Vec<&str> = session.log.columns().iter().map(|c| c.name.as_str()).collect();
        let mut text = format!(
            "{}: {} rows, {} s at {:.0} Hz: {}\n",
            out.display(),
            session.log.len(),
            session.log.duration_s(),
            1.0 / session.log.median_dt_s(),
            columns.join(", ")
        );
        for key in ["fault"].into_iter().filter_map(|k| session.log.note(k).map(|v| (k, v))) {
            text += &format!("{}: {}\n", key.0, key.1);
        }
        for (key, value) in session.log.notes().iter().filter(|(k, _)| k.starts_with("limited_")) {
            text += &format!("{key}: {value}\n");
        }
        match (&session.hidden, self.reveal) {
            (Some(hidden), true) => text += &format!("hidden: {hidden}\n"),
            (Some(_), false) => text += "hidden: one effect that the model lacks (--reveal says which)\n",
            (None, true) => text += "hidden: nothing\n",
            (None, false) => {}
        }
        self.json.text(&text)?;
        self.json.json(|| {
            json!({
                "log": out.display().to_string(),
                "samples": session.log.len(),
                "duration_s": session.log.duration_s(),
                "columns": columns,
                "notes": session.log.notes().iter().map(|(k, v)| (k.clone(), json!(v))).collect::<serde_json::Map<_, _>>(),
                "hidden": match (&session.hidden, self.reveal) {
                    (Some(hidden), true) => json!({ "effect": hidden.effect, "parameters": hidden.parameters }),
                    (None, true) => json!("none"),
                    _ => serde_json::Value::Null,
                },
            })
        })
    }
}
