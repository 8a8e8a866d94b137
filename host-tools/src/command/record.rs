//! `stand record`: a profile runs on a stand, and what the stand measures becomes a log.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use hal_sim::session::SessionRequest;
use serde_json::json;
use stand_firmware::profile::Parameter;
use stand_firmware::speed_loop::Mode;
use stand_firmware::telemetry::Channels;
use stand_firmware::telemetry::channel::{Sampling, Source};

use super::error::CliError;
use super::output::{JsonOutput, check_writable, progress_bar};
use super::profile::{self, ProfileOptions};
use super::signals::Interrupts;
use super::stand_file::{DriveMode, required_port};
use crate::acquire::link::{LinkError, Received, SerialLink};
use crate::acquire::record::{LogFile, Recorder, RowOutcome, shows_index};
use crate::log::{FaultNote, Log, Note, Notes, RateSource, VoltageSource};

/// A stand that says nothing for this long has gone.
const SILENCE: Duration = Duration::from_secs(3);
/// How often the log is flushed, and the stand hears that somebody is there.
const EACH: Duration = Duration::from_secs(1);
/// The stand switches its drive off when its host is silent for this long.
const WATCH: &str = "HOST:ARM 5 S";
/// The rate at which the index is looked for, and how long.
const LOOK_RAD_S: f64 = 3.0;
const LOOK: Duration = Duration::from_secs(10);

/// Record what a stand does.
#[derive(Debug, Args)]
#[command(after_help = profile::list())]
pub(super) struct Record {
    /// The serial port of the stand
    #[arg(long, value_name = "P")]
    port: Option<PathBuf>,
    /// The log to write, .csv or .parquet
    #[arg(long, value_name = "LOG")]
    out: PathBuf,
    #[command(flatten)]
    profile: ProfileOptions,
    /// Length of the record, s
    #[arg(long, default_value_t = 30.0, allow_negative_numbers = true)]
    seconds: f64,
    /// With the speed loop (rate) or without it (voltage)
    #[arg(long, value_enum, default_value_t = DriveMode::Rate)]
    mode: DriveMode,
    /// Seed of a random profile
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Rows of 1 ms in one row of the log
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1000))]
    decimation: u16,
    /// Turn the platform first, until its index is seen: the log's angles are from there
    #[arg(long)]
    find_index: bool,
    /// Channels beside the usual ones, e.g. angle_sensor_V,alpha_hat_rad; the line may want --decimation 2 then (STReam:CHANnels:LIST? in `stand console` has the names)
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    also: Vec<String>,
    /// A note for the log, as operator=Ann; may be repeated
    #[arg(long = "note", value_name = "KEY=VALUE")]
    notes: Vec<String>,
    #[command(flatten)]
    json: JsonOutput,
}

/// How a recording ended.
enum End {
    Whole,
    Interrupted,
    Fault(String),
    Lost(LinkError),
    Silent,
}

impl Record {
    pub(super) fn run(self) -> Result<(), CliError> {
        let port = required_port(self.port.clone())?;
        check_writable(&self.out)?;
        self.json.check()?;
        let place = LogFile::of(&self.out)?;
        let orders = self.orders()?;
        let also = self.also()?;
        let notes = self.notes.iter().map(|note| pair("--note", note)).collect::<Result<Vec<_>, _>>()?;
        let mut link = SerialLink::open(&port)?;
        let fault = link.query("FAULt?")?;
        if !fault.starts_with("0,") {
            return Err(CliError::Input(format!(
                "{}: the drive is off by a fault: {fault}; FAULt:CLEar in `stand console` first",
                port.display()
            )));
        }
        link.command("STReam OFF")?;
        for order in &orders {
            link.command(order)?;
        }
        let has_index = self.find_index(&mut link)?;
        let head = self.head(&mut link, has_index, notes)?;
        link.command(&format!("STReam:DECimation {}", self.decimation))?;
        let channels = self.channels().and(also);
        let names: Vec<&str> = channels.iter().map(|channel| channel.name).collect();
        link.command(&format!("STReam:CHANnels {}", names.join(",")))?;
        let file = place.create().map_err(|e| CliError::file(place.partial_path(), "write", &e))?;
        let mut recorder = Recorder::new(file, channels, head);
        let begun = Instant::now();
        let end = self.measure(&mut link, &mut recorder, place.partial_path())?;
        self.close(&mut link, recorder, &place, end, has_index, begun)
    }

