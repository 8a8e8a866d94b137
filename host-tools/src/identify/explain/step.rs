//! One adding step: everything is screened, the best few are fitted in full, and judged together by their whitened residuals.

use std::ops::Range;

use rayon::prelude::*;

use super::Candidate;
use super::Estimate;
use super::evidence::{Squares, Whitener, delta_bic, ln_chance};
use super::fitted::{APART, EXPLAINED, FAMILYWISE, Fitted, fit, place, refusal, shown_of, slices};
use super::ground::{Goal, Ground, near, within};
use super::orders::{HIGHEST, promising};
use super::screen::{ALIKE, Score, scores};
use super::trial::{Scene, Trial, Unseen, trials};
use crate::identify::fit::solve::Iterate;
use crate::log::Log;
use crate::statistics::Extremes;

/// Candidates that are fitted in full, and the part of the best score from which on.
const FITTED_MOST: usize = 8;
const FITTED_LEAST: usize = 4;
const FITTED_PART: f64 = 0.25;
/// One step from a finite trial promises only roughly.
const ROUGH_PART: f64 = 0.05;
/// χ²/n above which the model's own parameters may have run away, and how many trials are then fitted from short windows.
const FAR_OFF: f64 = 25.0;
const FROM_WINDOWS: usize = 6;
/// Part of what the best leaves in short windows by which another may leave more.
const LIKELY: f64 = 1.0;
/// Standard errors below which a play may be none.
const CLOSED: f64 = 10.0;
/// Part of what the best explains by which another may explain less and still be fitted to the end.
const HALF: f64 = 0.5;
/// A costly candidate is fitted to the whole log where it leaves less than this part of what the best other leaves of an excerpt.
const WORTH: f64 = 0.7;

/// One adding step: everything that was tried.
pub struct Step {
    /// Candidates that were fitted, the best first.
    pub fitted: Vec<Fitted>,
    /// The rest: best score of each effect that was only screened.
    screened: Vec<(Trial, Score, f64)>,
    unseen: Vec<Unseen>,
}

/// Everything that can be tried on a ground, screened.
struct Field {
    trials: Vec<Trial>,
    unseen: Vec<Unseen>,
    scores: Vec<Score>,
    /// The trials, who promises most first.
    order: Vec<usize>,
    /// How many chances one step gives to chance.
    tests: usize,
    /// The score that chance hardly reaches in so many tests.
    critical: f64,
}

impl Field {
    fn of(log: &Log, ground: &Ground) -> Self {
        let orders = promising(&ground.model, &ground.record, &ground.residuals(), &ground.weights);
        let (mut trials, unseen) = trials(&Scene { model: &ground.model, log, record: &ground.record, orders });
        if ground.misfit() <= EXPLAINED {
            // A shaft that shows leaves more than that.
            trials.retain(|t| !t.is_costly());
        }
        let scores = scores(ground, &trials);
        let mut order: Vec<usize> = (0..trials.len()).collect();
        order.sort_by(|a, b| scores[*b].gain.total_cmp(&scores[*a].gain));
        let tests = number_of_tests(&trials);
        Field { trials, unseen, scores, order, tests, critical: critical_gain(tests) }
    }

    /// The most promising of the costly trials, or of the others. Costly trials were scored on an excerpt: their gains stand apart.
    fn pick(&self, costly: bool) -> Vec<usize> {
        let Field { trials, scores, .. } = self;
        let mut chosen: Vec<usize> = Vec::new();
        let mut best = 0.0;
        for &k in self.order.iter().filter(|&&k| trials[k].is_costly() == costly) {
            best = f64::max(best, scores[k].gain);
            let alike = |other: &&usize| trials[**other].card.id == trials[k].card.id && trials[**other].screened == trials[k].screened;
            let rough = !trials[k].absent || trials[k].screened != trials[k].fitted;
            let part = if rough { ROUGH_PART } else { FITTED_PART };
            let few = chosen.iter().filter(alike).count() < 1 + usize::from(costly || scores[k].gain > 0.6 * best);
            let worth = scores[k].gain > part * best || chosen.len() < FITTED_LEAST;
            if scores[k].gain > self.critical && worth && few && chosen.len() < FITTED_MOST {
                chosen.push(k);
            }
        }
        chosen
    }

    /// The best score of each effect that was not fitted, with its probability by chance.
    fn only_screened(&self, fitted: &[Fitted]) -> Vec<(Trial, Score, f64)> {
        let mut screened: Vec<(Trial, Score, f64)> = Vec::new();
        for &k in &self.order {
            let (trial, score) = (&self.trials[k], &self.scores[k]);
            let known = fitted.iter().map(|f| &f.trial).chain(screened.iter().map(|(t, ..)| t)).any(|t| t.card.id == trial.card.id);
            if !known {
                let ln_p = (ln_chance(score.gain, score.free) + (self.tests as f64).ln()).min(0.0);
                screened.push((trial.clone(), score.clone(), ln_p));
            }
        }
        screened
    }
}

