//! `stand records`: lists the records of calibrations, shows one, or reports the trend of a device.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};

use super::error::CliError;
use super::output::{JsonOutput, ReportOutput, spinner};
use crate::calibrate::DutKind;
use crate::calibrate::archive::{ArchivedRecord, find_records};
use crate::calibrate::trend::{TrendSelection, trend_of_device};
use crate::report::calibration as report;

#[derive(Debug, Subcommand)]
pub(super) enum Records {
    /// The records below a folder, one line each
    List(List),
    /// One record: values, budgets, and verification against its raw logs
    Show(Show),
    /// Trend of one device under test: changes and their significance
    Trend(Trend),
}

/// The records below a folder, one line each.
#[derive(Debug, Args)]
pub(super) struct List {
    /// Folder to search, with all subfolders
    folder: PathBuf,
    #[command(flatten)]
    json: JsonOutput,
}

/// One record: values, budgets, and verification against its raw logs.
#[derive(Debug, Args)]
pub(super) struct Show {
    /// A file record.json, or the folder of a session
    record: PathBuf,
    #[command(flatten)]
    json: JsonOutput,
}

/// Kind of the calibrated device.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum RecordKind {
    /// A rate gyro
    Gyro,
    /// An accelerometer
    Accel,
    /// The drive of a stand
    Drive,
}

/// Trend of one device under test: changes and their significance.
#[derive(Debug, Args)]
pub(super) struct Trend {
    /// Folder to search, with all subfolders
    folder: PathBuf,
    /// Serial number of the device under test
    #[arg(long, value_name = "S")]
    serial: String,
    /// Kind of the device, if several devices have this serial number
    #[arg(long, value_enum)]
    what: Option<RecordKind>,
    /// Only this quantity
    #[arg(long, value_name = "NAME")]
    quantity: Option<String>,
    #[command(flatten)]
    output: ReportOutput,
}

impl Records {
    pub(super) fn run(self) -> Result<(), CliError> {
        match self {
            Records::List(list) => list.run(),
            Records::Show(show) => show.run(),
            Records::Trend(trend) => trend.run(),
        }
    }
}

/// The records below a folder, and the messages about skipped files.
fn records_and_messages(folder: &Path) -> Result<(Vec<ArchivedRecord>, Vec<String>), CliError> {
    let (records, skipped) = find_records(folder)?;
    Ok((records, skipped.iter().map(ToString::to_string).collect()))
}

impl List {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let (records, skipped) = records_and_messages(&self.folder)?;
        self.json.text(&report::list_text(&records, &skipped))?;
        self.json.json(|| report::list_json(&records, &skipped))
    }
}

impl Show {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let archived = ArchivedRecord::read(&self.record)?;
        let bar = spinner("recomputing from the raw logs");
        let verification = archived.verify();
        bar.finish_and_clear();
        self.json.text(&report::show_text(&archived.record, &verification))?;
        self.json.json(|| report::show_json(&archived.record, &verification))
    }
}

impl Trend {
    fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let (records, skipped) = records_and_messages(&self.folder)?;
        let selection = TrendSelection {
            serial: &self.serial,
            dut_kind: self.what.map(|kind| match kind {
                RecordKind::Gyro => DutKind::Gyro,
                RecordKind::Accel => DutKind::Accel,
                RecordKind::Drive => DutKind::Drive,
            }),
            quantity: self.quantity.as_deref(),
        };
        let trend = trend_of_device(&records, &selection).map_err(|e| CliError::in_file(&self.folder, e))?;
        self.output.text(&report::trend_text(&trend))?;
        self.output.text(&report::skipped_text(&skipped))?;
        self.output.html(|| report::trend_html(&trend))?;
        self.output.json(|| report::trend_json(&trend))
    }
}
