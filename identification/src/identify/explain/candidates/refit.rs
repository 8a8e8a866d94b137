//! Refits of the best trials, and what is necessary to find their minima.
//!
//! Where the given parameters may be far off, the trials are fitted to short windows first: within a short window a missing effect shifts
//! the parameters only a little, and a shaft does not run out of phase. Effects with a shaft are expensive to simulate: beside a model of the
//! whole logs they are compared on an excerpt first.

use std::ops::Range;

use rayon::prelude::*;

use super::candidate::{FittedCandidate, fit_trial};
use super::score::Score;
use super::screen::Screening;
use crate::identify::explain::criteria::MisfitClass;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::descent::{Goal, near_best, within};
use crate::identify::explain::fitted::trial::Trial;
use crate::identify::fit::solve::Iterate;
use crate::statistics::Extremes;

/// Screens everything and refits the best trials; the candidates that may be the best are fitted to the minimum.
pub fn screen_and_refit(base: &FittedModel) -> (Screening, Vec<FittedCandidate>) {
    let from_windows = if base.misfit() == MisfitClass::Dominant { fit_from_windows(base) } else { None };
    let (screening, fitted) = match from_windows {
        // The windows are explained completely. A second search would start from parameters that may be far off.
        Some((screening, fitted)) if explain_all(base, &fitted) => (screening, fitted),
        other => {
            let screening = Screening::of(base);
            let fitted = refit_best(base, &screening, other.map_or_else(Vec::new, |(_, fitted)| fitted));
            (screening, fitted)
        }
    };
    let best = least_chi2(&fitted);
    let max_deficit = base.context.criteria.screening.max_decrease_deficit * (base.fit.chi2 - best).max(0.0);
    let limit = near_best(&base.context.criteria.descent, best, &base.data).min(best + max_deficit);
    let fitted = best_of_each_structure(fitted).into_par_iter().map(|f| if f.chi2 <= limit { f.minimized(base) } else { f }).collect();
    (screening, fitted)
}

/// Refits the best trials of the screening on the whole data, besides those that are `fitted` already.
fn refit_best(base: &FittedModel, screening: &Screening, mut fitted: Vec<FittedCandidate>) -> Vec<FittedCandidate> {
    let Screening { trials, scores, .. } = screening;
    let criteria = base.context.criteria;
    let cheap = screening.best(false, criteria);
    // The best trials first: the refits of the others stop as soon as they cannot reach their χ².
    let (first, others) = cheap.split_at(cheap.len().min(criteria.screening.simultaneous_refits));
    for list in [first, others] {
        if base.data.budget.checkpoint() {
            break;
        }
        let rival = least_chi2(&fitted);
        let more: Vec<FittedCandidate> = list.par_iter().filter_map(|&k| fit_trial(base, &trials[k], &scores[k], rival)).collect();
        fitted.extend(more);
    }
    // Where an effect leaves only noise, a shaft with more parameters cannot be better.
    if !explain_all(base, &fitted) {
        let promising = best_on_excerpt(base, screening, &fitted);
        let rival = least_chi2(&fitted);
        let more: Vec<FittedCandidate> = promising.par_iter().filter_map(|(k, score)| fit_trial(base, &trials[*k], score, rival)).collect();
        let without_gap = more.iter().find_map(|f| shaft_without_gap(base, trials, f));
        fitted.extend(more);
        fitted.extend(without_gap);
    }
    fitted
}

/// One of the candidates leaves only noise.
fn explain_all(base: &FittedModel, fitted: &[FittedCandidate]) -> bool {
    let least = fitted.iter().map(|f| f.chi2_per_n).min_or_infinity();
    base.context.criteria.noise.misfit(least) == MisfitClass::Noise
}

/// The least χ² of the candidates; infinite where there is none.
fn least_chi2(fitted: &[FittedCandidate]) -> f64 {
    fitted.iter().map(|f| f.chi2).min_or_infinity()
}

/// The candidates by χ², and of several starts of one structure only the best.
fn best_of_each_structure(mut fitted: Vec<FittedCandidate>) -> Vec<FittedCandidate> {
    fitted.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
    let mut best: Vec<FittedCandidate> = Vec::new();
    for f in fitted {
        if !best.iter().any(|b| b.trial.has_structure_of(&f.trial)) {
            best.push(f);
        }
    }
    best
}

/// The best trials on short windows, fitted there and from there to the whole data; `None` where there are too few windows.
fn fit_from_windows(base: &FittedModel) -> Option<(Screening, Vec<FittedCandidate>)> {
    let short = base.in_windows()?;
    let (screening, mut tried) = fit_windows(&short, Vec::new());
    if !explain_all(base, &tried)
        && let Some(start) = short.at_start()
    {
        // Even in short windows a missing effect may have shifted the model's own parameters too far.
        tried = fit_windows(&start, tried).1;
    }
    let criteria = &base.context.criteria.screening;
    let limit = within(criteria.max_window_excess, least_chi2(&tried), &short.data);
    tried.retain(|f| f.chi2 < limit);
    let mut tried = best_of_each_structure(tried);
    let mut fitted: Vec<FittedCandidate> = Vec::new();
    while !tried.is_empty() && !base.data.budget.checkpoint() {
        let rival = least_chi2(&fitted);
        let few: Vec<FittedCandidate> = tried.drain(..tried.len().min(criteria.simultaneous_refits)).collect();
        fitted.extend(few.into_par_iter().filter_map(|f| f.on_whole_data(base, rival)).collect::<Vec<_>>());
    }
    Some((screening, fitted))
}

