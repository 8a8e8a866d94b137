//! `stand convert`: a log in the other format.

use std::path::PathBuf;

use clap::Args;

use super::error::CliError;
use super::import::ImportOptions;
use super::output::{JsonOutput, Overwrite};
use identification::log::{Format, Log, LogWarning, Note};
use stand_report::conversion as report;

/// Convert a log between CSV and Parquet; columns, numbers and notes stay as they are.
#[derive(Debug, Args)]
pub(super) struct Convert {
    /// The log, .csv or .parquet
    log: PathBuf,
    /// The log to write, .csv or .parquet
    out: PathBuf,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    json: JsonOutput,
}

impl Convert {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        Format::of(&self.out)?;
        self.overwrite.check(&self.out)?;
        self.import.apply([self.log.as_path()])?;
        let mut log = Log::read_all(&self.log)?;
        if log.warnings().iter().any(|warning| matches!(warning, LogWarning::EndMissing { .. })) {
            // The new file has an end, so that it must say what the old one lacked.
            let last_s = log.t_s().last().copied().unwrap_or(0.0);
            log.add_note(Note::Ended(format!("the end of {} is missing", self.log.display()), last_s));
        }
        log.write(&self.out)?;
        self.json.text(&report::text(&log, &self.out))?;
        self.json.json(|| report::json(&log, &self.out))
    }
}
