//! Beam search: the best models are each extended by the best effects, and by coloured noise of a sensor; the best of all extensions are kept, until nothing
//! improves BIC clearly. Then each added effect that the model no longer needs is removed.

use rayon::prelude::*;

use super::candidate::{Candidate, Extension};
use super::colour::coloured_channels;
use super::free_run::{Stage, free_run};
use super::model::PredictedModel;
use super::recorded::conventions;
use super::screen::Screening;
use crate::identify::explain::adequacy::input_between_samples;
use crate::identify::explain::criteria::MisfitClass;
use crate::identify::explain::fitted_model::FittedModel;
use crate::identify::explain::reasons::{Progress, Refusal, Remark};
use crate::identify::explain::trials::is_modified_by_another;
use crate::identify::fit::prepare::PreparationNote;
use crate::identify::fit::{FitError, Parameters, build};
use crate::identify::predict::fit::{NoiseModel, Prediction};
use crate::identify::recording_conventions::min_gain;
use crate::model::Model;

/// Models that are kept at each step.
const BEAM: usize = 2;
/// Effects that are fitted beside each model.
const REFITTED: usize = 6;
/// Effects of these that are fitted with a random torque of their own.
const COMPARED: usize = 4;
/// Part of the best improvement at the density of the model from which on an effect gets a random torque of its own.
const MIN_COMPARED_FRACTION: f64 = 0.1;
/// Smallest improvement of BIC by an added effect: odds of 20 (Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773).
pub const MIN_BIC_IMPROVEMENT: f64 = 6.0;
/// Part of the likelihood that the random torque has gained, which an effect must explain. Beside a structure that no effect has, the random torque is not
/// white, and many effects explain a little of it.
const MIN_PART: f64 = 0.03;
/// Part of the best improvement of BIC from which on another model is extended, too.
const MIN_RIVAL_FRACTION: f64 = 0.5;
/// Extensions that are made at most.
const MAX_ADDED: usize = 10;

/// An added effect.
#[derive(Clone, PartialEq)]
pub struct Addition {
    /// Its name in the model.
    pub name: String,
    /// Increase of BIC by its parameters, and by the choice among all that was tried.
    penalty: f64,
}

/// A model of the beam.
pub struct Node<'a> {
    /// The model.
    pub model: PredictedModel<'a>,
    /// The added effects.
    pub added: Vec<Addition>,
    /// The models before each of them was added.
    pub before: Vec<Stage>,
    /// Conventions by which the log was recorded.
    pub notes: Vec<PreparationNote>,
    /// BIC, with the choice among all that was tried, minus that of the given model.
    pub delta_bic: f64,
}

impl<'a> Node<'a> {
    /// Names of the added effects, in alphabetical order, the channels that have coloured noise, the number of conventions.
    fn structure(&self) -> (Vec<&str>, Vec<bool>, usize) {
        let mut names: Vec<&str> = self.added.iter().map(|a| a.name.as_str()).collect();
        names.sort_unstable();
        (names, self.model.prediction.noise.channels.iter().map(|c| c.coloured.is_some()).collect(), self.notes.len())
    }

    /// The model of the begin of the search.
    pub fn given(&self) -> Option<PredictedModel<'a>> {
        let Stage { model, prediction } = self.before.first()?.clone();
        let fitted = &self.model.fitted;
        let (system, _) = build::system(&model, fitted.data.temp_C.is_some());
        Some(PredictedModel::new(fitted.context, &model, system, prediction.parameters.clone(), &fitted.data, prediction))
    }

    /// Only white noise is left: no other model can be much better.
    fn is_complete(&self) -> bool {
        !self.model.has_random_torque() && coloured_channels(&self.model).is_empty()
    }

    /// The model as a free run.
    fn free_run(&self) -> Result<FittedModel<'a>, FitError> {
        free_run(self.model.fitted.context, &self.stage(), &self.model.fitted.data)
    }

    /// The model as a stage.
    pub fn stage(&self) -> Stage {
        Stage { model: self.model.fitted.model.clone(), prediction: self.model.prediction.clone() }
    }
}

