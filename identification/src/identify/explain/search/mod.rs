//! The search from the given model to one that leaves only noise.
//!
//! In: the given model, fitted. Out: a [`path::Search`]: the models on the way, and why it ended. [`forward`] adds effects, [`eliminate`]
//! removes what is no longer needed, [`termination`] ends it, [`recorded`] repeats it by another convention of recording, [`unfinished`] is
//! its state where the budget ends it.

mod eliminate;
pub mod forward;
pub mod path;
pub mod recorded;
mod termination;
pub mod unfinished;
