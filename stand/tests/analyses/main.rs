//! Analyses by the library: input in, data and reports out.
#![allow(clippy::unwrap_used)]

mod allan;
mod allan_disturbed;
mod allan_imu_noise;
mod allan_noise;
#[path = "../common/mod.rs"]
mod common;
mod drift_covered;
mod drift_three_axes;
mod explain_report;
mod linear_axis;
mod where_prescribed;
