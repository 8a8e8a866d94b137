//! What the stand is told once and keeps without supply: settings of the loops, scales of the hardware.
//!
//! [`Kept`] is all of it; [`fields`] is the list by name, unit and range, which the console goes over; [`store`] appends it as a record to one
//! of two flash sectors, so that a power cut at any word leaves the record before or the new one, never neither.

pub mod fields;
mod record;
pub mod store;

pub use fields::{FIELDS, Field};
pub use record::{Record, Saved};
pub use store::{Store, StoreError};

use crate::board::Hardware;
use crate::config::ConfigError;
use crate::speed_loop::{Config, Settings};

/// All that is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Kept {
    /// Gains, limits, the drive's constants and what was learnt of it.
    pub settings: Settings,
    /// Scales of the converters.
    pub hardware: Hardware,
}

impl Kept {
    /// The same in the tick's units.
    ///
    /// # Errors
    /// The name of the first number that makes no sense.
    pub fn config(&self) -> Result<Config, ConfigError> {
        Config::new(&self.settings, &self.hardware)
    }

    /// A number that is another one where the record's fields are others: firmware of another layout does not read it.
    pub fn layout() -> u32 {
        // 2: the third way of writing them, with an observer.
        FIELDS.iter().fold(2, |sum: u32, field| sum.rotate_left(5) ^ crate::telemetry::crc32(field.name.as_bytes()))
    }
}
