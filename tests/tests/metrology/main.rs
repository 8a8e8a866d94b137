//! Calibration, drift and noise: quantities with their uncertainties against the truth.
#![allow(clippy::unwrap_used)]

mod allan_mixture;
mod calibration_accel;
mod calibration_clipping;
mod calibration_clock;
mod calibration_coverage;
mod calibration_drive;
mod calibration_dynamic;
mod calibration_mounted;
mod calibration_order;
mod calibration_still;
mod calibration_turn_on;
mod drift_method;
mod rate_accuracy;
mod vibration_session;
