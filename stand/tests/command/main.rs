//! The command `stand`: arguments and files in, output, files and exit status out.
#![allow(clippy::unwrap_used)]

mod allan_command;
mod answers;
mod bad_input;
mod calibrate_command;
mod calibrate_foreign;
mod calibrate_refused;
mod certificate;
#[path = "../common/mod.rs"]
mod common;
mod drift_command;
mod explain_command;
mod explain_next;
mod files_of_0_1;
mod fit_command;
mod fleet;
mod import;
mod json_everywhere;
mod observer_command;
mod options;
mod record_store;
mod records_command;
mod session_page;
mod shell_command;
mod stability_command;
