//! Which physical effect is missing from a model, and how sure is that?
//!
//! In: logs and a model. Out: an [`Explanation`]: the path from the given model to one that leaves nothing but noise, the evidence for every
//! candidate of the catalogue, or the honest word that nothing is missing or that nothing known explains what is there.
//!
//! * [`trial`]: what may be missing, and from which values it is tried;
//! * [`orders`], [`screen`]: how much each would help, by its sensitivity at the fitted model;
//! * [`evidence`]: whitened residuals, BIC, the probability of chance;
//! * [`step`], [`fitted`]: the best few fitted and judged together;
//! * [`path`]: add the best, fit, ask again;
//! * [`unknown`]: what belongs to no effect of the catalogue;
//! * [`next`]: what to measure next.

mod answer;
pub mod evidence;
mod fitted;
mod gather;
mod ground;
pub mod next;
mod orders;
mod path;
mod screen;
mod shape;
mod step;
mod trial;
mod unknown;

use std::time::Instant;

pub use answer::{Candidate, Estimate, Explanation, NextExperiment, Shape, Shown, Stage, Verdict};
pub use fitted::APART;

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
    progress("looking at what is left");
    let (verdict, unexplained) = verdict(&mut path, &rows);
    let stages = path.grounds.iter().enumerate().map(|(k, g)| path::stage(g, k.checked_sub(1).map(|k| &path.missing[k]))).collect();
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
        unexplained,
        next,
        model: found,
        explained,
        log,
        remarks,
        seconds: begin.elapsed().as_secs_f64(),
    })
}

/// Effects from which on a path is suspected to imitate one structure of no name.
const MANY: usize = 3;

/// The answer in one word, and the shape of what no effect explains. Where one structure of no name does better than all that was added, the
/// path goes back to its begin.
fn verdict(path: &mut path::Path, rows: &[std::ops::Range<usize>]) -> (Verdict, Vec<Shape>) {
    let (Some(first), Some(last)) = (path.grounds.first(), path.grounds.last()) else { return (Verdict::Adequate, Vec::new()) };
    let (given, left) = (first.misfit(), last.misfit());
    let found = !path.missing.is_empty();
    if left <= unknown::LEFT && path.missing.len() < MANY {
        return (if found { Verdict::EffectFound } else { Verdict::Adequate }, Vec::new());
    }
    if found
        && let Some(instead) = unknown::best(first, rows)
        && instead.delta_bic < path::evidence(first, last, rows) - fitted::APART
        && instead.misfit < left.max(unknown::LEFT)
    {
        path.remarks.push(format!(
            "one structure of no name describes the log better than {} together: none of them is called the cause",
            path.missing.join(", ")
        ));
        path.missing.clear();
        path.grounds.truncate(1);
        return (Verdict::UnknownStructure, vec![instead.shape]);
    }
    if left <= unknown::LEFT {
        return (Verdict::EffectFound, Vec::new());
    }
    let shapes: Vec<Shape> = unknown::best(last, rows).map(|u| u.shape).into_iter().collect();
    let unseen = |ground: &ground::Ground| ground::misfit(ground.heldout().into_iter());
    let less_than_half = |given: f64, left: f64| found && left - 1.0 >= 0.5 * (given - 1.0);
    let not_beyond = less_than_half(unseen(first), unseen(last));
    if found && !less_than_half(given, left) && !not_beyond {
        return (Verdict::EffectFound, shapes);
    }
    if path.missing.len() >= MANY || not_beyond {
        let of_what = if not_beyond { "of the error on rows that the fit never saw" } else { "of it" };
        path.remarks.push(format!("{}: less than half {of_what} explained, none is called the cause", path.missing.join(", ")));
        path.missing.clear();
        path.grounds.truncate(1);
    }
    (Verdict::UnknownStructure, shapes)
}
