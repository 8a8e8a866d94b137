//! `stand observer track`.

use std::path::PathBuf;

use clap::Args;

use super::options::{DesignOptions, ObserverKind};
use crate::error::CliError;
use crate::import::ImportOptions;
use crate::output::{JsonOutput, Overwrite};
use identification::log::{Format, Log};
use stand_analysis::observer::Plant;
use stand_analysis::observer::recorded::{COLUMNS, row_interval_s};
use stand_report::observer::{track_json, track_text};

/// Run an observer over a recorded log. Columns: angle_sensor_V or alpha_rad; columns with the names of the states and moment_N_m are the
/// truth.
#[derive(Debug, Args)]
pub(crate) struct Track {
    /// The log, .csv or .parquet
    log: PathBuf,
    /// The element: a preset or a .toml file with [six_state] or [four_state]
    #[arg(long, value_name = "MODEL", default_value = "astatic-identifier-recovered")]
    model: String,
    #[command(flatten)]
    design: DesignOptions,
    /// Gain of the angle sensor, V/rad; default: the note angle_gain_V_rad
    #[arg(long, value_name = "V_RAD", allow_negative_numbers = true)]
    angle_gain: Option<f64>,
    /// Moment per current, N m/A: the current torquer_A acts on the element
    #[arg(long, value_name = "N_M_A", allow_negative_numbers = true)]
    torquer: Option<f64>,
    /// Write the estimates, and the truth, to this log
    #[arg(long, value_name = "LOG")]
    out: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    json: JsonOutput,
}

impl Track {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        if let Some(out) = &self.out {
            self.overwrite.check(out)?;
            Format::of(out)?;
        }
        if let Some(torquer) = self.torquer.filter(|torquer| !torquer.is_finite()) {
            return Err(CliError::Input(format!("--torquer {torquer} is not a finite number")));
        }
        self.import.apply([self.log.as_path()])?;
        let log = Log::read_also(&self.log, &COLUMNS)?;
        let step_s = row_interval_s(&log)?;
        let design = self.design.request(Plant::named(&self.model)?, Some(ObserverKind::Augmented), Some(step_s))?.design()?;
        let tracked = design.track(&log, self.angle_gain, self.torquer)?;
        if let Some(out) = &self.out {
            tracked.log(out)?.write(out)?;
        }
        let name = self.log.display().to_string();
        self.json.text(&track_text(&name, &design, &tracked))?;
        self.json.json(|| track_json(&name, &design, &tracked))
    }
}
