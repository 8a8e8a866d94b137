//! Output options of the commands: terminal text, JSON file, HTML file.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::error::CliError;
use identification::files;
use identification::identify::fit::FitResult;
use identification::identify::series::series;
use identification::log::Log;
use identification::recording::PreparedLog;
use stand_report::Style;
use stand_report::plot_files::{PngError, PngWriter, plots_of};
use stand_report::units::Units;

/// The JSON option of every command that computes.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct JsonOutput {
    /// Write the result as JSON to this file (`-`: to standard output, which then carries nothing else)
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// The JSON and HTML options of a command with plots.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct ReportOutput {
    #[command(flatten)]
    pub json: JsonOutput,
    /// Write an HTML report: one file with embedded plots
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Write each plot of the report into this folder, as SVG and as PNG
    #[arg(long, value_name = "FOLDER")]
    pub plots: Option<PathBuf>,
}

/// The units of a report.
#[derive(Debug, Clone, Copy, Default, Args)]
pub(super) struct UnitOptions {
    /// Units of text and pages, separated by commas: deg/h, deg/s, rad/s, deg/sqrt(h), (deg/s)/sqrt(Hz), m/s2, mg, ug, ug/sqrt(Hz), %, ppm
    /// …
    #[arg(long, value_name = "LIST", value_parser = str::parse::<Units>)]
    pub units: Option<Units>,
}

/// Permission to overwrite what cannot be computed or measured again in the same way: logs, models, sessions, settings.
#[derive(Debug, Clone, Copy, Default, Args)]
pub(super) struct Overwrite {
    /// Overwrite an existing file
    #[arg(long)]
    pub force: bool,
}

/// The series of a fit.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct SeriesOutput {
    /// Write the measured and the modelled series, row by row, to this file, .csv or .parquet
    #[arg(long, value_name = "FILE")]
    pub out_series: Option<PathBuf>,
}

impl SeriesOutput {
    /// Checks that the file can be written. Called before the work.
    pub(super) fn check(&self) -> Result<(), CliError> {
        let Some(path) = &self.out_series else { return Ok(()) };
        identification::log::Format::of(path)?;
        check_writable(path)
    }

    /// Writes the series if the option was given.
    pub(super) fn write(&self, log: &Log, data: &PreparedLog, fit: &FitResult) -> Result<(), CliError> {
        let Some(path) = &self.out_series else { return Ok(()) };
        Ok(series(log, data, fit)?.write(path)?)
    }
}

/// The time that an analysis may take.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct TimeLimit {
    /// Time after which the analysis ends with its best answer so far and exit status 1, s; 0: none. The answer then depends on the load of
    /// the machine
    #[arg(long, value_name = "S", default_value_t = 0.0, allow_negative_numbers = true)]
    pub time_limit: f64,
}

impl TimeLimit {
    /// The limit, s; `None`: none.
    pub(super) fn seconds(self) -> Result<Option<f64>, CliError> {
        match self.time_limit {
            0.0 => Ok(None),
            seconds if seconds > 0.0 => Ok(Some(seconds)),
            other => Err(CliError::Input(format!("--time-limit {other}: must be a positive number of seconds, or 0 for none"))),
        }
    }

    /// The error of an analysis that it has ended.
    pub(super) fn error(self, what: &str) -> CliError {
        CliError::Other(format!("the time limit of {} s has ended the {what}; --time-limit sets another one", self.time_limit))
    }
}

impl Overwrite {
    /// Checks that a file can be created at `path`, and that none exists there unless it may be overwritten. Called before the work.
    pub(super) fn check(self, path: &Path) -> Result<(), CliError> {
        check_writable(path)?;
        self.check_existing(path.exists().then_some(path))
    }

    /// Refuses an existing file, unless it may be overwritten.
    pub(super) fn check_existing(self, existing: Option<&Path>) -> Result<(), CliError> {
        match existing {
            Some(path) if !self.force => Err(CliError::in_file(path, "the file exists; --force overwrites it")),
            _ => Ok(()),
        }
    }
}

impl JsonOutput {
    /// Checks that the JSON can be written. Called before the work, so that a rejected command has written nothing.
    pub(super) fn check(&self) -> Result<(), CliError> {
        self.json.as_deref().filter(|path| !is_standard_output(path)).map_or(Ok(()), check_writable)
    }

    /// Prints text, unless standard output carries the JSON.
    pub(super) fn text(&self, text: &str) -> Result<(), CliError> {
        if self.json.as_deref().is_some_and(is_standard_output) { Ok(()) } else { print(text) }
    }

