//! The portable part of the stand's firmware.
//!
//! The control law is synchronous: [`speed_loop`] is a function of the 10 kHz timer interrupt. All else is asynchronous: [`measurement_loop`] and
//! [`profile`] are futures with lower priority, and a [`mailbox`] passes values between both. A [`session`] runs a profile and measures
//! it. [`calibration`] measures cogging and friction; the result is a [`compensation`] that the speed loop feeds forward. [`app`] is the whole
//! program with console and telemetry. [`board`] has the traits of the hardware. The caller owns all memory, so that a test or the
//! simulator can run many stands.
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
pub mod planned_stall;
pub mod profile;
pub mod receive_ring;
pub mod reset_cause;
pub mod sensors;
pub mod session;
pub mod settings;
pub mod speed_loop;
pub mod status;
pub mod supervision;
pub mod telemetry;
pub mod text;
pub mod tick_counter;

/// Version of the firmware, as the logs' notes carry it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
