//! Forward adding: the best effect that earns its place, then the next, until what is left is noise or nothing known helps.
//!
//! One step: every trial is screened by its score, the best few are fitted in full, and their whitened residuals are judged together with
//! the model's that lacks them. An effect is added if as much by chance has a probability below [`FAMILYWISE`] over everything that was
//! tried, if it pays for its parameters in BIC, if rows that no fit saw agree, if every log agrees, and if its parameters are physical.
//! After each adding it is asked whether every earlier one is still needed, and whether a rival of an earlier one has become better.

use std::ops::Range;

use hal_sim::effects::{CATALOGUE, Card, Kind};
use rayon::prelude::*;

use super::evidence::{Squares, Whitener, delta_bic, ln_chance};
use super::ground::{Ground, misfit};
use super::orders::{HIGHEST, promising};
use super::screen::{ALIKE, Score, scores};
use super::trial::{Scene, Trial, Unseen, may_be_added, trials};
use super::{Candidate, Estimate, Shown, Stage};
use crate::fit::normal::Starts;
use crate::fit::simulate::System;
use crate::fit::{FitError, Fitness, Parameters};
use crate::log::Log;
use crate::model::Model;

/// Probability of adding anything to a model that lacks nothing, per step and over the whole catalogue.
pub const FAMILYWISE: f64 = 0.002;
/// BIC by which rivals must differ to be told apart (interfaces.md), and by which an effect must pay.
pub const APART: f64 = 6.0;
/// Effects that one explanation adds at most.
const MOST_ADDED: usize = 10;
/// Candidates that are fitted in full, and the part of the best score from which on.
const FITTED_MOST: usize = 8;
const FITTED_LEAST: usize = 4;
const FITTED_PART: f64 = 0.25;
/// One step from a finite trial promises only roughly.
const ROUGH_PART: f64 = 0.05;
/// χ²/n up to which a candidate leaves nothing to explain.
const EXPLAINED: f64 = 1.03;
/// A costly candidate is fitted to the whole log where it leaves less than this part of what the best other leaves of an excerpt.
const WORTH: f64 = 0.7;
/// Held-out rows, or another log, speak against an effect where their likelihood falls by more than this.
const AGAINST: f64 = 6.0;
/// Standard errors by which a parameter may lie beyond its physical range.
const WITHIN_ERROR: f64 = 3.0;

/// One candidate, fitted.
pub struct Fitted {
    /// What was tried.
    pub trial: Trial,
    /// All parameters with it, and which are its own.
    system: System,
    starts: Starts,
    parameters: Parameters,
    own: Range<usize>,
    sigmas: Vec<f64>,
    residuals: Vec<Vec<f64>>,
    cost: f64,
    /// The largest χ²/n of its channels.
    misfit: f64,
    /// Parameters that it has more than the model, scanned ones too.
    more: usize,
    delta_bic: f64,
    ln_p: f64,
    refused: Option<String>,
}

/// One adding step: everything that was tried.
pub struct Step {
    /// Candidates that were fitted, the best first.
    pub fitted: Vec<Fitted>,
    /// The rest: best score of each effect that was only screened.
    screened: Vec<(Trial, Score, f64)>,
    unseen: Vec<Unseen>,
}

/// The way from the given model to the last.
pub struct Path<'a> {
    /// The given model, fitted; then one per added effect.
    pub grounds: Vec<Ground<'a>>,
    /// Names of what was added.
    pub missing: Vec<String>,
    /// The first step's candidates.
    pub candidates: Vec<Candidate>,
    /// What a person should know.
    pub remarks: Vec<String>,
}

