//! `stand fleet`: what a table of explained logs says about the stands.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::error::CliError;
use super::output::ReportOutput;
use stand_analysis::fleet::evaluation::evaluate;
use stand_analysis::fleet::identity::IdentityError;
use stand_analysis::fleet::row::microseconds_of;
use stand_analysis::fleet::table::{self, TableError};
use stand_analysis::fleet::{IdentityTable, SessionError};
use stand_report::fleet as report;

#[derive(Debug, Subcommand)]
pub(super) enum Fleet {
    /// Stands that have changed, effects common to a batch, outliers, logs without an explanation
    Report(FleetReport),
}

/// Stands that have changed, effects common to a batch, outliers, logs without an explanation.
#[derive(Debug, Args)]
pub(super) struct FleetReport {
    /// Tables of stand explain --table, or folders of such tables
    #[arg(required = true)]
    table: Vec<PathBuf>,
    /// Table of stands, .csv, as for the option --stands of stand explain; it replaces what the tables state
    #[arg(long, value_name = "FILE")]
    stands: Option<PathBuf>,
    /// Date from which on logs are compared with those before, 2026-11-22 or with a time, UTC without a zone; default: one month before the last log
    #[arg(long, value_name = "DATE")]
    since: Option<String>,
    #[command(flatten)]
    output: ReportOutput,
}

impl From<TableError> for CliError {
    fn from(error: TableError) -> Self {
        CliError::Input(error.to_string())
    }
}

impl From<IdentityError> for CliError {
    fn from(error: IdentityError) -> Self {
        CliError::Input(error.to_string())
    }
}

impl From<SessionError> for CliError {
    fn from(error: SessionError) -> Self {
        match error {
            SessionError::Write { path, source } => CliError::file(&path, "write", &source),
            busy @ SessionError::Busy(_) => CliError::Other(busy.to_string()),
        }
    }
}

impl Fleet {
    pub(super) fn run(self) -> Result<(), CliError> {
        match self {
            Fleet::Report(report) => report.run(),
        }
    }
}

impl FleetReport {
    fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let date = |text: &str| {
            microseconds_of(text)
                .ok_or_else(|| CliError::Input(format!("--since {text}: must be a date such as 2026-11-22 or 2026-11-22T08:30:00+01:00")))
        };
        let since_us = self.since.as_deref().map(date).transpose()?;
        let identities = self.stands.as_deref().map_or(Ok(IdentityTable::default()), IdentityTable::read)?;
        let mut rows = table::read(&self.table)?;
        rows.iter_mut().for_each(|row| identities.apply(row));
        let evaluation = evaluate(&rows, since_us);
        let names: Vec<String> = self.table.iter().map(|path| path.display().to_string()).collect();
        self.output.text(&report::text(&evaluation))?;
        self.output.html(|| report::html(&names.join(", "), &evaluation))?;
        self.output.json(|| report::json(&evaluation))
    }
}
