//! Forward adding: the best effect that earns its place, then the next, until what is left is noise or nothing known helps.
//!
//! One step: every trial is screened by its score, the best few are fitted in full, and their whitened residuals are judged together with
//! the model's that lacks them. An effect is added if as much by chance has a probability below [`super::fitted::FAMILYWISE`] over everything that was
//! tried, if it pays for its parameters in BIC, if rows that no fit saw agree, if every log agrees, and if its parameters are physical.
//! After each adding it is asked whether every earlier one is still needed, and whether a rival of an earlier one has become better. A path
//! that leads nowhere ends early, and what only stands in for something else at its end is not kept.

use std::ops::Range;

use drive_model::ParameterKind;
use rayon::prelude::*;

use super::evidence::{Whitener, delta_bic};
use super::fitted::{APART, Fitted, added, fit, refusal};
use super::ground::{Ground, leaves_far_less, near};
use super::screen::{Score, scores};
use super::step::step;
use super::trial::{Trial, carries_another, may_be_added};
use super::{Candidate, Estimate, FAR, HALF, STAND_IN, Shown, Stage, rest};
use crate::identify::fit::{ChannelFit, FitError};
use crate::log::Log;
use crate::model::Model;

/// Effects that one explanation adds at most.
const MOST_ADDED: usize = 10;
/// So many effects in turn, each of which explains no more than this part of what the one before left, lead nowhere.
const IN_VAIN: usize = 2;
const HARDLY: f64 = 0.03;
/// χ²/n from which on that is asked: nearer to the noise small effects are worth their while.
const FAR_FROM_NOISE: f64 = 2.0;
/// So many effects, and the part of the error that they may together leave far from the noise: with more none of them will be called its
/// cause, and a further one hardly makes them so.
const ASTRAY: [(usize, f64); 2] = [(4, HALF), (6, STAND_IN)];
/// Standard errors below which an amplitude is no more than a trifle, and how often such an effect may lead to a better fit without it.
const TRIFLE: f64 = 5.0;
const MOST_BETTER_GROUNDS: usize = 3;

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
    let mut better_grounds = 0;
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
        if better_grounds < MOST_BETTER_GROUNDS
            && is_a_trifle(&next, &name)
            && let Some(better) = without(&next, &name, logs)?
        {
            // What was added only led the fit to a better place of the model that was there.
            better_grounds += 1;
            if let Some(last) = path.grounds.last_mut() {
                *last = better;
            }
            continue;
        }
        rivals.push((name.clone(), alike));
        path.missing.push(name);
        path.grounds.push(next);
        if path.missing.len() > 1 {
            reconsider(&mut path, &mut rivals, logs)?;
        }
        let misfits = path.misfits();
        if leads_nowhere(&misfits) {
            path.keep(path.missing.len() - IN_VAIN);
            break;
        }
        if leads_astray(&misfits) {
            break;
        }
    }
    if let Some(kept) = before_stand_ins(&path.misfits()) {
        path.keep(kept);
    }
    Ok(path)
}

impl Path<'_> {
    /// χ²/n of the stages, in units of the noise that the last one found.
    fn misfits(&self) -> Vec<f64> {
        let of = |last: &Ground| self.grounds.iter().map(|g| g.misfits_beside(last).0).collect();
        self.grounds.last().map_or_else(Vec::new, of)
    }

    /// Keeps so many of the effects that were added; what comes after them stands in for something else.
    fn keep(&mut self, count: usize) {
        self.remarks
            .push(format!("far from the noise these help too little to be more than stand-ins: {}", self.missing[count..].join(", ")));
        self.missing.truncate(count);
        self.grounds.truncate(count + 1);
    }
}

/// After which stage of these χ²/n all that follows explains, together, less than half of what was left there, and is far from the noise.
fn before_stand_ins(misfits: &[f64]) -> Option<usize> {
    let (left, before) = misfits.split_last()?;
    before.iter().position(|m| *left > FAR && rest(*m, *left) >= HALF)
}

/// The last steps with these χ²/n of the stages hardly came nearer to the noise.
fn leads_nowhere(misfits: &[f64]) -> bool {
    let hardly = |w: &[f64]| w[1] > FAR_FROM_NOISE && w[1] - 1.0 > (1.0 - HARDLY) * (w[0] - 1.0);
    misfits.len() > IN_VAIN && misfits.windows(2).rev().take(IN_VAIN).all(hardly)
}

/// So many steps with these χ²/n of the stages leave too much, far from the noise.
fn leads_astray(misfits: &[f64]) -> bool {
    let (Some(given), Some(left)) = (misfits.first(), misfits.last()) else { return false };
    *left > FAR && ASTRAY.iter().any(|(effects, part)| misfits.len() > *effects && rest(*given, *left) >= *part)
}

