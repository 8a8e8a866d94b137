//! `stand records`: what is kept of calibrations.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};
use serde_json::{Map, Value, json};

use super::error::CliError;
use super::output::{JsonOutput, ReportOutput, spinner};
use crate::calibrate::kept::{Kept, below};
use crate::calibrate::session::What;
use crate::calibrate::trend;
use crate::report::calibration_records as page;

#[derive(Debug, Subcommand)]
pub(super) enum Records {
    /// The records below a folder, one line each
    List(List),
    /// One record: values, budgets, and whether its raw logs give them again
    Show(Show),
    /// One part over its records: what has changed, and whether beyond the uncertainty
    Trend(Trend),
}

/// The records below a folder, one line each.
#[derive(Debug, Args)]
pub(super) struct List {
    /// Searched with all folders in it
    folder: PathBuf,
    #[command(flatten)]
    json: JsonOutput,
}

/// One record: values, budgets, and whether its raw logs give them again.
#[derive(Debug, Args)]
pub(super) struct Show {
    /// A record.json, or a session's folder
    record: PathBuf,
    #[command(flatten)]
    json: JsonOutput,
}

/// Which records are of one kind.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Kind {
    /// A rate gyro
    Gyro,
    /// An accelerometer
    Accel,
    /// A stand's drive
    Drive,
}

/// One part over its records: what has changed, and whether beyond the uncertainty.
#[derive(Debug, Args)]
pub(super) struct Trend {
    /// Searched with all folders in it
    folder: PathBuf,
    /// Serial number of the part
    #[arg(long, value_name = "S")]
    serial: String,
    /// Kind of the records, where the serial number has several
    #[arg(long, value_enum)]
    what: Option<Kind>,
    /// One quantity alone
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

fn found(folder: &Path) -> Result<(Vec<Kept>, Vec<String>), CliError> {
    let (kept, passed) = below(folder)?;
    Ok((kept, passed.iter().map(ToString::to_string).collect()))
}

impl List {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let (kept, passed) = found(&self.folder)?;
        self.json.text(&page::list(&kept, &passed))?;
        self.json.json(|| {
            let line = |k: &Kept| {
                let r = &k.record;
                json!({
                    "record": k.path.display().to_string(), "began": r.journal.began, "what": r.session.what.name(), "sensor": r.session.sensor,
                    "serial": r.session.serial, "whole": r.is_whole(), "results": r.findings.quantities.len(),
                    "interruptions": r.journal.interruptions.len(),
                })
            };
            json!({"records": kept.iter().map(line).collect::<Vec<_>>(), "passed_over": passed})
        })
    }
}

impl Show {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let kept = Kept::read(&self.record)?;
        let bar = spinner("computing again");
        let checked = kept.checked();
        bar.finish_and_clear();
        self.json.text(&page::show(&kept, &checked))?;
        self.json.json(|| {
            let mut all: Map<String, Value> = kept.record.json().as_object().cloned().unwrap_or_default();
            all.insert("checked".into(), checked.json());
            Value::Object(all)
        })
    }
}

impl Trend {
    fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let (kept, passed) = found(&self.folder)?;
        let wanted = self.what.map(|what| match what {
            Kind::Gyro => What::Gyro,
            Kind::Accel => What::Accel,
            Kind::Drive => What::Drive,
        });
        let of = |k: &&Kept| k.record.session.serial == self.serial && wanted.is_none_or(|what| k.record.session.what == what);
        let part: Vec<&Kept> = kept.iter().filter(of).collect();
        let input = |says: String| Err(CliError::Input(format!("{}: {says}", self.folder.display())));
        let listed = |mut words: Vec<String>| {
            words.sort();
            words.dedup();
            if words.is_empty() { "none".to_owned() } else { words.join(", ") }
        };
        let Some(first) = part.first() else {
            let there = listed(kept.iter().map(|k| k.record.session.serial.clone()).filter(|s| !s.is_empty()).collect());
            return input(format!("no record of serial {}; there are: {there}", self.serial));
        };
        if part.iter().any(|k| k.record.session.what != first.record.session.what) {
            let kinds = listed(part.iter().map(|k| k.record.session.what.name().to_owned()).collect());
            return input(format!("serial {} has records of {kinds}: --what says which", self.serial));
        }
        let trend = trend::trend(&part, self.quantity.as_deref());
        if let (Some(name), true) = (&self.quantity, trend.series.is_empty()) {
            let there = listed(part.iter().flat_map(|k| &k.record.findings.quantities).map(|q| q.name.clone()).collect());
            return input(format!("--quantity: no record has {name}; there are: {there}"));
        }
        self.output.text(&page::trend_text(&trend))?;
        self.output.text(&passed.iter().map(|why| format!("passed over: {why}\n")).collect::<String>())?;
        self.output.html(|| page::trend_html(&trend))?;
        self.output.json(|| trend.json())
    }
}
