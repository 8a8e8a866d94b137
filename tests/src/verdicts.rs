//! One explanation held against what is known to be hidden.
//!
//! An effect is *visible* in a log if the user's model, fitted, leaves at least 1.05 times the noise in a channel, and the true structure
//! beats every rival outside its family by at least 20 in BIC on whitened residuals. Noise and whitening are those of the true structure,
//! fitted from the truth; rivals are the candidates that the explanation fitted in full and physics allows, with the BIC that it gives
//! them; where there is none, "no effect at all" is the rival. A family here is what the cards say. What is not visible need not be found.

use host_tools::identify::explain::likelihood::{Whitener, delta_bic};
use host_tools::identify::explain::{Explanation, explain};
use host_tools::identify::fit::{self, FitResult, PreparedLog, System};
use host_tools::log::Log;
use host_tools::model::Model;
use stand_firmware::board::Hardware;

use crate::TWO_SIDED_95;

/// Least rms of the user's model over the noise, in one channel.
const VISIBLE_RATIO: f64 = 1.05;
/// BIC by which the true structure must win.
const VISIBLE_BIC: f64 = 20.0;

/// What is known of a log.
pub struct Known<'a> {
    /// What the user believes.
    pub user: Model,
    /// The true structure at its true values; `None` where the catalogue lacks it.
    pub truth: Option<Model>,
    /// Hidden effects of the catalogue.
    pub hidden: &'a [String],
    /// Something outside the catalogue is hidden.
    pub outsider: bool,
    /// The rate was made from the encoder, which no note says.
    pub rate_from_encoder: bool,
    /// The true structure without one of its effects, at its true values.
    pub without: &'a dyn Fn(&str) -> Option<Model>,
}

/// What came out.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Verdict, or `bad-log`, or `error`.
    pub verdict: String,
    /// Names that were added, in order.
    pub missing: Vec<String>,
    /// What the first of them could not be told from.
    pub ambiguous_with: Vec<String>,
    /// The best candidates with their BIC.
    pub candidates: Vec<(String, Option<f64>)>,
    /// Coordinate over which what is unknown is drawn, else of the first failure.
    pub coordinate: String,
    /// Names of hidden effects that are visible.
    pub visible: Vec<String>,
    /// Largest rms over noise: of the user's model, and on held-out rows once everything is added.
    pub ratio_before: f64,
    /// See there.
    pub ratio_after: f64,
    /// Margin in BIC of the true structure before its best rival.
    pub margin: f64,
    /// Deviations of the parameters of rightly added effects from the truth, σ.
    pub deviations: Vec<(String, f64)>,
    /// An expression was proposed for what is left.
    pub drawn: bool,
    /// Duration, s.
    pub seconds: f64,
    /// What went wrong, where something did.
    pub error: String,
}

/// `cogging` of `cogging#2`.
pub fn stem(name: &str) -> &str {
    name.split('#').next().unwrap_or(name)
}

/// They are of one family by their cards.
pub fn akin(a: &str, b: &str) -> bool {
    let family = |id: &str| drive_model::card(stem(id)).map_or("", |c| c.family);
    stem(a) == stem(b) || (!family(a).is_empty() && family(a) == family(b))
}

impl Outcome {
    /// The first name is this effect.
    pub fn names_first(&self, effect: &str) -> bool {
        self.missing.first().is_some_and(|m| stem(m) == effect)
    }

    /// The first name is this effect, or it is said that the log cannot tell the two apart.
    pub fn names_family_first(&self, effect: &str) -> bool {
        self.names_first(effect) || (!self.missing.is_empty() && self.ambiguous_with.iter().any(|m| stem(m) == effect))
    }

    /// This effect was added, at some place.
    pub fn adds(&self, effect: &str) -> bool {
        self.missing.iter().any(|m| stem(m) == effect) || self.names_family_first(effect)
    }

    /// Deviations within the 95 % interval.
    pub fn covered(&self) -> usize {
        self.deviations.iter().filter(|(_, d)| d.abs() < TWO_SIDED_95).count()
    }
}

