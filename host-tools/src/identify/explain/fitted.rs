//! One candidate, fitted in full, and what speaks for and against it.

use std::ops::Range;

use drive_model::{CATALOGUE, Card, ParameterKind};

use super::evidence::Squares;
use super::ground::{Goal, Ground, leaves_far_less, misfit};
use super::screen::Score;
use super::trial::Trial;
use super::{Estimate, Shown};
use crate::identify::fit::Parameters;
use crate::identify::fit::normal_equations::InitialStates;
use crate::identify::fit::simulate::System;
use crate::identify::fit::solve::Iterate;
use crate::model::Model;

/// Probability of adding anything to a model that lacks nothing, per step and over the whole catalogue.
pub const FAMILYWISE: f64 = 0.002;
/// BIC by which rivals must differ to be told apart (interfaces.md), and by which an effect must pay.
pub const APART: f64 = 6.0;
/// FitResult-out rows, or another log, speak against an effect where their likelihood falls by more than this.
const AGAINST: f64 = 6.0;
/// A gain below this (2 ln of the likelihood ratio) is little, and must be found again on held-out rows, which are a third as many as the
/// fitted ones: at least this part of it.
const LITTLE: f64 = 200.0;
const CONFIRMED: f64 = 0.1;
/// χ²/n up to which a model leaves only noise, and the gain from which on something is still added to it: below, it may as well be an error
/// of the steps.
pub const EXPLAINED: f64 = 1.03;
const BEYOND_STEPS: f64 = 100.0;
/// χ²/n from which on much is unexplained, and the part of it that is hardly anything.
const MUCH: f64 = 4.0;
const HARDLY: f64 = 0.04;
/// Standard errors by which a parameter may lie beyond its physical range.
const WITHIN_ERROR: f64 = 3.0;

/// One candidate, fitted.
pub struct Fitted {
    /// What was tried.
    pub trial: Trial,
    /// The model with it.
    pub system: System,
    /// Initial states.
    pub starts: InitialStates,
    /// All parameters with it.
    pub parameters: Parameters,
    /// Which of them are its own.
    pub own: Range<usize>,
    /// Their standard errors, of all.
    pub sigmas: Vec<f64>,
    /// Residuals, by channel.
    pub residuals: Vec<Vec<f64>>,
    /// Weighted sum of squares.
    pub cost: f64,
    /// The largest χ²/n of its channels.
    pub misfit: f64,
    /// χ²/n of each channel on rows that the fit never saw.
    pub heldout: Vec<f64>,
    /// Parameters that it has more than the model, scanned ones too.
    pub more: usize,
    /// BIC on whitened residuals with it, minus that without.
    pub delta_bic: f64,
    /// Logarithm of the familywise probability of as much by chance.
    pub ln_p: f64,
    /// Why it cannot be the explanation.
    pub refused: Option<String>,
}

/// Parts of an absent effect's first step that are tried, until one helps.
const SHARES: &[f64] = &[1.0, 0.3, 0.1, 0.03];

/// Fits a trial from where its score promises most, until it is clear whether it can reach a rival of the χ² `rival`.
pub fn fit(ground: &Ground, trial: &Trial, score: &Score, rival: f64) -> Option<Fitted> {
    let record = ground.record_for(trial);
    let (system, parameters, own) = ground.with(trial, &trial.fitted);
    let starts = ground.starts_for(&system, &parameters, &record);
    let cost = |place: &Iterate| place.normal_equations(&ground.weights).cost;
    let race = |begin: Iterate| ground.descend_from(&system, &record, begin, Goal::Race(rival));
    let begin = |share: f64, along: bool| {
        let mut parameters = parameters.clone();
        for (p, value) in parameters.list[own.clone()].iter_mut().zip(part_of_the_way(trial, score, share)) {
            p.value = value;
        }
        if along {
            let step: Vec<f64> = score.step.iter().map(|s| share * s).collect();
            let base = ground.held.parameters.moved(&step);
            parameters.list[..base.list.len()].clone_from_slice(&base.list);
        }
        Iterate::new(&system, &parameters, &record, &starts)
    };
    // As far along as it helps: a whole step may hold the rotor fast, and from there no derivative leads back.
    let tried = if trial.absent { SHARES } else { &[1.0, 0.0] };
    let mut from = (1.0, begin(1.0, true));
    for &share in &tried[1..] {
        if cost(&from.1) < ground.held.chi2 {
            break;
        }
        let shorter = begin(share, true);
        if cost(&shorter) < cost(&from.1) || !cost(&from.1).is_finite() {
            from = (share, shorter);
        }
    }
    let (share, from) = from;
    // The model's own parameters go along, as the linear model says; or stay where they are.
    let mut place = race(from);
    let reached = ground.held.chi2 - cost(&place);
    if share > 0.0 && (reached.is_nan() || reached <= 0.3 * score.gain) {
        let other = race(begin(share, false));
        if cost(&other) < cost(&place) || !cost(&place).is_finite() {
            place = other;
        }
    }
    Fitted::at(ground, trial.clone(), system, own, place)
}

