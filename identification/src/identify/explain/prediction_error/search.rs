//! Beam search: the best models are each extended by the best effects; the best of all extensions are kept, until nothing improves BIC clearly.

use super::candidate::Candidate;
use super::model::PredictedModel;
use super::screen::Screening;
use crate::identify::explain::Context;
use crate::identify::fit::{PreparedLog, build};
use crate::identify::predict::fit::Prediction;
use crate::model::Model;

/// Models that are kept at each step.
const BEAM: usize = 3;
/// Effects that are fitted beside each model.
const REFITTED: usize = 6;
/// Effects of these that are fitted with a random torque of their own.
const COMPARED: usize = 4;
/// Part of the best improvement at the density of the model from which on an effect gets a random torque of its own.
const MIN_COMPARED_FRACTION: f64 = 0.1;
/// Smallest improvement of BIC by an added effect: odds of 20 (Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773).
pub const MIN_BIC_IMPROVEMENT: f64 = 6.0;
/// Part of the best improvement of BIC from which on another model is extended, too.
const MIN_RIVAL_FRACTION: f64 = 0.5;
/// Effects that are added at most.
const MAX_ADDED: usize = 10;

/// A model of the beam.
pub struct Node<'a> {
    /// The model.
    pub model: PredictedModel<'a>,
    /// Names of the added effects.
    pub added: Vec<String>,
    /// BIC, with the choice among all that was tried, minus that of the given model.
    pub delta_bic: f64,
}

/// Fits the given model.
pub fn given<'a>(context: Context<'a>, model: &Model, data: &PreparedLog<'a>) -> Option<Node<'a>> {
    let (system, parameters) = build::system(model, data.temp_C.is_some());
    let fit = Prediction::new(&system, data).fit_from_far(&parameters)?;
    let model = PredictedModel::new(context, model, system, parameters, data, fit);
    Some(Node { model, added: Vec::new(), delta_bic: 0.0 })
}

/// Candidates beside a model, the best first.
pub fn candidates(node: &Node) -> (Screening, Vec<Candidate>) {
    let base = &node.model;
    let screening = Screening::of(base);
    let n = base.samples();
    let mut list: Vec<Candidate> = screening
        .best(REFITTED)
        .into_iter()
        .filter_map(|s| Candidate::at_density_of(base, s, screening.penalty(&s.trial, n)))
        .collect();
    list.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
    let mut compared: Vec<Candidate> = Vec::new();
    let best = list.first().map_or(0.0, |c| c.delta_bic);
    for (k, candidate) in list.into_iter().enumerate() {
        let close = candidate.trial.is_expensive() || (k < COMPARED && candidate.delta_bic <= MIN_COMPARED_FRACTION * best);
        compared.push(if close { candidate.with_own_noise(base) } else { candidate });
    }
    compared.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
    (screening, compared)
}

/// The model with a candidate, as a node.
pub fn extended<'a>(node: &Node<'a>, candidate: &Candidate) -> Option<Node<'a>> {
    let base = &node.model.fitted;
    let (model, name) = candidate.trial.added_to(&base.model, candidate.parameters(), candidate.own.clone());
    let data = base.data_for(&candidate.trial).into_owned();
    let (system, mut parameters) = build::system(&model, data.temp_C.is_some());
    // By name: the parameters of the effect have the names of the model now.
    let own: Vec<String> = model.effects().iter().find(|e| e.name() == name)?.parameters.iter().map(|&k| model.parameters()[k].name.clone()).collect();
    let fitted = candidate.parameters();
    for p in &mut parameters.list {
        let value = match own.iter().position(|o| *o == p.name) {
            Some(k) => fitted.list.get(candidate.own.start + k),
            None => fitted.list[..candidate.own.start].iter().find(|q| q.name == p.name),
        };
        if let Some(value) = value {
            p.value = value.value;
            p.range = value.range;
        }
    }
    let prediction = Prediction::new(&system, &data);
    let fit = prediction.at(&parameters, Some(candidate.prediction.initial_states.clone()), candidate.prediction.noise.clone())?;
    let mut added = node.added.clone();
    added.push(name);
    let delta_bic = node.delta_bic + candidate.delta_bic;
    Some(Node { model: PredictedModel::new(base.context, &model, system, parameters, &data, fit), added, delta_bic })
}

/// The best model that the catalogue makes of the given one, and the candidates of the first step.
pub fn search<'a>(given: Node<'a>) -> (Vec<Node<'a>>, Vec<Candidate>) {
    let mut beam = vec![given];
    let mut first: Option<Vec<Candidate>> = None;
    for _ in 0..MAX_ADDED {
        let best = beam[0].delta_bic;
        let mut children: Vec<Node> = Vec::new();
        let worth = |node: &&Node| node.delta_bic <= MIN_RIVAL_FRACTION * best;
        for node in beam.iter().filter(worth) {
            if node.model.fitted.data.deadline.has_passed() {
                break;
            }
            let (_, list) = candidates(node);
            for candidate in list.iter().take(BEAM).filter(|c| c.delta_bic < -MIN_BIC_IMPROVEMENT) {
                if let Some(child) = extended(node, candidate) {
                    children.push(child);
                }
            }
            first.get_or_insert(list);
        }
        children.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
        let mut kept: Vec<Node> = Vec::new();
        for child in children {
            let same = |other: &Node| {
                let (mut a, mut b) = (other.added.clone(), child.added.clone());
                a.sort();
                b.sort();
                a == b
            };
            if kept.len() < BEAM && !kept.iter().any(same) {
                kept.push(child);
            }
        }
        match kept.first() {
            Some(child) if child.delta_bic < best - MIN_BIC_IMPROVEMENT => beam = kept,
            _ => break,
        }
    }
    (beam, first.unwrap_or_default())
}
