//! The effects of the catalogue beside a fitted model: what each would explain.
//!
//! In: the model of a stage of the search. Out: every effect with its evidence, and the one to add. [`trials`] (with [`visibility`]) lists
//! the effects and the values from which each is tried, [`screen`] (with [`score`], [`harmonics`], [`jumps`]) ranks them by their
//! sensitivity, [`refit`] fits the best few, [`compare`] (with [`refusal`], [`open_course`]) weighs their evidence.

pub mod candidate;
pub mod compare;
pub mod doubt;
pub mod harmonics;
mod jumps;
mod open_course;
mod refit;
pub mod refusal;
pub mod score;
pub mod screen;
pub mod trials;
mod visibility;