/// Walks from `ground` as far as the evidence carries.
///
/// # Errors
/// Where a model with an added effect cannot be simulated.
pub fn walk<'a>(log: &Log, logs: &[Range<usize>], ground: Ground<'a>, progress: &(dyn Fn(&str) + Sync)) -> Result<Path<'a>, FitError> {
    let mut path = Path { grounds: vec![ground], missing: Vec::new(), candidates: Vec::new(), remarks: Vec::new() };
    let mut rivals: Vec<(String, Vec<Trial>)> = Vec::new();
    while path.missing.len() < MOST_ADDED {
        let Some(ground) = path.grounds.last() else { break };
        progress(&match path.missing.last() {
            None => "trying every effect of the catalogue".to_owned(),
            Some(name) => format!("{name} added; trying what else may be missing"),
        });
        let step = step(log, logs, ground);
        if path.missing.is_empty() {
            path.candidates = step.candidates(ground);
        }
        let Some((chosen, alike)) = step.choice() else { break };
        let (model, name) = added(&ground.model, &step.fitted[chosen]);
        let record = ground.record_for(&step.fitted[chosen].trial);
        let next = ground.refit(&model, record)?;
        rivals.push((name.clone(), alike));
        path.missing.push(name);
        path.grounds.push(next);
        if path.missing.len() > 1 {
            reconsider(&mut path, &mut rivals, logs)?;
        }
    }
    Ok(path)
}

/// Screens everything, fits the best few, judges them together.
pub fn step(log: &Log, logs: &[Range<usize>], ground: &Ground) -> Step {
    let orders = promising(&ground.model, &ground.record, &ground.residuals(), &ground.weights);
    let (mut trials, unseen) = trials(&Scene { model: &ground.model, log, record: &ground.record, orders });
    if ground.misfit() <= EXPLAINED {
        // A shaft that shows leaves more than that.
        trials.retain(|t| !t.is_costly());
    }
    let scores = scores(ground, &trials);
    let tests = number_of_tests(&trials);
    let mut order: Vec<usize> = (0..trials.len()).collect();
    order.sort_by(|a, b| scores[*b].gain.total_cmp(&scores[*a].gain));
    let critical = critical_gain(tests);
    // Costly trials were scored on an excerpt: their gains stand apart.
    let pick = |costly: bool| -> Vec<usize> {
        let mut chosen: Vec<usize> = Vec::new();
        let mut best = 0.0;
        for &k in order.iter().filter(|&&k| trials[k].is_costly() == costly) {
            best = f64::max(best, scores[k].gain);
            let alike = |other: &&usize| trials[**other].card.id == trials[k].card.id && trials[**other].screened == trials[k].screened;
            let rough = !trials[k].absent || trials[k].screened != trials[k].fitted;
            let part = if rough { ROUGH_PART } else { FITTED_PART };
            let few = chosen.iter().filter(alike).count() < 1 + usize::from(costly || scores[k].gain > 0.6 * best);
            let worth = scores[k].gain > part * best || chosen.len() < FITTED_LEAST;
            if scores[k].gain > critical && worth && few && chosen.len() < FITTED_MOST {
                chosen.push(k);
            }
        }
        chosen
    };
    let (costly, cheap) = (pick(true), pick(false));
    let fit_all = |list: &[usize]| -> Vec<Fitted> { list.par_iter().filter_map(|&k| fit(ground, &trials[k], &scores[k])).collect() };
    let mut fitted = fit_all(&cheap);
    // What leaves nothing but noise with fewer parameters needs no shaft as a rival.
    let explained = fitted.iter().map(|f| f.misfit).fold(f64::INFINITY, f64::min);
    if explained > EXPLAINED {
        let worth = worth_their_cost(ground, &trials, &scores, &costly, &fitted);
        let more: Vec<Fitted> = worth.par_iter().filter_map(|(k, score)| fit(ground, &trials[*k], score)).collect();
        fitted.extend(more);
    }
    judge(ground, logs, &mut fitted, tests);
    let mut screened: Vec<(Trial, Score, f64)> = Vec::new();
    for &k in &order {
        let known =
            fitted.iter().any(|f| f.trial.card.id == trials[k].card.id) || screened.iter().any(|(t, ..)| t.card.id == trials[k].card.id);
        if !known {
            let ln_p = (ln_chance(scores[k].gain, scores[k].free) + (tests as f64).ln()).min(0.0);
            screened.push((trials[k].clone(), scores[k].clone(), ln_p));
        }
    }
    Step { fitted, screened, unseen }
}

