//! What an explanation says, in words: the same in every form of its report.

use hal_sim::effects::{self, Card};

use super::explain_coverage::Coverage;
use super::words::AS_SMALL;
use super::{digits, unit};
use crate::explain::{Candidate, Estimate, Explanation, Shown, Stage, Verdict};
use crate::model::Channel;

/// What is too weak for this is put down to chance: the same over the whole catalogue as the search itself (design.md).
const FAMILYWISE_LOG10: f64 = -2.699; // 0.2 %
/// From here on BIC tells rivals apart (interfaces.md).
const APART: f64 = 6.0;

/// Heading.
pub fn title(e: &Explanation) -> String {
    format!("What {} lacks, by {}", e.model.name(), e.log.path().display())
}

/// The effect's card: `cogging` of `cogging#2`.
pub fn card(name: &str) -> Option<&'static Card> {
    effects::card(name.split('#').next().unwrap_or(name))
}

/// The answer in a sentence or two.
pub fn headline(e: &Explanation) -> String {
    let channels = e.explained.channels.len();
    let every = if channels > 1 { "in every channel" } else { "in the one channel that is compared" };
    match e.verdict {
        Verdict::Adequate => {
            let left = off(last(e));
            let left = if left.is_empty() {
                format!("what is left is as small as the noise {every}")
            } else {
                format!("what is left ({left}) has no shape that any effect would leave")
            };
            format!("Nothing is missing that this log could show: {left}.")
        }
        Verdict::EffectFound => {
            let left = off(last(e));
            let left = match left.is_empty() {
                true => format!("With {} only noise is left {every}.", if e.missing.len() > 1 { "them" } else { "it" }),
                false => format!("Something small is left that no effect of the catalogue explains: {left}."),
            };
            format!("Missing: {}. {left}", listed(&e.missing))
        }
        Verdict::UnknownStructure => {
            let found = if e.missing.is_empty() { String::new() } else { format!("{} was missing, but that is not all. ", listed(&e.missing)) };
            let left = off(last(e));
            let left = if left.is_empty() { String::new() } else { format!(" ({left})") };
            format!("{found}Something is there that no effect of the catalogue explains{left}. Below is its shape.")
        }
    }
}

fn last(e: &Explanation) -> &[Shown] {
    e.stages.last().map_or(&[], |s| &s.outputs)
}

/// Channels that are off, with by how much; empty where none is.
fn off(outputs: &[Shown]) -> String {
    let off: Vec<String> = outputs
        .iter()
        .filter(|o| o.ratio() > AS_SMALL)
        .map(|o| format!("{} at {} × its noise", o.shows.column(), digits::significant(o.ratio(), 3)))
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

/// A probability: plain where it can be read, else as a power of ten; at most 1.
pub fn probability(log10_p: f64) -> String {
    if !log10_p.is_finite() {
        return "–".to_owned();
    }
    if log10_p >= -3.0 {
        return digits::plain(10f64.powf(log10_p.min(0.0)), 2);
    }
    format!("10{}", digits::superscript(log10_p.round() as i32))
}

/// How sure the evidence is, as sentences.
pub fn sure(c: &Candidate) -> String {
    let chance = match c.log10_p {
        p if p > FAMILYWISE_LOG10 => format!("chance alone does as much with a probability of {}: this is not sure", probability(p)),
        p if p > -6.0 => format!("chance alone would do as much once in {} times", digits::grouped(10f64.powf(-p).round() as usize)),
        p => format!("chance alone would not do this once in a million times (p = {})", probability(p)),
    };
    let bic = match c.delta_bic {
        Some(d) if d < -APART => format!(
            "; and it pays for its parameters: BIC, which weighs the better fit against their number, falls by {} ({}; {APART} is asked for)",
            grouped(-d),
            if d < -100.0 { "overwhelming" } else if d < -10.0 { "very strong evidence" } else { "strong evidence" }
        ),
        Some(d) => format!("; its better fit hardly pays for its parameters (BIC changes by {})", digits::significant(d, 2)),
        None => String::new(),
    };
    format!("How sure: {chance}{bic}.")
}

/// A large number in groups of three, a small one with two digits.
pub fn grouped(x: f64) -> String {
    let sign = if x < 0.0 { "−" } else { "" };
    let size = x.abs();
    if !size.is_finite() {
        "–".to_owned()
    } else if size >= 100.0 {
        format!("{sign}{}", digits::grouped(size.round() as usize))
    } else {
        format!("{sign}{}", digits::significant(size, 2))
    }
}

/// A parameter with its value: `cogging_N_m = 0.00190 ± 0.00002 N m`.
pub fn estimate(p: &Estimate) -> String {
    format!("{} = {}", p.name, value(p))
}

/// Its value with unit.
pub fn value(p: &Estimate) -> String {
    let number = digits::with_sigma(p.value, p.sigma);
    if p.unit.is_empty() || p.unit == "1" { number } else { format!("{number} {}", p.unit) }
}

/// The fitted parameters of an added effect, as the last stage has them.
pub fn parameters<'a>(e: &'a Explanation, name: &str) -> Vec<&'a Estimate> {
    let Some(found) = e.model.effects().iter().find(|u| u.name() == name) else { return Vec::new() };
    let names: Vec<&str> = found.parameters.iter().filter_map(|&k| e.model.parameters().get(k)).map(|p| p.name.as_str()).collect();
    e.stages.last().map_or(Vec::new(), |s| s.parameters.iter().filter(|p| names.contains(&p.name.as_str())).collect())
}

