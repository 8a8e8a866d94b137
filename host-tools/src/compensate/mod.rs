//! What is learnt goes back: a fitted model, or the stand's own calibration, becomes the firmware's compensation.
//!
//! In: a model and the log it was fitted to ([`learn`]), or what a calibration found. Out: the stand's file with the compensation written into
//! it ([`file`]), and what it does to the *true* rate of the simulated stand ([`ripple`]). Nothing here talks to a terminal.

pub mod file;
pub mod learn;
pub mod ripple;

pub use learn::{LearnError, Learnt, learn};
pub use ripple::{Ripple, RippleError, ripple};
