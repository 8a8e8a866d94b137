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
pub mod coverage;
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

use crate::identify::fit::FitError;
use crate::identify::fit::prepare::{self, PrepareError};
use crate::identify::residual;
use crate::log::Log;
use crate::log::plausible::{self, Finding};
use crate::model::Model;
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
    let paths = logs.iter().map(|l| l.path().display().to_string()).collect();
    let (log, rows) = gather::gather(logs)?;
    let (record, mut remarks) = prepare::prepare(&log, model, true)?;
    progress("fitting the model as it is");
    let given = Ground::fit(model, record)?;
    let (as_given, held) = (given.record.clone(), given.held.clone());
    let (path, failures) = rayon::join(|| path::walk(&log, &rows, given, progress), || residual::misfits(&log, &as_given, &held));
    let mut path = path?;
    remarks.append(&mut path.remarks);
    progress("looking at what is left");
    let (verdict, unexplained) = verdict(&mut path, &rows);
    let added = |k: usize| k.checked_sub(1).map(|k| &path.missing[k]);
    let stages = match path.grounds.last() {
        Some(last) => path.grounds.iter().enumerate().map(|(k, g)| path::stage(g, last, added(k))).collect(),
        None => Vec::new(),
    };
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
        logs: paths,
        log,
        remarks,
        seconds: begin.elapsed().as_secs_f64(),
    })
}

/// Part of what the given model leaves to explain; a cause that leaves more of it is none.
const HALF: f64 = 0.5;
/// χ²/n from which on the noise is far away; a cause that leaves more than this part there may stand in for another.
const FAR: f64 = 25.0;
const STAND_IN: f64 = 0.1;
/// χ²/n up to which what no effect explains and what has no shape may be the noise itself: a shaft encoder's is known to some hundredths.
const NOISE_KNOWN_TO: f64 = 1.15;
/// Effects from which on a path is suspected to imitate one structure of no name.
const MANY: usize = 3;

/// Part of what is left to explain at the χ²/n `given` that is left at `left` too.
fn rest(given: f64, left: f64) -> f64 {
    (left - 1.0).max(0.0) / (given - 1.0).max(1e-3)
}

/// What leaves the part `rest` of the error, and the χ²/n `left`, may be called its cause.
fn may_be_the_cause(rest: f64, left: f64) -> bool {
    rest < HALF && (left < FAR || rest < STAND_IN)
}

/// The answer in one word, and the shape of what no effect explains. Where one structure of no name does better than all that was added, the
/// path goes back to its begin.
fn verdict(path: &mut path::Path, rows: &[std::ops::Range<usize>]) -> (Verdict, Vec<Shape>) {
    let (Some(first), Some(last)) = (path.grounds.first(), path.grounds.last()) else { return (Verdict::Adequate, Vec::new()) };
    let left = last.misfit();
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
    if !found && shapes.is_empty() && left <= NOISE_KNOWN_TO {
        return (Verdict::Adequate, shapes);
    }
    let ((given, given_unseen), (_, left_unseen)) = (first.misfits_beside(last), last.misfits_beside(last));
    let beyond = rest(given_unseen, left_unseen);
    let rest = rest(given, left).max(beyond);
    if found && may_be_the_cause(rest, left) {
        return (Verdict::EffectFound, shapes);
    }
    if found && (path.missing.len() >= MANY || rest >= HALF) {
        path.remarks.push(format!(
            "{}: {:.0} % of the error is left with them{}, none is called the cause",
            path.missing.join(", "),
            100.0 * rest,
            if beyond >= HALF { " on rows that the fit never saw" } else { "" }
        ));
        path.missing.clear();
        path.grounds.truncate(1);
    }
    (Verdict::UnknownStructure, shapes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_leaves_much_of_an_error_far_from_the_noise_is_not_called_its_cause() {
        let judged = |given: f64, left: f64| may_be_the_cause(rest(given * given, left * left), left * left);
        assert!(judged(154.0, 1.0) && judged(154.0, 20.0), "next to nothing is left of it");
        assert!(!judged(154.0, 57.0), "a seventh of the squares, and 57 × the noise");
        assert!(judged(3.0, 1.5), "near to the noise");
        assert!(!judged(3.0, 2.5), "more than half is left");
        assert!(!judged(1.0, 1.1), "nothing was there to explain");
    }
}
