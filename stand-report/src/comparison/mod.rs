//! A comparison of a model with a log, or a fit of its parameters, as text, HTML and JSON.
//!
//! In: a [`Comparison`], which borrows log, model, prepared log and result. Out: text; nothing is printed or written here.
//!
//! * *rms*: root mean square of measured minus modelled; *noise*: estimate of the channel's own noise; *ratio*: rms over noise, 1 for a
//!   complete model;
//! * *held-out*: over rows that the fit did not use.

mod channel_plots;
mod html;
mod json;
mod misfit_plots;
mod parameters;
mod profiles;
mod text;
pub mod words;

pub use html::html;
pub(crate) use json::schemas;
pub use json::{compare_json, fit_json};
pub use parameters::{Determination, ParameterRow};
pub use profiles::profiles_json;
pub use text::text;

use super::log_warnings;
use identification::identify::evaluation::{Evaluated, EvaluationRemark};
use identification::identify::fit::FitResult;
use identification::identify::residual::Misfit;
use identification::log::Log;
use identification::model::Model;
use identification::recording::PreparedLog;

/// A comparison or a fit, ready to be reported.
pub struct Comparison<'a> {
    /// The log.
    pub log: &'a Log,
    /// The model as given; its values are the start values of a fit.
    pub model: &'a Model,
    /// The log, prepared for this model.
    pub data: &'a PreparedLog<'a>,
    /// Parameters, initial states and residual statistics.
    pub result: &'a FitResult,
    /// The parameters were fitted; else only the initial states.
    pub fitted: bool,
    /// Computing time, s.
    pub seconds: f64,
    /// Remarks on the comparison.
    pub remarks: &'a [EvaluationRemark],
    /// Systematic residuals, the largest share first.
    pub misfits: &'a [Misfit],
}

impl<'a> Comparison<'a> {
    /// The evaluation of `model`, the model as given, on `log`.
    pub fn of(log: &'a Log, model: &'a Model, evaluated: &'a Evaluated<'a>, fitted: bool) -> Self {
        Comparison {
            log,
            model,
            data: &evaluated.data,
            result: &evaluated.result,
            fitted,
            seconds: evaluated.seconds,
            remarks: &evaluated.remarks,
            misfits: &evaluated.misfits,
        }
    }

    /// Main heading.
    pub fn title(&self) -> String {
        let (log, model) = (self.log.path().display(), self.model.name());
        if self.fitted { format!("Fit of model {model} to {log}") } else { format!("Comparison of {log} with model {model}") }
    }

    /// Remarks of the model and of the comparison, without repetition.
    pub fn all_remarks(&self) -> Vec<String> {
        let warnings = self.all_warnings();
        let mut lines: Vec<String> = Vec::new();
        for line in
            self.model.remarks().iter().cloned().chain(self.remarks.iter().map(|r| crate::preparation::remark(self.model.axis(), r)))
        {
            if !lines.contains(&line) && !warnings.contains(&line) {
                lines.push(line);
            }
        }
        lines
    }

    /// Warnings of the log's reader, of constants that contradict the log, and of a fit that did not converge.
    pub fn all_warnings(&self) -> Vec<String> {
        let mut lines = log_warnings(self.log);
        let shifted = self.remarks.iter().filter(|remark| matches!(remark, EvaluationRemark::ShiftedConstant(_)));
        lines.extend(shifted.map(|r| crate::preparation::remark(self.model.axis(), r)));
        if self.fitted && !self.result.converged {
            lines.push(format!(
                "The fit did not converge in {} steps; the values are the best so far. Start closer to the solution, or fix the parameters that this log does not determine.",
                self.result.steps
            ));
        }
        lines
    }
}

#[cfg(test)]
mod tests;
