//! A log of the simulated stand, in virtual time, from the firmware's rows.
//!
//! Unlike [`super::recording`], this source does not pass through the telemetry stream: the rows keep full precision and contain all
//! columns at 1 kHz, more than the serial line carries. The same seed gives the same log, bit for bit.

use std::path::Path;

use hal_sim::plant::{Plant, Stand, StandError};
use hal_sim::session::{self, SessionError, SessionRequest};

use crate::log::{Column, Log, LogError, Note, Notes};

/// Why there is no log.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// The description of the stand is invalid.
    #[error(transparent)]
    Stand(#[from] StandError),
    /// The profile or the settings are invalid, or the firmware does not run.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The name of the log is invalid.
    #[error(transparent)]
    Log(#[from] LogError),
}

/// Runs `request` on `stand`, from the index on, and returns the log. `path` becomes the name of the log; no file is written.
///
/// # Errors
/// The stand, the request or the ending of `path` is invalid.
pub fn simulate(stand: &Stand, request: SessionRequest, path: &Path) -> Result<Log, SimulationError> {
    // Checked first: a wrong ending must not cost the simulation.
    crate::log::Format::of(path)?;
    let record = session::run(stand.setup(), Plant::new(stand, 0.0)?, request)?;
    let mut notes = Notes::from_iter([Note::Stand(stand.name.clone())]);
    record.notes.into_iter().for_each(|(key, value)| notes.push_text(key, value));
    notes.extend([Note::SupplyNominal(stand.drive.supply_V), Note::Date]);
    let columns = record.columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    Ok(Log::new(path, columns, notes)?)
}
