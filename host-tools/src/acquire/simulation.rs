//! A log of the simulated stand, in virtual time, from the firmware's rows.
//!
//! Unlike [`super::recording`], this source does not pass through the telemetry stream: the rows keep full precision and contain all
//! columns at 1 kHz, more than the serial line carries. The same seed gives the same log, bit for bit.

use std::path::Path;

use hal_sim::plant::{Plant, Stand, StandError};
use hal_sim::session::{self, SessionError, SessionRequest};

use crate::log::{Column, Log, LogError};

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
    let mut notes = vec![("stand".to_owned(), stand.name.clone())];
    notes.extend(record.notes);
    notes.push(("supply_nominal_V".to_owned(), stand.drive.supply_V.to_string()));
    notes.push(("date".to_owned(), jiff::Zoned::now().strftime("%Y-%m-%dT%H:%M:%S%:z").to_string()));
    let columns = record.columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    Ok(Log::new(path, columns, notes)?)
}
