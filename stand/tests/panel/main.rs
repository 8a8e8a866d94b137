//! The server of `stand panel`.
#![allow(clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;
mod panel;
mod panel_laboratory;
mod panel_measure;
mod panel_security;
