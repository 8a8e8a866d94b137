//! Sentences of an explanation, shared by text, HTML and JSON.

use super::coverage;
use super::evidence::evidence;
pub use super::names::card;
use super::names::first_lower;
use super::sentences::not_visible;
pub use crate::listed;
use crate::{column, numbers, unit};
use identification::identify::explain::OpenPart;
use identification::identify::explain::criteria::MisfitClass;
use identification::identify::explain::{ChannelError, DetectionLimit, Estimate, Explanation, NotVisible, Stage, Verdict};
use identification::log::Axis;

/// Column heads of the table of candidates, explained.
pub const TABLE_LEGEND: &str = "Sorted by score, highest first. ΔBIC: change of the Bayesian information criterion by adding the effect; negative is better, below −6 is required. p: probability of the improvement by chance, over the whole catalogue. held-out: rms over noise on rows that the fit did not use.";

/// Main heading.
pub fn title(e: &Explanation) -> String {
    format!("Effects missing in model {}, from log {}", e.model.name(), e.log.path().display())
}

/// The result in one to three sentences.
pub fn headline(e: &Explanation) -> String {
    let every = if e.explained.channels.len() > 1 { " in every channel" } else { "" };
    let above = above_noise(e, last(e));
    match e.verdict {
        Verdict::Adequate if above.is_empty() => {
            format!("No missing effect is visible in this log: the residual is at noise level{every}.")
        }
        Verdict::Adequate => {
            format!("No missing effect is visible in this log: the residual ({above}) has no structure that an effect would leave.")
        }
        Verdict::EffectFound => {
            let plural = e.missing.len() > 1;
            let (effects, them) = if plural { ("effects", "them") } else { ("effect", "it") };
            let left = if above.is_empty() {
                format!("With {them} the residual is at noise level{every}.")
            } else {
                format!("With {them} only noise is left; it is coloured or uneven ({above}) and depends on nothing in the log.")
            };
            format!("Missing {effects}: {}. {left}", listed(&named(e)))
        }
        Verdict::PartlyExplained => {
            let names: Vec<String> = named(e)
                .into_iter()
                .enumerate()
                .map(|(k, name)| match share(e, k + 1) {
                    Some(part) => format!("{name} (explains {:.0} % of the residual variance above the noise)", 100.0 * part),
                    None => name,
                })
                .collect();
            let over = remaining_coordinates(e);
            let over = match (&over[..], e.unexplained.is_empty()) {
                ([], true) => "it has no significant shape over any coordinate of this log".to_owned(),
                ([], false) => "its shape is given below".to_owned(),
                _ => format!("it is most visible over {}", listed(&over)),
            };
            format!(
                "Partly explained. Missing: {}. Something else is left ({above}): {over}, and no effect of the catalogue explains it.",
                listed(&names)
            )
        }
        Verdict::NotFinished => {
            let settled = match &named(e)[..] {
                [] => "No effect is settled.".to_owned(),
                names => format!("Settled so far: {}; with them {above} is left.", listed(names)),
            };
            let open = e.unfinished.as_ref().map_or(String::new(), |unfinished| format!(" Open: {}.", open_part(unfinished.open)));
            format!(
                "The search is not finished: its limit was reached after {} passes. {settled}{open}",
                numbers::grouped(e.effort_passes.round() as usize)
            )
        }
        Verdict::UnknownStructure => {
            let found = match &named(e)[..] {
                [] => String::new(),
                [one] => format!("{one} explains part of the residual, but may stand in for another cause. "),
                many => format!("{} explain part of the residual, but may stand in for another cause. ", listed(many)),
            };
            let above = if above.is_empty() { String::new() } else { format!(" ({above})") };
            let shape = if e.unexplained.is_empty() {
                "It has no significant shape over any coordinate of this log; it may be intermittent, oscillatory, or slow beside the log."
            } else {
                "Its shape is given below."
            };
            format!("{found}The log contains a structure that no effect of the catalogue explains{above}. {shape}")
        }
    }
}

/// The part of the method that a limit has left open.
pub fn open_part(open: OpenPart) -> String {
    match open {
        OpenPart::AddingStep { number: 1 } => "whether an effect is missing".to_owned(),
        OpenPart::AddingStep { number } => format!("whether a further effect is missing, step {number} of the search"),
        OpenPart::Conventions => "whether the log was recorded by another convention, and what is left".to_owned(),
        OpenPart::Remainder => "what is left beside these effects, and whether another structure describes it better".to_owned(),
    }
}

/// The coordinates over which the final model fails, most telling first.
pub fn remaining_coordinates(e: &Explanation) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for misfit in &e.remaining {
        let name = crate::misfits::coordinate(e.model.axis(), misfit.coordinate).to_owned();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.truncate(2);
    names
}

/// The added effects, each with those that the log does not distinguish from it: `asymmetric-friction or load (not distinguishable here)`.
pub fn named(e: &Explanation) -> Vec<String> {
    let name = |effect: &String| match alternatives(e, effect) {
        [] => effect.clone(),
        others => format!("{effect} or {} (not distinguishable here)", others.join(" or ")),
    };
    e.missing.iter().map(name).collect()
}