    /// What is told to the stand before the profile begins.
    fn orders(&self) -> Result<Vec<String>, CliError> {
        let (mode, word) = match self.mode {
            DriveMode::Rate => (Mode::Rate, "RATE"),
            DriveMode::Voltage => (Mode::Voltage, "VOLTage"),
        };
        if !(self.seconds.is_finite() && (1e-3..=1e6).contains(&self.seconds)) {
            return Err(CliError::Input(format!("--seconds: {} is outside 0.001 … 1000000", self.seconds)));
        }
        let config = self.profile.config(mode, self.seed)?;
        let kind = config.kind;
        let mut orders = vec![format!("PROFile:MODE {word}"), format!("PROFile:TYPE {}", kind.name())];
        for name in kind.parameters() {
            if let Some(parameter) = Parameter::of_name(name) {
                orders.push(format!("PROFile:{name} {}", (parameter.read)(&config)));
            }
        }
        // A little longer than what is recorded, so that the last row is of the profile.
        orders.push(format!("PROFile:DURation {}", self.seconds + 0.2));
        Ok(orders)
    }

    /// The channels of the log: the default selection, without commanded rate and angle in voltage mode.
    fn channels(&self) -> Channels {
        let motion_commands = Channels::matching(|channel| channel.source == Source::Command && channel.sampling == Sampling::Instant);
        match self.mode {
            DriveMode::Rate => Channels::DEFAULT,
            DriveMode::Voltage => Channels::DEFAULT.without(motion_commands),
        }
    }

    /// What is asked for beside the usual.
    fn also(&self) -> Result<Channels, CliError> {
        self.also.iter().try_fold(Channels::default(), |all, name| match Channels::named(name) {
            Some(one) => Ok(all.and(one)),
            None => {
                Err(CliError::Input(format!("--also: `{name}` is no channel (STReam:CHANnels:LIST? in `stand console` has the names)")))
            }
        })
    }

    /// Whether the index was seen, so that angles of the next stream are from there; `--find-index` turns the platform until it is.
    fn find_index(&self, link: &mut SerialLink) -> Result<bool, CliError> {
        link.command("STReam:DECimation 1")?;
        link.command("STReam:CHANnels from_index_rad")?;
        link.command("STReam ON")?;
        let mut seen = has_index(link, Duration::from_millis(200))?;
        if !seen && self.find_index {
            link.command(WATCH)?;
            link.command(&format!("SOURce:RATE {LOOK_RAD_S} RAD/S"))?;
            link.command("SOURce:MODE RATE")?;
            let begun = Instant::now();
            while !seen && begun.elapsed() < LOOK {
                link.command("HOST:ARM 5 S")?;
                seen = has_index(link, EACH)?;
            }
            link.command("SOURce:RATE 0 RAD/S")?;
            std::thread::sleep(EACH);
            link.command("OUTPut OFF")?;
            if !seen {
                link.command("STReam OFF")?;
                return Err(CliError::Input(
                    "--find-index: the platform was turned and its index was not seen; is it free, is the index wired?".to_owned(),
                ));
            }
        }
        link.command("STReam OFF")?;
        Ok(seen)
    }