/// Of the costly trials of each effect the best on an excerpt, with its values there, if there it beats the best of those that were fitted.
fn worth_their_cost(ground: &Ground, trials: &[Trial], scores: &[Score], costly: &[usize], fitted: &[Fitted]) -> Vec<(usize, Score)> {
    let excerpt = ground.excerpt();
    let rows = excerpt.segments[0].clone();
    let cost = |residuals: &[Vec<f64>]| -> f64 {
        let sum = |r: &Vec<f64>| r[rows.clone()].iter().filter(|r| r.is_finite()).map(|r| r * r).sum::<f64>();
        residuals.iter().zip(&ground.weights).map(|(r, w)| w * sum(r)).sum()
    };
    let given: Vec<Vec<f64>> = ground.residuals().into_iter().map(<[f64]>::to_vec).collect();
    let rival = fitted.iter().map(|f| cost(&f.residuals)).fold(cost(&given), f64::min);
    let tried: Vec<(usize, f64, Vec<f64>)> = costly
        .par_iter()
        .map(|&k| {
            let begin = Trial { values: scores[k].values.clone(), ..trials[k].clone() };
            let (system, parameters, own) = ground.with(&begin, &begin.fitted);
            let starts = ground.starts_for(&system, &parameters, &excerpt);
            let place = ground.descend(&system, &parameters, &excerpt, &starts);
            (k, place.linear(&ground.weights).cost, place.parameters.list[own].iter().map(|p| p.value).collect())
        })
        .collect();
    let mut best: Vec<(usize, f64, Vec<f64>)> = Vec::new();
    for one in tried.into_iter().filter(|(_, cost, _)| *cost < WORTH * rival) {
        match best.iter_mut().find(|b| trials[b.0].card.id == trials[one.0].card.id) {
            Some(known) if one.1 < known.1 => *known = one,
            Some(_) => {}
            None => best.push(one),
        }
    }
    // The model's own parameters begin where they are: the excerpt knows less of them than the whole log.
    best.into_iter().map(|(k, _, values)| (k, Score { values, step: vec![0.0; scores[k].step.len()], ..scores[k].clone() })).collect()
}

/// How many chances one step gives to chance: every trial, and every order that was looked at.
fn number_of_tests(trials: &[Trial]) -> usize {
    let scanned = trials.iter().any(|t| t.card.id == "cogging");
    trials.len() + if scanned { 2 * HIGHEST } else { 0 }
}

/// Score of one degree of freedom that chance reaches less often than [`FAMILYWISE`] in so many tests.
fn critical_gain(tests: usize) -> f64 {
    let wanted = (FAMILYWISE / tests.max(1) as f64).ln();
    let (mut low, mut high) = (0.0, 200.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if ln_chance(middle, 1) > wanted { low = middle } else { high = middle }
    }
    high
}

