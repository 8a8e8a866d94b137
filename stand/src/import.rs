//! Options about logs of other programs, and `stand log inspect`.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use super::error::CliError;
use super::output::JsonOutput;
use identification::log::import::{self, Statements};
use stand_report::inspection as report;

/// What the user states about a log of another program; it is remembered in NAME.import.toml beside the log.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct ImportOptions {
    /// A log of another program: column FROM of the file (name or number) is column TO, for example speed_rpm=omega_rad_s; FROM=- leaves it
    /// out
    #[arg(long, value_name = "FROM=TO", help_heading = "Logs of other programs")]
    map: Vec<String>,
    /// Unit of a column of the file, for example t=ms, speed=rpm, enc=counts:8192 (per turn), pwm="0.047 V"
    #[arg(long, value_name = "COLUMN=UNIT", help_heading = "Logs of other programs")]
    unit: Vec<String>,
    /// Rows per second of a file without a time, Hz
    #[arg(long, value_name = "HZ", help_heading = "Logs of other programs")]
    sample_rate: Option<f64>,
    /// How a column was made, for example "u_V=at t" or "u_V=terminal"; "u_V=" removes the note; see docs/logs-and-models.md
    #[arg(long, value_name = "KEY=TEXT", help_heading = "Logs of other programs")]
    note: Vec<String>,
}

impl ImportOptions {
    /// Nothing is stated.
    pub(super) fn is_empty(&self) -> bool {
        self.map.is_empty() && self.unit.is_empty() && self.sample_rate.is_none() && self.note.is_empty()
    }

    fn statements(&self) -> Result<Statements, CliError> {
        let pairs = |option: &str, list: &[String], example: &str| {
            let pair = |text: &String| match text.split_once('=') {
                Some((a, b)) if !a.trim().is_empty() && (!b.trim().is_empty() || option == "--note") => {
                    Ok((a.trim().to_owned(), b.trim().to_owned()))
                }
                _ => Err(CliError::Input(format!("{option} {text}: two names with = between them are needed, for example {example}"))),
            };
            list.iter().map(pair).collect::<Result<Vec<_>, _>>()
        };
        let notes = pairs("--note", &self.note, "\"u_V=at t\"")?;
        // A file may have notes for other programs. One that is typed here is meant for this one.
        if let Some(message) = report::note_not_understood(&notes) {
            return Err(CliError::Input(format!("--note: {message}")));
        }
        Ok(Statements {
            columns: pairs("--map", &self.map, "speed_rpm=omega_rad_s")?,
            units: pairs("--unit", &self.unit, "t=ms")?,
            sample_rate_Hz: self.sample_rate,
            notes,
        })
    }

    /// Writes what is stated into the import files of the logs; of a folder, of each log in it.
    pub(super) fn apply<'a>(&self, logs: impl IntoIterator<Item = &'a Path>) -> Result<(), CliError> {
        let statements = self.statements()?;
        if statements.is_empty() {
            return Ok(());
        }
        for log in logs {
            let files = if log.is_dir() { identification::identify::explain_logs::logs_in(log)? } else { vec![log.to_owned()] };
            for file in files {
                let inspection = import::inspect(&file, &statements)?;
                if let Some(question) = report::open_question(&inspection) {
                    return Err(CliError::in_file(&file, question));
                }
                inspection.accept()?;
            }
        }
        Ok(())
    }
}

/// Examine logs, also those of other programs
#[derive(Debug, Subcommand)]
pub(super) enum LogCommand {
    /// Show rows, rate, gaps, and range, resolution, saturation, unit and meaning of each column; accept them for the other commands
    Inspect(Inspect),
}

#[derive(Debug, Args)]
pub(super) struct Inspect {
    /// The file: .csv, .txt, .tsv, .dat, .asc, .lvm or .log (text), .parquet, .mat (MATLAB)
    file: PathBuf,
    /// Accept what is shown: write it into NAME.import.toml, by which the other commands read the file
    #[arg(long)]
    accept: bool,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    json: JsonOutput,
}

impl LogCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        let LogCommand::Inspect(inspect) = self;
        inspect.run()
    }
}

impl Inspect {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let inspection = import::inspect(&self.file, &self.import.statements()?)?;
        self.json.text(&report::text(&inspection))?;
        if self.accept {
            if let Some(open) = report::open_question(&inspection) {
                return Err(CliError::in_file(&self.file, open));
            }
            let path = inspection.accept()?;
            self.json.text(&format!("\nAccepted: written to {}.\n", path.display()))?;
        }
        self.json.json(|| report::json(&inspection))
    }
}
