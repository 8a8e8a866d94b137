//! `stand drift`: a gyro's drift by pulses of alternating sign.

mod run;

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use serde_json::json;

use super::error::CliError;
use super::output::{JsonOutput, ReportOutput};
use crate::drift::advise::advise;
use crate::drift::compute::{COLUMNS, Given, measured};
use crate::drift::{Answer, DEG_H, DriftError, platform};
use crate::log::Log;
use crate::report::drift as page;
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
    /// Greatest rate of a pulse, °/s; two of them (0.05,0.02) tell a torquer that is stronger one way from the drift, each with all cycles
    #[arg(long, value_name = "DEG_S", default_value = "0.05", value_delimiter = ',', allow_negative_numbers = true)]
    rate: Vec<f64>,
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
    output: ReportOutput,
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
    output: ReportOutput,
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
    output: ReportOutput,
}

#[derive(Debug, Args)]
pub(super) struct Platform {
    /// The log, with theta_rad and gyro_rad_s
    log: PathBuf,
    /// For how long the platform turns each way, s
    #[arg(long, value_name = "S", default_value_t = 5.0, allow_negative_numbers = true)]
    pulse: f64,
    #[command(flatten)]
    json: JsonOutput,
}

impl From<DriftError> for CliError {
    fn from(error: DriftError) -> Self {
        CliError::Input(error.to_string())
    }
}

impl Drift {
    pub(super) fn run(self) -> Result<(), CliError> {
        match self {
            Drift::Run(run) => run.run(),
            Drift::Compute(compute) => compute.run(),
            Drift::Advise(advise) => advise.run(),
            Drift::Platform(platform) => platform.run(),
        }
    }
}

fn tell(output: &ReportOutput, answer: &Answer) -> Result<(), CliError> {
    output.text(&page::text(answer))?;
    output.html(|| page::html(answer))?;
    output.json(|| answer.json())
}

impl Compute {
    fn run(self) -> Result<(), CliError> {
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
    fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let log = Log::read(&self.log)?;
        let name = self.log.display().to_string();
        let note = log.notes().number("angle_gain_V_rad");
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
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let log = Log::read(&self.log)?;
        let name = self.log.display().to_string();
        let found = platform::of_log(&log, self.pulse)?;
        self.json.text(&page::platform_text(&name, &found))?;
        self.json.json(|| {
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