/// Fits a trial in full, from where its score promises most.
fn fit(ground: &Ground, trial: &Trial, score: &Score) -> Option<Fitted> {
    let record = ground.record_for(trial);
    let begin = Trial { values: score.values.clone(), ..trial.clone() };
    let (system, at_own, own) = ground.with(&begin, &begin.fitted);
    // The model's own parameters go along, as the linear model says; or stay where they are.
    let mut moved = at_own.clone();
    let base = ground.held.parameters.moved(&score.step);
    moved.list[..base.list.len()].clone_from_slice(&base.list);
    let starts = ground.starts_for(&system, &at_own, &record);
    let finish = |parameters: &Parameters| ground.descend(&system, parameters, &record, &starts);
    let mut place = finish(&moved);
    let cost = |place: &crate::fit::solve::Place| place.linear(&ground.weights).cost;
    let reached = ground.held.chi2 - cost(&place);
    if reached.is_nan() || reached <= 0.3 * score.gain {
        let other = finish(&at_own);
        if cost(&other) < cost(&place) || !cost(&place).is_finite() {
            place = other;
        }
    }
    let linear = place.linear(&ground.weights);
    if !linear.cost.is_finite() {
        return None;
    }
    let free = place.parameters.free().len();
    let rows = record.len() * record.channels.len();
    let excess = (linear.cost / rows as f64).max(1.0);
    let covariance = linear.profiled().0.try_inverse().map(|c| c * excess);
    let sigmas = covariance.map_or_else(|| vec![0.0; place.parameters.list.len()], |c| place.parameters.sigmas(&c));
    let scanned = trial.card.parameters.iter().filter(|p| p.kind == Kind::Order).count();
    let more = free - ground.held.parameters.free().len() + scanned;
    Some(Fitted {
        trial: trial.clone(),
        own,
        sigmas,
        cost: linear.cost,
        misfit: misfit(shown_of(ground, &place.pass.residuals).iter().map(|s| s.ratio().powi(2))),
        residuals: std::mem::take(&mut place.pass.residuals),
        parameters: place.parameters,
        starts: place.starts,
        system,
        more,
        delta_bic: 0.0,
        ln_p: 0.0,
        refused: None,
    })
}

fn slices(residuals: &[Vec<f64>]) -> Vec<&[f64]> {
    residuals.iter().map(Vec::as_slice).collect()
}

/// Evidence for every fitted candidate against the model without it, on residuals that the best of them whitens.
fn judge(ground: &Ground, logs: &[Range<usize>], fitted: &mut Vec<Fitted>, tests: usize) {
    let Some(best) = fitted.iter().min_by(|a, b| a.cost.total_cmp(&b.cost)) else { return };
    let whitener = Whitener::of(&ground.record_for(&best.trial), &slices(&best.residuals));
    let without = ground.squares(&whitener, logs);
    let all: Vec<Squares> =
        fitted.par_iter().map(|f| whitener.squares(&f.system, &f.parameters, &f.starts, &ground.record_for(&f.trial), logs)).collect();
    for (f, squares) in fitted.iter_mut().zip(all) {
        let gain = without.gain(&squares);
        f.delta_bic = delta_bic(gain, f.more, without.witnesses());
        f.ln_p = (ln_chance(gain, f.more) + (tests as f64).ln()).min(0.0);
        f.refused = refusal(ground, logs, f, &without, &squares);
    }
    fitted.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic).then(place(a.trial.card).cmp(&place(b.trial.card))));
    // Of one effect the best trial is its candidate.
    let mut seen: Vec<&str> = Vec::new();
    fitted.retain(|f| {
        let new = !seen.contains(&f.trial.card.id);
        seen.push(f.trial.card.id);
        new
    });
}

/// Why a fitted candidate cannot be the explanation, whatever its figures.
fn refusal(ground: &Ground, logs: &[Range<usize>], f: &Fitted, without: &Squares, with: &Squares) -> Option<String> {
    for (k, p) in f.parameters.list.iter().enumerate() {
        let own = f.own.contains(&k);
        let (low, high) = p.range;
        let slack = WITHIN_ERROR * f.sigmas[k];
        // A level at zero is no effect at all.
        let absent = own && p.kind == Kind::Level && !p.fixed && p.value <= low && !f.trial.card.polar;
        if absent {
            return Some(format!("its {} would have to be negative", p.name));
        }
        if p.fixed || p.kind == Kind::Phase || (p.value >= low - slack && p.value <= high + slack) {
            continue;
        }
        let before = ground.held.parameters.list.get(k).map(|q| q.value);
        if own || before.is_some_and(|v| v >= low && v <= high) {
            let which = if own { "its" } else { "with it the model's" };
            return Some(format!("{which} {} would be {:.3e}, outside its physical range", p.name, p.value));
        }
    }
    if with.gain(without) > 0.0 {
        return Some("the residuals are no smaller with it".to_owned());
    }
    let seen = without.held_out_gain(with);
    if seen < -AGAINST {
        return Some("on the rows that the fit never saw the error grows".to_owned());
    }
    if logs.len() > 1 {
        for log in 0..logs.len() {
            if without.gain_on(with, log) < -AGAINST {
                return Some(format!("it helps the logs together and makes log {} worse", log + 1));
            }
        }
    }
    None
}

