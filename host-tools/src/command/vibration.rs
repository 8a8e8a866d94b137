//! `stand vibration compensate LOG`: what vibration does to an azimuth, taken off.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::error::CliError;
use super::output::ReportOutput;
use crate::log::Log;
use crate::observer::vibration::{Measured, compensate};
use crate::observer::{Element, Kind, Plant, Poles, Request};
use crate::report::observer::{vibration_html, vibration_json, vibration_text};

/// Columns beside those of interfaces.md.
const COLUMNS: [&str; 4] = ["alpha_rad", "gamma_rad", "alpha_rate_rad_s", "beta_rate_rad_s"];
/// Intervals may differ by this share: the observer runs at one step.
const UNEVEN: f64 = 1e-3;

#[derive(Debug, Subcommand)]
pub(super) enum VibrationCommand {
    /// Take the constant error that vibration leaves off the mean azimuth, by the estimated rate, and by the exact one where the log has it
    Compensate(Compensate),
}

impl VibrationCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        match self {
            Self::Compensate(compensate) => compensate.run(),
        }
    }
}

/// Columns: gamma_rad, and alpha_rad or angle_sensor_V; exact rates as alpha_rate_rad_s and beta_rate_rad_s.
#[derive(Debug, Args)]
pub(super) struct Compensate {
    /// The log, .csv or .parquet
    log: PathBuf,
    /// The element: a preset of four states or a .toml with [four_state]
    #[arg(long, value_name = "MODEL", default_value = "rate-observer")]
    model: String,
    /// Poles of the observer at −W, 1/s
    #[arg(long, visible_alias = "w0", value_name = "W", default_value_t = 100.0, allow_negative_numbers = true)]
    omega: f64,
    /// Frequency of the vibration, Hz; usually the greatest line of gamma_rad
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    vibration_hz: Option<f64>,
    /// Gain of the angle sensor, V/rad; usually the log's note `angle_gain_V_rad`
    #[arg(long, value_name = "V_RAD", allow_negative_numbers = true)]
    angle_gain: Option<f64>,
    #[command(flatten)]
    output: ReportOutput,
}

impl Compensate {
    fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let plant = Plant::named(&self.model)?;
        let Element::Four(element) = plant.element else {
            return Err(CliError::Input(format!("{}: vibration is corrected with the element of four states", self.model)));
        };
        let log = Log::read_also(&self.log, &COLUMNS)?;
        let name = self.log.display().to_string();
        let (alpha, gamma) = (self.alpha_rad(&log, &name)?, column(&log, "gamma_rad").ok_or_else(|| lacks(&name, "gamma_rad"))?);
        let t_s = column(&log, "t_s").ok_or_else(|| lacks(&name, "t_s"))?;
        let step_s = (t_s[t_s.len() - 1] - t_s[0]) / (t_s.len().max(2) - 1) as f64;
        if let Some(row) = t_s.windows(2).position(|w| ((w[1] - w[0]) / step_s - 1.0).abs() > UNEVEN) {
            return Err(CliError::Input(format!(
                "{name}: row {}, column t_s: the rows are not evenly spaced, and the observer runs at one step",
                row + 2
            )));
        }
        let exact = column(&log, "alpha_rate_rad_s").zip(column(&log, "beta_rate_rad_s"));
        let vibration_Hz = self.vibration_hz;
        let request = Request { plant, poles: Poles::Binomial(self.omega), kind: Kind::Static, step_s: Some(step_s), vibration_Hz };
        let mut design = request.design()?;
        let measured = Measured { step_s, alpha_rad: &alpha, gamma_rad: gamma, exact };
        let found = compensate(&measured, &element, &design, vibration_Hz).map_err(|e| CliError::Input(format!("{name}: {e}")))?;
        design.request.vibration_Hz = Some(found.vibration_Hz);
        let warnings = design.warnings();
        self.output.text(&vibration_text(&found, &warnings))?;
        self.output.json(|| vibration_json(&found, &warnings))?;
        self.output.html(|| vibration_html(&name, &measured, &found, &warnings))
    }

    /// The azimuth, from its own column or from the angle sensor's.
    fn alpha_rad(&self, log: &Log, name: &str) -> Result<Vec<f64>, CliError> {
        if let Some(alpha) = column(log, "alpha_rad") {
            return Ok(alpha.to_vec());
        }
        let volts = column(log, "angle_sensor_V").ok_or_else(|| lacks(name, "alpha_rad or angle_sensor_V"))?;
        let noted = log.notes().number("angle_gain_V_rad");
        let gain: f64 =
            self.angle_gain.or(noted).ok_or_else(|| CliError::Input(format!("{name}: no note `angle_gain_V_rad`: give --angle-gain")))?;
        if !(gain.is_finite() && gain != 0.0) {
            return Err(CliError::Input(format!("angle gain {gain} V/rad: must be a number other than 0")));
        }
        Ok(volts.iter().map(|volts| volts / gain).collect())
    }
}

fn column<'a>(log: &'a Log, name: &str) -> Option<&'a [f64]> {
    log.columns().iter().find(|column| column.name == name).map(|column| column.values.as_slice())
}

fn lacks(name: &str, column: &str) -> CliError {
    CliError::Input(format!("{name}: the log has no column {column}"))
}
