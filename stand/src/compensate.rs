//! `stand compensate`: friction and cogging written into the firmware's feed-forward compensation.

use std::path::{Path, PathBuf};

use clap::Args;
use embassy_futures::block_on;

use super::error::CliError;
use super::import::ImportOptions;
use super::output::{JsonOutput, check_writable, progress_bar, spinner, write};
use super::signals::Interrupts;
use super::stand_file::parse_stand;
use identification::log::Log;
use identification::model::Model;
use stand_acquire::link::SerialLink;
use stand_analysis::compensate::serial_stand::{self, SerialCompensationError, Writing};
use stand_analysis::compensate::simulated_stand::{self, SelfMeasurementError, grown, ripple_before_and_after};
use stand_analysis::compensate::{file, learn};
use stand_report::compensation as report;

/// Write friction and cogging into the firmware's feed-forward compensation; withdraw it if it makes the ripple of the rate larger.
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("source").required(true).args(["model", "measure_cogging"]))]
#[command(group = clap::ArgGroup::new("target").required(true).args(["stand", "port"]))]
pub(super) struct Compensate {
    /// Fitted model whose friction, cogging and unbalance are compensated, .toml
    #[arg(long)]
    model: Option<PathBuf>,
    /// Log that the model was fitted to; it states the zero of the angle, from which the phases count
    #[arg(long, requires = "model")]
    log: Option<PathBuf>,
    /// Without a model: the stand turns slowly in both directions and measures its cogging and friction
    #[arg(long)]
    measure_cogging: bool,
    /// Write into the description of the simulated stand, .toml; created from the default stand if it does not exist
    #[arg(long, value_name = "FILE")]
    stand: Option<PathBuf>,
    /// Write into the stand at this serial port
    #[arg(long, value_name = "P")]
    port: Option<PathBuf>,
    /// With --port: save the compensation in the stand's flash
    #[arg(long, requires = "port")]
    save: bool,
    /// With --port: do not turn the platform to compare the ripple before and after
    #[arg(long, requires = "port")]
    no_trial: bool,
    /// Seed of the sensor noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    json: JsonOutput,
}

impl From<SelfMeasurementError> for CliError {
    fn from(error: SelfMeasurementError) -> Self {
        match error {
            SelfMeasurementError::Session(error) => error.into(),
            other => CliError::Input(other.to_string()),
        }
    }
}

impl From<SerialCompensationError> for CliError {
    fn from(error: SerialCompensationError) -> Self {
        match error {
            SerialCompensationError::Connection(error) => error.into(),
            SerialCompensationError::Trial(_)
            | SerialCompensationError::TrialAfter(_)
            | SerialCompensationError::Interrupted
            | SerialCompensationError::Settings(_) => CliError::Other(error.to_string()),
            other => CliError::of_parameters(&other),
        }
    }
}

impl Compensate {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        match (&self.stand, &self.port) {
            (Some(file), _) => self.write_file(file),
            (None, Some(port)) => self.write_to_stand(port),
            // The argument parser requires one of the two.
            (None, None) => Ok(()),
        }
    }

    fn model_and_log(&self, model: &Path) -> Result<(Model, Option<Log>), CliError> {
        self.import.apply(self.log.as_deref())?;
        Ok((Model::read(model)?, self.log.as_deref().map(Log::read).transpose()?))
    }

    fn write_file(&self, path: &Path) -> Result<(), CliError> {
        check_writable(path)?;
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => file::NEW.to_owned(),
            Err(e) => return Err(CliError::file(path, "read", &e)),
        };
        let before = parse_stand(&text, path)?;
        let learnt = match &self.model {
            Some(model) => {
                let (model, log) = self.model_and_log(model)?;
                learn(&model, log.as_ref(), &before.firmware)?
            }
            None => {
                let bar = progress_bar(1000, "{msg} {wide_bar} {percent} %").with_message("the stand measures its cogging");
                let measured = simulated_stand::measure(&before, self.seed, |percent| bar.set_position((percent * 10.0) as u64));
                bar.finish_and_clear();
                measured.map_err(|error| match CliError::from(error) {
                    CliError::Input(message) => CliError::in_file(path, message),
                    other => other,
                })?
            }
        };
        let text = file::with_compensation(&text, &learnt.compensation).map_err(|e| CliError::in_file(path, e))?;
        // Parsed again, so that the ripple is that of the written digits.
        let after = parse_stand(&text, path)?;
        let turning = spinner("measuring the ripple before and after");
        let ripple = ripple_before_and_after(&before, &after, self.seed);
        turning.finish_and_clear();
        let ripple = ripple.map_err(|e| CliError::Input(format!("nothing was written: {e}")))?;
        let withdrawn = grown(&before, &after, &ripple);
        if withdrawn.is_none() {
            write(path, &text)?;
        }
        let result = report::FileCompensation {
            path,
            withdrawn: withdrawn.as_deref(),
            source: if self.model.is_some() { "model" } else { "measured" },
            compensation: &after.firmware.compensation,
            not_compensated: &learnt.not_compensated,
            ripple: &ripple,
        };
        self.json.text(&result.text())?;
        self.json.json(|| result.json())?;
        withdrawn.map_or(Ok(()), |_| Err(CliError::Other(format!("{}: {}; nothing was written", path.display(), report::WITHDRAWN))))
    }

    fn write_to_stand(&self, port: &Path) -> Result<(), CliError> {
        let mut link = SerialLink::open(port)?;
        Interrupts::install()?;
        let writing = Writing { save: self.save, trial: !self.no_trial, goes_on: || !Interrupts::any_so_far() };
        let (source, result) = match &self.model {
            Some(model) => {
                let (model, log) = self.model_and_log(model)?;
                let turning = spinner("the platform turns to compare the ripple before and after");
                let result = block_on(serial_stand::write_model(&mut link, &model, log.as_ref(), writing));
                turning.finish_and_clear();
                ("model", result?)
            }
            None => {
                let measuring = spinner("the stand measures its cogging");
                let progress = |progress: &str| measuring.set_message(format!("the stand measures its cogging, {progress}"));
                let result = block_on(serial_stand::measure(&mut link, writing, progress));
                measuring.finish_and_clear();
                ("measured", result?)
            }
        };
        self.json.text(&report::serial_text(&link.name(), &result, self.save))?;
        self.json.json(|| report::serial_json(&link.name(), source, &result, self.save))?;
        let restored = || CliError::Other(format!("{}: {}; the previous compensation was restored", link.name(), report::WITHDRAWN));
        result.withdrawn.as_ref().map_or(Ok(()), |_| Err(restored()))
    }
}
