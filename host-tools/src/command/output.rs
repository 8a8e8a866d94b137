//! Where answers go: terminal, JSON, HTML.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use indicatif::ProgressBar;

use super::error::CliError;

/// Where the answer goes, of every command that computes.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct JsonOutput {
    /// Write the answer as JSON to this file (`-`: to standard output, and nothing else there)
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// The same, where there is something to see.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct ReportOutput {
    #[command(flatten)]
    pub json: JsonOutput,
    /// Write a report, one HTML file with its plots inside
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
}

impl JsonOutput {
    /// The JSON has a place to go: said before the work, so that a refused command has written nothing.
    pub(super) fn check(&self) -> Result<(), CliError> {
        self.json.as_deref().filter(|path| !is_standard_output(path)).map_or(Ok(()), check_place)
    }

    /// Prints for a person, unless standard output is taken by the JSON.
    pub(super) fn text(&self, text: &str) -> Result<(), CliError> {
        if self.json.as_deref().is_some_and(is_standard_output) { Ok(()) } else { print(text) }
    }

    /// Writes the JSON where it was asked for.
    pub(super) fn json(&self, answer: impl FnOnce() -> serde_json::Value) -> Result<(), CliError> {
        let Some(path) = &self.json else { return Ok(()) };
        let text = serde_json::to_string_pretty(&answer()).map_err(|e| CliError::Other(format!("{}: {e}", path.display())))?;
        if is_standard_output(path) { print(&format!("{text}\n")) } else { write(path, &format!("{text}\n")) }
    }
}

impl ReportOutput {
    /// All that was asked for has a place to go.
    pub(super) fn check(&self) -> Result<(), CliError> {
        self.json.check()?;
        self.html.as_deref().map_or(Ok(()), check_place)
    }

    /// Prints for a person, unless standard output is taken by the JSON.
    pub(super) fn text(&self, text: &str) -> Result<(), CliError> {
        self.json.text(text)
    }

    /// Writes the JSON where it was asked for.
    pub(super) fn json(&self, answer: impl FnOnce() -> serde_json::Value) -> Result<(), CliError> {
        self.json.json(answer)
    }

    /// Writes the report where it was asked for.
    pub(super) fn html(&self, page: impl FnOnce() -> String) -> Result<(), CliError> {
        match &self.html {
            Some(path) => write(path, &page()),
            None => Ok(()),
        }
    }
}

/// A file could be written here: its folder is there, and it is no folder itself.
pub(super) fn check_place(path: &Path) -> Result<(), CliError> {
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if path.is_dir() {
        Err(CliError::Input(format!("{}: cannot write: this is a folder", path.display())))
    } else if folder.is_dir() {
        Ok(())
    } else {
        Err(CliError::Input(format!("{}: cannot write: there is no folder {}", path.display(), folder.display())))
    }
}

fn is_standard_output(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Prints to standard output; a closed pipe ends the command without a word.
pub(super) fn print(text: &str) -> Result<(), CliError> {
    std::io::stdout().write_all(text.as_bytes()).map_err(|e| CliError::file(Path::new("standard output"), "write", &e))
}

/// Writes a file whole.
pub(super) fn write(path: &Path, text: &str) -> Result<(), CliError> {
    std::fs::write(path, text).map_err(|e| CliError::file(path, "write", &e))
}

/// Colour and width of the terminal.
pub(super) fn is_terminal() -> bool {
    std::io::stdout().is_terminal()
}

/// A sign of life on a terminal while something takes longer; nothing on a pipe.
pub(super) fn working(says: &str) -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message(says.to_owned());
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
