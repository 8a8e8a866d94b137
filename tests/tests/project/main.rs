//! The project itself: layers, documentation, files of others, random input.
#![allow(clippy::unwrap_used)]

mod architecture;
mod build_identity;
mod docs_are_true;
mod environment_page;
mod everything_moves;
mod figures_page;
mod files_of_benches;
mod foreign_programs;
mod fuzz;
mod hardware_page;
mod one_build;
