//! What an explanation says, in words: the same in every form of its report.

use drive_model::Card;

use super::coverage;
pub use super::evidence::{chance, fate, grouped, has_chance, heldout, probability, sure, tried};
use super::sentences::{first_lower, needed, not_visible};
use crate::identify::explain::criteria::MisfitClass;
use crate::identify::explain::{ChannelError, Estimate, Explanation, NotVisible, Stage, Verdict};
use crate::report::{numbers, unit};

/// Heading.
pub fn title(e: &Explanation) -> String {
    format!("What {} lacks, by {}", e.model.name(), e.log.path().display())
}

/// The effect's card: `cogging` of `cogging#2`.
pub fn card(name: &str) -> Option<&'static Card> {
    drive_model::card(name.split('#').next().unwrap_or(name))
}

/// The answer in a sentence or two.
pub fn headline(e: &Explanation) -> String {
    let channels = e.explained.channels.len();
    let every = if channels > 1 { "in every channel" } else { "in the one channel that is compared" };
    match e.verdict {
        Verdict::Adequate => {
            let left = off(e, last(e));
            let left = if left.is_empty() {
                format!("what is left is as small as the noise {every}")
            } else {
                format!("what is left ({left}) has no shape that any effect would leave")
            };
            format!("Nothing is missing that this log could show: {left}.")
        }
        Verdict::EffectFound => {
            let left = off(e, last(e));
            let left = match left.is_empty() {
                true => format!("With {} only noise is left {every}.", if e.missing.len() > 1 { "them" } else { "it" }),
                false if last(e).iter().any(|o| class(e, o) > MisfitClass::Moderate) => format!(
                    "Much is left that no effect of the catalogue explains ({left}): a cause of no name may be behind {} too.",
                    if e.missing.len() > 1 { "them" } else { "it" }
                ),
                false => format!("Something small is left that no effect of the catalogue explains: {left}."),
            };
            format!("Missing: {}. {left}", listed(&e.missing))
        }
        Verdict::UnknownStructure => {
            let found = match &e.missing[..] {
                [] => String::new(),
                [one] => format!("{one} explains a part of the error, but may stand in for something else. "),
                many => format!("{} explain a part of the error, but may stand in for something else. ", listed(many)),
            };
            let left = off(e, last(e));
            let left = if left.is_empty() { String::new() } else { format!(" ({left})") };
            let shape = if e.unexplained.is_empty() {
                "Over none of this log's coordinates it has a shape that is sure: it may come at moments of its own, or ring"
            } else {
                "Below is its shape"
            };
            format!("{found}Something is there that no effect of the catalogue explains{left}. {shape}.")
        }
    }
}

fn last(e: &Explanation) -> &[ChannelError] {
    e.stages.last().map_or(&[], |s| &s.outputs)
}

/// Class of a channel's misfit.
fn class(e: &Explanation, o: &ChannelError) -> MisfitClass {
    e.criteria.noise.misfit(o.ratio() * o.ratio())
}

/// A channel's error is visibly larger than its noise.
pub fn exceeds_noise(e: &Explanation, o: &ChannelError) -> bool {
    class(e, o) > MisfitClass::Invisible
}

/// Channels that are off, with by how much; empty where none is.
fn off(e: &Explanation, outputs: &[ChannelError]) -> String {
    let off: Vec<String> = outputs
        .iter()
        .filter(|o| exceeds_noise(e, o))
        .map(|o| format!("{} at {} × its noise", o.channel.column(), numbers::significant(o.ratio(), 3)))
        .collect();
    listed(&off)
}

/// `a`, `a and b`, `a, b and c`.
pub fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [before @ .., last] => format!("{} and {last}", before.join(", ")),
    }
}

/// Mean square of the residual that is not noise, over all channels, in units of the noise.
fn excess(stage: &Stage) -> f64 {
    stage.outputs.iter().map(|o| (o.ratio() * o.ratio() - 1.0).max(0.0)).filter(|x| x.is_finite()).sum()
}

/// Part of the given model's excess that stage `k` removed; `None` where there was none.
pub fn share(e: &Explanation, k: usize) -> Option<f64> {
    let first = excess(e.stages.first()?);
    let before = excess(e.stages.get(k.checked_sub(1)?)?);
    let after = excess(e.stages.get(k)?);
    (first > 0.0).then(|| (before - after) / first)
}

/// A parameter with its value: `cogging_N_m = 0.00190 ± 0.00002 N m`.
pub fn estimate(p: &Estimate) -> String {
    format!("{} = {}", p.name, value(p))
}

/// Its value with unit.
pub fn value(p: &Estimate) -> String {
    let number = numbers::with_sigma(p.value, p.sigma);
    if p.unit.is_empty() || p.unit == "1" { number } else { format!("{number} {}", p.unit) }
}

/// The fitted parameters of an added effect, as the last stage has them.
pub fn parameters<'a>(e: &'a Explanation, name: &str) -> Vec<&'a Estimate> {
    let Some(found) = e.model.effects().iter().find(|u| u.name() == name) else { return Vec::new() };
    let names: Vec<&str> = found.parameters.iter().filter_map(|&k| e.model.parameters().get(k)).map(|p| p.name.as_str()).collect();
    e.stages.last().map_or(Vec::new(), |s| s.parameters.iter().filter(|p| names.contains(&p.name.as_str())).collect())
}

