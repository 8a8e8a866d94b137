//! Compensation of identified torques: a fitted model, or the stand's own calibration, becomes the firmware's feed-forward table.
//!
//! Input: a model and the log it was fitted to ([`learn`]), or the result of a calibration. Output: the stand file with the compensation
//! ([`file`]) or the commands of a stand at a port ([`serial_stand`]). Each compensation with harmonics is tried, and withdrawn if it makes
//! the ripple larger: by the *true* rate of the simulated stand ([`ripple`]), by the measured angle of a stand at a port ([`trial`]).

pub mod file;
pub mod learn;
pub mod order_spectrum;
pub mod ripple;
pub mod serial_stand;
pub mod simulated_stand;
pub mod trial;

pub use learn::{LearnError, Learnt, NotCompensated, learn};
pub use order_spectrum::{OrderChange, OrderSpectrum};
pub use ripple::{Ripple, RippleError, ripple};