/// Effects that the log does not distinguish from an added effect. Those of later stages were compared in the presence of the earlier ones
/// only.
pub fn alternatives<'a>(e: &'a Explanation, effect: &str) -> &'a [String] {
    e.candidates.iter().find(|c| c.effect == effect && c.refitted).map_or(&[], |c| &c.ambiguous_with)
}

fn last(e: &Explanation) -> &[ChannelError] {
    e.stages.last().map_or(&[], |s| &s.outputs)
}

/// Class of a channel's misfit.
fn class(e: &Explanation, o: &ChannelError) -> MisfitClass {
    e.criteria.noise.misfit(o.ratio() * o.ratio())
}

/// The residual of the channel is visibly larger than its noise.
pub fn exceeds_noise(e: &Explanation, o: &ChannelError) -> bool {
    class(e, o) > MisfitClass::Invisible
}

/// The channels whose residual is above the noise, with their ratios; empty where there are none.
fn above_noise(e: &Explanation, outputs: &[ChannelError]) -> String {
    let above: Vec<String> = outputs
        .iter()
        .filter(|o| exceeds_noise(e, o))
        .map(|o| format!("{} at {} × noise", column(e.model.axis(), o.channel), numbers::significant(o.ratio(), 3)))
        .collect();
    listed(&above)
}

/// Mean square of the residual above the noise, over all channels, in units of the noise variance.
fn excess(stage: &Stage) -> f64 {
    stage.outputs.iter().map(|o| (o.ratio() * o.ratio() - 1.0).max(0.0)).filter(|x| x.is_finite()).sum()
}

/// Fraction of the given model's excess that stage `k` removed; `None` where there was no excess.
pub fn share(e: &Explanation, k: usize) -> Option<f64> {
    let first = excess(e.stages.first()?);
    let before = excess(e.stages.get(k.checked_sub(1)?)?);
    let after = excess(e.stages.get(k)?);
    (first > 0.0).then(|| (before - after) / first)
}

/// A parameter with its value: `cogging_N_m = 0.00190 ± 0.00002 N m`.
pub fn estimate(axis: Axis, p: &Estimate) -> String {
    format!("{} = {}", axis.parameter(&p.name), value(axis, p))
}

/// The value with its standard uncertainty and unit.
pub fn value(axis: Axis, p: &Estimate) -> String {
    let number = numbers::with_sigma(p.value, p.sigma);
    if p.unit.is_empty() || p.unit == "1" { number } else { format!("{number} {}", axis.unit(p.unit)) }
}

/// The fitted parameters of an added effect, as the last stage has them.
pub fn parameters<'a>(e: &'a Explanation, name: &str) -> Vec<&'a Estimate> {
    let Some(found) = e.model.effects().iter().find(|u| u.name() == name) else { return Vec::new() };
    let names: Vec<&str> = found.parameters.iter().filter_map(|&k| e.model.parameters().get(k)).map(|p| p.name.as_str()).collect();
    e.stages.last().map_or(Vec::new(), |s| s.parameters.iter().filter(|p| names.contains(&p.name.as_str())).collect())
}

/// The report of added effect `k`, counted from 0: terms with their texts.
pub fn added_effect(e: &Explanation, k: usize) -> Vec<(String, String)> {
    let Some(name) = e.missing.get(k) else { return Vec::new() };
    let mut list = Vec::new();
    let mut add = |term: &str, text: String| list.push((term.to_owned(), text));
    let card = card(name);
    let estimates = parameters(e, name);
    let sigma = if estimates.iter().any(|p| p.sigma > 0.0) {
        format!(" (± {}1σ)", numbers::at_least(e.stages.last().is_some_and(Stage::sigma_is_lower_bound)))
    } else {
        String::new()
    };
    let values: Vec<String> = estimates.into_iter().map(|p| estimate(e.model.axis(), p)).collect();
    let what = card.map_or("", |c| c.description.summary);
    add(name, if values.is_empty() { what.to_owned() } else { format!("{what} Fitted: {}{sigma}.", values.join(", ")) });
    // The candidates are those of the first step; effects added later were compared in the presence of the earlier ones.
    let candidate = e.candidates.iter().find(|c| k == 0 && c.effect == *name && c.refitted);
    if let Some(c) = candidate {
        let mut text = evidence(e, c);
        if e.verdict == Verdict::UnknownStructure {
            text.push_str(" The effect improves the fit but may not be the cause: the remaining residual is far above the noise.");
        }
        add("Evidence", text);
    }
    if let Some(text) = reduction(e, k + 1) {
        add("Error reduction", text);
    }
    if let Some(card) = card {
        add("Signature", card.description.signature.to_owned());
    }
    let rivals = candidate.map_or(&[][..], |c| &c.ambiguous_with);
    let similar = card.map_or("", |c| c.description.similar);
    let text = match (rivals, candidate) {
        ([], None) => similar.to_owned(),
        ([], Some(_)) => format!("In this log no other effect fits nearly as well. In other logs: {}", first_lower(similar)),
        (rivals, _) => {
            let rivals: Vec<String> = rivals.iter().map(|name| format!("`{name}`")).collect();
            format!(
                "Not distinguishable from {} in this log (ΔBIC < {}); the first in the catalogue is named. {similar}",
                listed(&rivals),
                e.criteria.evidence.min_bic_difference
            )
        }
    };
    add("Similar effects", text);
    list
}

