//! The console: text lines in, text lines out, SCPI for a person in a plain terminal and for instrument libraries.
//!
//! In: bytes of the serial line. [`guard`] is what the receive interrupt runs on every byte, so that a stop acts whatever else goes on;
//! [`line`] puts lines together and checks them; [`parse`] takes them apart; [`quantity`] knows numbers and units, [`text`] writes them;
//! [`errors`] and [`status`] keep what went wrong. What the commands *do* is the app's ([`crate::app`]).
//!
//! Own code and not the crate `scpi` 1.0 (last release 2023): that brings `lexical-core` and `uom`, more flash than the whole console has, lists
//! no tree for `HELP?`, and its parsers can panic.

pub mod errors;
pub mod guard;
pub mod line;
pub mod parse;
pub mod quantity;
pub mod status;
pub mod text;

pub use guard::{Guard, StopLine};
