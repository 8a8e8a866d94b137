//! `stand records`: lists the records of calibrations, shows one, evaluates one at a rate, reports the trend of a device; fills and exports
//! a record store.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};

use super::error::{CliError, options};
use super::output::{JsonOutput, Overwrite, ReportOutput, UnitOptions, spinner, write};
use stand_analysis::calibrate::DutKind;
use stand_analysis::calibrate::response_function::EvaluateError;
use stand_records::archive::{ArchivedRecord, find_records};
use stand_records::store::{RecordStore, StoreError};
use stand_records::trend::{TrendSelection, trend_of_device};
use stand_report::calibration as report;

#[derive(Debug, Subcommand)]
pub(super) enum Records {
    /// The records below a folder, one line each
    List(List),
    /// One record: values, budgets, and verification against its raw logs
    Show(Show),
    /// Trend of one device under test: changes and their significance
    Trend(Trend),
    /// Output of the calibrated device at a rate, or the rate that belongs to an output, with the uncertainty there
    Evaluate(Evaluate),
    /// Add sessions with their raw logs to a record store
    Add(Add),
    /// Quantities of all sessions of a record store as CSV
    Export(Export),
}

/// Output of the calibrated device at a rate, or the rate that belongs to an output, with the uncertainty there.
#[derive(Debug, Args)]
#[group(id = "at", required = true, multiple = false, args = ["rate", "reading"])]
pub(super) struct Evaluate {
    /// A file record.json, the folder of a session, or a record store with --session
    record: PathBuf,
    /// Rates, rad/s
    #[arg(long, value_name = "RATE", allow_hyphen_values = true, value_delimiter = ',')]
    rate: Vec<f64>,
    /// Outputs of the device, rad/s; the noise of a reading is not part of the result
    #[arg(long, value_name = "OUTPUT", allow_hyphen_values = true, value_delimiter = ',')]
    reading: Vec<f64>,
    /// Number of the session in a record store
    #[arg(long, value_name = "N")]
    session: Option<i64>,
    #[command(flatten)]
    units: UnitOptions,
    #[command(flatten)]
    json: JsonOutput,
}

/// Add sessions with their raw logs to a record store.
#[derive(Debug, Args)]
pub(super) struct Add {
    /// Folder of the store; it is created where there is none
    store: PathBuf,
    /// Folders of sessions
    #[arg(required = true)]
    sessions: Vec<PathBuf>,
    #[command(flatten)]
    json: JsonOutput,
}

/// Quantities of all sessions of a record store as CSV.
#[derive(Debug, Args)]
pub(super) struct Export {
    /// Folder of the store
    store: PathBuf,
    /// The CSV file
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    json: JsonOutput,
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
    /// A file record.json, the folder of a session, or a record store with --session
    record: PathBuf,
    /// Number of the session in a record store
    #[arg(long, value_name = "N")]
    session: Option<i64>,
    #[command(flatten)]
    units: UnitOptions,
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
            Records::Evaluate(evaluate) => evaluate.run(),
            Records::Add(add) => add.run(),
            Records::Export(export) => export.run(),
        }
    }
}

impl From<StoreError> for CliError {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Session { .. } | StoreError::NoRecord { .. } | StoreError::Journal(_) => CliError::Input(error.to_string()),
            StoreError::Database { .. } | StoreError::File { .. } => CliError::Other(error.to_string()),
        }
    }
}

/// A record, with its number if it is one of a store.
type NumberedRecord = (Option<i64>, ArchivedRecord);

/// The records below a folder or in a store, and the messages about skipped files.
fn records_and_messages(folder: &Path) -> Result<(Vec<NumberedRecord>, Vec<String>), CliError> {
    if RecordStore::is_store(folder) {
        let records = RecordStore::open(folder)?.records()?;
        return Ok((records.into_iter().map(|(number, record)| (Some(number), record)).collect(), Vec::new()));
    }
    let (records, skipped) = find_records(folder)?;
    Ok((records.into_iter().map(|record| (None, record)).collect(), skipped.iter().map(ToString::to_string).collect()))
}

