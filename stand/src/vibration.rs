//! `stand vibration compensate`: the effect of vibration on an azimuth, and its correction.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::error::CliError;
use super::import::ImportOptions;
use super::output::ReportOutput;
use identification::log::Log;
use stand_analysis::observer::Plant;
use stand_analysis::observer::vibration::VibrationUncertainties;
use stand_analysis::observer::vibration_log::{COLUMNS, CorrectedLog, VibrationLog};
use stand_report::observer::{vibration_html, vibration_json, vibration_text};

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
    /// Standard uncertainty of the gain of the roll channel, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 1.0, allow_negative_numbers = true)]
    gamma_gain_error: f64,
    /// Standard uncertainty of the delay of the roll channel against the azimuth, ms
    #[arg(long, value_name = "MS", default_value_t = 0.5, allow_negative_numbers = true)]
    gamma_delay_error: f64,
    /// Standard uncertainty of the rotation of the roll sensor about the vertical, mrad
    #[arg(long, value_name = "MRAD", default_value_t = 5.0, allow_negative_numbers = true)]
    gamma_misalignment: f64,
    /// Standard uncertainty of the offset of the roll channel, mrad
    #[arg(long, value_name = "MRAD", default_value_t = 1.0, allow_negative_numbers = true)]
    gamma_offset: f64,
    /// Relative standard uncertainty of the element's H/k and (Jx - Jz)/k, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 1.0, allow_negative_numbers = true)]
    element_error: f64,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    output: ReportOutput,
}

impl Compensate {
    fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let plant = Plant::named(&self.model)?;
        self.import.apply([self.log.as_path()])?;
        let log = Log::read_also(&self.log, &COLUMNS)?;
        let record = VibrationLog::of(&log, self.angle_gain)?;
        let uncertainties = VibrationUncertainties {
            gamma_gain: self.gamma_gain_error / 100.0,
            gamma_delay_s: self.gamma_delay_error * 1e-3,
            gamma_misalignment_rad: self.gamma_misalignment * 1e-3,
            gamma_offset_rad: self.gamma_offset * 1e-3,
            element: self.element_error / 100.0,
        }
        .checked()?;
        let CorrectedLog { compensated, warnings } = record.corrected(&self.model, plant, self.omega, self.vibration_hz, &uncertainties)?;
        self.output.text(&vibration_text(&compensated, &warnings))?;
        self.output.json(|| vibration_json(&compensated, &warnings))?;
        self.output.html(|| vibration_html(&self.log.display().to_string(), &record.measured(), &compensated, &warnings))
    }
}
