//! The noise of a sensor at rest by its Allan deviation: from one column of a log to five coefficients, each with its uncertainty or with the reason
//! why this record does not show it.
//!
//! In: a column ([`Request`]), its times row by row. Out: an [`Answer`]. [`time_stamps`] finds gaps and bursts; [`deviation`] computes the deviations,
//! [`confidence`] how far they are to be trusted, [`noise`] the processes behind them; [`answer`] and [`page`] tell it. Memory is that of the column.
//!
//! σ²(τ) = 3Q²/τ² + N²/τ + (2 ln 2/π) B² + K²τ/3 + R²τ²/2 (IEEE Std 952, annex C):
//!
//! * *Q* quantisation of the angle, *N* angle random walk (white noise of the rate; its one-sided density is √2 N), *B* bias instability (flicker; the
//!   floor of the curve is 0.664 B), *K* rate random walk, *R* rate ramp;
//! * *m* rows are averaged, τ = m τ₀; a *term* is one difference of neighbouring averages; T is the time that all rows cover.
//!
//! A number belongs to the column's own unit, and for rates also to degrees and hours. Nothing is read from the curve beyond τ = T/10.

pub mod answer;
pub mod confidence;
pub mod deviation;
pub mod error;
pub mod noise;

pub mod request;
pub mod time_stamps;
pub mod units;

pub use answer::Answer;
pub use error::AllanError;
pub use request::{Request, Take, Taus};

/// √(2 ln 2/π): the floor of the Allan deviation of flicker noise is this part of B.
pub const FLOOR: f64 = 0.664_282_470_267_960_1;
/// The curve is read up to this part of the record: beyond it there are too few independent differences.
pub const READ_UP_TO: f64 = 0.1;