/// What a search found.
pub struct Found<'a> {
    /// The best model.
    pub best: Node<'a>,
    /// The candidates beside the given model, the best first.
    pub first: Vec<Candidate<'a>>,
    /// Everything that was screened beside the given model.
    pub screening: Screening,
    /// Remarks for the user.
    pub remarks: Vec<Remark>,
}

/// Candidates beside a model, the best first.
fn candidates<'a>(node: &Node<'a>, invisible: bool) -> (Screening, Vec<Candidate<'a>>) {
    let base = &node.model;
    let screening = Screening::of(base);
    let n = base.samples();
    let mut list: Vec<Candidate<'a>> =
        screening.best(REFITTED).into_par_iter().filter_map(|s| Candidate::effect(base, s, screening.penalty(&s.trial, n))).collect();
    list.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
    let best = list.first().map_or(0.0, |c| c.delta_bic);
    let mut compared: Vec<Candidate<'a>> = list
        .into_par_iter()
        .enumerate()
        .map(|(k, candidate)| {
            let close = candidate.is_expensive() || (k < COMPARED && candidate.delta_bic <= MIN_COMPARED_FRACTION * best);
            if close { candidate.with_own_noise(base) } else { candidate }
        })
        .collect();
    let colour_penalty = 2.0 * n.ln() + 2.0 * (base.fitted.data.channels.len() as f64).ln();
    if !node.is_complete() {
        compared.extend(conventions(base).into_iter().map(|recorded| Candidate::recorded(base, recorded)));
    }
    let coloured = coloured_channels(base);
    if !coloured.is_empty() {
        compared.extend(Candidate::colour(base, &coloured, coloured.len() as f64 * colour_penalty));
    }
    // Where the free run leaves only noise, an effect that the innovations show may be an error of the simulation: of the input within a row.
    let min_gain = if invisible { min_gain(n) } else { 0.0 };
    for candidate in compared.iter_mut().filter(|c| c.refused.is_none() && c.gain < min_gain) {
        candidate.refused = Some(Refusal::OnlyNoiseLeft { gain: candidate.gain, min_gain });
    }
    let excess = base.random_torque_excess();
    for candidate in compared.iter_mut().filter(|c| c.refused.is_none() && c.gain < MIN_PART * excess) {
        candidate.refused = Some(Refusal::InsignificantPart { ratio: 1.0 - candidate.gain.max(0.0) / excess });
    }
    compared.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
    (screening, compared)
}

/// The model with a candidate, as a node.
fn extended<'a>(node: &Node<'a>, candidate: &Candidate<'a>) -> Option<Node<'a>> {
    let base = &node.model.fitted;
    let (mut added, mut before, mut notes) = (node.added.clone(), node.before.clone(), node.notes.clone());
    let (model, data, parameters) = match &candidate.extension {
        Extension::Effect(trial) => {
            let (model, name) = trial.added_to(&base.model, candidate.parameters(), candidate.own.clone());
            let parameters = parameters_of(&model, base.data.temp_C.is_some(), candidate.parameters(), Some((&name, candidate.own.start)))?;
            added.push(Addition { name, penalty: candidate.penalty });
            before.push(node.stage());
            (model, base.data_for(trial).into_owned(), parameters)
        }
        Extension::Colour => (base.model.clone(), base.data.clone(), candidate.parameters().clone()),
        Extension::Recorded(recorded) => {
            notes.push(recorded.note.clone());
            (base.model.clone(), recorded.data.clone(), candidate.parameters().clone())
        }
        Extension::FreeForm(_) => return None,
    };
    let (system, _) = build::system(&model, data.temp_C.is_some());
    let states = base.initial_states_for(&system, &parameters, &data);
    let known = &candidate.prediction.initial_states;
    let states = if known.kinds == states.kinds { known.clone() } else { states };
    let fit = Prediction::new(&system, &data).at(&parameters, Some(states), candidate.prediction.noise.clone())?;
    let delta_bic = node.delta_bic + candidate.delta_bic;
    Some(Node { model: PredictedModel::new(base.context, &model, system, parameters, &data, fit), added, before, notes, delta_bic })
}