/// How much of the error stage `k` removed, in all and by channel.
fn reduction(e: &Explanation, k: usize) -> Option<String> {
    let (before, after) = (e.stages.get(k.checked_sub(1)?)?, e.stages.get(k)?);
    let channels: Vec<String> = before
        .outputs
        .iter()
        .zip(&after.outputs)
        .filter(|(b, _)| exceeds_noise(e, b))
        .map(|(b, a)| {
            format!(
                "{} from {} to {} {} (noise {})",
                column(e.model.axis(), b.channel),
                numbers::significant(b.rms, 3),
                numbers::significant(a.rms, 3),
                unit(e.model.axis(), b.channel),
                numbers::significant(a.noise, 3)
            )
        })
        .collect();
    let percent = match 100.0 * share(e, k)? {
        p if p >= 99.95 => "More than 99.9 %".to_owned(),
        p if p >= 0.05 => format!("{} %", numbers::significant(p, 3)),
        _ => "Less than 0.1 %".to_owned(),
    };
    let channels = if channels.is_empty() { String::new() } else { format!("; rms of {}", listed(&channels)) };
    Some(format!("{percent} of the residual variance above the noise{channels}."))
}

/// What this log cannot show, because of its motion or its columns; a sentence each.
pub fn not_shown(e: &Explanation) -> Vec<String> {
    let mut list = vec![coverage::covered(&e.coverage)];
    list.extend(coverage::not_covered(&e.coverage));
    let mut reasons: Vec<(NotVisible, Vec<String>)> = Vec::new();
    for c in &e.candidates {
        let Some(reason) = c.not_visible else { continue };
        match reasons.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, names)) => names.push(c.effect.clone()),
            None => reasons.push((reason, vec![c.effect.clone()])),
        }
    }
    list.extend(reasons.into_iter().map(|(reason, names)| format!("Not visible: {} ({}).", listed(&names), not_visible(&reason))));
    list
}

/// A detection limit in words.
pub struct LimitRow {
    /// The effect.
    pub effect: &'static str,
    /// Its smallest amplitude that the log would have shown, with name and unit.
    pub size: String,
    /// The order, frequency or time at which it is that large; empty where there is none.
    pub at: String,
}

/// The smallest effects that the log would have shown.
pub fn detection_limits(e: &Explanation) -> Vec<LimitRow> {
    let axis = e.model.axis();
    let number = |x: f64| numbers::significant(x, 2);
    let row = |l: &DetectionLimit| {
        let amplitude = &l.card.parameters[l.parameter];
        let unit = |unit| if unit == "1" { "" } else { axis.unit(unit) };
        let size = format!("{} = {} {}", axis.parameter(amplitude.name), number(l.size), unit(amplitude.unit));
        let least_visible = l.at.map_or(String::new(), |(k, value)| {
            let other = &l.card.parameters[k];
            format!("least visible of those tried: {} = {} {}", axis.parameter(other.name), number(value), axis.unit(other.unit))
        });
        LimitRow { effect: l.card.id, size: size.trim_end().to_owned(), at: least_visible.trim_end().to_owned() }
    };
    e.detection_limits.iter().map(row).collect()
}

/// Meaning of the detection limits.
pub const DETECTION_LEGEND: &str =
    "An effect of this amplitude, alone, would have been found in about nine of ten such logs. A smaller one may be present.";

/// How to use a proposed expression.
pub fn paste(e: &Explanation) -> String {
    let model = e.model.name();
    // Only `explain` takes several logs.
    let command = if e.logs.len() > 1 { "explain" } else { "fit" };
    format!(
        "To try this expression, paste these lines at the end of {model}, then run `stand {command} {} --model {model}`.",
        e.logs.join(" ")
    )
}

/// Label of a stage.
pub fn stage(s: &Stage) -> String {
    s.added.as_ref().map_or("as given".to_owned(), |name| format!("+ {name}"))
}

/// Terms of the report and their explanations.
pub const GLOSSARY: &[(&str, &str)] = &[
    (
        "ΔBIC",
        "change of the Bayesian information criterion: improvement of the fit minus a penalty for each new parameter. Negative is better; a difference of 6 or more is strong evidence.",
    ),
    (
        "p",
        "probability that chance alone, in a log without this effect, gives as large an improvement for any effect of the catalogue. Below 1e-12 the noise model is more doubtful than chance.",
    ),
    ("held-out", "rms over noise on rows that the fit did not use, over all channels. A real effect reduces it too."),
    ("refused", "improves the fit but cannot be the cause: a parameter would be unphysical, or the error on held-out rows grows."),
    ("lower score", "the screening step gains far less than the best effect; not fitted, therefore no figures."),
    ("not distinguishable", "this log does not distinguish the effect from the one that was added (ΔBIC < 6)."),
    ("not significant", "the improvement may be chance, or is too small for the number of parameters."),
];
