//! The evidence for a candidate, in words and figures.

use super::sentences::{not_visible, refusal};
use crate::identify::explain::{Candidate, ChannelError, Explanation};
use crate::report::numbers;

/// A probability: plain where it can be read, else as a power of ten; at most 1.
pub fn probability(log10_p: f64) -> String {
    if !log10_p.is_finite() {
        return "–".to_owned();
    }
    if log10_p >= -3.0 {
        return numbers::plain(10f64.powf(log10_p.min(0.0)), 2);
    }
    format!("10{}", numbers::superscript(log10_p.round() as i32))
}

/// It has a probability that can be stood for: only a fit is judged on whitened residuals, so that a first step alone has no honest small one.
pub fn has_chance(e: &Explanation, c: &Candidate) -> bool {
    tried(c) && (c.refitted || c.may_be_chance(&e.criteria))
}

/// Probability in the table.
pub fn chance(e: &Explanation, c: &Candidate) -> String {
    if has_chance(e, c) { probability(c.log10_p) } else { "–".to_owned() }
}

/// How sure the evidence is, as a sentence.
pub fn sure(e: &Explanation, c: &Candidate) -> String {
    let required = e.criteria.evidence.min_bic_difference;
    let chance = match c.log10_p {
        _ if c.may_be_chance(&e.criteria) => {
            format!("chance alone does as much with a probability of {}: this is not sure", probability(c.log10_p))
        }
        p if p > -6.0 => format!("chance alone would do as much once in {} times", numbers::grouped(10f64.powf(-p).round() as usize)),
        p => format!("chance alone would not do this once in a million times (p = {})", probability(p)),
    };
    let bic = match c.delta_bic {
        Some(d) if d < -required => format!(
            "; and it pays for its parameters: BIC, which weighs the better fit against their number, falls by {} ({}; {required} is asked for)",
            grouped(-d),
            if d < -100.0 {
                "overwhelming"
            } else if d < -10.0 {
                "very strong evidence"
            } else {
                "strong evidence"
            }
        ),
        Some(d) => format!("; its better fit hardly pays for its parameters (BIC changes by {})", numbers::significant(d, 2)),
        None => String::new(),
    };
    format!("{}{bic}.", first_upper(&chance))
}

/// A large number in groups of three, a small one with two digits.
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

/// What becomes of a candidate, in a few words; and why, where it was refused.
pub fn fate(e: &Explanation, c: &Candidate) -> (&'static str, Option<String>) {
    let added = |k: usize| e.missing.get(k).is_some_and(|name| *name == c.effect);
    if added(0) {
        return ("added", None);
    }
    if (1..e.missing.len()).any(added) {
        return ("added later", None);
    }
    if let Some(reason) = &c.refused {
        return ("refused", Some(refusal(reason)));
    }
    if let Some(reason) = &c.not_visible {
        return ("not to be seen here", Some(not_visible(reason)));
    }
    if c.ambiguous_with.iter().any(|name| e.missing.contains(name)) {
        return ("fits as well", None);
    }
    if !c.refitted && !c.may_be_chance(&e.criteria) {
        return ("promises less", None);
    }
    if !c.refitted || c.may_be_chance(&e.criteria) || c.delta_bic.is_some_and(|d| d > -e.criteria.evidence.min_bic_difference) {
        return ("no more than chance", None);
    }
    (if e.missing.is_empty() { "helps" } else { "helps less" }, None)
}

/// It could be tried on this log at all.
pub fn tried(c: &Candidate) -> bool {
    c.not_visible.is_none()
}

/// Error of a candidate or stage on rows that the fit never saw, over all channels, in units of the noise.
pub fn heldout(outputs: &[ChannelError]) -> Option<f64> {
    let squares: Vec<f64> = outputs.iter().filter_map(|o| o.heldout_rms.map(|r| (r / o.noise).powi(2))).collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

fn first_upper(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |c| c.to_uppercase().to_string() + letters.as_str())
}
