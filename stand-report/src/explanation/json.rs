//! The answer of `stand explain --json`.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::evidence::{Outcome, has_p_value, reason, strength};
use super::sentences::{NotVisibleKind, PurposeKind, RefusalKind, ShapeKind, not_visible_kind, purpose_kind, refusal_kind, shape_kind};
use super::{sentences, words};
use crate::bad_log::BadLogJson;
use crate::json::schema_of;
use crate::json::{Entries, value};
use crate::misfits::{MisfitJson, p_value};
use crate::{column, log_warnings};
use identification::identify::explain::{Candidate, ChannelError, DetectionLimit, Estimate, Explanation, Shape, Stage};
use identification::log::plausible::Defect;
use identification::log::{Axis, Log};

#[derive(Serialize, JsonSchema)]
struct ExplanationJson<'a> {
    verdict: &'static str,
    missing: &'a [String],
    /// By effect of `missing`, where there are any: the effects that the log does not distinguish from it.
    not_distinguishable: Entries<&'a [String]>,
    says: String,
    log: String,
    model: &'a str,
    samples: usize,
    duration_s: f64,
    steps: Vec<StageJson<'a>>,
    candidates: Vec<CandidateJson<'a>>,
    failures: Vec<MisfitJson>,
    /// Misfits of the final model.
    remaining: Vec<MisfitJson>,
    /// By effect of `missing`: fraction of the residual variance above the noise that it removed.
    explained_fraction: Entries<Option<f64>>,
    unexplained: Vec<ShapeJson<'a>>,
    next_experiment: Option<NextJson>,
    parameters: Entries<EstimateJson>,
    /// The last model leaves more than noise: `sigma` does not contain what it lacks.
    sigma_is_lower_bound: bool,
    not_shown: Vec<String>,
    detection_limits: Vec<DetectionLimitJson>,
    remarks: Vec<String>,
    warnings: Vec<String>,
    /// Where the search is not finished: the part that is open.
    open: Option<String>,
    /// Simulated rows × lanes over the rows of the logs: the same on every machine.
    effort_passes: f64,
    seconds: f64,
}

#[derive(Serialize, JsonSchema)]
struct StageJson<'a> {
    effects: &'a [String],
    added: Option<&'a str>,
    rms: Entries<f64>,
    heldout_rms: Entries<Option<f64>>,
    ratio: Entries<f64>,
    noise: Entries<f64>,
    share: Option<f64>,
}

#[derive(Serialize, JsonSchema)]
struct CandidateJson<'a> {
    effect: &'a str,
    parameters: Entries<EstimateJson>,
    heldout_rms: Entries<Option<f64>>,
    delta_bic: Option<f64>,
    p_value: Option<f64>,
    log10_p: Option<f64>,
    ambiguous_with: &'a [String],
    refitted: bool,
    fate: &'static str,
    refused: Option<String>,
    /// Why it was refused or is not visible: kind and numbers.
    reason: Option<ReasonKind>,
    /// Of the evidence: `very strong`, `strong`, `weak`.
    strength: Option<&'static str>,
}

/// Why an effect was refused or is not visible.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
enum ReasonKind {
    Refused(RefusalKind),
    NotVisible(NotVisibleKind),
}

#[derive(Serialize, JsonSchema)]
struct EstimateJson {
    value: f64,
    sigma: f64,
    unit: &'static str,
}

#[derive(Serialize, JsonSchema)]
struct DetectionLimitJson {
    effect: &'static str,
    parameter: String,
    value: f64,
    unit: &'static str,
    /// The value of another parameter at which the limit is highest.
    at: Entries<f64>,
}

#[derive(Serialize, JsonSchema)]
struct ShapeJson<'a> {
    acts_on: &'static str,
    coordinate: &'static str,
    along: String,
    bins: Vec<BinJson>,
    expression: Option<&'a str>,
    delta_bic: f64,
    form: ShapeKind,
    says: String,
}

#[derive(Serialize, JsonSchema)]
struct BinJson {
    at: f64,
    mean: f64,
    confidence: f64,
}

#[derive(Serialize, JsonSchema)]
struct NextJson {
    says: Option<String>,
    purpose: PurposeKind,
    command: String,
    /// Expected ΔBIC of each run, the best first.
    expected: Vec<ExpectedJson>,
}

#[derive(Serialize, JsonSchema)]
struct ExpectedJson {
    command: String,
    delta_bic: f64,
}

/// The answer about an implausible log: that of a comparison, and the keys of an explanation, empty.
#[derive(Serialize, JsonSchema)]
struct ExplainBadLogJson {
    #[serde(flatten)]
    bad_log: BadLogJson,
    missing: [(); 0],
    steps: [(); 0],
    candidates: [(); 0],
    unexplained: [(); 0],
    next_experiment: Option<()>,
}

