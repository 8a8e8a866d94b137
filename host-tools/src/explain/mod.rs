//! Which physical effect is missing from a model, and how sure is that?
//!
//! In: logs and a model. Out: an [`Explanation`]: the path from the given model to one that leaves nothing but noise, the evidence for every
//! candidate of the catalogue, or the honest word that nothing is missing or that nothing known explains what is there.

mod answer;

pub use answer::{Candidate, Estimate, Explanation, NextExperiment, Shape, Shown, Stage, Verdict};

use crate::fit::FitError;
use crate::fit::prepare::PrepareError;
use crate::log::Log;
use crate::model::Model;
use crate::plausible::Finding;

/// Why there is no explanation.
#[derive(Debug, thiserror::Error)]
pub enum ExplainError {
    /// A log lacks what the model asks for.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The model cannot be held against the logs.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// A log is no plausible record of a drive (verdict `bad-log`).
    #[error("{log}: {}", .findings.iter().map(|f| f.says.as_str()).collect::<Vec<_>>().join(" "))]
    BadLog {
        /// Which log.
        log: String,
        /// What is wrong with it.
        findings: Vec<Finding>,
    },
    /// Logs cannot be fitted together.
    #[error("{0}")]
    Apart(String),
}

/// Explains what `model` lacks on these logs together. `progress` is told what is being done.
///
/// # Errors
/// [`ExplainError`].
pub fn explain(_logs: Vec<Log>, _model: &Model, _progress: &(dyn Fn(&str) + Sync)) -> Result<Explanation, ExplainError> {
    Err(ExplainError::Apart("explain: being built".to_owned()))
}
