//! The firmware on the simulated board, in virtual time.
#![allow(clippy::unwrap_used)]

mod adxl355;
mod app_over_the_line;
mod clock_reference;
#[path = "../common/mod.rs"]
mod common;
mod controller;
mod current_limit;
mod estimates;
mod faults;
mod gyro_drift;
mod imu;
mod measurement_is_independent;
mod observer;
mod safety;
mod session;
mod settings;
mod settings_in_flash;
