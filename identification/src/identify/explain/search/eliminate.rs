//! Elimination: effects that are no longer needed beside later ones are removed, or replaced by a rival that fits better.

use drive_model::ParameterKind;
use rayon::prelude::*;

use super::path::{Added, Search, bic_difference};
use crate::identify::explain::answer::reasons::Remark;
use crate::identify::explain::candidates::candidate::{FittedCandidate, fit_trial};
use crate::identify::explain::candidates::compare::{familywise_ln_p, position};
use crate::identify::explain::candidates::refusal::refusal;
use crate::identify::explain::candidates::score::{Score, score_trials};
use crate::identify::explain::candidates::trials::{is_modified_by_another, may_be_added};
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::descent::near_best;
use crate::identify::explain::fitted::likelihood::{WhitenedSums, Whitener, delta_bic};
use crate::identify::explain::fitted::trial::Trial;
use crate::identify::fit::FitError;
use crate::model::Model;
use crate::statistics::Extremes;

/// The model without effect `name`, where all its amplitudes may be zero and the logs do not need it.
pub fn without_if_zero<'a>(fitted: &FittedModel<'a>, name: &str) -> Result<Option<FittedModel<'a>>, FitError> {
    if all_amplitudes_may_be_zero(fitted, name) { without(fitted, name) } else { Ok(None) }
}

/// No amplitude of effect `name` differs significantly from zero.
fn all_amplitudes_may_be_zero(fitted: &FittedModel, name: &str) -> bool {
    let Some(found) = fitted.model.effects().iter().find(|e| e.name() == name) else { return false };
    let sigmas = fitted.context.criteria.search.zero_amplitude_sigmas;
    let own: Vec<&str> = found.parameters.iter().map(|&k| fitted.model.parameters()[k].name.as_str()).collect();
    let pairs = fitted.fit.parameters.list.iter().zip(&fitted.fit.sigmas);
    pairs
        .filter(|(p, _)| own.contains(&p.name.as_str()) && matches!(p.kind, ParameterKind::NonNegative | ParameterKind::Signed))
        .all(|(p, sigma)| p.value.abs() < sigmas * sigma)
}

/// The model without effect `name`, fitted from the minimum with it; `None` where the logs need the effect.
fn without<'a>(fitted: &FittedModel<'a>, name: &str) -> Result<Option<FittedModel<'a>>, FitError> {
    let mut model = fitted.model.clone();
    if model.remove(name).is_err() {
        return Ok(None);
    }
    let less = fitted.refit_against(&model, fitted.fit.chi2)?;
    let not_needed = bic_difference(&less, fitted) > -fitted.context.criteria.evidence.min_bic_difference;
    Ok(not_needed.then_some(less))
}

/// Removes or replaces each earlier effect that the later ones make unnecessary.
pub fn eliminate<'a>(search: &mut Search<'a>) -> Result<(), FitError> {
    let mut k = 0;
    while k + 1 < search.added.len() {
        let last = search.models.last();
        let name = search.added[k].name.clone();
        let mut model = last.model.clone();
        let modified = last.model.effects().iter().any(|e| e.name() == name && is_modified_by_another(&last.model, e.card));
        if modified || model.remove(&name).is_err() {
            k += 1;
            continue;
        }
        let less = last.refit_against(&model, last.fit.chi2)?;
        let need = Need::of(last, &less);
        if need.delta_bic > -last.context.criteria.evidence.min_bic_difference {
            search.remarks.push(Remark::NoLongerNeeded { effect: name, beside: search.names(k + 1) });
            search.added.remove(k);
            search.models.keep(k);
            add_again(search, k, &less)?;
            continue;
        }
        if let Some(rival) = better_rival(last, &less, &need, &search.added[k].rivals) {
            let (model, other) = rival.added_to(&less.model);
            search.remarks.push(Remark::Exchanged { effect: name, by: other.clone(), beside: search.names(k + 1) });
            let end = less.refit(&model, less.data_for(&rival.trial).into_owned())?;
            search.added[k] = Added { name: other, rivals: Vec::new() };
            search.models.keep(k);
            add_again(search, k, &end)?;
        }
        k += 1;
    }
    Ok(())
}

/// Removes effects that would not be added to the others of the last model, the least needed first: at the end of a search each is
/// examined, the last one too.
pub fn eliminate_at_end(search: &mut Search) -> Result<(), FitError> {
    while search.added.len() > 1 && !search.models.last().data.budget.checkpoint() {
        let last = search.models.last();
        let evidence = &last.context.criteria.evidence;
        let mut least: Option<(f64, usize, FittedModel)> = None;
        for (k, added) in search.added.iter().enumerate() {
            let mut model = last.model.clone();
            let is_modified = last.model.effects().iter().any(|e| e.name() == added.name && is_modified_by_another(&last.model, e.card));
            if is_modified || model.remove(&added.name).is_err() {
                continue;
            }
            let less = last.refit_against(&model, last.fit.chi2)?;
            let need = Need::of(last, &less);
            let is_needed = evidence.is_significant(familywise_ln_p(need.gain, need.more_parameters, search.tests), need.delta_bic);
            if !is_needed && least.as_ref().is_none_or(|(bic, ..)| need.delta_bic > *bic) {
                least = Some((need.delta_bic, k, less));
            }
        }
        let Some((_, k, less)) = least else { break };
        let effect = search.added.remove(k).name;
        search.models.keep(k);
        search.remarks.push(Remark::NotNeededAtEnd { effect, beside: search.names(0) });
        add_again(search, k, &less)?;
    }
    Ok(())
}