/// Screens everything, fits the best few, judges them together.
pub fn step(log: &Log, logs: &[Range<usize>], ground: &Ground) -> Step {
    let short = if ground.misfit() > FAR_OFF { from_windows(log, ground) } else { None };
    let (field, fitted) = match short {
        // What short windows explain need not be looked for from where the model's own parameters have run away to.
        Some((field, fitted)) if explained(&fitted) <= EXPLAINED => (field, fitted),
        other => {
            let field = Field::of(log, ground);
            let fitted = along(ground, &field, other.map_or_else(Vec::new, |(_, fitted)| fitted));
            (field, fitted)
        }
    };
    // Who may be the best: near to it in what it leaves, and in what it explains.
    let best = least(&fitted);
    let near = near(best, &ground.record).min(best + HALF * (ground.held.chi2 - best).max(0.0));
    let mut fitted: Vec<Fitted> =
        best_of_each(fitted).into_par_iter().map(|f| if f.cost <= near { f.finished(ground) } else { f }).collect();
    judge(ground, logs, &mut fitted, field.tests);
    Step { screened: field.only_screened(&fitted), fitted, unseen: field.unseen }
}

/// The best few of the field beside those that are `fitted` already, each fitted to the whole log.
fn along(ground: &Ground, field: &Field, mut fitted: Vec<Fitted>) -> Vec<Fitted> {
    let Field { trials, scores, .. } = field;
    let cheap = field.pick(false);
    // Who promises most goes first: the others need not be followed to the end where they cannot reach it.
    let (first, others) = cheap.split_at(cheap.len().min(2));
    for list in [first, others] {
        let rival = least(&fitted);
        let more: Vec<Fitted> = list.par_iter().filter_map(|&k| fit(ground, &trials[k], &scores[k], rival)).collect();
        fitted.extend(more);
    }
    // What leaves nothing but noise with fewer parameters needs no shaft as a rival.
    if explained(&fitted) > EXPLAINED {
        let worth = worth_their_cost(ground, trials, scores, &field.pick(true), &fitted);
        let rival = least(&fitted);
        let more: Vec<Fitted> = worth.par_iter().filter_map(|(k, score)| fit(ground, &trials[*k], score, rival)).collect();
        let without_play = more.iter().find_map(|f| shaft_alone(ground, trials, f));
        fitted.extend(more);
        fitted.extend(without_play);
    }
    fitted
}

/// The least χ²/n that one of them leaves in its worst channel.
fn explained(fitted: &[Fitted]) -> f64 {
    fitted.iter().map(|f| f.misfit).min_or_infinity()
}

/// The least χ² among them; infinite where there is none.
fn least(fitted: &[Fitted]) -> f64 {
    fitted.iter().map(|f| f.cost).min_or_infinity()
}

/// The best first, and of several starts of one structure the best alone.
fn best_of_each(mut fitted: Vec<Fitted>) -> Vec<Fitted> {
    fitted.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut best: Vec<Fitted> = Vec::new();
    for f in fitted {
        if !best.iter().any(|b| b.is_the_same_as(&f)) {
            best.push(f);
        }
    }
    best
}

/// The best trials of short windows, fitted there and from there to the whole log; `None` where there are too few windows.
fn from_windows(log: &Log, ground: &Ground) -> Option<(Field, Vec<Fitted>)> {
    let short = ground.fit_windows()?;
    let (field, mut tried) = in_short(log, &short, Vec::new());
    if explained(&tried) > EXPLAINED
        && let Some(begun) = short.as_begun()
    {
        // Even in short windows what is missing may have carried the model's own parameters off.
        tried = in_short(log, &begun, tried).1;
    }
    // Who leaves twice as much as the best even there has no prospect along the whole log.
    let prospect = within(LIKELY, least(&tried), &short.record);
    tried.retain(|f| f.cost < prospect);
    let mut tried = best_of_each(tried);
    let mut fitted: Vec<Fitted> = Vec::new();
    while !tried.is_empty() {
        let rival = least(&fitted);
        let few: Vec<Fitted> = tried.drain(..tried.len().min(2)).collect();
        fitted.extend(few.into_par_iter().filter_map(|f| f.along(ground, rival)).collect::<Vec<_>>());
    }
    Some((field, fitted))
}

