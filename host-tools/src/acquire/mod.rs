//! Acquisition: a stand behind a serial port or simulated in virtual time, and its rows as a log.

pub mod connection;
pub mod hidden;
pub mod link;
pub mod record;
#[cfg(unix)]
pub mod serve;
