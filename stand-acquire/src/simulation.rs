//! A log of the simulated stand, in virtual time, from the firmware's rows.
//!
//! Unlike [`super::recording`], this source does not pass through the telemetry stream: the rows keep full precision and contain all
//! columns at 1 kHz, more than the serial line carries. The same seed gives the same log, bit for bit.

use std::io;
use std::path::{Path, PathBuf};

use hal_sim::plant::{Plant, Stand, StandError};
use hal_sim::session::{self, Block, Record, SessionError, SessionRequest};
use stand_firmware::speed_loop::Config;

use identification::files;
use identification::log::{BlockWriter, Column, Format, Log, LogError, LogErrorKind, Note, Notes};

/// Rows that [`simulate_to_file`] keeps in memory: 131 s, 14 MB.
const BLOCK_ROWS: usize = 1 << 17;

/// Why there is no log.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// The description of the stand is invalid.
    #[error(transparent)]
    Stand(#[from] StandError),
    /// The profile or the settings are invalid, or the firmware does not run.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The name of the log is invalid, or it cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
}

/// The stand of a description in TOML, checked in full: its parts, sensors and firmware settings.
///
/// # Errors
/// What is wrong, in words.
pub fn described_stand(description: &str) -> Result<Stand, String> {
    let stand = Stand::parse(description).map_err(|error| error.to_string())?;
    stand.sensors.check().map_err(|error| error.to_string())?;
    Config::new(&stand.firmware, &stand.hardware).map_err(|error| error.to_string())?;
    Ok(stand)
}

/// A log without its rows.
#[derive(Debug, Clone, PartialEq)]
pub struct LogSummary {
    /// Its path.
    pub path: PathBuf,
    /// Names of its columns.
    pub columns: Vec<String>,
    /// Number of its rows.
    pub rows: usize,
    /// Time from the first to the last row plus one interval, s.
    pub duration_s: f64,
    /// Median interval of its first rows, s.
    pub interval_s: f64,
    /// Its notes.
    pub notes: Notes,
}

impl From<&Log> for LogSummary {
    fn from(log: &Log) -> Self {
        LogSummary {
            path: log.path().to_owned(),
            columns: log.columns().iter().map(|column| column.name.clone()).collect(),
            rows: log.len(),
            duration_s: log.duration_s(),
            interval_s: log.median_dt_s(),
            notes: log.notes().clone(),
        }
    }
}

impl LogSummary {
    /// Takes the next rows of the same log.
    fn take(&mut self, block: &Log) {
        self.rows += block.len();
        self.duration_s += block.duration_s();
        self.take_notes(block.notes());
    }

    fn take_notes(&mut self, notes: &[(String, String)]) {
        notes.iter().for_each(|(key, value)| self.notes.push_text(key.clone(), value.clone()));
    }
}

/// Notes of the log in addition to those of the session: before them, and after them.
fn stand_notes(stand: &Stand) -> [Notes; 2] {
    [Notes::from_iter([Note::Stand(stand.name.clone())]), Notes::from_iter([Note::SupplyNominal(stand.drive.supply_V), Note::Date])]
}

fn columns(columns: Vec<(&str, Vec<f64>)>) -> Vec<Column> {
    columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect()
}

/// Runs `request` on `stand`, from the index on, and returns the log. `path` becomes the name of the log; no file is written.
///
/// # Errors
/// The stand, the request or the ending of `path` is invalid.
pub fn simulate(stand: &Stand, request: SessionRequest, path: &Path) -> Result<Log, SimulationError> {
    // Checked first: a wrong ending must not cost the simulation.
    Format::of(path)?;
    let Record { notes, columns: values, .. } = session::run(stand.setup(), Plant::new(stand, 0.0)?, request)?;
    let [before, after] = stand_notes(stand);
    Ok(Log::new(path, columns(values), [before.to_vec(), notes, after.to_vec()].concat())?)
}

/// Runs `request` on `stand`, from the index on, and writes the log while it runs, so that it may be longer than the memory. A log of at
/// most [`BLOCK_ROWS`] rows is the log of [`simulate`]; in a longer one, the notes that are known at its end stand there. `goes_on` is
/// asked with the time of each row, s; once it returns false, the log ends there with a note.
///
/// # Errors
/// The stand, the request or the ending of `path` is invalid, or the log cannot be written; no file remains.
pub fn simulate_to_file(
    stand: &Stand,
    request: SessionRequest,
    path: &Path,
    mut goes_on: impl FnMut(f64) -> bool,
) -> Result<LogSummary, SimulationError> {
    let format = Format::of(path)?;
    let plant = Plant::new(stand, 0.0)?;
    let mut stopped_s = None;
    let mut failed = None;
    let mut summary: Option<LogSummary> = None;
    let written = files::replace(path, |file| {
        let mut file = Some(file);
        let mut writer = None;
        let mut take = |block: Block| -> Result<(), SimulationError> {
            let write_error = |error| LogError::new(path, LogErrorKind::Write(error));
            match (&mut writer, &mut summary) {
                (Some(writer), Some(summary)) if block.columns.iter().all(|(_, values)| values.is_empty()) => {
                    summary.take_notes(&block.notes);
                    BlockWriter::notes(writer, &block.notes).map_err(write_error)?;
                }
                (Some(writer), Some(summary)) => {
                    let block = Log::new(path, columns(block.columns), block.notes)?;
                    summary.take(&block);
                    writer.add(&block).map_err(write_error)?;
                }
                _ => {
                    let [before, after] = stand_notes(stand);
                    let first = Log::new(path, columns(block.columns), [before.to_vec(), block.notes, after.to_vec()].concat())?;
                    summary = Some(LogSummary::from(&first));
                    writer = file.take().map(|file| BlockWriter::new(format, file, &first)).transpose().map_err(write_error)?;
                }
            }
            Ok(())
        };
        let goes_on = |t_s| {
            let goes_on = goes_on(t_s);
            if !goes_on {
                stopped_s = Some(t_s);
            }
            goes_on
        };
        let ran = session::run_blocks(stand.setup(), plant, request, BLOCK_ROWS, goes_on, |block| match take(block) {
            Ok(()) => true,
            Err(error) => {
                failed = Some(error);
                false
            }
        });
        if let Err(error) = ran {
            failed.get_or_insert(error.into());
        }
        match (writer, &failed) {
            (Some(mut writer), None) => {
                if let (Some(stopped_s), Some(summary)) = (stopped_s, &mut summary) {
                    let note = Notes::from_iter([Note::Ended("by hand".to_owned(), stopped_s)]);
                    summary.take_notes(&note);
                    writer.notes(&note)?;
                }
                writer.finish()
            }
            // Nothing of this text is shown: `failed` says it.
            _ => Err(io::Error::other("the simulation ended without a log")),
        }
    });
    if let Some(error) = failed {
        return Err(error);
    }
    written.map_err(|error| LogError::new(path, LogErrorKind::Write(error)))?;
    summary.ok_or_else(|| LogError::new(path, LogErrorKind::Empty).into())
}