/// The most promising trials of a ground of short windows, fitted there, beside those that are `tried` already.
fn in_short(log: &Log, short: &Ground, mut tried: Vec<Fitted>) -> (Field, Vec<Fitted>) {
    let field = Field::of(log, short);
    let Field { trials, scores, .. } = &field;
    let mut chosen: Vec<usize> = Vec::new();
    for &k in field.order.iter().filter(|&&k| scores[k].gain > field.critical && !trials[k].is_costly()) {
        let alike = chosen.iter().filter(|&&other| trials[other].card.id == trials[k].card.id).count();
        if chosen.len() < FROM_WINDOWS && alike < 2 {
            chosen.push(k);
        }
    }
    for few in chosen.chunks(2) {
        let rival = least(&tried);
        tried.extend(few.par_iter().filter_map(|&k| fit(short, &trials[k], &scores[k], rival)).collect::<Vec<_>>());
    }
    (field, tried)
}

/// A shaft whose play has closed, fitted without it.
fn shaft_alone(ground: &Ground, trials: &[Trial], f: &Fitted) -> Option<Fitted> {
    let [gap_rad, shaft @ ..] = &f.parameters.list[f.own.clone()] else { return None };
    if gap_rad.name != "gap_rad" || gap_rad.value > CLOSED * f.sigmas[f.own.start] {
        return None;
    }
    let trial = trials.iter().find(|t| t.card.id == "compliance")?;
    let values: Vec<f64> = shaft.iter().map(|p| p.value).collect();
    let step = vec![0.0; ground.held.parameters.free().len()];
    let score = Score { gain: 0.0, free: values.len(), step, values: values.clone(), apart: 1.0, negative: false };
    fit(ground, &Trial { values, ..trial.clone() }, &score, f64::INFINITY)
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
            // From the trial's own values, or a step further where that is better.
            let at = |values: &[f64]| {
                let begin = Trial { values: values.to_vec(), ..trials[k].clone() };
                let (system, parameters, own) = ground.with(&begin, &begin.fitted);
                let starts = ground.starts_for(&system, &parameters, &excerpt);
                (Iterate::new(&system, &parameters, &excerpt, &starts), system, own)
            };
            let cost =
                |place: &Iterate| Some(place.normal_equations(&ground.weights).cost).filter(|c| c.is_finite()).unwrap_or(f64::INFINITY);
            let (here, further) = (at(&trials[k].values), at(&scores[k].values));
            let (begin, system, own) = if cost(&further.0) < cost(&here.0) { further } else { here };
            let place = ground.descend_from(&system, &excerpt, begin, Goal::Race(WORTH * rival));
            (k, place.normal_equations(&ground.weights).cost, place.parameters.list[own].iter().map(|p| p.value).collect())
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

impl Step {
    /// The best that earns its place: by BIC; but whitening weighs lightly what is slow, and while much is left unexplained, who leaves far
    /// less of it on rows that the fit never saw goes before.
    fn best(&self) -> Option<&Fitted> {
        let mut best = self.fitted.iter().find(|f| f.earns())?;
        while let Some(better) = self.fitted.iter().find(|f| f.earns() && f.leaves_far_less_than(best)) {
            best = better;
        }
        Some(best)
    }

    /// The log cannot tell it from the best.
    fn is_as_good(f: &Fitted, best: &Fitted) -> bool {
        f.earns() && f.delta_bic < best.delta_bic + APART && !best.leaves_far_less_than(f)
    }

    /// Which candidate is added, with the rivals that may take its place later; `None` where none earns its place.
    pub fn choice(&self) -> Option<(usize, Vec<Trial>)> {
        let best = self.best()?;
        let alike = (0..self.fitted.len()).filter(|&k| Self::is_as_good(&self.fitted[k], best));
        let first = alike.min_by_key(|&k| place(self.fitted[k].trial.card))?;
        let rivals = self.fitted.iter().enumerate().filter(|(k, f)| *k != first && f.refused.is_none()).map(|(_, f)| f.trial.clone());
        Some((first, rivals.take(4).collect()))
    }

    /// The step's candidates as the answer shows them.
    pub fn candidates(&self, ground: &Ground) -> Vec<Candidate> {
        let best = self.best();
        let named = |f: &Fitted| ground.model.next_name(f.trial.card.id);
        let mut list: Vec<Candidate> = self
            .fitted
            .iter()
            .map(|f| {
                let close = |a: f64, b: f64| (a - b).abs() < APART;
                let near_best = |f: &Fitted| best.is_some_and(|best| Self::is_as_good(f, best));
                let others = self.fitted.iter().filter(|o| near_best(f) && near_best(o) && o.trial.card.id != f.trial.card.id);
                let ambiguous_with = others.filter(|o| close(o.delta_bic, f.delta_bic)).map(named).collect();
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