/// The parameters of a model with fitted values, by name; those of an effect that was just added (its name, the position of its first one) by position.
fn parameters_of(model: &Model, has_temperature: bool, fitted: &Parameters, new: Option<(&str, usize)>) -> Option<Parameters> {
    let (_, mut parameters) = build::system(model, has_temperature);
    let own: Vec<&str> = match new {
        Some((name, _)) => {
            let found = model.effects().iter().find(|e| e.name() == name)?;
            found.parameters.iter().map(|&k| model.parameters()[k].name.as_str()).collect()
        }
        None => Vec::new(),
    };
    let first = new.map_or(fitted.list.len(), |(_, first)| first);
    for p in &mut parameters.list {
        let value = match own.iter().position(|o| *o == p.name) {
            Some(k) => fitted.list.get(first + k),
            None => fitted.list[..first].iter().find(|q| q.name == p.name),
        };
        if let Some(value) = value {
            p.value = value.value;
            p.range = value.range;
        }
    }
    Some(parameters)
}

/// The best model that the catalogue makes of the given one.
pub fn search<'a>(given: PredictedModel<'a>, progress: &(dyn Fn(&Progress) + Sync)) -> Found<'a> {
    let deadline = given.fitted.data.deadline;
    let mut beam = vec![Node { model: given, added: Vec::new(), before: Vec::new(), notes: Vec::new(), delta_bic: 0.0 }];
    let mut first: Option<(Screening, Vec<Candidate<'a>>)> = None;
    for _ in 0..MAX_ADDED {
        progress(&Progress::Trying { added: beam[0].added.last().map(|a| a.name.clone()) });
        let best = beam[0].delta_bic;
        let mut children: Vec<Node> = Vec::new();
        for node in beam.iter().filter(|node| node.delta_bic <= MIN_RIVAL_FRACTION * best) {
            let Ok(free_run) = node.free_run() else { continue };
            // What the model leaves may come from what the input did between its samples: an effect that fits better may imitate it.
            if deadline.has_passed() || input_between_samples(&free_run).is_some() {
                break;
            }
            let (screening, list) = candidates(node, free_run.misfit() <= MisfitClass::Invisible);
            let better = list.iter().filter(|c| c.refused.is_none() && c.delta_bic < -MIN_BIC_IMPROVEMENT).take(BEAM);
            children.extend(better.filter_map(|candidate| extended(node, candidate)));
            first.get_or_insert((screening, list));
        }
        children.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
        let mut kept: Vec<Node> = Vec::new();
        for child in children {
            if kept.len() < BEAM && !kept.iter().any(|other| other.structure() == child.structure()) {
                kept.push(child);
            }
        }
        match kept.first() {
            Some(child) if child.delta_bic < best - MIN_BIC_IMPROVEMENT => {
                if child.is_complete() {
                    kept.truncate(1);
                }
                beam = kept;
            }
            _ => break,
        }
    }
    let mut best = beam.swap_remove(0);
    let mut remarks = Vec::new();
    while !deadline.has_passed()
        && let Some((less, remark)) = without_one(&best)
    {
        best = less;
        remarks.extend(remark);
    }
    let (screening, first) = first.unwrap_or_default();
    Found { best, first, screening, remarks }
}