    /// What the log says of itself: interfaces.md, "Logs".
    fn head(&self, link: &mut SerialLink, has_index: bool, more: Vec<(String, String)>) -> Result<Notes, CliError> {
        let mut setting = |name: &str| -> Result<Option<f64>, CliError> {
            match link.query(&format!("SETTings:{name}?")) {
                Ok(reply) => Ok(reply.split_whitespace().next().and_then(|number| number.parse().ok())),
                // An older firmware may not have it.
                Err(LinkError::Refused { .. }) => Ok(None),
                Err(error) => Err(error.into()),
            }
        };
        let counts = setting("counts_per_turn")?;
        let rate_lsb = setting("rate_rad_s_per_code")?;
        let supply = setting("supply_nominal_V")?;
        let cutoff = setting("rate_cutoff_Hz")?.filter(|cutoff| *cutoff > 0.0);
        let identity: Vec<&str> = link.identity().split(',').collect();
        let part = |k: usize| identity.get(k).copied().unwrap_or("").trim().to_owned();
        let (mode, unit) = match self.mode {
            DriveMode::Rate => ("rate", "rad/s"),
            DriveMode::Voltage => ("voltage", "V"),
        };
        let mode_kind = if self.mode == DriveMode::Rate { Mode::Rate } else { Mode::Voltage };
        let amplitude = self.profile.amplitude.unwrap_or_else(|| SessionRequest::usual_amplitude(mode_kind));
        let mut notes = Notes::from_iter([
            Note::Stand(format!("{} {} {}", part(0), part(1), part(2))),
            Note::Text("firmware", part(3)),
            Note::Text("port", link.name()),
            Note::Profile(self.profile.profile.clone()),
            Note::Text("amplitude", format!("{amplitude} {unit}")),
            Note::Mode(mode.to_owned()),
            Note::Text("profile_seed", self.seed.to_string()),
            Note::Voltage(VoltageSource::Command),
            Note::MeanCurrent,
            Note::Rate(RateSource::RateSensor, cutoff),
        ]);
        if let Some(counts) = counts {
            notes.extend([Note::Encoder(counts), Note::QuantizationStep("theta", "rad", std::f64::consts::TAU / counts)]);
        }
        notes.extend(has_index.then_some(Note::ThetaZeroIsIndex));
        notes.extend(rate_lsb.map(|step| Note::QuantizationStep("omega", "rad_s", step)));
        notes.extend(supply.map(Note::SupplyNominal));
        notes.push(Note::Date);
        // What the person says of a column stands for what is said here.
        notes.replace(more.into());
        Ok(notes)
    }

    /// Runs the profile and takes rows until the record is long enough, somebody interrupts, or the line is no more.
    fn measure<W: std::io::Write>(&self, link: &mut SerialLink, recorder: &mut Recorder<W>, file: &Path) -> Result<End, CliError> {
        let interrupted = Interrupts::install()?;
        let bar = progress_bar((self.seconds * 1e3) as u64, "{wide_bar} {msg}");
        link.command("STReam ON")?;
        link.command(WATCH)?;
        link.command("PROFile:STARt")?;
        link.forget();
        let failed = |e: std::io::Error| CliError::file(file, "write", &e);
        let (mut heard_at, mut each) = (Instant::now(), Instant::now());
        let end = loop {
            if interrupted.any() {
                break End::Interrupted;
            }
            match link.next(Duration::from_millis(50)) {
                Err(lost) => break End::Lost(lost),
                Ok(None) if heard_at.elapsed() > SILENCE => break End::Silent,
                Ok(None) => {}
                Ok(Some(heard)) => {
                    heard_at = Instant::now();
                    if let Received::Row(row) = heard {
                        match recorder.take(&row).map_err(failed)? {
                            RowOutcome::Fault(_) => break End::Fault(String::new()),
                            RowOutcome::Written
                                if recorder.last_s() + 0.5e-3 * f64::from(self.decimation)
                                    >= self.seconds - 1e-3 * f64::from(self.decimation) =>
                            {
                                break End::Whole;
                            }
                            _ => {}
                        }
                        if row.sequence.is_multiple_of(100) {
                            let rate = row.value("omega_rad_s").unwrap_or(f64::NAN);
                            let lost = link.losses().rows;
                            bar.set_position((recorder.last_s() * 1e3) as u64);
                            bar.set_message(format!("{:.1} of {} s, {rate:+.3} rad/s, {lost} rows lost", recorder.last_s(), self.seconds));
                        }
                    }
                }
            }
            if each.elapsed() > EACH {
                each = Instant::now();
                recorder.flush().map_err(failed)?;
                if let Err(lost) = link.send("HOST:ARM 5 S") {
                    break End::Lost(lost);
                }
            }
        };
        bar.finish_and_clear();
        Ok(end)
    }

