//! What the numbers mean, in words: the same in every form of a report.

use super::Comparison;
use crate::identify::fit::ChannelFit;
use crate::model::Channel;
use crate::report::{numbers, unit};

/// Up to this ratio of rms to noise a residual is called as small as the noise.
pub const AS_SMALL: f64 = 1.05;
/// A weaker correlation than this explains nothing.
const SEEN_TO_TRADE: f64 = 0.5;
/// Beyond a physical range by less than this many standard errors is no finding.
const WITHIN_ERROR: f64 = 2.0;
/// A parameter this near to its bound, relative to its start, stands at it.
const NEAR_BOUND: f64 = 1e-9;

/// Ratio of a residual to the noise, as a word.
pub fn size(ratio: f64) -> String {
    if !ratio.is_finite() {
        "cannot be told from these rows".to_owned()
    } else if ratio <= AS_SMALL {
        "as small as the noise".to_owned()
    } else {
        format!("{} × the noise", numbers::significant(ratio, 3))
    }
}

const OUTSIDE: &str = "outside its physical range";

/// One parameter of the model after a fit, with what is to be said of it.
pub struct ParameterRow {
    /// Name in the model file.
    pub name: String,
    /// What it is, from the catalogue; empty for one of the user's own.
    pub says: &'static str,
    /// Unit; empty for one of the user's own.
    pub unit: &'static str,
    /// Value at the start.
    pub start: f64,
    /// Value now.
    pub value: f64,
    /// Standard error; 0 where it was not fitted.
    pub sigma: f64,
    /// Was not to be fitted.
    pub fixed: bool,
    /// Stands at the end of its range.
    pub at_bound: bool,
    /// Lies beyond its physical range.
    pub out_of_range: bool,
    /// Beyond it by no more than the standard error explains.
    pub within_error: bool,
    /// This log does not determine it; with which other it trades, and their correlation.
    pub undetermined: Option<Option<(String, f64)>>,
}

impl ParameterRow {
    /// Value and standard error with sensible digits, with the unit.
    pub fn value_text(&self) -> String {
        let number =
            if self.undetermined.is_some() { numbers::significant(self.value, 3) } else { numbers::with_sigma(self.value, self.sigma) };
        if self.unit.is_empty() || self.unit == "1" { number } else { format!("{number} {}", self.unit) }
    }

    /// A short mark: `fixed`, `at its bound`, …; empty where nothing is to be said.
    pub fn mark(&self) -> &'static str {
        if self.undetermined.is_some() {
            "not determined"
        } else if self.out_of_range {
            if self.within_error { "zero within its error" } else { OUTSIDE }
        } else if self.at_bound {
            "at its bound"
        } else if self.fixed {
            "fixed"
        } else {
            ""
        }
    }

    /// What follows from the mark; `None` where nothing does.
    pub fn advice(&self) -> Option<String> {
        let name = &self.name;
        if let Some(trade) = &self.undetermined {
            let with = match trade {
                Some((other, r)) if r.abs() > SEEN_TO_TRADE => format!(
                    "only its combination with {other} shows (correlation {}): hold one of the two, `{{ value = …, fixed = true }}`, or record what tells them apart.",
                    numbers::significant(*r, 3)
                ),
                _ => "it hardly moves any channel: hold it, `{ value = …, fixed = true }`, or record a run that excites it.".to_owned(),
            };
            return Some(format!("{name} is not determined by this log; {with}"));
        }
        if self.out_of_range && self.within_error {
            return Some(format!("{name} lies beyond its physical range by no more than its error: this log does not show its effect."));
        }
        if self.out_of_range {
            return Some(format!(
                "{name} came out at {}, which no real drive has: the model is wrong in another place, and this parameter makes up for it. Do not use this fit; look for the effect that is missing.",
                self.value_text()
            ));
        }
        self.at_bound.then(|| {
            format!("{name} stands at the end of its range: its effect is not seen in this log and could be removed from the model.")
        })
    }
}

/// The parameters of a fit, in the model's order.
pub fn parameters(c: &Comparison) -> Vec<ParameterRow> {
    let held = c.held;
    let sigmas = held.sigmas.iter().copied().chain(std::iter::repeat(0.0));
    held.parameters
        .list
        .iter()
        .zip(sigmas)
        .map(|(p, sigma)| {
            let given = c.model.parameter(&p.name);
            let info = given.and_then(|g| g.info);
            let start = given.map_or(f64::NAN, |g| g.value);
            let near = NEAR_BOUND * info.map_or(1.0, |i| i.start.abs()).max(f64::MIN_POSITIVE);
            let (low, high) = p.range;
            // A phase closes on itself: its ends are no bounds.
            let bounded = !p.fixed && p.kind != drive_model::ParameterKind::Phase && p.kind != drive_model::ParameterKind::HarmonicOrder;
            ParameterRow {
                name: p.name.clone(),
                says: info.map_or("", |i| i.description),
                unit: info.map_or("", |i| i.unit),
                start,
                value: p.value,
                sigma,
                fixed: p.fixed || p.kind == drive_model::ParameterKind::HarmonicOrder,
                at_bound: bounded && ((p.value - low).abs() <= near || (p.value - high).abs() <= near),
                out_of_range: bounded && (p.value < low - near || p.value > high + near),
                within_error: p.value > low - WITHIN_ERROR * sigma && p.value < high + WITHIN_ERROR * sigma,
                undetermined: held.not_identifiable.iter().find(|(n, _)| *n == p.name).map(|(_, with)| with.clone()),
            }
        })
        .collect()
}

