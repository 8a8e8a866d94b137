//! A comparison of a model with a log, or a fit of its parameters, as text, HTML and JSON.
//!
//! In: a [`Comparison`], which borrows log, model, prepared log and result. Out: text; nothing is printed or written here.
//!
//! * *rms*: root mean square of measured minus modelled; *noise*: estimate of the channel's own noise; *ratio*: rms over noise, 1 for a
//!   complete model;
//! * *held-out*: over rows that the fit did not use.

mod channel_plots;
mod failure_plots;
mod html;
mod json;
mod text;
pub mod words;

pub use html::html;
pub use json::{compare_json, fit_json};
pub use text::text;

use super::log_warnings;
use crate::identify::fit::{FitResult, PreparedLog};
use crate::identify::residual::Misfit;
use crate::log::Log;
use crate::model::Model;

/// A model held against a log, ready to be told.
pub struct Comparison<'a> {
    /// Heading: what was done, e.g. `compare run.csv`.
    pub title: String,
    /// The log.
    pub log: &'a Log,
    /// The model as it was given: start values of a fit.
    pub model: &'a Model,
    /// The log as the model sees it.
    pub record: &'a PreparedLog<'a>,
    /// The result.
    pub held: &'a FitResult,
    /// The parameters were fitted, not only compared.
    pub fitted: bool,
    /// How long the work took, s.
    pub seconds: f64,
    /// What a person should know of how it was done, beyond what log and model say themselves; a line each.
    pub remarks: Vec<String>,
    /// Where the model fails, most telling first.
    pub failures: Vec<Misfit>,
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

#[cfg(test)]
mod tests;
