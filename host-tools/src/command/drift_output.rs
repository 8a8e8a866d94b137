//! Options and output that `stand drift compute` and `stand drift run` share.

use clap::Args;

use super::error::CliError;
use super::output::ReportOutput;
use crate::drift::measurement::SetupUncertainties;
use crate::drift::{DEG_H, DriftResult};
use crate::report::drift as report;

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
}

impl Uncertainties {
    /// The values in SI units.
    pub(super) fn setup(&self) -> SetupUncertainties {
        SetupUncertainties {
            turn_error_rad: self.turn_error * ARCMIN,
            level_error_rad: self.level_error * DEG_H,
            gain_error: self.gain_error / 100.0,
        }
    }
}

/// Writes the result as text, HTML and JSON.
pub(super) fn write_report(output: &ReportOutput, result: &DriftResult) -> Result<(), CliError> {
    output.text(&report::text(result))?;
    output.html(|| report::html(result))?;
    output.json(|| report::json(result))
}
