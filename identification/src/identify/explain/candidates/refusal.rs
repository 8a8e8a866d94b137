//! Why a fitted candidate cannot be the explanation, whatever its gain.

use std::ops::Range;

use drive_model::{Card, ParameterKind};

use super::candidate::FittedCandidate;
use super::jumps::is_less_than_a_count;
use crate::identify::explain::answer::reasons::Refusal;
use crate::identify::explain::criteria::MisfitClass;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::likelihood::WhitenedSums;
use crate::identify::explain::fitted::motion::turns;
use crate::identify::fit::Parameters;
use crate::statistics::Extremes;

/// The first reason that applies: an unphysical parameter, then no gain, held-out rows, and single logs. `without` and `with` are the
/// whitened sums of the model without and with the candidate.
pub fn refusal(base: &FittedModel, candidate: &FittedCandidate, without: &WhitenedSums, with: &WhitenedSums) -> Option<Refusal> {
    unphysical(base, candidate.trial.card, &candidate.parameters, &candidate.sigmas, &candidate.own)
        .or_else(|| no_gain(base, candidate, without, with))
        .or_else(|| heldout_error_grows(base, candidate))
        .or_else(|| log_gets_worse(base, without, with))
}

/// A fitted parameter that no drive has: `own` are the positions of the effect's parameters.
pub fn unphysical(base: &FittedModel, card: &Card, parameters: &Parameters, sigmas: &[f64], own: &Range<usize>) -> Option<Refusal> {
    let tolerance = base.context.criteria.evidence.range_tolerance_sigmas;
    for (k, p) in parameters.list.iter().enumerate() {
        let of_effect = own.contains(&k);
        let (low, high) = p.range;
        let slack = tolerance * sigmas[k];
        if let Some(effect) = card.reduces_to.filter(|_| of_effect) {
            if p.kind == ParameterKind::Periodicity {
                if (p.value - p.value.round()).abs() < slack.max(least_distance(base)) {
                    return Some(Refusal::WholeOrder { parameter: p.name.clone(), value: p.value, effect });
                }
            } else if k == own.start && !card.polar && p.value < slack {
                return Some(Refusal::ReducesTo { parameter: p.name.clone(), effect });
            }
        }
        if k == own.start && is_less_than_a_count(base, card, p.value) {
            return Some(Refusal::LessThanACount { parameter: p.name.clone(), jump_rad: p.value, count_rad: base.data.theta_quantum });
        }
        // A level at zero is no effect.
        let absent = of_effect && p.kind == ParameterKind::NonNegative && !p.fixed && p.value <= low && !card.polar;
        if absent {
            return Some(Refusal::NegativeAmplitude { parameter: Some(p.name.clone()) });
        }
        if p.fixed || p.kind == ParameterKind::Phase || (p.value >= low - slack && p.value <= high + slack) {
            continue;
        }
        let before = base.fit.parameters.list.get(k).map(|q| q.value);
        if of_effect || before.is_some_and(|v| v >= low && v <= high) {
            return Some(Refusal::OutsideRange { parameter: p.name.clone(), own: of_effect, value: p.value, range: p.range });
        }
    }
    None
}

/// Least distance of a number of periods per turn from a whole one that is a difference: a hundredth of a period over all turns of the log,
/// a few counts of an encoder.
fn least_distance(base: &FittedModel) -> f64 {
    0.01 / turns(&base.data).max(1.0)
}

fn no_gain(base: &FittedModel, candidate: &FittedCandidate, without: &WhitenedSums, with: &WhitenedSums) -> Option<Refusal> {
    let criteria = &base.context.criteria.evidence;
    if with.gain(without) > 0.0 {
        return Some(Refusal::NoGain);
    }
    let (gain, heldout_gain) = (without.gain(with), without.held_out_gain(with));
    if heldout_gain < -criteria.max_heldout_loss {
        return Some(Refusal::HeldOutErrorGrows { gain: heldout_gain });
    }
    let small = gain < criteria.confirmed_below_gain;
    if small && !candidate.trial.acts_in_few_rows() && without.holds_rows_out() && heldout_gain < criteria.min_confirmed_fraction * gain {
        return Some(Refusal::NotConfirmed { gain, heldout_gain });
    }
    let min_gain = base.min_gain();
    if gain < min_gain {
        return Some(Refusal::OnlyNoiseLeft { gain, min_gain });
    }
    None
}

/// While much is unexplained, whitened residuals are mostly the colour of the error. Then the residuals themselves must get smaller too.
fn heldout_error_grows(base: &FittedModel, candidate: &FittedCandidate) -> Option<Refusal> {
    if base.misfit() <= MisfitClass::Moderate || candidate.trial.acts_in_few_rows() {
        return None;
    }
    let change = base.context.criteria.evidence.max_insignificant_change;
    let before = base.heldout_chi2_per_n();
    let ratios: Vec<f64> = before.into_iter().zip(&candidate.heldout_chi2_per_n).map(|(before, after)| after / before).collect();
    if let Some(k) = ratios.iter().position(|ratio| *ratio > 1.0 + change) {
        return Some(Refusal::ChannelErrorGrows { channel: base.fit.channels[k].channel, ratio: ratios[k] });
    }
    if ratios.iter().all(|ratio| *ratio > 1.0 - change) {
        return Some(Refusal::InsignificantPart { ratio: ratios.iter().copied().min_or_infinity() });
    }
    None
}

fn log_gets_worse(base: &FittedModel, without: &WhitenedSums, with: &WhitenedSums) -> Option<Refusal> {
    let logs = base.context.log_rows.len();
    if logs < 2 {
        return None;
    }
    let losses = (0..logs).map(|log| (log, without.gain_on(with, log)));
    let worse = losses.into_iter().find(|(_, gain)| *gain < -base.context.criteria.evidence.max_heldout_loss);
    worse.map(|(log, gain)| Refusal::LogGetsWorse { log, gain })
}
