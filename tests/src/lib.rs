//! Shared by the tests and tables of whole sessions: external logs with their answers, sessions on the simulated stand, stands with a
//! hidden effect, and the evaluation of explanations.

pub mod bench;
pub mod calibration;
pub mod campaign;
pub mod dirt;
pub mod draw;
pub mod drift;
pub mod fails;
pub mod foreign;
pub mod memory;
pub mod own;
pub mod programs;
pub mod rate_accuracy;
pub mod real;
pub mod sensor;
pub mod streaming;

/// 0.975-quantile of the normal distribution.
pub const TWO_SIDED_95: f64 = 1.959_963_984_540_054;
