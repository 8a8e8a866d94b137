//! Compensation of identified torques: a fitted model, or the stand's own calibration, becomes the firmware's feed-forward table.
//!
//! Input: a model and the log it was fitted to ([`learn`]), or the result of a calibration. Output: the stand file with the compensation
//! ([`file`]), and the ripple of the *true* rate of the simulated stand with it ([`ripple`]).

pub mod file;
pub mod learn;
pub mod ripple;
pub mod serial_stand;
pub mod simulated_stand;

pub use learn::{LearnError, Learnt, NotCompensated, learn};
pub use ripple::{Ripple, RippleError, ripple};
