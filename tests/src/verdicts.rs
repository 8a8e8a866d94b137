//! Comparison of an explanation with the known hidden effects.
//!
//! An effect is *visible* in a log under two conditions. The fitted user's model leaves at least 1.05 times the noise in a channel. The true
//! structure beats every rival outside its family by at least 20 in BIC on whitened residuals. Noise and whitening are those of the true structure,
//! fitted from the true values. Rivals are the physically allowed candidates that the explanation fitted on the full log, with their BIC; without
//! any, the rival is "no effect". Families are those of the cards. An effect that is not visible need not be found.

use host_tools::identify::explain::likelihood::{Whitener, delta_bic};
use host_tools::identify::explain::{Criteria, Engine, Explanation, explain_by};
use host_tools::identify::fit::{self, FitResult, PreparedLog, System};
use host_tools::log::Log;
use host_tools::model::Model;
use stand_firmware::board::Hardware;

use crate::TWO_SIDED_95;

/// Least ratio of the user's model's rms to the noise, in one channel.
const VISIBLE_RATIO: f64 = 1.05;
/// BIC margin of the true structure.
const VISIBLE_BIC: f64 = 20.0;

/// Most time of one log, s. A few logs of play and soft shafts take longer; `not-finished` is their verdict.
const TIME_LIMIT_S: f64 = 300.0;

/// Known facts about a log.
pub struct Known<'a> {
    /// The user's model.
    pub user: Model,
    /// The true structure with true values; `None` where the catalogue lacks it.
    pub truth: Option<Model>,
    /// Hidden effects of the catalogue.
    pub hidden: &'a [String],
    /// A disturbance outside the catalogue is hidden.
    pub outsider: bool,
    /// The rate is derived from the encoder, without a note in the log.
    pub rate_from_encoder: bool,
    /// The true structure without one of its effects, with true values.
    pub without: &'a dyn Fn(&str) -> Option<Model>,
}

/// Result of an explanation.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Verdict, or `bad-log`, or `error`.
    pub verdict: String,
    /// Names of the added effects, in the sequence of addition.
    pub missing: Vec<String>,
    /// Effects not distinguishable from the first one.
    pub ambiguous_with: Vec<String>,
    /// The best candidates with their BIC.
    pub candidates: Vec<(String, Option<f64>)>,
    /// Coordinate of the first unexplained shape, else of the first misfit.
    pub coordinate: String,
    /// Names of hidden effects that are visible.
    pub visible: Vec<String>,
    /// Largest rms over noise of the user's model.
    pub ratio_before: f64,
    /// Largest rms over noise on held-out rows after all additions.
    pub ratio_after: f64,
    /// BIC margin of the true structure over its best rival.
    pub margin: f64,
    /// Deviations of the correctly added effects' parameters from the truth, σ.
    pub deviations: Vec<(String, f64)>,
    /// An expression was proposed for the remainder.
    pub drawn: bool,
    /// Duration, s.
    pub seconds: f64,
    /// Error message, if any.
    pub error: String,
}

/// `cogging` of `cogging#2`.
pub fn stem(name: &str) -> &str {
    name.split('#').next().unwrap_or(name)
}

/// True if both effects are of one family.
pub fn same_family(a: &str, b: &str) -> bool {
    let family = |id: &str| drive_model::card(stem(id)).map_or("", |c| c.family);
    stem(a) == stem(b) || (!family(a).is_empty() && family(a) == family(b))
}

impl Outcome {
    /// True if the first name is this effect.
    pub fn names_first(&self, effect: &str) -> bool {
        self.missing.first().is_some_and(|m| stem(m) == effect)
    }

    /// True if the first name is this effect or not distinguishable from it in this log.
    pub fn names_family_first(&self, effect: &str) -> bool {
        self.names_first(effect) || (!self.missing.is_empty() && self.ambiguous_with.iter().any(|m| stem(m) == effect))
    }

    /// True if this effect was added, at any position.
    pub fn adds(&self, effect: &str) -> bool {
        self.missing.iter().any(|m| stem(m) == effect) || self.names_family_first(effect)
    }

    /// Number of deviations within the 95 % interval.
    pub fn covered(&self) -> usize {
        self.deviations.iter().filter(|(_, d)| d.abs() < TWO_SIDED_95).count()
    }
}

/// Explains a log by an engine and compares the result with the known effects.
pub fn judge(log: Log, known: &Known, engine: Engine) -> Outcome {
    let mut criteria = Criteria::default();
    criteria.search.engine = engine;
    criteria.search.time_limit_s = Some(TIME_LIMIT_S);
    let explanation = match explain_by(criteria, vec![log.clone()], &known.user, &|_| ()) {
        Ok(explanation) => explanation,
        Err(e) => {
            let bad = matches!(e, host_tools::identify::explain::ExplainError::BadLog { .. });
            let verdict = if bad { "bad-log" } else { "error" };
            return Outcome { verdict: verdict.to_owned(), error: e.to_string(), ..Outcome::default() };
        }
    };
    let mut outcome = read(&explanation);
    mark_visible(&mut outcome, &explanation, &log, known);
    if !known.outsider {
        outcome.deviations = deviations(&explanation, known);
    }
    outcome
}

/// Coordinate of the first unexplained shape; if there is none, of the first misfit.
fn coordinate(explanation: &Explanation) -> &'static str {
    let drawn = explanation.unexplained.first().map(|s| s.coordinate);
    drawn.or(explanation.misfits.first().map(|f| f.coordinate)).map_or("", |c| c.name())
}

