//! Stopping rule of a descent: it has converged, or it cannot reach a better rival.

use std::ops::Range;

use crate::identify::explain::criteria::DescentCriteria;
use crate::recording::PreparedLog;

/// How far a descent goes.
#[derive(Debug, Clone, Copy)]
pub enum Goal {
    /// To the minimum.
    Minimum,
    /// Until the χ² of the minimum is clear, or until it cannot reach a rival of this χ² (infinite: there is no rival).
    Compare(f64),
}

/// Rule that ends one descent.
pub struct StopRule<'c> {
    criteria: &'c DescentCriteria,
    goal: Goal,
    noise_chi2: f64,
    max_steps: usize,
    /// χ² after each accepted step.
    passed: Vec<f64>,
}

impl<'c> StopRule<'c> {
    /// A rule for a descent of `max_steps` steps on data whose noise leaves `noise_chi2`.
    pub fn new(criteria: &'c DescentCriteria, goal: Goal, noise_chi2: f64, max_steps: usize) -> Self {
        StopRule { criteria, goal, noise_chi2, max_steps, passed: Vec::new() }
    }

    /// Predicted decrease of χ² below which the descent ends at the χ² `chi2`; infinite where it ends at once.
    pub fn min_decrease(&mut self, chi2: f64) -> f64 {
        let c = self.criteria;
        // A refused step has no rate of convergence.
        if self.passed.last() != Some(&chi2) {
            self.passed.push(chi2);
        }
        match self.goal {
            Goal::Minimum if stagnates(c, &self.passed) => f64::INFINITY,
            Goal::Minimum => c.min_chi2_decrease,
            Goal::Compare(rival) if rival.is_finite() && cannot_reach(c, &self.passed, rival, self.max_steps) => f64::INFINITY,
            Goal::Compare(rival) => {
                let approach = if rival.is_finite() { c.min_rival_approach * (chi2 - rival) } else { 0.0 };
                c.min_chi2_decrease.max(c.min_excess_decrease * (chi2 - self.noise_chi2)).max(approach)
            }
        }
    }
}

/// The last steps decreased χ² by less than any decision needs.
fn stagnates(c: &DescentCriteria, passed: &[f64]) -> bool {
    passed.len().checked_sub(c.trend_steps + 1).is_some_and(|before| passed[before] - passed[passed.len() - 1] < c.min_trend_decrease)
}

/// At the mean decrease of its last steps the descent does not reach the χ² `rival` within `max_steps` steps.
fn cannot_reach(c: &DescentCriteria, passed: &[f64], rival: f64, max_steps: usize) -> bool {
    let Some(before) = passed.len().checked_sub(c.trend_steps + 1) else { return false };
    let now = passed[passed.len() - 1];
    let per_step = (passed[before] - now) / c.trend_steps as f64;
    now - per_step * max_steps.saturating_sub(passed.len() - 1) as f64 > rival
}

/// Largest χ² that noise alone leaves; held-out rows are counted.
pub fn max_noise_chi2(data: &PreparedLog) -> f64 {
    (data.segments.iter().map(Range::len).sum::<usize>() * data.channels.len()) as f64
}

/// χ² below which a fit is near one of the χ² `best`.
pub fn near_best(criteria: &DescentCriteria, best: f64, data: &PreparedLog) -> f64 {
    within(criteria.near_best_fraction, best, data)
}

/// χ² that exceeds `best` by this fraction of the excess of `best`, or of the noise where that is larger.
pub fn within(fraction: f64, best: f64, data: &PreparedLog) -> f64 {
    let noise = max_noise_chi2(data);
    best + fraction * (best - noise).max(noise)
}