/// Values of a trial at a share of the way that its score promises: an absent effect grows from nothing, another begins at either end.
fn part_of_the_way(trial: &Trial, score: &Score, share: f64) -> Vec<f64> {
    if !trial.absent {
        return if share > 0.0 { score.values.clone() } else { trial.values.clone() };
    }
    let grows = |k: usize| trial.screened[k] && matches!(trial.card.parameters[k].kind, ParameterKind::NonNegative | ParameterKind::Signed);
    score.values.iter().enumerate().map(|(k, value)| if grows(k) { share * value } else { *value }).collect()
}

impl Fitted {
    /// A trial at the end of its descent; `None` where the model cannot be simulated there.
    fn at(ground: &Ground, trial: Trial, system: System, own: Range<usize>, place: Iterate) -> Option<Self> {
        let linear = place.normal_equations(&ground.weights);
        if !linear.cost.is_finite() {
            return None;
        }
        let rows = ground.record.len() * ground.record.channels.len();
        let excess = (linear.cost / rows as f64).max(1.0);
        let covariance = linear.profiled().0.try_inverse().map(|c| c * excess);
        let sigmas = covariance.map_or_else(|| vec![0.0; place.parameters.list.len()], |c| place.parameters.sigmas(&c));
        let scanned = trial.card.parameters.iter().filter(|p| p.kind == ParameterKind::HarmonicOrder).count();
        let shown = shown_of(ground, &place.linearization.residuals);
        Some(Fitted {
            more: place.parameters.free().len() - ground.held.parameters.free().len() + scanned,
            misfit: misfit(shown.iter().map(|s| s.ratio().powi(2))),
            heldout: shown.iter().map(|s| (s.heldout_rms.unwrap_or(s.rms) / s.noise).powi(2)).collect(),
            trial,
            own,
            sigmas,
            cost: linear.cost,
            residuals: place.linearization.residuals,
            parameters: place.parameters,
            starts: place.starts,
            system,
            delta_bic: 0.0,
            ln_p: 0.0,
            refused: None,
        })
    }

    /// The rest of the way, for one that may be the best.
    pub fn finished(self, ground: &Ground) -> Self {
        let record = ground.record_for(&self.trial);
        let place = ground.minimize(&self.system, &self.parameters, &record, &self.starts, Goal::End);
        let (trial, system, own) = (self.trial.clone(), self.system.clone(), self.own.clone());
        Fitted::at(ground, trial, system, own, place).unwrap_or(self)
    }

    /// What was fitted to short windows, fitted to the whole of this ground's record.
    pub fn along(self, ground: &Ground, rival: f64) -> Option<Self> {
        let record = ground.record_for(&self.trial);
        let parameters = ground.lengthened(&self.system, &self.parameters, &record);
        let starts = ground.starts_for(&self.system, &parameters, &record);
        let place = ground.minimize(&self.system, &parameters, &record, &starts, Goal::Race(rival));
        Fitted::at(ground, self.trial, self.system, self.own, place)
    }

