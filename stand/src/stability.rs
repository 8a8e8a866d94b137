//! `stand stability`: rate stability over parts of a turn and whole turns.

use std::path::PathBuf;

use clap::Args;

use super::error::CliError;
use super::import::ImportOptions;
use super::output::{ReportOutput, UnitOptions};
use identification::log::Log;
use stand_analysis::stability::{StabilitySettings, of_log};
use stand_report::stability as report;

/// Rate stability of the platform: standard deviation of the mean rates over windows of 1°, 10°, 360° and whole turns, on each plateau of
/// constant rate.
#[derive(Debug, Args)]
pub(super) struct Stability {
    /// The log, with theta_rad; turn_s for whole turns; rate_cmd_rad_s for the plateaus
    log: PathBuf,
    /// Time at the beginning of each plateau that is left out, s
    #[arg(long, value_name = "S", default_value_t = StabilitySettings::default().settle_s, allow_negative_numbers = true)]
    settle: f64,
    /// Largest accepted standard deviation, ppm of the rate: each width is compared with it
    #[arg(long, value_name = "PPM", allow_negative_numbers = true)]
    limit: Option<f64>,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    units: UnitOptions,
    #[command(flatten)]
    output: ReportOutput,
}

impl Stability {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        self.import.apply([self.log.as_path()])?;
        let log = Log::read(&self.log)?;
        let name = self.log.display().to_string();
        let settings = StabilitySettings { settle_s: self.settle, limit: self.limit.map(|ppm| ppm * 1e-6) };
        let plateaus = of_log(&log, settings)?;
        let units = self.units.units.unwrap_or_default();
        self.output.text(&report::text(&name, &plateaus, units))?;
        self.output.html(|| report::html(&name, &plateaus, units))?;
        self.output.json(|| report::json(&name, &plateaus, units))
    }
}
