//! Settings of the loops and scales of the hardware, kept in flash.
//!
//! [`Kept`] holds them; [`fields`] lists them by name, unit and range, for the console; [`store`] appends them as a record to one of two
//! flash sectors, so that after a power cut at any time either the old or the new record is complete.

pub mod fields;
mod record;
pub mod store;

pub use fields::{FIELDS, Field};
pub use record::{Record, Saved};
pub use store::{Store, StoreError};

use crate::board::Hardware;
use crate::config::ConfigError;
use crate::speed_loop::{Config, Settings};

/// The kept settings and scales.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Kept {
    /// Gains, limits, constants of the drive, and its compensation.
    pub settings: Settings,
    /// Scales of the converters.
    pub hardware: Hardware,
}

impl Kept {
    /// The configuration of the speed loop, in units of the tick.
    ///
    /// # Errors
    /// A setting is invalid; names the first.
    pub fn config(&self) -> Result<Config, ConfigError> {
        Config::new(&self.settings, &self.hardware)
    }

    /// Identifies the fields of a record: firmware with other fields has another number and does not read the record.
    pub fn layout() -> u32 {
        // Version 2 of the record: with an observer.
        FIELDS.iter().fold(2, |sum: u32, field| sum.rotate_left(5) ^ crate::telemetry::crc32(field.name.as_bytes()))
    }
}
