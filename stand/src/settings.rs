//! `stand settings`: all settings of a stand into a file, and back.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use super::error::CliError;
use super::output::{JsonOutput, Overwrite, write};
use super::stand_file::required_port;
use identification::log::timestamp;
use stand_acquire::link::SerialLink;
use stand_acquire::settings::{Difference, SettingsError, file, import, read};
use stand_report::settings as report;

/// Save and restore the settings of a stand: gains, limits, scales, compensation, observer
#[derive(Debug, Subcommand)]
pub(super) enum Settings {
    /// Write all settings of a stand into a TOML file
    ///
    /// The file has the settings and scales with their units, the harmonics of the compensation, the observer, and the stand's serial
    /// number and firmware. `stand settings import` writes it into this or another stand.
    Export(Export),
    /// Write the settings of a file into a stand and its flash
    ///
    /// Every value is checked before the first is sent. The drive must be off. Differences are printed, the settings are written, saved in
    /// the stand's flash and read back. A key that the file lacks keeps the stand's value. Scales act from the next power-on on.
    Import(Import),
}

#[derive(Debug, Args)]
pub(super) struct Export {
    #[command(flatten)]
    overwrite: Overwrite,
    /// Serial port of the stand
    #[arg(long, value_name = "P")]
    port: Option<PathBuf>,
    /// File to write, .toml; without it the settings are printed
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
    #[command(flatten)]
    json: JsonOutput,
}

#[derive(Debug, Args)]
pub(super) struct Import {
    /// Serial port of the stand
    #[arg(long, value_name = "P")]
    port: Option<PathBuf>,
    /// File to read, .toml; without it standard input is read
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
    #[command(flatten)]
    json: JsonOutput,
}

/// An error of an import from `path`.
fn import_error(error: SettingsError, path: &Path) -> CliError {
    match error {
        SettingsError::Link(error) => error.into(),
        SettingsError::Reply { .. } | SettingsError::ReadBack { .. } => CliError::Other(error.to_string()),
        SettingsError::Busy { .. } => CliError::Input(error.to_string()),
        SettingsError::Unknown { .. } | SettingsError::Invalid { .. } | SettingsError::Restored { .. } => CliError::in_file(path, error),
    }
}

impl Settings {
    pub(super) fn run(self) -> Result<(), CliError> {
        match self {
            Settings::Export(export) => export.run(),
            Settings::Import(import) => import.run(),
        }
    }
}

impl Export {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        if let Some(path) = &self.file {
            self.overwrite.check(path)?;
        }
        let port = required_port(self.port.clone())?;
        let mut link = SerialLink::open(&port)?;
        let settings = read(&mut link).map_err(|error| import_error(error, &port))?;
        let text = file::text(&settings, link.identity(), &timestamp());
        match &self.file {
            None => self.json.text(&text)?,
            Some(path) => {
                write(path, &text)?;
                self.json.text(&report::exported(&path.display().to_string(), link.identity(), &settings))?;
            }
        }
        self.json.json(|| report::exported_json(link.identity(), &settings))
    }
}

impl Import {
    fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let path = self.file.as_deref().unwrap_or(Path::new("standard input"));
        let text = match &self.file {
            Some(path) => std::fs::read_to_string(path),
            None => std::io::read_to_string(std::io::stdin()),
        };
        let text = text.map_err(|e| CliError::file(path, "read", &e))?;
        let content = file::parse(&text).map_err(|e| CliError::in_file(path, e))?;
        let mut link = SerialLink::open(&required_port(self.port.clone())?)?;
        let identity = link.identity().to_owned();
        let mut shown = Ok(());
        let show = |differences: &[Difference]| shown = self.json.text(&report::differences(&content.source, &identity, differences));
        let imported = import(&mut link, &content, show).map_err(|error| import_error(error, path))?;
        shown?;
        self.json.text(&report::imported(&imported))?;
        self.json.json(|| report::imported_json(&content.source, &identity, &imported))
    }
}