/// The whole answer.
pub fn explain_json(e: &Explanation) -> Value {
    let axis = e.model.axis();
    value(&ExplanationJson {
        verdict: e.verdict.name(),
        missing: &e.missing,
        not_distinguishable: Entries(
            e.missing.iter().map(|name| (name.clone(), words::alternatives(e, name))).filter(|(_, others)| !others.is_empty()).collect(),
        ),
        says: words::headline(e),
        log: e.log.path().display().to_string(),
        model: e.model.name(),
        samples: e.log.len(),
        duration_s: e.log.duration_s(),
        steps: e.stages.iter().enumerate().map(|(k, s)| stage(e, k, s)).collect(),
        candidates: e.candidates.iter().map(|c| candidate(e, c)).collect(),
        failures: e.misfits.iter().map(|m| MisfitJson::of(axis, m)).collect(),
        remaining: e.remaining.iter().map(|m| MisfitJson::of(axis, m)).collect(),
        explained_fraction: Entries(e.missing.iter().enumerate().map(|(k, name)| (name.clone(), words::share(e, k + 1))).collect()),
        unexplained: e.unexplained.iter().map(|s| shape(axis, s)).collect(),
        next_experiment: e.next.as_ref().map(|n| NextJson {
            says: sentences::next_experiment(e),
            purpose: purpose_kind(&n.purpose),
            command: sentences::command(&n.run),
            expected: n
                .expected
                .iter()
                .map(|s| ExpectedJson { command: sentences::command(&s.run), delta_bic: s.expected_delta_bic })
                .collect(),
        }),
        parameters: estimates(axis, e.stages.last().map_or(&[], |s| &s.parameters)),
        sigma_is_lower_bound: e.stages.last().is_some_and(Stage::sigma_is_lower_bound),
        not_shown: words::not_shown(e),
        detection_limits: e.detection_limits.iter().map(|l| detection_limit(axis, l)).collect(),
        remarks: sentences::remarks(e),
        warnings: log_warnings(&e.log),
        open: e.unfinished.as_ref().map(|unfinished| words::open_part(unfinished.open)),
        effort_passes: e.effort_passes,
        seconds: e.seconds,
    })
}

/// The answer about an implausible log.
pub fn explain_bad_log_json(log: &Log, problems: &[Defect]) -> Value {
    value(&ExplainBadLogJson {
        bad_log: BadLogJson::new(log, problems),
        missing: [],
        steps: [],
        candidates: [],
        unexplained: [],
        next_experiment: None,
    })
}

fn stage<'a>(e: &'a Explanation, k: usize, s: &'a Stage) -> StageJson<'a> {
    StageJson {
        effects: &s.effects,
        added: s.added.as_deref(),
        rms: by_output(e.model.axis(), &s.outputs, |o| o.rms),
        heldout_rms: by_output(e.model.axis(), &s.outputs, |o| o.heldout_rms),
        ratio: by_output(e.model.axis(), &s.outputs, ChannelError::ratio),
        noise: by_output(e.model.axis(), &s.outputs, |o| o.noise),
        share: words::share(e, k),
    }
}

fn candidate<'a>(e: &Explanation, c: &'a Candidate) -> CandidateJson<'a> {
    let outcome = Outcome::of(e, c);
    CandidateJson {
        effect: &c.effect,
        parameters: estimates(e.model.axis(), &c.parameters),
        heldout_rms: by_output(e.model.axis(), &c.outputs, |o| o.heldout_rms),
        delta_bic: c.delta_bic,
        p_value: has_p_value(e, c).then(|| p_value(c.p_value)),
        log10_p: has_p_value(e, c).then_some(c.log10_p),
        ambiguous_with: &c.ambiguous_with,
        refitted: c.refitted,
        fate: outcome.name(),
        refused: reason(e.model.axis(), c, outcome),
        reason: match outcome {
            Outcome::Refused => c.refused.as_ref().map(|r| ReasonKind::Refused(refusal_kind(e.model.axis(), r))),
            Outcome::NotVisible => c.not_visible.as_ref().map(|reason| ReasonKind::NotVisible(not_visible_kind(reason))),
            _ => None,
        },
        strength: c.delta_bic.map(|delta_bic| strength(e, delta_bic)),
    }
}

fn by_output<T>(axis: Axis, outputs: &[ChannelError], value: impl Fn(&ChannelError) -> T) -> Entries<T> {
    Entries(outputs.iter().map(|o| (column(axis, o.channel).to_owned(), value(o))).collect())
}

fn estimates(axis: Axis, list: &[Estimate]) -> Entries<EstimateJson> {
    Entries(
        list.iter().map(|p| (axis.parameter(&p.name), EstimateJson { value: p.value, sigma: p.sigma, unit: axis.unit(p.unit) })).collect(),
    )
}

fn detection_limit(axis: Axis, l: &DetectionLimit) -> DetectionLimitJson {
    let parameters = l.card.parameters;
    DetectionLimitJson {
        effect: l.card.id,
        parameter: axis.parameter(parameters[l.parameter].name),
        value: l.size,
        unit: axis.unit(parameters[l.parameter].unit),
        at: Entries(l.at.iter().map(|(k, value)| (axis.parameter(parameters[*k].name), *value)).collect()),
    }
}

fn shape(axis: Axis, s: &Shape) -> ShapeJson<'_> {
    ShapeJson {
        acts_on: s.acts_on.key(),
        coordinate: s.coordinate.name(),
        along: sentences::along(axis, s).to_string(),
        bins: s.bins.iter().map(|b| BinJson { at: b.at, mean: b.mean, confidence: b.confidence }).collect(),
        expression: s.expression.as_deref(),
        delta_bic: s.delta_bic,
        form: shape_kind(axis, s),
        says: sentences::shape(axis, s),
    }
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("explain", schema_of::<ExplanationJson<'_>>()), ("explain, not a plausible record", schema_of::<ExplainBadLogJson>())]
}