fn place(card: &Card) -> usize {
    CATALOGUE.iter().position(|c| c.id == card.id).unwrap_or(usize::MAX)
}

impl Fitted {
    /// It earns its place.
    fn earns(&self) -> bool {
        self.refused.is_none() && self.ln_p < FAMILYWISE.ln() && self.delta_bic < -APART
    }

    fn estimates(&self) -> Vec<Estimate> {
        let own = self.parameters.list[self.own.clone()].iter().zip(&self.sigmas[self.own.clone()]);
        own.zip(self.trial.card.parameters)
            .map(|((p, sigma), info)| Estimate { name: p.name.clone(), unit: info.unit, value: p.value, sigma: *sigma })
            .collect()
    }
}

impl Step {
    /// Which candidate is added, with the rivals that the log cannot tell from it; `None` where none earns its place.
    fn choice(&self) -> Option<(usize, Vec<Trial>)> {
        let best = self.fitted.iter().find(|f| f.earns())?.delta_bic;
        let alike: Vec<usize> =
            (0..self.fitted.len()).filter(|&k| self.fitted[k].earns() && self.fitted[k].delta_bic < best + APART).collect();
        let first = alike.iter().copied().min_by_key(|&k| place(self.fitted[k].trial.card))?;
        let rivals = self.fitted.iter().enumerate().filter(|(k, f)| *k != first && f.refused.is_none()).map(|(_, f)| f.trial.clone());
        Some((first, rivals.take(4).collect()))
    }

    /// The step's candidates as the answer shows them.
    fn candidates(&self, ground: &Ground) -> Vec<Candidate> {
        let best = self.fitted.iter().find(|f| f.earns()).map(|f| f.delta_bic);
        let named = |f: &Fitted| ground.model.next_name(f.trial.card.id);
        let mut list: Vec<Candidate> = self
            .fitted
            .iter()
            .map(|f| {
                let close = |a: f64, b: f64| (a - b).abs() < APART;
                let near_best = best.is_some_and(|best| f.earns() && f.delta_bic < best + APART);
                let ambiguous_with = if near_best {
                    let others = self.fitted.iter().filter(|o| o.trial.card.id != f.trial.card.id && o.earns());
                    others.filter(|o| close(o.delta_bic, f.delta_bic) && best.is_some_and(|b| o.delta_bic < b + APART)).map(named).collect()
                } else {
                    Vec::new()
                };
                Candidate {
                    effect: named(f),
                    parameters: f.estimates(),
                    refitted: true,
                    outputs: shown_of(ground, &f.residuals),
                    delta_bic: Some(f.delta_bic),
                    p_value: f.ln_p.exp(),
                    log10_p: f.ln_p / std::f64::consts::LN_10,
                    ambiguous_with,
                    refused: f.refused.clone(),
                }
            })
            .collect();
        // The one that is named first stands first.
        if let Some((first, _)) = self.choice() {
            let chosen = list.remove(first);
            list.insert(0, chosen);
        }
        for (trial, score, ln_p) in &self.screened {
            let refused = if score.negative {
                Some("its best amplitude would be negative, which physics does not allow".to_owned())
            } else if score.apart <= ALIKE {
                Some("this log cannot tell it from the model's own parameters".to_owned())
            } else {
                None
            };
            let parameters = trial.card.parameters.iter().zip(&score.values);
            list.push(Candidate {
                effect: ground.model.next_name(trial.card.id),
                parameters: parameters.map(|(p, v)| Estimate { name: p.name.to_owned(), unit: p.unit, value: *v, sigma: 0.0 }).collect(),
                refitted: false,
                outputs: Vec::new(),
                delta_bic: None,
                p_value: ln_p.exp(),
                log10_p: ln_p / std::f64::consts::LN_10,
                ambiguous_with: Vec::new(),
                refused,
            });
        }
        for unseen in &self.unseen {
            list.push(Candidate {
                effect: ground.model.next_name(unseen.card.id),
                parameters: Vec::new(),
                refitted: false,
                outputs: Vec::new(),
                delta_bic: None,
                p_value: 1.0,
                log10_p: 0.0,
                ambiguous_with: Vec::new(),
                refused: Some(unseen.says.clone()),
            });
        }
        list
    }
}

