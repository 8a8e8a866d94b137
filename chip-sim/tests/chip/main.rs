//! The flashed image on the emulated chip.
#![allow(clippy::unwrap_used)]

mod boots;
mod budget;
mod clock_reference;
#[path = "../common/mod.rs"]
mod common;
mod drives;
mod faults;
mod receives;
mod replay;
mod saves;
mod side_by_side;
mod streams;
mod unicorn;