    /// Another start of the same structure: only the better of the two is of interest.
    pub fn is_the_same_as(&self, other: &Fitted) -> bool {
        let (one, two) = (&self.trial, &other.trial);
        let given = |t: &Trial| t.values.iter().zip(&t.fitted).filter(|(_, fitted)| !**fitted).map(|(v, _)| *v).collect::<Vec<_>>();
        one.card.id == two.card.id && one.fitted == two.fitted && given(one) == given(two) && one.rate_from_encoder == two.rate_from_encoder
    }

    /// It earns its place.
    pub fn earns(&self) -> bool {
        self.refused.is_none() && self.ln_p < FAMILYWISE.ln() && self.delta_bic < -APART
    }

    /// It leaves far less to explain than `other`, on rows that neither has seen.
    pub fn leaves_far_less_than(&self, other: &Fitted) -> bool {
        leaves_far_less(&self.heldout, &other.heldout)
    }

    pub fn estimates(&self) -> Vec<Estimate> {
        let own = self.parameters.list[self.own.clone()].iter().zip(&self.sigmas[self.own.clone()]);
        own.zip(self.trial.card.parameters)
            .map(|((p, sigma), info)| Estimate { name: p.name.clone(), unit: info.unit, value: p.value, sigma: *sigma })
            .collect()
    }
}

/// Why a fitted candidate cannot be the explanation, whatever its figures.
pub fn refusal(ground: &Ground, logs: &[Range<usize>], f: &Fitted, without: &Squares, with: &Squares) -> Option<String> {
    for (k, p) in f.parameters.list.iter().enumerate() {
        let own = f.own.contains(&k);
        let (low, high) = p.range;
        let slack = WITHIN_ERROR * f.sigmas[k];
        if own && p.name == "gap_rad" && p.value < WITHIN_ERROR * f.sigmas[k] {
            return Some("its gap_rad is not told from zero: a shaft without play, which is compliance".to_owned());
        }
        // A level at zero is no effect at all.
        let absent = own && p.kind == ParameterKind::NonNegative && !p.fixed && p.value <= low && !f.trial.card.polar;
        if absent {
            return Some(format!("its {} would have to be negative", p.name));
        }
        if p.fixed || p.kind == ParameterKind::Phase || (p.value >= low - slack && p.value <= high + slack) {
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
    let (gain, seen) = (without.gain(with), without.held_out_gain(with));
    if seen < -AGAINST {
        return Some("on the rows that the fit never saw the error grows".to_owned());
    }
    if gain < LITTLE && without.holds_rows_out() && seen < CONFIRMED * gain {
        return Some("what little it explains is not found again on the rows that the fit never saw".to_owned());
    }
    if ground.misfit() <= EXPLAINED && gain < BEYOND_STEPS {
        return Some("without it only noise is left, and what it explains of that is too little to be sure".to_owned());
    }
    if ground.misfit() > MUCH {
        // While so much is unexplained, whitened residuals are mostly its colour; what is shown must get better too.
        let falls = || ground.heldout().into_iter().zip(&f.heldout).map(|(before, after)| after / before);
        if falls().any(|fall| fall > 1.0 + HARDLY) {
            return Some("on the rows that the fit never saw the error of a channel grows".to_owned());
        }
        if falls().all(|fall| fall > 1.0 - HARDLY) {
            return Some("it explains hardly any of the much that is left".to_owned());
        }
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

pub fn place(card: &Card) -> usize {
    CATALOGUE.iter().position(|c| c.id == card.id).unwrap_or(usize::MAX)
}

/// Channels of residuals that were not held as a fit.
pub fn shown_of(ground: &Ground, residuals: &[Vec<f64>]) -> Vec<Shown> {
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
            Shown { channel: f.channel, rms: rms(false).unwrap_or(f64::NAN), heldout_rms: rms(true), noise: f.noise }
        })
        .collect()
}

pub fn slices(residuals: &[Vec<f64>]) -> Vec<&[f64]> {
    residuals.iter().map(Vec::as_slice).collect()
}

/// The model with a fitted candidate in it, and the candidate's name there.
pub fn added(model: &Model, f: &Fitted) -> (Model, String) {
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
        if !f.trial.fitted[k] && p.kind != ParameterKind::HarmonicOrder {
            let _ = next.fix(name, true);
        }
    }
    (next, name)
}