/// Explains a log, and holds the answer against what is known.
pub fn judge(log: Log, known: &Known) -> Outcome {
    let explanation = match explain(vec![log.clone()], &known.user, &|_| ()) {
        Ok(explanation) => explanation,
        Err(e) => {
            let bad = matches!(e, host_tools::identify::explain::ExplainError::BadLog { .. });
            let verdict = if bad { "bad-log" } else { "error" };
            return Outcome { verdict: verdict.to_owned(), error: e.to_string(), ..Outcome::default() };
        }
    };
    let mut outcome = read(&explanation);
    see(&mut outcome, &explanation, &log, known);
    if !known.outsider {
        outcome.deviations = deviations(&explanation, known);
    }
    outcome
}

/// Over what the answer draws what it does not know; where it draws nothing, over what the model fails most.
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

/// A model held against a log, with what it was held by.
struct Holding<'a> {
    record: PreparedLog<'a>,
    system: System,
    held: FitResult,
}

fn hold<'a>(log: &'a Log, model: &Model, rate_from_encoder: bool) -> Option<Holding<'a>> {
    let (mut record, _) = fit::prepare::prepare(log, model, true).ok()?;
    record.rate_from_encoder |= rate_from_encoder;
    let (system, parameters) = fit::build::system(model, record.temp_C.is_some());
    let held = fit::fit(&system, &parameters, &record).ok()?;
    Some(Holding { record, system, held })
}

fn residuals(held: &FitResult) -> Vec<&[f64]> {
    held.channels.iter().map(|c| c.residual.as_slice()).collect()
}

/// Which of the hidden effects this log shows.
fn see(outcome: &mut Outcome, explanation: &Explanation, log: &Log, known: &Known) {
    let Some(truth) = known.truth.as_ref().and_then(|t| hold(log, t, known.rate_from_encoder)) else { return };
    let rows = 0..truth.record.len();
    let whitener = Whitener::of(&truth.record, &residuals(&truth.held), &explanation.criteria.whitening);
    let squares = |system: &System, held: &FitResult| {
        whitener.sums(system, &held.parameters, &held.initial_states, &truth.record, std::slice::from_ref(&rows))
    };
    let full = squares(&truth.system, &truth.held);
    // How much worse a model without it is, in BIC, and in the ratio of its rms to the noise.
    let better = |system: &System, without: &FitResult| {
        let more = truth.held.parameters.free().len().saturating_sub(without.parameters.free().len());
        let bic = -delta_bic(squares(system, without).gain(&full), more, full.effective_samples());
        let ratio = without.channels.iter().zip(&truth.held.channels).map(|(c, t)| c.rms / t.noise).fold(0.0, f64::max);
        (bic, ratio)
    };
    if let [hidden] = known.hidden {
        let (system, _) = fit::build::system(&known.user, truth.record.temp_C.is_some());
        let (bic, ratio) = better(&system, &explanation.given);
        let rivals = explanation.candidates.iter().filter(|c| c.refused.is_none() && !akin(&c.effect, hidden));
        let rival = rivals.filter_map(|c| c.delta_bic).fold(0.0, |best: f64, d| best.max(-d));
        outcome.margin = bic - rival;
        if ratio >= VISIBLE_RATIO && outcome.margin >= VISIBLE_BIC {
            outcome.visible.push(hidden.clone());
        }
        return;
    }
    for hidden in known.hidden {
        let Some(less) = (known.without)(hidden).and_then(|m| hold(log, &m, known.rate_from_encoder)) else { continue };
        let (bic, ratio) = better(&less.system, &less.held);
        if ratio >= VISIBLE_RATIO && bic >= VISIBLE_BIC {
            outcome.visible.push(hidden.clone());
        }
    }
}

/// By how much the phase of an eccentric disc differs where the angle is counted from its own index, which the disc shows at e sin φ: in
/// whole counts, and a row holds the middle of its count.
fn index_shift(truth: &Model) -> f64 {
    let value = |name: &str| truth.value(name).unwrap_or(0.0);
    let count_rad = Hardware::default().rad_per_count();
    let shown = value("eccentricity_rad") * value("eccentricity_phase_rad").sin();
    value("eccentricity_order") * (shown / count_rad).floor() * count_rad
}

/// Fitted minus true, in standard errors, of the free parameters of rightly added effects, if everything that was added is right.
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