/// What a channel's numbers say, in a sentence.
pub fn channel(f: &ChannelFit) -> String {
    let ratio = f.rms / f.noise;
    let column = f.channel.column();
    let noise = numbers::significant(f.noise, 2);
    let unit = unit(f.channel);
    if !ratio.is_finite() {
        return format!("{column}: too few rows to say.");
    }
    if ratio <= AS_SMALL {
        let rest = (ratio * ratio - 1.0).max(0.0).sqrt();
        return if f.white() {
            format!("{column}: what is left is white and as small as the noise ({noise} {unit}).")
        } else if f.channel == Channel::Angle && ratio < 1.0 {
            format!("{column}: as small as the noise ({noise} {unit}).")
        } else {
            format!(
                "{column}: as small as the noise ({noise} {unit}), though not quite white: a trace of structure{}.",
                if rest > 0.0 { format!(", at most {} % of the noise", numbers::significant(100.0 * rest, 2)) } else { String::new() }
            )
        };
    }
    format!("{column} is off by {} × its noise.", numbers::significant(ratio, 3))
}

/// The report's last words: what was found, and what to do next.
pub fn conclusion(c: &Comparison) -> String {
    let mut text = String::new();
    let mut off: Vec<&ChannelFit> = c.held.channels.iter().filter(|f| f.rms / f.noise > AS_SMALL).collect();
    off.sort_by(|a, b| (b.rms / b.noise).total_cmp(&(a.rms / a.noise)));
    let rows = if c.fitted { parameters(c) } else { Vec::new() };
    let unphysical: Vec<String> = rows.into_iter().filter(|p| p.mark() == OUTSIDE).map(|p| p.name).collect();
    if off.is_empty() {
        text.push_str(if c.held.channels.len() > 1 { "Within the noise in every channel" } else { "Within the noise" });
        text.push_str(": this log shows nothing that the model lacks.");
        if !unphysical.is_empty() {
            text.push_str(&format!(" But {} left the physical range, so the model is not to be trusted elsewhere.", unphysical.join(", ")));
        }
        return text;
    }
    let list = off
        .iter()
        .enumerate()
        .map(|(k, f)| {
            let ratio = numbers::significant(f.rms / f.noise, 3);
            if k == 0 {
                format!("{} is off by {ratio} × its noise", f.channel.column())
            } else {
                format!("{} by {ratio} ×", f.channel.column())
            }
        })
        .collect::<Vec<_>>();
    text.push_str(&list.join(", "));
    text.push_str(if c.fitted {
        ", after the best fit of this model's parameters: the model lacks something. "
    } else {
        " with these parameters. "
    });
    if let Some(first) = c.failures.first() {
        text.push_str(&first.says);
        text.push(' ');
    }
    let model = c.model.name();
    if c.fitted {
        text.push_str(&format!("Next: `stand effects` lists what it could be; `stand model add {model} EFFECT` adds one; then fit again."));
    } else {
        text.push_str(&format!(
            "Next: `stand fit {} --model {model}` finds the parameters; what remains after that is an effect that the model lacks (`stand effects`).",
            c.log.path().display()
        ));
    }
    text
}

/// What each number of a report means: term and a line, for a student.
pub const GLOSSARY: &[(&str, &str)] = &[
    ("residual", "measured minus modelled. Of a complete model it is the sensors' noise and nothing else."),
    ("rms", "root mean square of the residual: its usual size, in the channel's unit."),
    (
        "noise",
        "what the channel scatters by itself, estimated from the fine structure that no model could follow (at least the step of its converter).",
    ),
    (
        "ratio",
        "rms over noise. 1: the model lacks nothing that this channel could show. 10: nine tenths and more of the residual is the model's.",
    ),
    ("χ²/n", "the ratio squared; 1.00 is expected, and more than 1 means that something is missing."),
    (
        "fit",
        "100 % × (1 − size of the residual / size of the signal's own variation). 100 %: all is explained; 0 %: no better than its mean.",
    ),
    (
        "held-out",
        "rms over blocks of 2 s, every fourth, that the fit never saw. Much above the rms: the model has learnt the noise of the rest by heart.",
    ),
    (
        "white",
        "the residual does not remember: its value now says nothing about its value later (Ljung–Box test, one in a thousand). Physics that is missing is hardly ever white.",
    ),
    (
        "± sigma",
        "standard error of a fitted parameter: were the run repeated, two thirds of the values would lie within it, 95 % within twice of it.",
    ),
    (
        "not determined",
        "the log hardly changes if this parameter does, or another makes up for it. Its value means nothing; its combination with the other may.",
    ),
    ("correlation", "of two parameters' errors: near +1 or −1 the log shows only one combination of them."),
    (
        "angle increment",
        "a free-running model's angle wanders off without limit, so that the angle is compared by how far it moves in 20 ms.",
    ),
];