/// The model without an effect, or without a coloured noise, that it does not need; `None` where it needs all.
fn without_one<'a>(node: &Node<'a>) -> Option<(Node<'a>, Option<Remark>)> {
    let base = &node.model.fitted;
    let p = &node.model.prediction;
    for (k, addition) in node.added.iter().enumerate().rev() {
        let card = base.model.effects().iter().find(|e| e.name() == addition.name)?.card;
        let mut model = base.model.clone();
        if is_modified_by_another(&base.model, card) || model.remove(&addition.name).is_err() {
            continue;
        }
        let Some(fitted) = fitted_without(node, &model) else { continue };
        let gain = fitted.prediction.minus_2_ln_likelihood - p.minus_2_ln_likelihood;
        if gain - addition.penalty < MIN_BIC_IMPROVEMENT {
            let mut added = node.added.clone();
            added.remove(k);
            let mut before = node.before.clone();
            before.truncate(k + 1);
            for name in added[k..].iter().map(|a| a.name.clone()) {
                let mut stage = Stage { model: fitted.fitted.model.clone(), prediction: fitted.prediction.clone() };
                // The stages after it lack what was added later than themselves.
                let later: Vec<String> = added.iter().skip_while(|a| a.name != name).skip(1).map(|a| a.name.clone()).collect();
                if later.iter().all(|l| stage.model.remove(l).is_ok()) {
                    before.push(stage);
                }
            }
            before.truncate(added.len());
            let beside = added[k..].iter().map(|a| a.name.clone()).collect();
            let remark = Remark::NoLongerNeeded { effect: addition.name.clone(), beside };
            let delta_bic = node.delta_bic + gain - addition.penalty;
            return Some((Node { model: fitted, added, before, notes: node.notes.clone(), delta_bic }, Some(remark)));
        }
    }
    let n = node.model.samples();
    for c in (0..p.noise.channels.len()).filter(|&c| p.noise.channels[c].coloured.is_some()) {
        let mut noise = p.noise.clone();
        let coloured = noise.channels[c].coloured.take().map_or(0.0, |coloured| coloured.sigma);
        noise.channels[c].white = noise.channels[c].white.hypot(coloured);
        let prediction = Prediction::new(&base.system, &base.data);
        let begin = prediction.at(&p.parameters, Some(p.initial_states.clone()), noise)?;
        let end = prediction.fit(begin)?;
        let penalty = 2.0 * n.ln() + 2.0 * (p.noise.channels.len() as f64).ln();
        let gain = end.minus_2_ln_likelihood - p.minus_2_ln_likelihood;
        if gain - penalty < MIN_BIC_IMPROVEMENT {
            let model = PredictedModel::new(base.context, &base.model, base.system.clone(), end.parameters.clone(), &base.data, end);
            let less = Node {
                model,
                added: node.added.clone(),
                before: node.before.clone(),
                notes: node.notes.clone(),
                delta_bic: node.delta_bic + gain - penalty,
            };
            return Some((less, None));
        }
    }
    None
}

/// A model with fewer effects, fitted from the parameters of the node.
fn fitted_without<'a>(node: &Node<'a>, model: &Model) -> Option<PredictedModel<'a>> {
    let base = &node.model.fitted;
    let p = &node.model.prediction;
    let parameters = parameters_of(model, base.data.temp_C.is_some(), &p.parameters, None)?;
    let (system, _) = build::system(model, base.data.temp_C.is_some());
    let prediction = Prediction::new(&system, &base.data);
    let states = base.initial_states_for(&system, &parameters, &base.data);
    let begin = prediction.at(&parameters, Some(states.clone()), p.noise.clone())?;
    let here = prediction.descend(begin, 12)?;
    // What the effect explained may be random torque now.
    let from_far = prediction.largest_density(&parameters).and_then(|torque_density| {
        let noise = NoiseModel { torque_density, channels: p.noise.channels.clone() };
        prediction.at(&here.parameters, Some(states), noise)
    });
    let ends = [Some(here), from_far].into_iter().flatten().filter_map(|begin| prediction.fit(begin));
    let end = ends.min_by(|a, b| a.minus_2_ln_likelihood.total_cmp(&b.minus_2_ln_likelihood))?;
    Some(PredictedModel::new(base.context, model, system, parameters, &base.data, end))
}