/// All that is to be said of one added effect, a paragraph each; `k` counts from 0.
pub fn of_effect(e: &Explanation, k: usize) -> Vec<String> {
    let Some(name) = e.missing.get(k) else { return Vec::new() };
    let mut paragraphs = Vec::new();
    let card = card(name);
    let sizes: Vec<String> = parameters(e, name).into_iter().map(estimate).collect();
    let sizes = if sizes.is_empty() { String::new() } else { format!(" Here: {}.", sizes.join(", ")) };
    match card {
        Some(card) => paragraphs.push(format!("{name}: {}{sizes}", card.account.what)),
        None => paragraphs.push(format!("{name}.{sizes}")),
    }
    let candidate = e.candidates.iter().find(|c| c.effect == *name && c.refitted);
    if let Some(c) = candidate {
        paragraphs.push(sure(c));
    }
    paragraphs.extend(fall(e, k + 1));
    if let Some(card) = card {
        paragraphs.push(format!("How it shows: {}", card.account.shows));
    }
    let rivals = candidate.map_or(&[][..], |c| &c.ambiguous_with);
    let looks = card.map_or("", |c| c.account.looks_like);
    paragraphs.push(if rivals.is_empty() {
        format!("What could look the same: none of the others fits this log nearly as well. In other logs: {}", first_lower(looks))
    } else {
        format!(
            "What could look the same: this log cannot tell it from {}; any of them would fit as well (within {APART} in BIC), and the first in the catalogue is named. {looks}",
            listed(rivals)
        )
    });
    paragraphs
}

fn first_lower(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |c| c.to_lowercase().to_string() + letters.as_str())
}

/// How much of the error a stage took away, channel by channel.
fn fall(e: &Explanation, k: usize) -> Option<String> {
    let (before, after) = (e.stages.get(k.checked_sub(1)?)?, e.stages.get(k)?);
    let channels: Vec<String> = before
        .outputs
        .iter()
        .zip(&after.outputs)
        .filter(|(b, _)| b.ratio() > AS_SMALL)
        .map(|(b, a)| {
            format!(
                "{} from {} to {} {} (noise {})",
                b.shows.column(),
                digits::significant(b.rms, 3),
                digits::significant(a.rms, 3),
                unit(b.shows),
                digits::significant(a.noise, 3)
            )
        })
        .collect();
    let part = share(e, k)?;
    let part = match 100.0 * part {
        p if p >= 99.95 => "practically all".to_owned(),
        p if p >= 0.05 => format!("{} %", digits::significant(p, 3)),
        _ => "hardly any".to_owned(),
    };
    let channels = if channels.is_empty() { String::new() } else { format!(": the rms error fell, {}", listed(&channels)) };
    Some(format!("How much of the error it was: {part} of what was not noise{channels}."))
}

