//! Acquisition: a stand behind a serial port or simulated in virtual time, and its rows as a log.
//!
//! [`link`] is the serial line, [`connection`] a stand behind it or in virtual time, [`record`] the log made from a stream of rows,
//! [`simulation`] the log made directly from the simulated firmware's rows, [`serve`] a simulated stand as a serial port.

pub mod connection;
pub mod hidden;
pub mod link;
pub mod record;
#[cfg(unix)]
pub mod serve;
pub mod simulation;
