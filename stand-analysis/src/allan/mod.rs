//! Noise of a sensor at rest by its Allan deviation: from one column of a log to five coefficients, each with its uncertainty or the reason
//! why this record does not show it.
//!
//! Input: a column of a log ([`Request`]). Output: an [`Answer`]. [`time_stamps`] finds gaps, lost rows, bursts and changes of the sampling
//! rate, [`wild_rows`] single rows that are no noise, [`spectral_lines`] periodic signals, [`disturbances`] steps and slow motions of the level
//! by the likelihood of [`block_increments`]; what is found is removed from the rows. [`deviation`] computes the deviations, [`confidence`]
//! their covariances and confidence intervals, [`noise`] fits the processes. The memory used is that of the column.
//!
//! σ²(τ) = 3Q²/τ² + N²/τ + (2 ln 2/π) B² + K²τ/3 + R²τ²/2 (IEEE Std 952, annex C):
//!
//! * *Q* quantisation of the angle, *N* angle random walk (white noise of the rate; its one-sided density is √2 N), *B* bias instability
//!   (flicker; the floor of the curve is 0.664 B), *K* rate random walk, *R* rate ramp;
//! * *m* rows are averaged, τ = m τ₀; a *term* is one difference of adjacent averages; T is the duration of all rows.
//!
//! Results are in the unit of the column, for rates also in degrees and hours. The curve beyond τ = T/10 is not used.

pub mod answer;
pub mod block_increments;
pub mod confidence;
pub mod curve;
pub mod deviation;
pub mod disturbances;
pub mod error;
pub mod noise;
pub mod request;
pub mod spectral_lines;
pub mod time_stamps;
pub mod units;
pub mod wild_rows;

pub use answer::{Answer, Interpretation};
pub use error::AllanError;
pub use request::{Recorded, Request, Taus};

/// √(2 ln 2/π): ratio of the floor of the Allan deviation to B for flicker noise.
pub const FLOOR: f64 = 0.664_282_470_267_960_1;
/// Longest averaging time used, relative to the duration of the record: beyond it too few differences are independent.
pub const MAX_RELATIVE_TAU: f64 = 0.1;