/// Screens a model of short windows and fits its best trials there, besides those that are `tried` already.
fn fit_windows(short: &FittedModel, mut tried: Vec<FittedCandidate>) -> (Screening, Vec<FittedCandidate>) {
    let screening = Screening::of(short);
    let Screening { trials, scores, .. } = &screening;
    let criteria = short.context.criteria;
    for few in screening.best_for_windows(criteria).chunks(criteria.screening.simultaneous_refits) {
        if short.data.budget.checkpoint() {
            break;
        }
        let rival = least_chi2(&tried);
        tried.extend(few.par_iter().filter_map(|&k| fit_trial(short, &trials[k], &scores[k], rival)).collect::<Vec<_>>());
    }
    (screening, tried)
}

/// A shaft whose gap has closed in the fit, fitted without the gap.
fn shaft_without_gap(base: &FittedModel, trials: &[Trial], f: &FittedCandidate) -> Option<FittedCandidate> {
    let rest = f.trial.card.reduces_to?;
    let [gap, shaft @ ..] = &f.parameters.list[f.own.clone()] else { return None };
    if gap.value > base.context.criteria.screening.closed_gap_sigmas * f.sigmas[f.own.start] {
        return None;
    }
    let trial = trials.iter().find(|t| t.card.id == rest)?;
    let trial = Trial { values: shaft.iter().map(|p| p.value).collect(), ..trial.clone() };
    fit_trial(base, &trial, &Score::zero(&trial, base.free_parameters()), f64::INFINITY)
}

/// Fits the expensive trials to an excerpt. For each effect the best trial with its fitted values, if it leaves clearly less of the excerpt
/// than the best candidate of `fitted`.
fn best_on_excerpt(base: &FittedModel, screening: &Screening, fitted: &[FittedCandidate]) -> Vec<(usize, Score)> {
    let Screening { trials, scores, .. } = screening;
    let criteria = base.context.criteria;
    let expensive = screening.best(true, criteria);
    let excerpt = base.excerpt();
    let chi2_of = |residuals: &mut dyn Iterator<Item = &[f64]>| -> f64 {
        let of_rows = |r: &[f64], rows: &Range<usize>| r[rows.clone()].iter().filter(|r| r.is_finite()).map(|r| r * r).sum::<f64>();
        let sum = |r: &[f64]| excerpt.segments.iter().map(|rows| of_rows(r, rows)).sum::<f64>();
        residuals.zip(&base.weights).map(|(r, w)| w * sum(r)).sum()
    };
    let given = chi2_of(&mut base.residuals().into_iter());
    let rival = fitted.iter().map(|f| chi2_of(&mut f.residuals.iter().map(Vec::as_slice))).fold(given, f64::min);
    let limit = criteria.screening.max_expensive_chi2_fraction * rival;
    let tried: Vec<(usize, f64, Vec<f64>)> = expensive
        .par_iter()
        .map(|&k| {
            // From the trial's own values, or from one step further where that is better.
            let at = |values: &[f64]| {
                let begin = Trial { values: values.to_vec(), ..trials[k].clone() };
                let (system, parameters, own) = base.with(&begin, &begin.fitted);
                let states = base.initial_states_for(&system, &parameters, &excerpt);
                (Iterate::new(&system, &parameters, &excerpt, &states), system, own)
            };
            let chi2 =
                |iterate: &Iterate| Some(iterate.normal_equations(&base.weights).cost).filter(|c| c.is_finite()).unwrap_or(f64::INFINITY);
            let (here, further) = (at(&trials[k].values), at(&scores[k].values));
            let (begin, system, own) = if chi2(&further.0) < chi2(&here.0) { further } else { here };
            let end = base.minimize_from(&system, &excerpt, begin, Goal::Compare(limit));
            (k, end.normal_equations(&base.weights).cost, end.parameters.list[own].iter().map(|p| p.value).collect())
        })
        .collect();
    let mut best: Vec<(usize, f64, Vec<f64>)> = Vec::new();
    for one in tried.into_iter().filter(|(_, chi2, _)| *chi2 < limit) {
        match best.iter_mut().find(|b| trials[b.0].card.id == trials[one.0].card.id) {
            Some(known) if one.1 < known.1 => *known = one,
            Some(_) => {}
            None => best.push(one),
        }
    }
    // The model's own parameters begin at their fitted values: the excerpt determines them less well than the whole data.
    best.into_iter().map(|(k, _, values)| (k, Score { values, step: vec![0.0; scores[k].step.len()], ..scores[k].clone() })).collect()
}
