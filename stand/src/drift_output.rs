//! Options and output that `stand drift compute` and `stand drift run` share.

use clap::Args;

use super::error::CliError;
use super::output::{ReportOutput, UnitOptions};
use stand_analysis::drift::measurement::{
    DEFAULT_LATITUDE_ERROR_RAD, DEFAULT_TORQUER_ASYMMETRY, DEFAULT_TORQUER_GAIN_ERROR, SetupUncertainties,
};
use stand_analysis::drift::{DEG_H, DriftResult};
use stand_report::drift as report;

const ARCMIN: f64 = std::f64::consts::PI / 180.0 / 60.0;

/// Standard uncertainties of the setup.
#[derive(Debug, Clone, Args)]
pub(super) struct Uncertainties {
    /// Standard uncertainty of the turn between two positions, arcminutes
    #[arg(long, value_name = "ARCMIN", default_value_t = 0.0, allow_negative_numbers = true)]
    pub turn_error: f64,
    /// Standard uncertainty of the level, arcseconds
    #[arg(long, value_name = "ARCSEC", default_value_t = 0.0, allow_negative_numbers = true)]
    pub level_error: f64,
    /// Relative standard uncertainty of the angle sensor's gain, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 0.0, allow_negative_numbers = true)]
    pub gain_error: f64,
    /// Relative standard uncertainty of the torquer's gain K_m/H in the correction by the current, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 100.0 * DEFAULT_TORQUER_GAIN_ERROR, allow_negative_numbers = true)]
    pub torquer_gain_error: f64,
    /// Standard uncertainty of the latitude, degrees
    #[arg(long, value_name = "DEG", default_value_t = DEFAULT_LATITUDE_ERROR_RAD.to_degrees(), allow_negative_numbers = true)]
    pub latitude_error: f64,
    /// Bound of the asymmetry of the torquer's gain between both signs, percent; acts where the pulses have one amplitude, which does not
    /// show it
    #[arg(long, value_name = "PERCENT", default_value_t = 100.0 * DEFAULT_TORQUER_ASYMMETRY, allow_negative_numbers = true)]
    pub torquer_asymmetry: f64,
}

impl Uncertainties {
    /// The values in SI units.
    pub(super) fn setup(&self) -> SetupUncertainties {
        SetupUncertainties {
            turn_error_rad: self.turn_error * ARCMIN,
            level_error_rad: self.level_error * DEG_H,
            gain_error: self.gain_error / 100.0,
            torquer_gain_error: self.torquer_gain_error / 100.0,
            latitude_error_rad: self.latitude_error.to_radians(),
            torquer_asymmetry: self.torquer_asymmetry / 100.0,
        }
    }
}

/// Writes the result as text, HTML and JSON.
pub(super) fn write_report(output: &ReportOutput, units: UnitOptions, result: &DriftResult) -> Result<(), CliError> {
    let units = units.units.unwrap_or_default();
    output.text(&report::text(result, units))?;
    output.html(|| report::html(result, units))?;
    output.json(|| report::json(result, units))
}
