//! Sentences and numbers of a fleet's evaluation.

use crate::{p_value, with_sigma};
use stand_analysis::fleet::change::{FindingChange, MIN_DOF, ParameterChange};
use stand_analysis::fleet::evaluation::FleetEvaluation;
use stand_analysis::fleet::outlier::{MIN_STANDS, StandValue};
use stand_analysis::fleet::row::day_of;

/// A count with its noun: `1 log`, `2 logs`.
pub(super) fn counted(n: usize, noun: &str) -> String {
    format!("{} {noun}{}", crate::grouped(n), if n == 1 { "" } else { "s" })
}

/// Size and range of the table.
pub(super) fn size(e: &FleetEvaluation) -> String {
    let range = e.range_us.map_or(String::new(), |(from, to)| format!(", recorded {} to {}", day_of(from), day_of(to)));
    let batches = if e.batches > 0 { format!(", {} batch{}", e.batches, if e.batches == 1 { "" } else { "es" }) } else { String::new() };
    format!("{} of {}{batches}{range}", counted(e.logs, "log"), counted(e.stands, "stand"))
}

/// The date that divides the logs.
pub(super) fn since(e: &FleetEvaluation) -> String {
    e.since_us.map_or(String::new(), day_of)
}

/// Results in one line.
pub(super) fn headline(e: &FleetEvaluation) -> String {
    let changed: std::collections::BTreeSet<&str> = (e.parameter_changes.iter().filter(|c| c.is_significant()).map(|c| c.stand.as_str()))
        .chain(e.finding_changes.iter().filter(|c| c.is_significant()).map(|c| c.stand.as_str()))
        .collect();
    let outliers: std::collections::BTreeSet<&str> =
        e.spreads.iter().flat_map(|s| &s.stands).filter(|s| s.is_significant()).map(|s| s.stand.as_str()).collect();
    let batch_effects = e.batch_effects.iter().filter(|b| b.is_significant()).count();
    format!(
        "{} changed since {}; {} common to a batch; {} among the stands; {} without an explanation.",
        counted(changed.len(), "stand"),
        if e.since_us.is_some() { since(e) } else { "–".to_owned() },
        counted(batch_effects, "effect"),
        counted(outliers.len(), "outlier"),
        counted(e.failed.len(), "log")
    )
}

/// What the table cannot show.
pub(super) fn limits(e: &FleetEvaluation) -> Vec<String> {
    let mut limits = Vec::new();
    if e.since_us.is_none() {
        limits.push("No log has a date: nothing can be said about changes. State the dates in a table of stands (--stands).".to_owned());
    } else if e.without_date > 0 {
        limits.push(format!("{} without a date: not in the comparison over time.", counted(e.without_date, "log")));
    }
    if e.stands == 0 {
        limits.push("No log names its stand: nothing can be said about changes, and each log counts as a stand of its own.".to_owned());
    } else if e.without_stand > 0 {
        limits.push(format!(
            "{} without a stand: each counts as a stand of its own, and none is in the comparison over time.",
            counted(e.without_stand, "log")
        ));
    }
    let untested = e.parameter_changes.iter().filter(|c| c.adjusted_p.is_none()).count();
    if untested > 0 {
        limits.push(format!(
            "{} of parameters not tested: too few logs of one stand in one period to know how much a stand varies from log to log (fewer than {MIN_DOF} degrees of freedom).",
            counted(untested, "difference")
        ));
    } else if e.since_us.is_some() && e.stands > 0 && e.parameter_changes.is_empty() {
        limits
            .push("No stand has a usable log both before and since the date: nothing can be said about changes of parameters.".to_owned());
    }
    if !e.spreads.is_empty() && e.spreads.iter().all(|s| s.stands.len() < MIN_STANDS) {
        limits.push(format!("Fewer than {MIN_STANDS} stands: outliers are not sought."));
    }
    if e.batches == 0 {
        limits.push("No log names a batch: nothing can be said about batches. State them in a table of stands (--stands).".to_owned());
    }
    if e.settings > 1 {
        limits.push(format!(
            "The answers were computed with {} different settings (model, build): a change may be one of the settings.",
            e.settings
        ));
    }
    limits
}

/// A value before and since.
pub(super) fn values(c: &ParameterChange) -> [String; 2] {
    [with_sigma(c.before.value, c.before.u), with_sigma(c.since.value, c.since.u)]
}

/// The adjusted p-value; a dash where nothing was tested.
pub(super) fn adjusted(p: Option<f64>) -> String {
    p.map_or("not tested".to_owned(), |p| p_value(p.log10()))
}

/// Counts of a finding: `0 of 6`.
pub(super) fn fraction((with, all): (usize, usize)) -> String {
    format!("{with} of {all}")
}

/// One line about a finding.
pub(super) fn finding(c: &FindingChange) -> String {
    format!("{}: {}, {} logs before, {} since", c.stand, c.finding, fraction(c.before), fraction(c.since))
}

/// Distance from the other stands.
pub(super) fn distance(s: &StandValue) -> String {
    format!("{:+.1}", s.z).replace('-', "−")
}
