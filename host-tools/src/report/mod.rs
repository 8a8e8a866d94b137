//! What a comparison or a fit found, told three ways: JSON for programs, plain text for a terminal, one HTML file for a browser.
//!
//! In: a [`Comparison`], which borrows log, model, record and result. Out: text; nothing is written or printed here. Every form says
//! the same: the words come from [`words`], the plots from [`plot`] over [`svg`]. A log that is no
//! record of a drive has no comparison; [`bad_log_text`] and its sisters tell of it.
//!
//! * *rms*: root mean square of measured minus modelled; *noise*: the tool's own estimate of what the channel scatters by itself;
//!   *ratio*: the one over the other, 1 where the model lacks nothing;
//! * *held-out*: over rows that the fit never saw.
//!
//! An explanation will be made of the same parts: plots, tables and words take a channel's residual and a coordinate, not a command.

pub mod allan;
mod allan_picture;
mod bad_log;
pub mod calibration;
pub mod calibration_records;
pub mod coordinates;
mod digits;
pub mod drift;
pub mod explain_coverage;
mod explain_evidence;
mod explain_html;
mod explain_json;
mod explain_plots;
mod explain_text;
pub mod explain_words;
pub mod failing;
mod html;
mod json;
pub mod observer;
pub mod page;
pub mod pages;
pub mod plot;
mod sections;
pub mod series;
pub mod statistics;
pub mod svg;
mod terminal;
pub mod words;

pub use crate::identify::residual::Failure;
pub use bad_log::{bad_log_html, bad_log_json, bad_log_text};
pub use digits::{grouped, plain, significant, with_sigma};
pub use explain_html::explain_html;
pub use explain_json::{explain_bad_log_json, explain_json};
pub use explain_text::explain_text;
pub use html::html;
pub use json::{compare_json, failures_json, finite, fit_json};
pub use terminal::{Style, sparkline, text};

use crate::identify::fit::{Held, Record};
use crate::log::Log;
use crate::model::{Channel, Model};

/// A model held against a log, ready to be told.
pub struct Comparison<'a> {
    /// Heading: what was done, e.g. `compare run.csv`.
    pub title: String,
    /// The log.
    pub log: &'a Log,
    /// The model as it was given: start values of a fit.
    pub model: &'a Model,
    /// The log as the model sees it.
    pub record: &'a Record<'a>,
    /// The result.
    pub held: &'a Held,
    /// The parameters were fitted, not only compared.
    pub fitted: bool,
    /// How long the work took, s.
    pub seconds: f64,
    /// What a person should know of how it was done, beyond what log and model say themselves; a line each.
    pub remarks: Vec<String>,
    /// Where the model fails, most telling first.
    pub failures: Vec<Failure>,
}

impl Comparison<'_> {
    /// What a person should know, each line once: of the model, of the work.
    pub fn all_remarks(&self) -> Vec<String> {
        let warnings = self.all_warnings();
        let mut lines: Vec<String> = Vec::new();
        for line in self.model.remarks().iter().chain(&self.remarks) {
            if !lines.contains(line) && !warnings.contains(line) {
                lines.push(line.clone());
            }
        }
        lines
    }

    /// What a person should beware of: what the log's reader did not understand, a descent that did not end.
    pub fn all_warnings(&self) -> Vec<String> {
        let mut lines = log_warnings(self.log);
        if self.fitted && !self.held.converged {
            lines.push(format!(
                "the fit did not settle in {} steps: its values are the best so far; begin nearer, or fix what this log does not determine",
                self.held.steps
            ));
        }
        lines
    }
}

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

#[cfg(test)]
mod tests;