fn read(explanation: &Explanation) -> Outcome {
    let missing = explanation.missing.clone();
    let first = explanation.candidates.iter().find(|c| missing.first() == Some(&c.effect));
    let worst = |of: &dyn Fn(&fit::ChannelFit) -> f64, held: &FitResult| held.channels.iter().map(of).fold(0.0, f64::max);
    Outcome {
        verdict: explanation.verdict.name().to_owned(),
        ambiguous_with: first.map_or(Vec::new(), |c| c.ambiguous_with.clone()),
        candidates: explanation.candidates.iter().take(3).map(|c| (c.effect.clone(), c.delta_bic)).collect(),
        coordinate: coordinate(explanation).to_owned(),
        ratio_before: worst(&|c| c.rms / c.noise, &explanation.given),
        ratio_after: worst(&|c| c.heldout_rms.unwrap_or(c.rms) / c.noise, &explanation.explained),
        drawn: explanation.unexplained.iter().any(|shape| shape.expression.is_some()),
        seconds: explanation.seconds,
        missing,
        ..Outcome::default()
    }
}

/// A fitted model with its inputs.
struct Fitted<'a> {
    record: PreparedLog<'a>,
    system: System,
    held: FitResult,
}

fn fit_model<'a>(log: &'a Log, model: &Model, rate_from_encoder: bool) -> Option<Fitted<'a>> {
    let (mut record, _) = fit::prepare::prepare(log, model, true).ok()?;
    record.rate_from_encoder |= rate_from_encoder;
    let (system, parameters) = fit::build::system(model, record.temp_C.is_some());
    let held = fit::fit(&system, &parameters, &record).ok()?;
    Some(Fitted { record, system, held })
}

fn residuals(held: &FitResult) -> Vec<&[f64]> {
    held.channels.iter().map(|c| c.residual.as_slice()).collect()
}

/// Determines the hidden effects that this log shows.
fn mark_visible(outcome: &mut Outcome, explanation: &Explanation, log: &Log, known: &Known) {
    let Some(truth) = known.truth.as_ref().and_then(|t| fit_model(log, t, known.rate_from_encoder)) else { return };
    let rows = 0..truth.record.len();
    let whitener = Whitener::of(&truth.record, &residuals(&truth.held), &explanation.criteria.whitening);
    let squares = |system: &System, held: &FitResult| {
        whitener.sums(system, &held.parameters, &held.initial_states, &truth.record, std::slice::from_ref(&rows))
    };
    let full = squares(&truth.system, &truth.held);
    // BIC increase of a model without the effect, and its rms over noise.
    let better = |system: &System, without: &FitResult| {
        let more = truth.held.parameters.free().len().saturating_sub(without.parameters.free().len());
        let bic = -delta_bic(squares(system, without).gain(&full), more as f64, full.effective_samples());
        let ratio = without.channels.iter().zip(&truth.held.channels).map(|(c, t)| c.rms / t.noise).fold(0.0, f64::max);
        (bic, ratio)
    };
    if let [hidden] = known.hidden {
        let (system, _) = fit::build::system(&known.user, truth.record.temp_C.is_some());
        let (bic, ratio) = better(&system, &explanation.given);
        let rivals = explanation.candidates.iter().filter(|c| c.refused.is_none() && !same_family(&c.effect, hidden));
        let rival = rivals.filter_map(|c| c.delta_bic).fold(0.0, |best: f64, d| best.max(-d));
        outcome.margin = bic - rival;
        if ratio >= VISIBLE_RATIO && outcome.margin >= VISIBLE_BIC {
            outcome.visible.push(hidden.clone());
        }
        return;
    }
    for hidden in known.hidden {
        let Some(less) = (known.without)(hidden).and_then(|m| fit_model(log, &m, known.rate_from_encoder)) else { continue };
        let (bic, ratio) = better(&less.system, &less.held);
        if ratio >= VISIBLE_RATIO && bic >= VISIBLE_BIC {
            outcome.visible.push(hidden.clone());
        }
    }
}

/// Phase shift of an eccentric disc when the angle counts from its own index, which is displaced by e sin φ, in whole counts; a row contains the
/// middle of its count.
fn index_shift(truth: &Model) -> f64 {
    let value = |name: &str| truth.value(name).unwrap_or(0.0);
    let count_rad = Hardware::default().rad_per_count();
    let shown = value("eccentricity_rad") * value("eccentricity_phase_rad").sin();
    value("eccentricity_order") * (shown / count_rad).floor() * count_rad
}

/// Fitted minus true value, in standard errors, of the free parameters of correctly added effects, if all additions are correct.
fn deviations(explanation: &Explanation, known: &Known) -> Vec<(String, f64)> {
    let Some(truth) = &known.truth else { return Vec::new() };
    let right = |name: &String| known.hidden.iter().any(|h| h == name);
    if explanation.missing.len() != known.hidden.len() || !explanation.missing.iter().all(right) {
        return Vec::new();
    }
    let Some(last) = explanation.stages.last() else { return Vec::new() };
    let mut list = Vec::new();
    for card in known.hidden.iter().filter_map(|h| drive_model::card(h)) {
        for p in card.parameters {
            let fitted = last.parameters.iter().find(|e| e.name == p.name && e.sigma > 0.0);
            if let (Some(fitted), Some(value)) = (fitted, truth.value(p.name)) {
                let mut off = fitted.value - value;
                if p.name == "eccentricity_phase_rad" {
                    off -= index_shift(truth);
                }
                if p.kind == drive_model::ParameterKind::Phase {
                    off -= std::f64::consts::TAU * (off / std::f64::consts::TAU).round();
                }
                list.push((p.name.to_owned(), off / fitted.sigma));
            }
        }
    }
    list
}
