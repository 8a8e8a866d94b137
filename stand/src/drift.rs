//! `stand drift`: drift of a gyroscope by pulses of alternating sign.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::drift_output::{Uncertainties, write_report};
use super::drift_run::Run;
use super::error::{CliError, options};
use super::import::ImportOptions;
use super::output::{ReportOutput, UnitOptions};
use identification::log::Log;
use stand_analysis::drift::compute::{COLUMNS, DriftSettings, measurement};
use stand_analysis::drift::pulse_advice::advise;
use stand_analysis::drift::{DriftError, platform};
use stand_report::drift as report;

/// Measure the drift of a gyroscope, or compute it from logs
#[derive(Debug, Subcommand)]
pub(super) enum Drift {
    /// Measure: the firmware runs the cycles in two or more positions, on the simulated stand or over a port
    Run(Box<Run>),
    /// Compute from logs with angle_sensor_V and torquer_A
    Compute(Compute),
    /// Recommend the pulse duration, from a log of the angle sensor without pulses
    Advise(Advise),
    /// Apply the method to a rate gyro on the turning platform: bias and scale
    Platform(Platform),
}

#[derive(Debug, Args)]
pub(super) struct Compute {
    /// Logs, .csv or .parquet; several form one measurement
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// K_k, V/rad; without it by the note angle_gain_V_rad
    #[arg(long, value_name = "V_RAD", allow_negative_numbers = true)]
    angle_gain: Option<f64>,
    /// K_m/H, rad/s/A; without it by the note torquer_gain_rad_s_A
    #[arg(long, value_name = "RAD_S_A", allow_negative_numbers = true)]
    torquer_gain: Option<f64>,
    /// Duration of one pulse, s; without it by the note pulse_s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pulse: Option<f64>,
    /// End of the angle sensor's range, V; without it by the note angle_limit_V
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    angle_limit: Option<f64>,
    /// Latitude, degrees; without it by the note latitude_deg
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    latitude: Option<f64>,
    #[command(flatten)]
    uncertainties: Uncertainties,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    units: UnitOptions,
    #[command(flatten)]
    output: ReportOutput,
}

#[derive(Debug, Args)]
pub(super) struct Advise {
    /// The log
    log: PathBuf,
    /// Wanted duration of a pulse, s
    #[arg(long, value_name = "S", default_value_t = 5.0, allow_negative_numbers = true)]
    pulse: f64,
    /// K_k, V/rad; without it by the note angle_gain_V_rad
    #[arg(long, value_name = "V_RAD", allow_negative_numbers = true)]
    angle_gain: Option<f64>,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    output: ReportOutput,
}

#[derive(Debug, Args)]
pub(super) struct Platform {
    /// The log, with theta_rad and gyro_rad_s
    log: PathBuf,
    /// Duration of the rotation in each direction, s; default: the median time between reversals
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pulse: Option<f64>,
    /// Latitude, degrees, north positive: the Earth rate is subtracted from the bias (platform axis vertical)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    latitude: Option<f64>,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    units: UnitOptions,
    #[command(flatten)]
    output: ReportOutput,
}

impl From<DriftError> for CliError {
    fn from(error: DriftError) -> Self {
        CliError::Input(format!("{}{}", report::error_text(&error), options(&error)))
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

impl Compute {
    fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let settings = DriftSettings {
            angle_gain_V_rad: self.angle_gain,
            torquer_gain_rad_s_A: self.torquer_gain,
            pulse_s: self.pulse,
            angle_limit_V: self.angle_limit,
            latitude_deg: self.latitude,
            uncertainties: self.uncertainties.setup(),
        };
        self.import.apply(self.logs.iter().map(PathBuf::as_path))?;
        let logs = self.logs.iter().map(|path| Log::read_also(path, &COLUMNS)).collect::<Result<Vec<_>, _>>()?;
        write_report(&self.output, self.units, &measurement(&logs, &settings)?.evaluate()?)
    }
}

impl Advise {
    fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        self.import.apply([self.log.as_path()])?;
        let log = Log::read(&self.log)?;
        let name = self.log.display().to_string();
        let advice = advise(&log, self.angle_gain, self.pulse)?;
        self.output.text(&report::advice_text(&name, &advice))?;
        self.output.html(|| report::advice_html(&name, &advice))?;
        self.output.json(|| report::advice_json(&name, &advice))
    }
}

impl Platform {
    fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        self.import.apply([self.log.as_path()])?;
        let log = Log::read(&self.log)?;
        let name = self.log.display().to_string();
        let settings = platform::PlatformSettings { pulse_s: self.pulse, latitude_deg: self.latitude };
        let result = platform::of_log(&log, settings)?;
        let units = self.units.units.unwrap_or_default();
        self.output.text(&report::platform_text(&name, &result, units))?;
        self.output.html(|| report::platform_html(&name, &result, units))?;
        self.output.json(|| report::platform_json(&name, &result, units))
    }
}
