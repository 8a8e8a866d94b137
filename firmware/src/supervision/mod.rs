//! Supervision: the faults that switch the drive off.
//!
//! [`TickSupervisor`] runs in the control interrupt and detects what must be fast. [`Watch`] runs in a task and looks at each row; its
//! faults go to the interrupt as the `trip` of a command. [`Settings`] hold the thresholds of both.

mod settings;
mod tick;
mod watch;

pub use settings::Settings;
pub use tick::{DriveConstants, DriveState, Thresholds, TickSupervisor};
pub use watch::Watch;
