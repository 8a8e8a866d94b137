//! Which physical effect is missing from a model, and how sure is that?
//!
//! In: logs and a model. Out: an [`Explanation`]: the path from the given model to one that leaves nothing but noise, the evidence for every
//! candidate of the catalogue, or the honest word that nothing is missing or that nothing known explains what is there.
//!
//! * [`trial`]: what may be missing, and from which values it is tried;
//! * [`orders`], [`screen`]: how much each would help, by its sensitivity at the fitted model;
//! * [`evidence`]: whitened residuals, BIC, the probability of chance;
//! * [`path`]: add the best, fit, ask again;
//! * [`next`]: what to measure next.

mod answer;
pub mod evidence;
mod gather;
mod ground;
pub mod next;
mod orders;
mod path;
mod screen;
mod trial;

use std::time::Instant;

pub use answer::{Candidate, Estimate, Explanation, NextExperiment, Shape, Shown, Stage, Verdict};

use crate::fit::FitError;
use crate::fit::prepare::{self, PrepareError};
use crate::log::Log;
use crate::model::Model;
use crate::plausible::{self, Finding};
use crate::residual;
use ground::Ground;

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
pub fn explain(logs: Vec<Log>, model: &Model, progress: &(dyn Fn(&str) + Sync)) -> Result<Explanation, ExplainError> {
    let begin = Instant::now();
    for log in &logs {
        prepare::prepare(log, model, true)?;
        let findings = plausible::check(log, model.input().column());
        if !findings.is_empty() {
            return Err(ExplainError::BadLog { log: log.path().display().to_string(), findings });
        }
    }
    let (log, rows) = gather::gather(logs)?;
    let (record, mut remarks) = prepare::prepare(&log, model, true)?;
    progress("fitting the model as it is");
    let given = Ground::fit(model, record)?;
    let failures = residual::failures(&log, &given.record, &given.held);
    let mut path = path::walk(&log, &rows, given, progress)?;
    remarks.append(&mut path.remarks);
    let stages = path.grounds.iter().enumerate().map(|(k, g)| path::stage(g, k.checked_sub(1).map(|k| &path.missing[k]))).collect();
    let verdict = if path.missing.is_empty() { Verdict::Adequate } else { Verdict::EffectFound };
    let last = path.grounds.pop();
    let mut grounds = path.grounds.into_iter();
    let (given, explained, found) = match (grounds.next(), last) {
        (Some(first), Some(last)) => (first.held, last.held, last.model),
        (_, Some(only)) => (only.held.clone(), only.held, only.model),
        _ => return Err(ExplainError::Apart("nothing was fitted".to_owned())),
    };
    let next = next::next(&found, &path.candidates, &path.missing, verdict, &log);
    Ok(Explanation {
        verdict,
        given,
        missing: path.missing,
        stages,
        candidates: path.candidates,
        failures,
        unexplained: Vec::new(),
        next,
        model: found,
        explained,
        log,
        remarks,
        seconds: begin.elapsed().as_secs_f64(),
    })
}
