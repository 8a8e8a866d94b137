//! `stand record`: a profile run on a stand and recorded into a log.

use std::path::PathBuf;

use clap::Args;
use embassy_futures::block_on;
use indicatif::ProgressBar;
use stand_firmware::telemetry::Channels;

use super::error::CliError;
use super::output::{JsonOutput, Overwrite, check_writable, progress_bar};
use super::profile::{self, ProfileOptions};
use super::signals::Interrupts;
use super::stand_file::{DriveMode, required_port};
use stand_acquire::link::SerialLink;
use stand_acquire::profile_recording::{ProfileRecordingError, ProfileRecordingRequest, record_profile};
use stand_acquire::record::LogFile;
use stand_acquire::recording::{RecordingEnd, RecordingMonitor, RecordingProgress};
use stand_report::recording as report;

/// Run a profile on a stand and record its measurements.
#[derive(Debug, Args)]
#[command(after_help = profile::list())]
pub(super) struct Record {
    /// Serial port of the stand
    #[arg(long, value_name = "P")]
    port: Option<PathBuf>,
    /// Log to write, .csv or .parquet
    #[arg(long, value_name = "LOG")]
    out: PathBuf,
    #[command(flatten)]
    profile: ProfileOptions,
    /// Duration of the log, s
    #[arg(long, default_value_t = 30.0, allow_negative_numbers = true)]
    seconds: f64,
    /// Control of the drive: the profile is a rate setpoint or a voltage
    #[arg(long, value_enum, default_value_t = DriveMode::Rate)]
    mode: DriveMode,
    /// Seed of a random profile
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Decimation: rows of 1 ms in one row of the log
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1000))]
    decimation: u16,
    /// Turn the platform to its index first, so that the angles of the log count from the index
    #[arg(long)]
    find_index: bool,
    /// Additional channels, e.g. angle_sensor_V,alpha_hat_rad; may need --decimation 2 (STReam:CHANnels:LIST? in `stand console` lists all)
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    also: Vec<String>,
    /// Note for the log, e.g. operator=Ann; may be repeated
    #[arg(long = "note", value_name = "KEY=VALUE")]
    notes: Vec<String>,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    json: JsonOutput,
}

impl From<ProfileRecordingError> for CliError {
    fn from(error: ProfileRecordingError) -> Self {
        match error {
            ProfileRecordingError::Connection(error) => error.into(),
            ProfileRecordingError::Log(error) => error.into(),
            ProfileRecordingError::Write { path, source } => CliError::file(&path, "write", &source),
            ProfileRecordingError::Fault { .. } | ProfileRecordingError::NoIndex => CliError::Input(error.to_string()),
            ProfileRecordingError::NotAtRest | ProfileRecordingError::NoRows { .. } => CliError::Other(error.to_string()),
        }
    }
}

impl Record {
    pub(super) fn run(self) -> Result<(), CliError> {
        let port = required_port(self.port.clone())?;
        check_writable(&self.out)?;
        self.json.check()?;
        self.overwrite.check_existing(LogFile::of(&self.out)?.existing())?;
        let mode = self.mode.firmware_mode();
        check_recorded_seconds(self.seconds)?;
        let request = ProfileRecordingRequest {
            mode,
            profile: self.profile.config(mode, self.seed)?,
            seconds: self.seconds,
            decimation: self.decimation,
            find_index: self.find_index,
            additional_channels: self.additional_channels()?,
            notes: self.notes.iter().map(|note| note_of(note)).collect::<Result<Vec<_>, _>>()?.into(),
            path: &self.out,
        };
        let mut link = SerialLink::open(&port)?;
        let mut monitor = ProgressMonitor::new(self.seconds)?;
        let recording = block_on(record_profile(&mut link, &request, &mut monitor));
        monitor.finish();
        let recording = recording?;
        self.json.text(&report::text(&recording))?;
        self.json.json(|| report::json(&recording))?;
        let failed = |message: String| Err(CliError::Other(format!("{message}; the rows until then are in {}", self.out.display())));
        match &recording.end {
            RecordingEnd::Complete => Ok(()),
            RecordingEnd::Interrupted => failed("interrupted".to_owned()),
            RecordingEnd::Fault(fault) => failed(format!("{}: the drive was switched off because of a fault: {fault}", link.name())),
            RecordingEnd::Disconnected(error) => failed(error.to_string()),
            RecordingEnd::Silent | RecordingEnd::IncompleteRows => failed(format!("{}: the stand sends no more rows", link.name())),
        }
    }

    /// Channels of the option `--also`.
    fn additional_channels(&self) -> Result<Channels, CliError> {
        self.also.iter().try_fold(Channels::default(), |all, name| match Channels::named(name) {
            Some(one) => Ok(all.and(one)),
            None => Err(CliError::Input(format!("--also: `{name}` is not a channel (STReam:CHANnels:LIST? in `stand console` lists all)"))),
        })
    }
}

/// Checks the option `--seconds` of a recording.
pub(super) fn check_recorded_seconds(seconds: f64) -> Result<(), CliError> {
    if (1e-3..=1e6).contains(&seconds) {
        Ok(())
    } else {
        Err(CliError::Input(format!("--seconds: {seconds} is outside 0.001 … 1000000")))
    }
}

/// A progress bar, and the signals that interrupt the recording.
pub(super) struct ProgressMonitor {
    seconds: f64,
    interrupts: Interrupts,
    bar: ProgressBar,
}

impl ProgressMonitor {
    /// The bar of a recording of `seconds`.
    pub(super) fn new(seconds: f64) -> Result<Self, CliError> {
        let bar = progress_bar((seconds * 1e3) as u64, "{wide_bar} {percent} %, {eta} left {msg}");
        Ok(Self { seconds, interrupts: Interrupts::install()?, bar })
    }

    /// Takes the bar away.
    pub(super) fn finish(self) {
        self.bar.finish_and_clear();
    }
}

impl RecordingMonitor for ProgressMonitor {
    fn progress(&mut self, progress: RecordingProgress) -> bool {
        self.bar.set_position((progress.at_s * 1e3) as u64);
        self.bar.set_message(format!("{:.1} of {} s, {:+.3} rad/s", progress.at_s, self.seconds, progress.rate_rad_s));
        !self.interrupts.any()
    }
}

/// The note `KEY=VALUE` of the option `--note`.
fn note_of(text: &str) -> Result<(String, String), CliError> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err(CliError::Input(format!("--note {text}: must have the form KEY=VALUE"))),
    }
}
