//! Whole sessions of firmware and tools on the simulated stand.
#![allow(clippy::unwrap_used)]

mod at_the_console;
mod compensation;
mod console;
mod damaged_line;
mod estimates;
mod faults;
mod sessions;
mod settings_power_cut;
mod side_by_side;
mod streaming;
