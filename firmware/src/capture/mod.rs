//! Capture: a recording of every tick around a fault or a trigger.
//!
//! [`Memory`] is a ring of atomic words, so that the interrupt writes and the tasks read without waiting. The interrupt's [`Recorder`]
//! writes a [`Sample`] in each tick. After a trigger (a fault, or [`Memory::trigger`]) it records the part after it and then freezes the
//! memory, which the tasks read with [`Memory::record`] until [`Memory::arm`] restarts the recording. Clearing a fault restarts it, too.

mod memory;
mod recorder;
#[cfg(test)]
mod tests;

pub use memory::{Memory, Recording, SAMPLES};
pub use recorder::Recorder;

use crate::board::{CurrentCode, EncoderCount};

/// One tick of a recording.
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
