//! The evidence for a candidate effect, in words and figures.

use super::sentences;
use crate::{numbers, p_statement, p_value};
use identification::identify::explain::{Candidate, ChannelError, Explanation};
use identification::log::Axis;

/// |ΔBIC| from which the evidence is called very strong (Kass & Raftery, J. Am. Stat. Assoc. 90 (1995) 773).
const VERY_STRONG_BIC: f64 = 10.0;

/// The outcome for a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Added in the first step.
    Added,
    /// Added in a later step.
    AddedLater,
    /// Improves the fit, but cannot be the cause.
    Refused,
    /// Cannot be seen in this log.
    NotVisible,
    /// Not distinguishable from an effect that was added.
    NotDistinguishable,
    /// Scored lower than the best and was not fitted.
    LowerScore,
    /// Its improvement may be chance.
    NotSignificant,
    /// Improves the fit; nothing was added.
    Helps,
    /// Improves the fit less than the effect that was added.
    HelpsLess,
}

impl Outcome {
    /// All of them.
    pub const ALL: [Outcome; 9] = [
        Outcome::Added,
        Outcome::AddedLater,
        Outcome::Refused,
        Outcome::NotVisible,
        Outcome::NotDistinguishable,
        Outcome::LowerScore,
        Outcome::NotSignificant,
        Outcome::Helps,
        Outcome::HelpsLess,
    ];

    /// The outcome for candidate `c`.
    pub fn of(e: &Explanation, c: &Candidate) -> Outcome {
        let is_missing = |name: &String| e.missing.contains(name);
        match e.missing.iter().position(|name| *name == c.effect) {
            Some(0) => return Outcome::Added,
            Some(_) => return Outcome::AddedLater,
            None => {}
        }
        let significant = !c.may_be_chance(&e.criteria);
        if c.refused.is_some() {
            Outcome::Refused
        } else if c.not_visible.is_some() {
            Outcome::NotVisible
        } else if c.ambiguous_with.iter().any(is_missing) {
            Outcome::NotDistinguishable
        } else if !c.refitted && significant {
            Outcome::LowerScore
        } else if !c.refitted || !significant || c.delta_bic.is_some_and(|d| d > -e.criteria.evidence.min_bic_difference) {
            Outcome::NotSignificant
        } else if e.missing.is_empty() {
            Outcome::Helps
        } else {
            Outcome::HelpsLess
        }
    }

    /// The outcome in a few words.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Added => "added",
            Outcome::AddedLater => "added later",
            Outcome::Refused => "refused",
            Outcome::NotVisible => "not visible in this log",
            Outcome::NotDistinguishable => "not distinguishable",
            Outcome::LowerScore => "lower score",
            Outcome::NotSignificant => "not significant",
            Outcome::Helps => "helps",
            Outcome::HelpsLess => "helps less",
        }
    }
}

/// Why the candidate was refused or is not visible, as a sentence.
pub fn reason(axis: Axis, c: &Candidate, outcome: Outcome) -> Option<String> {
    match outcome {
        Outcome::Refused => c.refused.as_ref().map(|r| sentences::refusal(axis, r)),
        Outcome::NotVisible => c.not_visible.as_ref().map(sentences::not_visible),
        _ => None,
    }
}

/// The candidate could be tried on this log at all.
pub fn tried(c: &Candidate) -> bool {
    c.not_visible.is_none()
}

/// The p-value can be reported: a small one only after a fit, because only then it rests on whitened residuals.
pub fn has_p_value(e: &Explanation, c: &Candidate) -> bool {
    tried(c) && (c.refitted || c.may_be_chance(&e.criteria))
}

/// The p-value for the table; a dash where it cannot be reported.
pub fn p_cell(e: &Explanation, c: &Candidate) -> String {
    if has_p_value(e, c) { p_value(c.log10_p) } else { "–".to_owned() }
}

/// Words for the strength of the evidence, the strongest first.
pub const STRENGTHS: [&str; 3] = ["very strong", "strong", "weak"];

/// Strength of the evidence by ΔBIC.
pub fn strength(e: &Explanation, delta_bic: f64) -> &'static str {
    let [very_strong, strong, weak] = STRENGTHS;
    match delta_bic {
        d if d < -VERY_STRONG_BIC => very_strong,
        d if d < -e.criteria.evidence.min_bic_difference => strong,
        _ => weak,
    }
}

/// ΔBIC and p-value of a fitted candidate, as a sentence.
pub fn evidence(e: &Explanation, c: &Candidate) -> String {
    let p = p_statement(c.log10_p);
    let bic = c.delta_bic.map(|d| format!("ΔBIC = {} ({}), ", grouped(d), strength(e, d)));
    let verdict = if c.may_be_chance(&e.criteria) { ": not significant" } else { "" };
    format!("{}{p}{verdict}.", bic.unwrap_or_default())
}

/// A large number in groups of three digits, a small one with two digits.
pub fn grouped(x: f64) -> String {
    let sign = if x < 0.0 { "−" } else { "" };
    let size = x.abs();
    if !size.is_finite() {
        "–".to_owned()
    } else if size >= 100.0 {
        format!("{sign}{}", numbers::grouped(size.round() as usize))
    } else {
        format!("{sign}{}", numbers::significant(size, 2))
    }
}

/// rms over noise on held-out rows, over all channels; `None` where nothing was held out.
pub fn heldout_ratio(outputs: &[ChannelError]) -> Option<f64> {
    let squares: Vec<f64> = outputs.iter().filter_map(|o| o.heldout_rms.map(|r| (r / o.noise).powi(2))).collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}