/// All that is to be said of one added effect: what, and a text to it; `k` counts from 0.
pub fn of_effect(e: &Explanation, k: usize) -> Vec<(String, String)> {
    let Some(name) = e.missing.get(k) else { return Vec::new() };
    let mut list = Vec::new();
    let mut says = |term: &str, text: String| list.push((term.to_owned(), text));
    let card = card(name);
    let sizes: Vec<String> = parameters(e, name).into_iter().map(estimate).collect();
    let what = card.map_or("", |c| c.description.summary);
    says(name, if sizes.is_empty() { what.to_owned() } else { format!("{what} Here: {}.", sizes.join(", ")) });
    // The list is that of the first step; what was added later was judged again, beside what was added before.
    let candidate = e.candidates.iter().find(|c| k == 0 && c.effect == *name && c.refitted);
    if let Some(c) = candidate {
        let not_the_cause = "Sure that it helps, not that it is the cause: what is left with it is far more than noise.";
        says("How sure", if e.verdict == Verdict::UnknownStructure { format!("{not_the_cause} {}", sure(e, c)) } else { sure(e, c) });
    }
    if let Some(text) = fall(e, k + 1) {
        says("How much", text);
    }
    if let Some(card) = card {
        says("How it shows", card.description.signature.to_owned());
    }
    let rivals = candidate.map_or(&[][..], |c| &c.ambiguous_with);
    let looks = card.map_or("", |c| c.description.similar);
    says(
        "What looks alike",
        match (rivals, candidate) {
            ([], None) => looks.to_owned(),
            ([], Some(_)) => format!("None of the others fits this log nearly as well. In other logs: {}", first_lower(looks)),
            (rivals, _) => format!(
                "This log cannot tell it from {}: what was tried fits as well within {} in BIC, and the first in the catalogue is named. {looks}",
                listed(rivals),
                e.criteria.evidence.min_bic_difference
            ),
        },
    );
    list
}

/// How much of the error a stage took away, channel by channel.
fn fall(e: &Explanation, k: usize) -> Option<String> {
    let (before, after) = (e.stages.get(k.checked_sub(1)?)?, e.stages.get(k)?);
    let channels: Vec<String> = before
        .outputs
        .iter()
        .zip(&after.outputs)
        .filter(|(b, _)| exceeds_noise(e, b))
        .map(|(b, a)| {
            format!(
                "{} from {} to {} {} (noise {})",
                b.channel.column(),
                numbers::significant(b.rms, 3),
                numbers::significant(a.rms, 3),
                unit(b.channel),
                numbers::significant(a.noise, 3)
            )
        })
        .collect();
    let part = share(e, k)?;
    let part = match 100.0 * part {
        p if p >= 99.95 => "practically all".to_owned(),
        p if p >= 0.05 => format!("{} %", numbers::significant(p, 3)),
        _ => "hardly any".to_owned(),
    };
    let channels = if channels.is_empty() { String::new() } else { format!(": the rms error fell, {}", listed(&channels)) };
    Some(format!("It was {part} of the error that was not noise{channels}."))
}

/// What this log could not have shown: of its motion, and by its columns; a sentence each.
pub fn blind(e: &Explanation) -> Vec<String> {
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
    list.extend(reasons.into_iter().map(|(reason, names)| match reason {
        NotVisible::Needs(requirement) => format!("Not visible without {}: {}.", needed(requirement), listed(&names)),
        _ => format!("Not visible: {} ({}).", listed(&names), not_visible(&reason)),
    }));
    list
}

/// Where a proposed expression goes, as sentences.
pub fn paste(e: &Explanation) -> String {
    let model = e.model.name();
    // Only `explain` takes several logs.
    let command = if e.logs.len() > 1 { "explain" } else { "fit" };
    format!("To try it, paste these lines at the end of {model}, then run `stand {command} {} --model {model}`.", e.logs.join(" "))
}

/// Name of a stage in a staircase.
pub fn stage(s: &Stage) -> String {
    s.added.as_ref().map_or("as given".to_owned(), |name| format!("+ {name}"))
}

/// What the words of an explanation mean, for a student.
pub const GLOSSARY: &[(&str, &str)] = &[
    (
        "ΔBIC",
        "change of the Bayesian information criterion: how much better the model fits, less a charge for each new parameter. Negative is better; by 6 and more the two can be told apart.",
    ),
    ("p", "probability that chance alone, in a log without this effect, would look as good for any of all the effects that were tried."),
    (
        "held-out",
        "error on rows that the fit never saw, all channels together, as a multiple of the noise. An effect that is real makes it smaller too.",
    ),
    (
        "refused",
        "it fits better, but cannot be the reason: a parameter would be unphysical, or the error grows on rows that the fit never saw.",
    ),
    ("promises less", "its first step, without a fit, gains far less than the best; it was not fitted, so that it has no figures."),
    ("fits as well", "the log cannot tell this effect from the one that was added."),
];