/// What becomes of a candidate, in a few words; and why, where it was refused.
pub fn fate(e: &Explanation, c: &Candidate) -> (&'static str, Option<String>) {
    let added = |k: usize| e.missing.get(k).is_some_and(|name| *name == c.effect);
    if added(0) {
        return ("added", None);
    }
    if (1..e.missing.len()).any(added) {
        return ("added later", None);
    }
    if let Some(why) = &c.refused {
        return (if tried(c) { "refused" } else { "not to be seen here" }, Some(why.clone()));
    }
    if c.ambiguous_with.iter().any(|name| e.missing.contains(name)) {
        return ("fits as well", None);
    }
    if !c.refitted || c.log10_p > FAMILYWISE_LOG10 || c.delta_bic.is_some_and(|d| d > -APART) {
        return ("no more than chance", None);
    }
    (if e.missing.is_empty() { "helps" } else { "helps less" }, None)
}

/// It could be tried on this log at all.
pub fn tried(c: &Candidate) -> bool {
    !c.parameters.is_empty()
}

/// Error of a candidate or stage on rows that the fit never saw, over all channels, in units of the noise.
pub fn heldout(outputs: &[Shown]) -> Option<f64> {
    let squares: Vec<f64> = outputs.iter().filter_map(|o| o.heldout_rms.map(|r| (r / o.noise).powi(2))).collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

/// What this log could not have shown: of its motion, and by its columns; a sentence each.
pub fn blind(e: &Explanation) -> Vec<String> {
    let coverage = Coverage::of(&e.log);
    let mut list = vec![coverage.says()];
    list.extend(coverage.blind());
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for c in e.candidates.iter().filter(|c| !tried(c)) {
        let why = c.refused.as_deref().unwrap_or("it could not be tried");
        match reasons.iter_mut().find(|(said, _)| *said == why) {
            Some((_, names)) => names.push(c.effect.clone()),
            None => reasons.push((why, vec![c.effect.clone()])),
        }
    }
    list.extend(reasons.into_iter().map(|(why, names)| format!("Not to be seen here: {} ({why}).", listed(&names))));
    list
}

/// Where a proposed expression goes, as sentences.
pub fn paste(e: &Explanation) -> String {
    let model = e.model.name();
    format!("To try it, paste these lines at the end of {model}, then run `stand fit {} --model {model}`.", e.log.path().display())
}

/// Name of a stage in a staircase.
pub fn stage(s: &Stage) -> String {
    s.added.as_ref().map_or("as given".to_owned(), |name| format!("+ {name}"))
}

/// Name and unit of what a shape acts on.
pub fn acts_on(what: &str) -> (&'static str, &'static str) {
    match what {
        "torque_N_m" => ("residual torque", "N m"),
        "voltage_V" => ("residual voltage", "V"),
        "omega_rad_s" => ("residual of the rate", unit(Channel::Rate)),
        "theta_rad" => ("residual of the angle", unit(Channel::Angle)),
        "i_A" => ("residual of the current", unit(Channel::Current)),
        _ => ("what is left", ""),
    }
}

/// What the words of an explanation mean, for a student.
pub const GLOSSARY: &[(&str, &str)] = &[
    (
        "ΔBIC",
        "change of the Bayesian information criterion: how much better the model fits, less a charge for each new parameter. Negative is better; by 6 and more the two can be told apart.",
    ),
    ("p", "probability that chance alone, in a log without this effect, would look as good for any of all the effects that were tried."),
    ("held-out", "error on rows that the fit never saw, all channels together, as a multiple of the noise. An effect that is real makes it smaller too."),
    ("refused", "it fits better, but cannot be the reason: a parameter would be unphysical, or the error grows on rows that the fit never saw."),
    ("fits as well", "the log cannot tell this effect from the one that was added."),
];