/// A record by its file or folder, or by its number in a store. The folder of a store's session exists as long as the returned guard.
fn one_record(path: &Path, session: Option<i64>) -> Result<(ArchivedRecord, Option<tempfile::TempDir>), CliError> {
    let Some(number) = session else {
        if RecordStore::is_store(path) {
            return Err(CliError::in_file(path, "a record store has several sessions: --session selects one"));
        }
        return Ok((ArchivedRecord::read(path)?, None));
    };
    if !RecordStore::is_store(path) {
        return Err(CliError::in_file(path, "--session: not a record store"));
    }
    let folder = tempfile::tempdir().map_err(|e| CliError::file(&std::env::temp_dir(), "write", &e))?;
    let record = RecordStore::open(path)?.check_out(number, folder.path())?;
    Ok((record, Some(folder)))
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
        let (archived, _folder) = one_record(&self.record, self.session)?;
        let bar = spinner("recomputing from the raw logs");
        let verification = archived.verify();
        bar.finish_and_clear();
        let displayed = report::displayed_record(&archived.record, &self.units.units.unwrap_or_default());
        self.json.text(&report::show_text(&displayed, &verification))?;
        self.json.json(|| report::show_json(&archived.record, &verification))
    }
}

impl Evaluate {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let (archived, _folder) = one_record(&self.record, self.session)?;
        let Some(function) = &archived.record.header.response_function else {
            return Err(CliError::in_file(
                &archived.path,
                "the record has no characteristic over the rate; `stand calibrate gyro` makes one",
            ));
        };
        let at_rates = self.rate.iter().map(|rate| Ok((*rate, function.output_at(*rate)?)));
        let of_readings = self.reading.iter().map(|output| Ok((*output, function.input_of(*output)?)));
        let values = at_rates.chain(of_readings).collect::<Result<Vec<_>, EvaluateError>>().map_err(|e| CliError::Input(e.to_string()))?;
        let units = self.units.units.unwrap_or_default();
        let displayed: Vec<_> = values.iter().map(|(at, q)| (*at, report::displayed(q, &units))).collect();
        self.json.text(&report::evaluated_text(function, &displayed))?;
        self.json.json(|| report::evaluated_json(function, &values))
    }
}

impl Add {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let mut store = RecordStore::open(&self.store)?;
        let mut added = Vec::new();
        for folder in &self.sessions {
            let number = store.add(folder)?;
            // Printed once the session is on the disk.
            self.json.text(&format!("{}: session {number} of {}\n", folder.display(), self.store.display()))?;
            added.push((folder.as_path(), number));
        }
        self.json.json(|| report::added_json(&added))
    }
}

impl Export {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        self.overwrite.check(&self.out)?;
        if !RecordStore::is_store(&self.store) {
            return Err(CliError::in_file(&self.store, "not a record store; `stand records add` makes one"));
        }
        let rows = RecordStore::open(&self.store)?.quantities()?;
        write(&self.out, &report::export_csv(&rows))?;
        self.json.text(&format!("{}: {} quantities\n", self.out.display(), rows.len()))?;
        self.json.json(|| report::export_json(&rows))
    }
}

impl Trend {
    fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let (records, skipped) = records_and_messages(&self.folder)?;
        let records: Vec<ArchivedRecord> = records.into_iter().map(|(_, record)| record).collect();
        let selection = TrendSelection {
            serial: &self.serial,
            dut_kind: self.what.map(|kind| match kind {
                RecordKind::Gyro => DutKind::Gyro,
                RecordKind::Accel => DutKind::Accel,
                RecordKind::Drive => DutKind::Drive,
            }),
            quantity: self.quantity.as_deref(),
        };
        let trend = trend_of_device(&records, &selection).map_err(|e| CliError::in_file(&self.folder, format!("{e}{}", options(&e))))?;
        self.output.text(&report::trend_text(&trend))?;
        self.output.text(&report::skipped_text(&skipped))?;
        self.output.html(|| report::trend_html(&trend))?;
        self.output.json(|| report::trend_json(&trend))
    }
}
