//! The portable part of the stand's firmware.
//!
//! The control law is synchronous: [`speed_loop`] is a function of the 10 kHz timer interrupt. All else is asynchronous:
//! [`measurement_loop`] and [`profile`] are futures with lower priority, and a [`mailbox`] passes values between both. A [`session`] runs a
//! profile and measures it. [`calibration`] measures cogging and friction; the result is a [`compensation`] that the speed loop feeds
//! forward. [`app`] is the whole program with console and telemetry. [`board`] has the traits of the hardware. The caller owns all memory,
//! so that a test or the simulator can run many stands.
//!
//! The library has no `unsafe` code. The tick cannot reach a panic and calls no double-precision routine.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::unreachable,
        clippy::todo,
        clippy::indexing_slicing,
        clippy::integer_division_remainder_used
    )
)]
#![cfg_attr(test, allow(clippy::unwrap_used))]
#![warn(missing_docs)]

pub mod app;
pub mod board;
pub mod button;
pub mod calibration;
pub mod capture;
pub mod compensation;
pub mod config;
pub mod console;
pub mod gyro_loop;
pub mod mailbox;
pub mod measurement_loop;
pub mod profile;
pub mod reset_cause;
pub mod sensors;
pub mod session;
pub mod settings;
pub mod speed_loop;
pub mod status;
pub mod supervision;
pub mod telemetry;
pub mod text;

/// Commit of the sources that this program was built from: the short hash, with `-dirty` where the firmware's sources differ from the
/// commit, or `unknown` without git (build.rs).
pub const COMMIT: &str = env!("STAND_COMMIT");

/// Firmware level: version and commit, as `*IDN?` replies it in its fourth field (IEEE 488.2 §10.14) and the logs' notes carry it.
pub const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("STAND_COMMIT"));
