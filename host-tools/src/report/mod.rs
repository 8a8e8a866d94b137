//! Text, HTML and JSON of all results.
//!
//! In: the data that the analyses return. Out: text; nothing is printed or written here. One file or folder for each topic. Shared:
//! [`numbers`] (digits, uncertainties, p-values), [`terminal`] (line width, emphasis), [`html`] (HTML) and [`plot`] (SVG).

pub mod allan;
mod allan_picture;
mod bad_log;
pub mod calibration;
pub mod calibration_records;
pub mod comparison;
pub mod demonstration;
pub mod drift;
pub mod effects;
pub mod equation_error;
pub mod explanation;
pub mod html;
mod json;
pub mod model;
pub mod numbers;
pub mod observer;
pub mod page;
pub mod plot;
pub mod residual;
pub mod simulation;
pub mod terminal;

pub use bad_log::{bad_log_html, bad_log_json, bad_log_text};
pub use comparison::{Comparison, compare_json, fit_json, html as comparison_html, text as comparison_text};
pub use explanation::{explain_bad_log_json, explain_html, explain_json, explain_text};
pub use json::{failures_json, finite};
pub use numbers::{grouped, p_statement, p_value, plain, significant, with_sigma};
pub use terminal::{Style, sparkline};

use crate::log::Log;
use crate::model::Channel;

/// What the log's reader has to say.
fn log_warnings(log: &Log) -> Vec<String> {
    let mut lines = log.warnings().to_vec();
    if !log.ignored().is_empty() {
        lines.push(format!("columns of unknown name, ignored: {}", log.ignored().join(", ")));
    }
    lines
}

/// A number for a person, six digits at most, without zeros at its end.
pub fn digits(x: f64) -> String {
    plain(x, 6)
}

/// Unit of a channel.
pub fn unit(channel: Channel) -> &'static str {
    match channel {
        Channel::Rate => "rad/s",
        Channel::Angle => "rad",
        Channel::Current => "A",
        Channel::Voltage => "V",
        Channel::Torque => "N m",
    }
}

/// What a channel is, for a heading.
pub fn quantity(channel: Channel) -> &'static str {
    match channel {
        Channel::Rate => "rate",
        Channel::Angle => "angle increment over 20 ms",
        Channel::Current => "current",
        Channel::Voltage => "voltage",
        Channel::Torque => "torque",
    }
}
