//! The console: command lines in the manner of SCPI, for a terminal and for instrument libraries.
//!
//! In: bytes of the serial line. [`guard`] runs in the receive interrupt on every byte and detects a stop; [`line`](mod@line) assembles and
//! checks lines; [`parse`] splits them into commands and parameters; [`quantity`] knows numbers and units; [`errors`] and [`status`] keep
//! the error queue and the status registers. The commands themselves are in [`crate::app`].
//!
//! The crate `scpi` 1.0 (last release 2023) is not used: it brings `lexical-core` and `uom`, has no command list for `HELP?`, and its
//! parsers can panic.

pub mod errors;
pub mod guard;
pub mod line;
pub mod line_errors;
pub mod parse;
pub mod quantity;
pub mod status;

pub use guard::{Guard, StopLine};
pub use line_errors::LineErrors;
