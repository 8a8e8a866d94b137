//! What must be real: signals, killed programs, ports, sockets and clients of others.
//!
//! Their limits of time hold with a load of four on a busy machine. Everything else runs in virtual time.
#![allow(clippy::unwrap_used)]
#![cfg(unix)]

mod calibrate_faults;
#[path = "../common/mod.rs"]
mod common;
mod lab_real_stand;
mod python_reads;
mod reliability;
mod schemas;
mod serial_line;
mod settings_command;
mod sim_long;
mod tcp_line;