/// Channels of residuals that were not held as a fit.
fn shown_of(ground: &Ground, residuals: &[Vec<f64>]) -> Vec<Shown> {
    let record = &ground.record;
    ground
        .held
        .channels
        .iter()
        .zip(residuals)
        .map(|(f, residual)| {
            let rms = |held: bool| {
                let rows = residual.iter().enumerate().filter(|(k, r)| r.is_finite() && record.held_out(*k) == held);
                let (sum, n) = rows.fold((0.0, 0usize), |(s, n), (_, r)| (s + r * r, n + 1));
                (n > 0).then(|| (sum / n as f64).sqrt())
            };
            Shown { shows: f.shows, rms: rms(false).unwrap_or(f64::NAN), heldout_rms: rms(true), noise: f.noise }
        })
        .collect()
}

/// The model with a fitted candidate in it, and the candidate's name there.
fn added(model: &Model, f: &Fitted) -> (Model, String) {
    let name = model.next_name(f.trial.card.id);
    let mut next = model.clone();
    if next.add(&name).is_err() {
        return (next, name);
    }
    for p in &f.parameters.list[..f.own.start] {
        let _ = next.set(&p.name, p.value);
    }
    let names: Vec<String> = match next.effects().iter().find(|e| e.name() == name) {
        Some(found) => found.parameters.iter().map(|&k| next.parameters()[k].name.clone()).collect(),
        None => return (next, name),
    };
    for (k, name) in names.iter().enumerate() {
        let p = &f.parameters.list[f.own.start + k];
        let _ = next.set(name, p.value.clamp(p.range.0, p.range.1));
        if !f.trial.fitted[k] && p.kind != Kind::Order {
            let _ = next.fix(name, true);
        }
    }
    (next, name)
}

