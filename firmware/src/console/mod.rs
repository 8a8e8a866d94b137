//! The console: text lines in, text lines out, SCPI for a person in a plain terminal and for instrument libraries.
//!
//! [`guard`] is what the receive interrupt runs on every byte, so that a stop acts whatever else goes on.

pub mod guard;

pub use guard::{Guard, StopLine};
