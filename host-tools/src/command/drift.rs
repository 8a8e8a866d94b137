//! `stand drift`: a gyro's drift by pulses of alternating sign.

use std::cell::RefCell;
use std::io::{BufRead, IsTerminal};
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};
use embassy_futures::block_on;
use hal_sim::board::linear_motor::LinearMotor;
use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::gyro::{Place, SingleAxis};
use hal_sim::session::StandSetup;
use serde_json::json;

use super::error::Trouble;
use super::output::{Answer as Out, Output, check_place, working};
use crate::drift::advise::advise;
use crate::drift::answer::{CycleLine, Measured};
use crate::drift::compute::{COLUMNS, Given, measured};
use crate::drift::error::within;
use crate::drift::session::{self, Plan, Scales, Simulated, Stand};
use crate::drift::{Answer, DEG_H, DriftError, page, platform, separate};
use crate::link::Link;
use crate::log::{Column, Format, Log};
use crate::report::finite;

const ARCMIN: f64 = std::f64::consts::PI / 180.0 / 60.0;

/// Measure a gyro's drift, or work it out from a log
#[derive(Debug, Subcommand)]
pub(super) enum Drift {
    /// Measure: the firmware runs the cycles, on the simulated stand or over a port, in two positions or more
    Run(Box<Run>),
    /// Work it out from logs with angle_sensor_V and torquer_A
    Compute(Compute),
    /// How long the pulses should be, from a log of the angle sensor without pulses
    Advise(Advise),
    /// The same method with a rate gyro on the turning platform: bias and scale
    Platform(Platform),
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Shape {
    Rectangular,
    Triangular,
    Sawtooth,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Sequence {
    /// + − in each cycle
    PlusMinus,
    /// − + in each cycle
    MinusPlus,
    /// By turns
    Both,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Turn {
    /// A person turns the gyro and says when it stands
    Hand,
    /// The stand's drive turns the platform that carries it
    Drive,
}

/// What the uncertainty is to know.
#[derive(Debug, Clone, Args)]
struct Errors {
    /// Standard error of the turn between two positions, arcminutes
    #[arg(long, value_name = "ARCMIN", default_value_t = 0.0, allow_negative_numbers = true)]
    turn_error: f64,
    /// Standard error of the level, arcseconds
    #[arg(long, value_name = "ARCSEC", default_value_t = 0.0, allow_negative_numbers = true)]
    level_error: f64,
    /// Relative standard error of the angle sensor's gain, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 0.0, allow_negative_numbers = true)]
    gain_error: f64,
}

#[derive(Debug, Args)]
pub(super) struct Run {
    /// The serial port of the stand; without it the simulated one measures, in virtual time
    #[arg(long, value_name = "P")]
    port: Option<PathBuf>,
    /// Cycles in each position
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    cycles: u32,
    /// Duration of one pulse, s; a cycle is two
    #[arg(long, value_name = "S", default_value_t = 5.0, allow_negative_numbers = true)]
    pulse: f64,
    /// Period of vibration or mains of which the pulse is a multiple, s; 0: none
    #[arg(long, value_name = "S", default_value_t = 0.02, allow_negative_numbers = true)]
    period: f64,
    /// Greatest rate of a pulse, °/s
    #[arg(long, value_name = "DEG_S", default_value_t = 0.05, allow_negative_numbers = true)]
    rate: f64,
    /// Time with the correction loop closed before each cycle, s
    #[arg(long, value_name = "S", default_value_t = 4.0, allow_negative_numbers = true)]
    rest: f64,
    /// Signs of the pulses
    #[arg(long, value_enum, default_value_t = Sequence::Both)]
    sequence: Sequence,
    /// Their shape
    #[arg(long, value_enum, default_value_t = Shape::Rectangular)]
    shape: Shape,
    /// The second pulse runs backwards
    #[arg(long)]
    reversed: bool,
    /// The positions in their order: degrees by which the gyro is turned, and behind colons raised and rolled, as 0,180,0:0:90
    #[arg(long, value_name = "LIST", default_value = "0,180", allow_hyphen_values = true)]
    positions: String,
    /// Who turns it
    #[arg(long, value_enum, default_value_t = Turn::Hand)]
    turn: Turn,
    /// Latitude, degrees, north positive; for the azimuth. Of a simulated gyro it is known
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    latitude: Option<f64>,
    /// The simulated gyro, a TOML file (site, own, torquer, sensor, vibration); without it 1.5 °/h at 70° north
    #[arg(long, value_name = "FILE")]
    gyro: Option<PathBuf>,
    /// Seed of its noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Write the rows to this log too, .csv or .parquet
    #[arg(long, value_name = "LOG")]
    out: Option<PathBuf>,
    #[command(flatten)]
    errors: Errors,
    #[command(flatten)]
    output: Output,
}

#[derive(Debug, Args)]
pub(super) struct Compute {
    /// Logs, .csv or .parquet; several are one measurement
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// K_k, V/rad; else by the note angle_gain_V_rad
    #[arg(long, value_name = "V_RAD", allow_negative_numbers = true)]
    angle_gain: Option<f64>,
    /// K_m/H, rad/s/A; else by the note torquer_gain_rad_s_A
    #[arg(long, value_name = "RAD_S_A", allow_negative_numbers = true)]
    torquer_gain: Option<f64>,
    /// Duration of one pulse, s; else by the note pulse_s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pulse: Option<f64>,
    /// End of the angle sensor's range, V; else by the note angle_limit_V
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    angle_limit: Option<f64>,
    /// Latitude, degrees; else by the note latitude_deg
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    latitude: Option<f64>,
    #[command(flatten)]
    errors: Errors,
    #[command(flatten)]
    output: Output,
}

#[derive(Debug, Args)]
pub(super) struct Advise {
    /// The log
    log: PathBuf,
    /// About how long a pulse is to be, s
    #[arg(long, value_name = "S", default_value_t = 5.0, allow_negative_numbers = true)]
    pulse: f64,
    /// K_k, V/rad; else by the note angle_gain_V_rad
    #[arg(long, value_name = "V_RAD", allow_negative_numbers = true)]
    angle_gain: Option<f64>,
    #[command(flatten)]
    output: Output,
}

#[derive(Debug, Args)]
pub(super) struct Platform {
    /// The log, with theta_rad and gyro_rad_s
    log: PathBuf,
    /// For how long the platform turns each way, s
    #[arg(long, value_name = "S", default_value_t = 5.0, allow_negative_numbers = true)]
    pulse: f64,
    #[command(flatten)]
    answer: Out,
}

impl From<DriftError> for Trouble {
    fn from(error: DriftError) -> Self {
        Trouble::Input(error.to_string())
    }
}

impl From<session::SessionError> for Trouble {
    fn from(error: session::SessionError) -> Self {
        match error {
            session::SessionError::Link(error) => error.into(),
            refused @ session::SessionError::Refused { .. } => Trouble::Input(refused.to_string()),
            other => Trouble::Other(other.to_string()),
        }
    }
}

impl Drift {
    pub(super) fn run(self) -> Result<(), Trouble> {
        match self {
            Drift::Run(run) => run.run(),
            Drift::Compute(compute) => compute.run(),
            Drift::Advise(advise) => advise.run(),
            Drift::Platform(platform) => platform.run(),
        }
    }
}

fn tell(output: &Output, answer: &Answer) -> Result<(), Trouble> {
    output.text(&page::text(answer))?;
    output.html(|| page::html(answer))?;
    output.json(|| answer.json())
}

impl Compute {
    fn run(self) -> Result<(), Trouble> {
        self.output.check()?;
        let given = Given {
            angle_gain_V_rad: self.angle_gain,
            torquer_gain_rad_s_A: self.torquer_gain,
            pulse_s: self.pulse,
            angle_limit_V: self.angle_limit,
            latitude_deg: self.latitude,
            turn_error_rad: self.errors.turn_error * ARCMIN,
            level_error_rad: self.errors.level_error * DEG_H,
            gain_error: self.errors.gain_error / 100.0,
        };
        let logs = self.logs.iter().map(|path| Log::read_also(path, &COLUMNS)).collect::<Result<Vec<_>, _>>()?;
        tell(&self.output, &measured(&logs, &given)?.answer()?)
    }
}

impl Advise {
    fn run(self) -> Result<(), Trouble> {
        self.output.check()?;
        let log = Log::read(&self.log)?;
        let name = self.log.display().to_string();
        let note = log.note("angle_gain_V_rad").and_then(|text| text.split_whitespace().next()?.parse().ok());
        let gain = self.angle_gain.or(note).ok_or_else(|| DriftError::Note {
            log: name.clone(),
            note: "angle_gain_V_rad",
            option: "--angle-gain",
        })?;
        let advice = advise(&log, gain, self.pulse)?;
        self.output.text(&page::advice_text(&name, &advice))?;
        self.output.html(|| page::advice_html(&name, &advice))?;
        self.output.json(|| {
            json!({
                "log": name,
                "pulse_s": finite(advice.pulse_s),
                "period_s": if advice.period_s > 0.0 { finite(advice.period_s) } else { serde_json::Value::Null },
                "periods": advice.periods,
                "leaves_deg_h": finite(advice.leaves_rad_s[0] / DEG_H),
                "wanted_leaves_deg_h": finite(advice.leaves_rad_s[1] / DEG_H),
                "noise_deg_h": finite(advice.noise_rad_s / DEG_H),
                "lines": advice.lines.iter().map(|l| json!({"frequency_Hz": finite(l.frequency_Hz), "amplitude_arcsec": finite(l.amplitude_rad / DEG_H)})).collect::<Vec<_>>(),
            })
        })
    }
}

impl Platform {
    fn run(self) -> Result<(), Trouble> {
        self.answer.check()?;
        let log = Log::read(&self.log)?;
        let name = self.log.display().to_string();
        let found = platform::of_log(&log, self.pulse)?;
        self.answer.text(&page::platform_text(&name, &found))?;
        self.answer.json(|| {
            let with = |(value, sigma): (f64, Option<f64>), unit: &str| json!({"value": finite(value), "sigma": sigma.map_or(serde_json::Value::Null, finite), "unit": unit});
            json!({
                "log": name,
                "bias_rad_s": with(found.bias_rad_s, "rad/s"),
                "scale": with(found.scale, "1"),
                "cycles": found.cycles.iter().map(|c| json!({"start_s": finite(c.start_s), "bias_rad_s": finite(c.bias_rad_s), "scale": finite(c.scale), "uncorrected": {"bias_rad_s": finite(c.plain[0]), "scale": finite(c.plain[1])}})).collect::<Vec<_>>(),
            })
        })
    }
}

/// `0,180,0:0:90`: turned, and raised and rolled.
fn places(list: &str) -> Result<Vec<Place>, Trouble> {
    let one = |text: &str| {
        let wrong = || Trouble::Input(format!("--positions: `{text}` is no position: degrees turned, and behind colons raised and rolled"));
        let mut numbers = [0.0; 3];
        let parts: Vec<&str> = text.split(':').collect();
        if parts.len() > 3 {
            return Err(wrong());
        }
        for (number, part) in numbers.iter_mut().zip(&parts) {
            *number = part.trim().parse().ok().filter(|n: &f64| n.is_finite()).ok_or_else(wrong)?;
        }
        let [turned_rad, raised_rad, rolled_rad] = numbers.map(f64::to_radians);
        Ok(Place { turned_rad, raised_rad, rolled_rad })
    };
    list.split(',').map(one).collect()
}

/// What was measured in all positions.
#[derive(Default)]
struct Session {
    cycles: Vec<CycleLine>,
    /// `t_s`, the channels of the session, and the place of each row.
    rows: Vec<[f64; 4]>,
    row_places: Vec<(usize, Place)>,
}

impl Run {
    fn run(self) -> Result<(), Trouble> {
        self.output.check()?;
        if let Some(path) = &self.out {
            check_place(path)?;
            Format::of(path)?;
        }
        let places = places(&self.positions)?;
        within("--pulse", self.pulse, 1e-3, 60.0)?;
        within("--period", self.period, 0.0, 60.0)?;
        within("--rest", self.rest, 1e-3, 1e5)?;
        within("--rate", self.rate, 1e-6, 100.0)?;
        if let Some(latitude) = self.latitude {
            separate::earth_rad_s(latitude)?;
        }
        let (session, scales, name, latitude_deg) = match &self.port {
            Some(port) => {
                let mut link = Link::open(port)?;
                let name = link.name();
                let (session, scales) = block_on(self.session(&mut link, &places, async |place, _| by_hand(place)))?;
                (session, scales, name, self.latitude)
            }
            None => self.simulated(&places)?,
        };
        if let Some(path) = &self.out {
            self.log(path, &session, &scales, latitude_deg)?.write(path)?;
        }
        let measured = Measured {
            name,
            cycles: session.cycles,
            has_three_axes: false,
            latitude_deg,
            turn_error_rad: within("--turn-error", self.errors.turn_error * ARCMIN, 0.0, 1.0)?,
            level_error_rad: within("--level-error", self.errors.level_error * DEG_H, 0.0, 1.0)?,
            gain_error: within("--gain-error", self.errors.gain_error / 100.0, 0.0, 1.0)?,
            warnings: Vec::new(),
        };
        tell(&self.output, &measured.answer()?)
    }

    fn plan(&self) -> Plan {
        let shape = ["RECTangular", "TRIangular", "SAWTooth"][self.shape as usize];
        let sequence = ["PLUSminus", "MINusplus", "BOTH"][self.sequence as usize];
        Plan {
            shape,
            reversed: self.reversed,
            sequence,
            rate_rad_s: self.rate.to_radians(),
            pulse_s: self.pulse,
            period_s: self.period,
            rest_s: self.rest,
            cycles: self.cycles,
        }
    }

    /// All positions on one stand; `turn` puts the gyro where it is not yet.
    async fn session<S: Stand>(
        &self,
        stand: &mut S,
        places: &[Place],
        turn: impl AsyncFn(&Place, &mut S) -> Result<(), Trouble>,
    ) -> Result<(Session, Scales), Trouble> {
        let fault = stand.ask("FAULt?").await?;
        if !fault.starts_with("0,") {
            return Err(Trouble::Input(format!("the drive is off by a fault: {fault}; FAULt:CLEar in `stand console` first")));
        }
        stand.tell("STReam OFF").await?;
        let scales = session::scales(stand).await?;
        session::set_up(stand, &self.plan()).await?;
        if self.out.is_some() {
            stand.tell(&format!("STReam:CHANnels {}", session::CHANNELS.join(","))).await?;
            stand.tell("STReam:DECimation 1").await?;
            stand.tell("STReam ON").await?;
        }
        let mut all = Session::default();
        let mut origin_rad = None;
        for (k, place) in places.iter().enumerate() {
            if k > 0 && self.turn == Turn::Drive {
                drive_to(stand, place.turned_rad - places[0].turned_rad, &mut origin_rad).await?;
            } else if k > 0 || place != &Place::default() {
                turn(place, stand).await?;
            }
            let bar = working(&format!("position {} of {}", k + 1, places.len()));
            // The firmware's pair is of positions 1 and 2.
            let number = k as u32 + 1;
            let position =
                session::measure(stand, &scales, number, *place, |state| bar.set_message(format!("position {number}: {state}"))).await?;
            bar.finish_and_clear();
            all.cycles.extend(position.cycles);
            all.row_places.push((all.rows.len(), *place));
            for row in position.rows {
                let value = |name: &str| {
                    let place = stand_firmware::telemetry::Channels::named(name).map_or(0, |c| c.0.trailing_zeros() as usize);
                    row.values.get(place).copied().unwrap_or(f64::NAN)
                };
                all.rows.push([row.at as f64 * 1e-7, value("angle_sensor_V"), value("torquer_A"), value("drift_mark")]);
            }
        }
        if self.turn == Turn::Drive {
            stand.tell("OUTPut OFF").await?;
        }
        if self.out.is_some() {
            stand.tell("STReam OFF").await?;
        }
        Ok((all, scales))
    }

    fn simulated(&self, places: &[Place]) -> Result<(Session, Scales, String, Option<f64>), Trouble> {
        let gyro: SingleAxis = match &self.gyro {
            None => SingleAxis::default(),
            Some(path) => {
                let text = std::fs::read_to_string(path).map_err(|e| Trouble::file(path, "read", &e))?;
                hal_sim::gyro::read(&text).map_err(|says| Trouble::Input(format!("{}: {says}", path.display())))?
            }
        };
        let latitude_deg = self.latitude.unwrap_or(gyro.site.latitude_rad.to_degrees());
        separate::earth_rad_s(latitude_deg)?;
        let other = |e: hal_sim::controller::ControllerError| Trouble::Other(e.to_string());
        let clock = VirtualClock::default();
        let controller = Controller::new(&clock, &StandSetup::default(), LinearMotor::default(), flash(self.seed), self.seed)
            .map_err(other)?
            .with_gyro(Box::new(gyro.seeded(self.seed)), self.seed);
        let done = RefCell::new(None);
        let host = async {
            let mut stand = Simulated::new(&controller);
            // Rows come from 2 ms on.
            let began = stand.wait_s(0.1).await;
            let turn = async |place: &Place, _: &mut Simulated<'_, '_, LinearMotor>| {
                if let Some(line) = controller.bench().borrow_mut().gyro() {
                    line.gyro().put(*place);
                }
                Ok(())
            };
            let all = match began {
                Ok(_) => self.session(&mut stand, places, turn).await,
                Err(error) => Err(error.into()),
            };
            done.replace(Some(all));
        };
        controller.run(host, |_| ()).map_err(other)?;
        let (session, scales) = done.into_inner().ok_or_else(|| Trouble::Other("the simulated stand did not end".to_owned()))??;
        Ok((session, scales, "simulated".to_owned(), Some(latitude_deg)))
    }

    /// The rows with what a later `drift compute` must know.
    fn log(&self, path: &Path, session: &Session, scales: &Scales, latitude_deg: Option<f64>) -> Result<Log, Trouble> {
        let mut columns: Vec<Column> = ["t_s", "angle_sensor_V", "torquer_A", "drift_mark", "turned_deg", "raised_deg", "rolled_deg"]
            .iter()
            .map(|name| Column { name: (*name).to_owned(), values: Vec::with_capacity(session.rows.len()) })
            .collect();
        let first_s = session.rows.first().map_or(0.0, |row| row[0]);
        let mut place = Place::default();
        for (k, row) in session.rows.iter().enumerate() {
            if let Some((_, next)) = session.row_places.iter().rev().find(|(from, _)| *from <= k) {
                place = *next;
            }
            // A row without a sample is none.
            if row.iter().any(|value| !value.is_finite()) {
                continue;
            }
            let at = [row[0] - first_s, row[1], row[2], row[3]];
            let angles = [place.turned_rad, place.raised_rad, place.rolled_rad].map(f64::to_degrees);
            columns.iter_mut().zip(at.into_iter().chain(angles)).for_each(|(column, value)| column.values.push(value));
        }
        let pulse_s = session.cycles.first().map_or(self.pulse, |cycle| cycle.integral.pulse_s);
        let mut notes = vec![
            ("angle_gain_V_rad".to_owned(), format!("{}", scales.angle_gain_V_rad)),
            ("torquer_gain_rad_s_A".to_owned(), format!("{}", scales.torquer_gain_rad_s_A)),
            ("angle_limit_V".to_owned(), format!("{}", scales.angle_limit_V)),
            ("pulse_s".to_owned(), format!("{pulse_s}")),
            ("sequence".to_owned(), format!("{:?}", self.sequence).to_lowercase()),
            ("shape".to_owned(), format!("{:?}", self.shape).to_lowercase()),
        ];
        notes.extend(latitude_deg.map(|latitude| ("latitude_deg".to_owned(), format!("{latitude}"))));
        Ok(Log::new(path, columns, notes)?)
    }
}

/// The stand's drive turns the platform, by an angle from where it stood first; the encoder counts to the left, azimuths go to the right.
async fn drive_to<S: Stand>(stand: &mut S, turned_rad: f64, origin_rad: &mut Option<f64>) -> Result<(), Trouble> {
    let angle = async |stand: &mut S| -> Result<f64, Trouble> {
        let says = stand.ask("MEASure:ANGLe?").await?;
        let word = says.split(' ').next().unwrap_or_default();
        word.parse().map_err(|_| Trouble::Other(format!("MEASure:ANGLe? is no number: `{says}`")))
    };
    let origin = match *origin_rad {
        Some(origin) => origin,
        None => *origin_rad.insert(angle(stand).await?),
    };
    let goal = origin - turned_rad;
    for order in ["SOURce:MODE POSition".to_owned(), format!("SOURce:POSition {goal:e} RAD"), "OUTPut ON".to_owned()] {
        stand.tell(&order).await?;
    }
    let mut off = f64::INFINITY;
    for _ in 0..150 {
        stand.wait_s(0.2).await?;
        off = angle(stand).await? - goal;
        if off.abs() < 5e-4 {
            // Until it is still.
            stand.wait_s(2.0).await?;
            return Ok(());
        }
    }
    Err(Trouble::Other(format!("the platform stands {} rad from where it should be turned to", crate::report::significant(off, 2))))
}

/// A person turns it and says so.
fn by_hand(place: &Place) -> Result<(), Trouble> {
    let [turned, raised, rolled] =
        [place.turned_rad, place.raised_rad, place.rolled_rad].map(|rad| crate::report::plain(rad.to_degrees(), 6));
    eprintln!("Turn the gyro to {turned}° (raised {raised}°, rolled {rolled}°), level it, and press Enter when it stands.");
    let mut line = String::new();
    let stdin = std::io::stdin();
    let count = stdin.lock().read_line(&mut line).map_err(|e| Trouble::Other(format!("standard input: {e}")))?;
    if count == 0 {
        let who = if stdin.is_terminal() { "" } else { " (standard input has ended)" };
        return Err(Trouble::Input(format!("no turn: nobody said that the gyro stands at {turned}°{who}")));
    }
    Ok(())
}