/// No amplitude of effect `name` is told from zero by its standard error.
fn is_a_trifle(ground: &Ground, name: &str) -> bool {
    let Some(found) = ground.model.effects().iter().find(|e| e.name() == name) else { return false };
    let own: Vec<&str> = found.parameters.iter().map(|&k| ground.model.parameters()[k].name.as_str()).collect();
    let pairs = ground.held.parameters.list.iter().zip(&ground.held.sigmas);
    pairs
        .filter(|(p, _)| own.contains(&p.name.as_str()) && matches!(p.kind, ParameterKind::NonNegative | ParameterKind::Signed))
        .all(|(p, sigma)| p.value.abs() < TRIFLE * sigma)
}

/// The model without effect `name`, fitted from the place where it is with it; `None` where the log misses the effect there.
fn without<'a>(ground: &Ground<'a>, name: &str, logs: &[Range<usize>]) -> Result<Option<Ground<'a>>, FitError> {
    let mut model = ground.model.clone();
    if model.remove(name).is_err() {
        return Ok(None);
    }
    let less = ground.refit_beside(&model, ground.record.clone(), ground.held.chi2)?;
    Ok((evidence(&less, ground, logs) > -APART).then_some(less))
}

/// Is every earlier effect still needed, and still better than its rivals? What is not goes, or is exchanged.
fn reconsider(path: &mut Path, rivals: &mut Vec<(String, Vec<Trial>)>, logs: &[Range<usize>]) -> Result<(), FitError> {
    let mut k = 0;
    while k + 1 < path.missing.len() {
        let Some(last) = path.grounds.last() else { break };
        let name = path.missing[k].clone();
        let mut model = last.model.clone();
        let carries = last.model.effects().iter().any(|e| e.name() == name && carries_another(&last.model, e.card));
        if carries || model.remove(&name).is_err() {
            k += 1;
            continue;
        }
        let without = last.refit_beside(&model, last.record.clone(), last.held.chi2)?;
        let whitener = Whitener::of(&last.record, &last.residuals());
        let (full, less) = (last.squares(&whitener, logs), without.squares(&whitener, logs));
        let more = last.held.parameters.free().len() - without.held.parameters.free().len();
        if delta_bic(less.gain(&full), more, full.witnesses()) > -APART {
            path.remarks.push(format!("{name} was added first and is no longer needed beside {}", path.missing[k + 1..].join(", ")));
            path.missing.remove(k);
            rivals.remove(k);
            // The stages after it were fitted with it.
            path.grounds.truncate(k + 1);
            add_again(path, k, &without)?;
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
                let rival = last.held.chi2;
                let raced = fit(&without, trial, &score, rival)?;
                Some(if raced.cost < near(rival, &without.record) { raced.finished(&without) } else { raced })
            })
            .collect();
        let better = tried
            .into_iter()
            .filter_map(|f| {
                let with = whitener.squares(&f.system, &f.parameters, &f.starts, &without.record_for(&f.trial), logs);
                let bic = delta_bic(less.gain(&with), f.more, full.witnesses());
                let refused = refusal(&without, logs, &f, &less, &with).is_some();
                let worse = leaves_far_less(&last.heldout(), &f.heldout);
                (!refused && !worse && bic < own_bic - APART).then_some((f, bic))
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
            add_again(path, k, &end)?;
        }
        k += 1;
    }
    Ok(())
}

/// Adds what is missing from number `from` on to the last stage again, one by one, with the values that it has at `end`.
fn add_again<'a>(path: &mut Path<'a>, from: usize, end: &Ground<'a>) -> Result<(), FitError> {
    for k in from..path.missing.len() {
        let Some(before) = path.grounds.last() else { break };
        let mut model = before.model.clone();
        if let Some(name) = copy_effect(&end.model, &mut model, &path.missing[k])
            && name != path.missing[k]
        {
            path.remarks.push(format!("{} is called {name} from there on", path.missing[k]));
            path.missing[k] = name;
        }
        let next = before.refit(&model, end.record.clone())?;
        path.grounds.push(next);
    }
    Ok(())
}

