//! What the tests and tables of whole sessions share: logs from elsewhere with their answers, and sessions on the simulated stand.

pub mod foreign;
pub mod own;
pub mod real;

/// 0.975-quantile of the normal distribution.
pub const TWO_SIDED_95: f64 = 1.959_963_984_540_054;
