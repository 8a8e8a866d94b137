//! Acquisition: a stand behind a serial port or simulated in virtual time, and its rows as a log.
//!
//! Two sources give a log:
//! * [`recording`], the stream of a stand, for every [`connection`]: a serial [`link`] or the simulated controller in virtual time;
//! * [`simulation`], the rows of the simulated firmware without the stream, in full precision.
//!
//! [`vibration_simulation`] and [`three_axis_simulation`] write logs of gyroscopes without the firmware.
//!
//! [`calibration_session`] and [`drift_session`] run the steps of a measurement through the first source. [`preparation`] brings a stand to
//! rest, finds its index and reads its settings; [`record`] writes rows into a log file; [`settings`] saves and restores a stand's
//! settings; [`serve`] is a simulated stand as a serial port; [`hidden`] adds an effect to a simulated stand; [`profile_choice`] makes a
//! profile of its name and parameters.

pub mod calibration_session;
pub mod connection;
pub mod drift_session;
pub mod hidden;
pub mod link;
pub mod preparation;
pub mod profile_choice;
pub mod profile_recording;
pub mod record;
pub mod recording;
#[cfg(unix)]
pub mod serve;
pub mod settings;
pub mod simulation;
pub mod three_axis_simulation;
pub mod vibration_simulation;
