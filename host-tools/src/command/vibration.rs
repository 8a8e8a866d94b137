//! `stand vibration compensate`: the effect of vibration on an azimuth, and its correction.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::error::CliError;
use super::output::ReportOutput;
use crate::log::Log;
use crate::observer::vibration::compensate;
use crate::observer::vibration_log::{COLUMNS, VibrationLog, VibrationLogError};
use crate::observer::{Element, Kind, Plant, Poles, Request};
use crate::report::observer::{vibration_html, vibration_json, vibration_text};

#[derive(Debug, Subcommand)]
pub(super) enum VibrationCommand {
    /// Correct the mean azimuth for the constant error due to vibration, with estimated rates and with exact rates if the log has them
    Compensate(Compensate),
}

impl VibrationCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        match self {
            Self::Compensate(compensate) => compensate.run(),
        }
    }
}

/// Columns of the log: gamma_rad, and alpha_rad or angle_sensor_V; optionally the exact rates alpha_rate_rad_s and beta_rate_rad_s.
#[derive(Debug, Args)]
pub(super) struct Compensate {
    /// The log, .csv or .parquet
    log: PathBuf,
    /// The element: a preset with four states or a .toml file with [four_state]
    #[arg(long, value_name = "MODEL", default_value = "rate-observer")]
    model: String,
    /// All poles of the observer at −W, 1/s
    #[arg(long, visible_alias = "w0", value_name = "W", default_value_t = 100.0, allow_negative_numbers = true)]
    omega: f64,
    /// Frequency of the vibration, Hz; default: the largest spectral line of gamma_rad
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    vibration_hz: Option<f64>,
    /// Gain of the angle sensor, V/rad; default: the note angle_gain_V_rad
    #[arg(long, value_name = "V_RAD", allow_negative_numbers = true)]
    angle_gain: Option<f64>,
    #[command(flatten)]
    output: ReportOutput,
}

impl From<VibrationLogError> for CliError {
    fn from(error: VibrationLogError) -> Self {
        CliError::Input(error.to_string())
    }
}

impl Compensate {
    fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let plant = Plant::named(&self.model)?;
        let Element::Four(element) = plant.element else {
            return Err(CliError::Input(format!("{}: the correction needs an element with four states ([four_state])", self.model)));
        };
        let log = Log::read_also(&self.log, &COLUMNS)?;
        let record = VibrationLog::of(&log, self.angle_gain)?;
        let measured = record.measured();
        let request = Request {
            plant,
            poles: Poles::Binomial(self.omega),
            kind: Kind::Static,
            step_s: Some(measured.step_s),
            vibration_Hz: self.vibration_hz,
        };
        let mut design = request.design()?;
        let corrected = compensate(&measured, &element, &design, self.vibration_hz).map_err(|e| CliError::in_file(&self.log, e))?;
        design.request.vibration_Hz = Some(corrected.vibration_Hz);
        let warnings = design.warnings();
        self.output.text(&vibration_text(&corrected, &warnings))?;
        self.output.json(|| vibration_json(&corrected, &warnings))?;
        self.output.html(|| vibration_html(&self.log.display().to_string(), &measured, &corrected, &warnings))
    }
}
