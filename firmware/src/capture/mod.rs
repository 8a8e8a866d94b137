//! What happened around a fault, or around a moment that was asked for: each tick of it.
//!
//! [`Memory`] belongs to the app: an array of atomic words, so that the interrupt writes and the tasks read without either waiting. The
//! interrupt's [`Recorder`] writes a [`Sample`] in each tick, round and round. A trigger (a fault, or [`Memory::trigger`]) lets it go on for
//! the part after it and then freezes the memory, which the tasks read with [`Memory::record`] for as long as they like, until
//! [`Memory::arm`] lets it begin anew. A fault that is cleared arms it by itself, so that the next one has its record, too.

mod memory;
mod recorder;
#[cfg(test)]
mod tests;

pub use memory::{Memory, Record, SAMPLES};
pub use recorder::Recorder;

use crate::board::{CurrentCode, EncoderCount};

/// One tick of a record.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// The speed loop's counter at the tick.
    pub count: EncoderCount,
    /// Compare counts from the next tick on.
    pub duty: i16,
    /// The newest conversion of the current.
    pub current: CurrentCode,
    /// The estimated rate, counts per tick.
    pub rate: f32,
    /// The setpoint: rate, 2⁻¹⁶ counts per tick, or voltage, 2⁻¹⁶ compare counts.
    pub command: i32,
}