/// Is every earlier effect still needed, and still better than its rivals? What is not goes, or is exchanged.
fn reconsider(path: &mut Path, rivals: &mut Vec<(String, Vec<Trial>)>, logs: &[Range<usize>]) -> Result<(), FitError> {
    let mut k = 0;
    while k + 1 < path.missing.len() {
        let Some(last) = path.grounds.last() else { break };
        let name = path.missing[k].clone();
        let mut model = last.model.clone();
        if model.remove(&name).is_err() {
            k += 1;
            continue;
        }
        let without = last.refit(&model, last.record.clone())?;
        let whitener = Whitener::of(&last.record, &last.residuals());
        let (full, less) = (last.squares(&whitener, logs), without.squares(&whitener, logs));
        let more = last.held.parameters.free().len() - without.held.parameters.free().len();
        if delta_bic(less.gain(&full), more, full.witnesses()) > -APART {
            path.remarks.push(format!("{name} was added first and is no longer needed beside {}", path.missing[k + 1..].join(", ")));
            path.missing.remove(k);
            rivals.remove(k);
            // The stages after it were fitted with it.
            path.grounds.truncate(k + 1);
            let mut grounds = Vec::new();
            for name in &path.missing[k..] {
                let before = grounds.last().or(path.grounds.last());
                let Some(before) = before else { break };
                let mut model: Model = before.model.clone();
                copy_effect(&without.model, &mut model, name);
                grounds.push(before.refit(&model, without.record.clone())?);
            }
            path.grounds.extend(grounds);
            continue;
        }
        // A rival of an earlier effect, in its place.
        let own_bic = delta_bic(less.gain(&full), more, full.witnesses());
        let base = Score {
            gain: 0.0,
            free: 0,
            step: vec![0.0; without.held.parameters.free().len()],
            values: Vec::new(),
            apart: 1.0,
            negative: false,
        };
        let tried: Vec<Fitted> = rivals[k]
            .1
            .par_iter()
            .filter(|trial| may_be_added(&without.model, trial.card))
            .filter_map(|trial| {
                let score = scores(&without, std::slice::from_ref(trial)).into_iter().next().unwrap_or_else(|| base.clone());
                fit(&without, trial, &score)
            })
            .collect();
        let better = tried
            .into_iter()
            .filter_map(|f| {
                let with = whitener.squares(&f.system, &f.parameters, &f.starts, &without.record_for(&f.trial), logs);
                let bic = delta_bic(less.gain(&with), f.more, full.witnesses());
                let refused = refusal(&without, logs, &f, &less, &with).is_some();
                (!refused && bic < own_bic - APART).then_some((f, bic))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((f, _)) = better {
            let (model, other) = added(&without.model, &f);
            path.remarks
                .push(format!("{name} was added first; beside {} {other} does better in its place", path.missing[k + 1..].join(", ")));
            let record = without.record_for(&f.trial);
            path.missing[k] = other.clone();
            rivals[k] = (other, Vec::new());
            let end = without.refit(&model, record)?;
            path.grounds.truncate(k + 1);
            let mut grounds: Vec<Ground> = Vec::new();
            for name in &path.missing[k..] {
                let Some(before) = grounds.last().or(path.grounds.last()) else { break };
                let mut stage: Model = before.model.clone();
                copy_effect(&end.model, &mut stage, name);
                grounds.push(before.refit(&stage, end.record.clone())?);
            }
            path.grounds.extend(grounds);
        }
        k += 1;
    }
    Ok(())
}

/// Adds effect `name` of `from` to `to`, with its values.
fn copy_effect(from: &Model, to: &mut Model, name: &str) {
    if to.add(name).is_err() {
        return;
    }
    let Some(found) = from.effects().iter().find(|e| e.name() == name) else { return };
    for &k in &found.parameters {
        let p = &from.parameters()[k];
        let _ = to.set(&p.name, p.value);
        if p.fixed {
            let _ = to.fix(&p.name, true);
        }
    }
}

/// BIC on whitened residuals of `last` minus that of `first`, which has fewer parameters.
pub fn evidence(first: &Ground, last: &Ground, logs: &[Range<usize>]) -> f64 {
    let whitener = Whitener::of(&last.record, &last.residuals());
    let (before, after) = (first.squares(&whitener, logs), last.squares(&whitener, logs));
    let more = last.held.parameters.free().len().saturating_sub(first.held.parameters.free().len());
    delta_bic(before.gain(&after), more, before.witnesses())
}

/// A ground as a stage of the answer.
pub fn stage(ground: &Ground, added: Option<&String>) -> Stage {
    let held = &ground.held;
    let unit = |name: &str| {
        let own = ground.model.parameter(name).and_then(|p| p.info);
        own.map_or("", |info| info.unit)
    };
    Stage {
        effects: ground.model.effect_names(),
        added: added.cloned(),
        outputs: held.channels.iter().map(shown).collect(),
        parameters: held
            .parameters
            .list
            .iter()
            .zip(&held.sigmas)
            .filter(|(p, _)| !p.fixed)
            .map(|(p, sigma)| Estimate { name: p.name.clone(), unit: unit(&p.name), value: p.value, sigma: *sigma })
            .collect(),
    }
}

fn shown(f: &Fitness) -> Shown {
    Shown { shows: f.shows, rms: f.rms, heldout_rms: f.heldout_rms, noise: f.noise }
}