    /// Writes the JSON if the option was given.
    pub(super) fn json(&self, answer: impl FnOnce() -> serde_json::Value) -> Result<(), CliError> {
        let Some(path) = &self.json else { return Ok(()) };
        let text = serde_json::to_string_pretty(&answer()).map_err(|e| CliError::Other(format!("{}: {e}", path.display())))?;
        if is_standard_output(path) { print(&format!("{text}\n")) } else { write(path, &format!("{text}\n")) }
    }
}

impl ReportOutput {
    /// Checks that JSON and HTML can be written.
    pub(super) fn check(&self) -> Result<(), CliError> {
        self.json.check()?;
        self.html.as_deref().map_or(Ok(()), check_html)?;
        let Some(folder) = &self.plots else { return Ok(()) };
        if folder.exists() && !folder.is_dir() {
            return Err(CliError::in_file(folder, "--plots writes several files: give the name of a folder"));
        }
        std::fs::create_dir_all(folder).map_err(|e| CliError::file(folder, "create", &e))?;
        files::check_folder(folder).map_err(|e| CliError::file(folder, "write", &e))
    }

    /// Prints text, unless standard output carries the JSON.
    pub(super) fn text(&self, text: &str) -> Result<(), CliError> {
        self.json.text(text)
    }

    /// Writes the JSON if the option was given.
    pub(super) fn json(&self, answer: impl FnOnce() -> serde_json::Value) -> Result<(), CliError> {
        self.json.json(answer)
    }

    /// Writes the HTML report and its plots if the options were given.
    pub(super) fn html(&self, page: impl FnOnce() -> String) -> Result<(), CliError> {
        if self.html.is_none() && self.plots.is_none() {
            return Ok(());
        }
        let page = page();
        if let Some(path) = &self.html {
            write(path, &page)?;
        }
        self.plots.as_deref().map_or(Ok(()), |folder| write_plots(folder, &page))
    }
}

/// Writes each plot of a page into a folder.
fn write_plots(folder: &Path, page: &str) -> Result<(), CliError> {
    let failed = |error: PngError| CliError::Other(format!("{}: {error}", folder.display()));
    let png_writer = PngWriter::new().map_err(failed)?;
    for plot in plots_of(page) {
        let path = |ending| folder.join(format!("{}.{ending}", plot.name));
        write(&path("svg"), &plot.svg)?;
        let (path, png) = (path("png"), png_writer.png(&plot).map_err(failed)?);
        files::replace(&path, |file| file.write_all(&png)).map_err(|e| CliError::file(&path, "write", &e))?;
    }
    Ok(())
}

/// Checks that a file can be created at `path`: its folder exists and can be written, and `path` is not a folder.
pub(super) fn check_writable(path: &Path) -> Result<(), CliError> {
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if path.is_dir() {
        Err(CliError::Input(format!("{}: cannot write: this is a folder; give the name of a file", path.display())))
    } else if !folder.is_dir() {
        Err(CliError::Input(format!("{}: cannot write: the folder {} does not exist", path.display(), folder.display())))
    } else if path.exists() && !path.is_file() {
        // A device, such as /dev/stdout.
        Ok(())
    } else {
        files::check_folder(folder).map_err(|e| CliError::file(path, "write", &e))
    }
}

/// Checks that an HTML report can be written at `path`, whose ending tells other programs what the file contains.
fn check_html(path: &Path) -> Result<(), CliError> {
    check_writable(path)?;
    let ending = path.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
    if !matches!(ending.as_deref(), Some("html" | "htm")) {
        return Err(CliError::in_file(
            path,
            "--html writes an HTML page with embedded plots: the name of the file must end in .html or .htm",
        ));
    }
    Ok(())
}

fn is_standard_output(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Prints to standard output. A closed pipe ends the command without a message.
pub(super) fn print(text: &str) -> Result<(), CliError> {
    std::io::stdout().write_all(text.as_bytes()).map_err(|e| CliError::file(Path::new("standard output"), "write", &e))
}

/// Writes a text file as a whole.
pub(super) fn write(path: &Path, text: &str) -> Result<(), CliError> {
    files::replace_text(path, text).map_err(|e| CliError::file(path, "write", &e))
}

/// Style of text on standard output: colour on a terminal, 80 columns.
pub(super) fn style() -> Style {
    Style { colour: is_terminal(), width: 80 }
}

/// Standard output is a terminal.
pub(super) fn is_terminal() -> bool {
    std::io::stdout().is_terminal()
}

/// A spinner with a message on a terminal; invisible on a pipe.
pub(super) fn spinner(message: &str) -> ProgressBar {
    let mut bar = ProgressBar::new_spinner().with_message(message.to_owned());
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        bar = bar.with_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// A progress bar of `length` steps with this template; invisible on a pipe.
pub(super) fn progress_bar(length: u64, template: &str) -> ProgressBar {
    let bar = ProgressBar::new(length);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}
