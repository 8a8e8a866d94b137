//! Supervision: the faults that switch the drive off.
//!
//! [`TickSupervisor`] runs in the control interrupt and detects what must be fast. [`RowSupervisor`] runs in a task once per row; its
//! faults go to the interrupt as the `trip` of a command. [`Settings`] hold the thresholds of both.

mod row;
mod settings;
mod tick;

pub use row::{HOST_TIMEOUT_S, RowState, RowSupervisor};
pub use settings::Settings;
pub use tick::{DriveConstants, DriveState, Thresholds, TickSupervisor};