/// Adds effect `name` of `from` to `to`, with its values, and says what it is called there: the second of its kind may be the first now.
fn copy_effect(from: &Model, to: &mut Model, name: &str) -> Option<String> {
    let found = from.effects().iter().find(|e| e.name() == name)?;
    let name = to.next_name(found.card.id);
    to.add(&name).ok()?;
    let own = to.effects().iter().find(|e| e.name() == name)?.parameters.clone();
    for (&there, &here) in own.iter().zip(&found.parameters) {
        let p = &from.parameters()[here];
        let own_name = to.parameters()[there].name.clone();
        let _ = to.set(&own_name, p.value);
        if p.fixed {
            let _ = to.fix(&own_name, true);
        }
    }
    Some(name)
}

/// BIC on whitened residuals of `last` minus that of `first`, which has fewer parameters.
pub fn evidence(first: &Ground, last: &Ground, logs: &[Range<usize>]) -> f64 {
    let whitener = Whitener::of(&last.record, &last.residuals());
    let (before, after) = (first.squares(&whitener, logs), last.squares(&whitener, logs));
    let more = last.held.parameters.free().len().saturating_sub(first.held.parameters.free().len());
    delta_bic(before.gain(&after), more, before.witnesses())
}

/// A ground as a stage of the answer, in units of the noise that the `last` one found.
pub fn stage(ground: &Ground, last: &Ground, added: Option<&String>) -> Stage {
    let held = &ground.held;
    let unit = |name: &str| {
        let own = ground.model.parameter(name).and_then(|p| p.info);
        own.map_or("", |info| info.unit)
    };
    Stage {
        effects: ground.model.effect_names(),
        added: added.cloned(),
        outputs: held.channels.iter().zip(&last.held.channels).map(|(f, last)| shown(f, last.noise)).collect(),
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

fn shown(f: &ChannelFit, noise: f64) -> Shown {
    Shown { channel: f.channel, rms: f.rms, heldout_rms: f.heldout_rms, noise }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Input;

    #[test]
    fn small_effects_are_in_vain_only_far_from_the_noise() {
        assert!(leads_nowhere(&[13.0, 12.9, 12.8]));
        assert!(!leads_nowhere(&[13.0, 12.9]), "one may fail");
        assert!(!leads_nowhere(&[13.0, 12.9, 9.0]), "the last one helped");
        assert!(!leads_nowhere(&[13.0, 9.0, 8.9]), "the one before did");
        assert!(!leads_nowhere(&[1.30, 1.299, 1.298]), "near to the noise");
    }

    #[test]
    fn the_end_of_a_path_that_explains_less_than_half_far_from_the_noise_is_of_stand_ins() {
        assert_eq!(before_stand_ins(&[5480.0, 3557.0, 28.2, 27.9, 24.0]), None, "near enough");
        assert_eq!(before_stand_ins(&[5_480_000.0, 3_557_000.0, 28_200.0, 27_900.0, 24_000.0, 18_000.0]), Some(2));
        assert_eq!(before_stand_ins(&[2000.0, 1800.0]), Some(0));
        assert_eq!(before_stand_ins(&[2000.0, 30.0]), None);
        assert_eq!(before_stand_ins(&[2000.0]), None);
    }

    #[test]
    fn a_path_that_leaves_most_of_the_error_far_from_the_noise_leads_astray() {
        assert!(leads_astray(&[2000.0, 1800.0, 1500.0, 1300.0, 1200.0]));
        assert!(!leads_astray(&[2000.0, 1800.0, 1500.0, 1300.0, 900.0]), "more than half is explained");
        assert!(!leads_astray(&[20.0, 18.0, 17.0, 16.0, 15.0]), "near to the noise");
        assert!(!leads_astray(&[2000.0, 1800.0, 1500.0, 1300.0]), "only three");
        assert!(leads_astray(&[2000.0, 1000.0, 900.0, 600.0, 500.0, 400.0, 300.0]));
        assert!(!leads_astray(&[2000.0, 1000.0, 900.0, 600.0, 500.0, 400.0, 150.0]));
    }

    #[test]
    fn what_was_the_second_of_its_kind_is_added_as_the_first_where_the_first_has_gone() {
        let mut from = Model::new(Input::Voltage, "the end").expect("a model");
        from.add("cogging").expect("the first");
        from.add("cogging#2").expect("the second");
        from.set("cogging_order#2", 13.0).expect("an order");
        from.fix("cogging_N_m#2", true).expect("a parameter");
        let mut to = Model::new(Input::Voltage, "the stage").expect("a model");
        assert_eq!(copy_effect(&from, &mut to, "cogging#2").as_deref(), Some("cogging"));
        assert_eq!(to.value("cogging_order"), Some(13.0));
        assert!(to.parameter("cogging_N_m").is_some_and(|p| p.fixed));
        assert_eq!(copy_effect(&from, &mut to, "cogging").as_deref(), Some("cogging#2"));
    }
}
