//! The stand's program, portable part: what it does is here, on what hardware it does it is not.
//!
//! Synchronous control law, asynchronous everything else. [`speed_loop`] is one function for the 10 kHz timer
//! interrupt; [`measurement_loop`] and [`profile`] run below it as plain futures; [`mailbox`] joins the two halves;
//! [`session`] puts them together; [`calibration`] is a session that measures cogging and friction, and what was learnt is a
//! [`compensation`] that the loop feeds forward. The hardware is [`board`]: two traits and a clock. Nothing here is a task, a static
//! or `'static`: whoever calls owns the memory, so that a test or the simulator holds a hundred stands at once.
//!
//! No panic is reachable from the tick, no `unsafe` anywhere in the library, no double-precision call in the tick.
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
pub mod calibration;
pub mod capture;
pub mod compensation;
pub mod config;
pub mod console;
pub mod gyro_loop;
pub mod imu;
pub mod mailbox;
mod maths;
pub mod measurement_loop;

pub mod profile;

pub mod session;
pub mod settings;
pub mod speed_loop;
pub mod status;
pub mod supervision;
pub mod telemetry;
pub mod words;

/// Version of the firmware, as the logs' notes carry it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