    /// Leaves the stand at rest and the log whole, and says what came of it.
    fn close<W: std::io::Write>(
        &self,
        link: &mut SerialLink,
        recorder: Recorder<W>,
        place: &LogFile,
        mut end: End,
        has_index: bool,
        begun: Instant,
    ) -> Result<(), CliError> {
        let losses = link.losses();
        if !matches!(end, End::Lost(_) | End::Silent) {
            let rest = ["PROFile:STOP", "HOST:ARM 0 S", "STReam OFF"].iter().try_for_each(|order| link.command(order));
            let said = link.query("FAULt?");
            match (&end, rest, said) {
                (End::Fault(_), _, Ok(says)) => end = End::Fault(says),
                (_, Err(lost), _) | (_, _, Err(lost)) => end = End::Lost(lost),
                _ => {}
            }
        }
        let (rows, last_s, left_out) = (recorder.rows(), recorder.last_s(), recorder.left_out());
        let absent = recorder.absent().join(", ");
        let how = match &end {
            End::Whole => None,
            End::Interrupted => Some("by hand".to_owned()),
            End::Fault(says) => Some(format!("fault {says}")),
            End::Lost(error) => Some(error.to_string()),
            End::Silent => Some(format!("the stand was silent for {} s", SILENCE.as_secs())),
        };
        let mut notes = Notes::from_iter([Note::LostRows(losses.rows), Note::DamagedFrames(losses.damaged)]);
        if let End::Fault(says) = &end {
            notes.push(Note::Fault(FaultNote { message: says.clone(), at_s: last_s.to_string() }));
        }
        notes.extend(how.iter().map(|how| Note::Ended(how.clone(), last_s)));
        recorder.finish(&notes).map_err(|e| CliError::file(place.partial_path(), "write", &e))?;
        if rows == 0 {
            let _ = std::fs::remove_file(place.partial_path());
            return Err(CliError::Other(format!("nothing was recorded: {}", how.unwrap_or_else(|| "no rows came".to_owned()))));
        }
        place.close()?;
        let log = Log::read(&self.out)?;
        let mut text =
            format!("{}: {rows} rows, {:.3} s, in {:.1} s\n", self.out.display(), log.duration_s(), begun.elapsed().as_secs_f64());
        if !losses.is_none() {
            text += &format!("lost on the line: {} rows; {} frames or lines were damaged and are not shown\n", losses.rows, losses.damaged);
        }
        if left_out > 0 {
            text += &format!("left out: {left_out} rows that lacked a value\n");
        }
        if !absent.is_empty() {
            text += &format!("not in the log, for the stand has no values: {absent}\n");
        }
        if !has_index {
            text += "the index was not seen: the angle's zero is arbitrary (--find-index turns the platform first)\n";
        }
        if let Some(how) = &how {
            text += &format!("ended before its time: {how}\n");
        }
        self.json.text(&text)?;
        self.json.json(|| {
            json!({
                "log": self.out.display().to_string(), "samples": rows, "duration_s": log.duration_s(),
                "lost_rows": losses.rows, "lost_frames": losses.frames, "damaged": losses.damaged, "left_out": left_out,
                "theta_zero": if has_index { json!("index") } else { serde_json::Value::Null },
                "ended": how,
            })
        })?;
        match end {
            End::Whole | End::Interrupted | End::Fault(_) => Ok(()),
            End::Lost(error) => Err(CliError::Other(format!("{error}; what came until then is in {}", self.out.display()))),
            End::Silent => Err(CliError::Other(format!(
                "{}: the stand says nothing any more; what came until then is in {}",
                link.name(),
                self.out.display()
            ))),
        }
    }
}

/// Whether a row of the running stream says that the index was seen; `from_index_rad` must be among its channels.
pub(super) fn has_index(link: &mut SerialLink, within: Duration) -> Result<bool, CliError> {
    let until = Instant::now() + within;
    while Instant::now() < until {
        if let Some(Received::Row(row)) = link.next(Duration::from_millis(20))?
            && shows_index(&row)
        {
            return Ok(true);
        }
    }
    Ok(false)
}

/// `NAME=VALUE` in two.
fn pair(option: &str, text: &str) -> Result<(String, String), CliError> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() => Ok((name.trim().to_owned(), value.trim().to_owned())),
        _ => Err(CliError::Input(format!("{option} {text}: must be NAME=VALUE"))),
    }
}