/// How much the last model needs an effect.
struct Need {
    whitener: Whitener,
    gain: f64,
    more_parameters: usize,
    /// Sums of the model without it.
    without: WhitenedSums,
    effective_samples: f64,
    /// BIC of the last model minus that without the effect.
    delta_bic: f64,
}

impl Need {
    fn of(last: &FittedModel, less: &FittedModel) -> Self {
        let whitener = last.whitener();
        let (with, without) = (last.whitened_sums(&whitener), less.whitened_sums(&whitener));
        let more_parameters = last.free_parameters().saturating_sub(less.free_parameters());
        let effective_samples = with.effective_samples();
        // The whitened sums are those of a step beside the minimum: where the residuals themselves are not smaller with the effect, they
        // prove nothing.
        let gain = if last.fit.chi2 < less.fit.chi2 { without.gain(&with) } else { 0.0 };
        let delta_bic = delta_bic(gain, more_parameters as f64, effective_samples);
        Need { whitener, gain, more_parameters, delta_bic, effective_samples, without }
    }
}

/// The rival of an effect that fits clearly better in its place, the best of all; `less` is the last model without the effect.
fn better_rival(last: &FittedModel, less: &FittedModel, need: &Need, rivals: &[Trial]) -> Option<FittedCandidate> {
    let criteria = last.context.criteria;
    let chi2 = last.fit.chi2;
    let fitted: Vec<FittedCandidate> = rivals
        .par_iter()
        .filter(|trial| may_be_added(&less.model, trial.card))
        .filter_map(|trial| {
            let none = || Score { values: Vec::new(), identifiable_fraction: 1.0, free: 0, ..Score::zero(trial, less.free_parameters()) };
            let score = score_trials(less, std::slice::from_ref(trial)).into_iter().next().unwrap_or_else(none);
            let fitted = fit_trial(less, trial, &score, chi2)?;
            Some(if fitted.chi2 < near_best(&criteria.descent, chi2, &less.data) { fitted.minimized(less) } else { fitted })
        })
        .collect();
    let better = fitted.into_iter().filter_map(|f| {
        let with = f.whitened_sums(less, &need.whitener);
        let bic = delta_bic(need.without.gain(&with), f.extra_parameters as f64, need.effective_samples);
        let refused = refusal(less, &f, &need.without, &with).is_some();
        let worse = criteria.evidence.leaves_far_less(&last.heldout_chi2_per_n(), &f.heldout_chi2_per_n);
        (!refused && !worse && bic < need.delta_bic - criteria.evidence.min_bic_difference).then_some((f, bic))
    });
    let better: Vec<(FittedCandidate, f64)> = better.collect();
    // Of those that the logs cannot distinguish the first in the catalogue, as where an effect is added.
    let best = better.iter().map(|(_, bic)| *bic).min_or_infinity();
    let alike = better.into_iter().filter(|(_, bic)| *bic < best + criteria.evidence.min_bic_difference);
    alike.min_by_key(|(f, _)| position(f.trial.card)).map(|(f, _)| f)
}

/// Adds the effects from number `from` on to the last model again, one by one, with their values at `end`.
fn add_again<'a>(search: &mut Search<'a>, from: usize, end: &FittedModel<'a>) -> Result<(), FitError> {
    for k in from..search.added.len() {
        let before = search.models.last();
        let mut model = before.model.clone();
        if let Some(name) = copy_effect(&end.model, &mut model, &search.added[k].name)
            && name != search.added[k].name
        {
            search.remarks.push(Remark::Renamed { from: search.added[k].name.clone(), to: name.clone() });
            search.added[k].name = name;
        }
        let next = before.refit(&model, end.data.clone())?;
        search.models.push(next);
    }
    Ok(())
}

/// Adds effect `name` of `from` to `to`, with its values, and returns its name there: the second of its kind may be the first now.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::explain::fitted::test_rotor::with_fit;
    use crate::model::Input;

    #[test]
    fn only_the_needed_effect_is_left_at_the_end() {
        let error = |k: u32| 0.05 * ((f64::from(k) * 12.989_8).sin() * 43_758.545_3).fract();
        with_fit((0..1200).map(|k| (-3e-4, error(k))), |given| {
            let mut search = Search { tests: 1000, ..Search::new(given) };
            for name in ["quadratic-drag", "load", "load-step"] {
                let before = search.models.last();
                let mut model = before.model.clone();
                model.add(name).expect("an effect");
                let next = before.refit(&model, before.data.clone()).expect("a fit");
                search.models.push(next);
                search.added.push(Added { name: name.to_owned(), rivals: Vec::new() });
            }
            eliminate_at_end(&mut search).expect("fits");
            assert_eq!(search.names(0), ["load"]);
            assert_eq!(search.models.all().len(), 2);
            let removed = search.remarks.iter().filter(|r| matches!(r, Remark::NotNeededAtEnd { .. })).count();
            assert_eq!(removed, 2, "{:?}", search.remarks);
        });
    }

    #[test]
    fn second_effect_of_a_kind_becomes_the_first_where_the_first_was_removed() {
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
