//! Effects planted at the detection limit that `explain` states for a log in which nothing is missing: are they found? Aim: 95 %.
//!
//! The effects come in turn; the log is simulated again with one of them.

use std::collections::BTreeMap;
use std::fmt::Write;

use identification::identify::explain::{Explanation, explain};
use serde::{Deserialize, Serialize};

use super::case::Case;
use super::judge::{same_family, upper_limit};
use super::record::List;
use super::run::Identified;
use super::sets::null;
use crate::draw::Drawn;

/// Logs of the accepted run.
pub const LOGS: u64 = 44;
/// Seed of the first log.
const FIRST: u64 = 7001;
/// Step from one effect to the next in the list of limits; prime to its length.
const STEP: usize = 7;

/// A log with a planted effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlantedRecord {
    /// Name of the log.
    pub id: String,
    /// The planted effect; empty where the log states no limit.
    pub effect: String,
    /// Its amplitude, the limit.
    pub size: f64,
    /// Verdict on the log with it.
    pub verdict: String,
    /// Names in that answer.
    pub missing: List,
    /// It is named, or not distinguishable from what is named.
    pub is_named: bool,
}

/// What became of a planted effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// The log states no limit, so nothing was planted.
    NotPlanted,
    /// It is named, or not distinguishable from what is named.
    Named,
    /// Another effect is named.
    OtherName,
    /// Nothing is named.
    Missed,
}

impl PlantedRecord {
    /// What became of the effect.
    pub fn fate(&self) -> Fate {
        match (self.effect.is_empty(), self.is_named, self.missing.0.is_empty()) {
            (true, ..) => Fate::NotPlanted,
            (_, true, _) => Fate::Named,
            (.., false) => Fate::OtherName,
            (.., true) => Fate::Missed,
        }
    }
}

impl Identified for PlantedRecord {
    fn id(&self) -> &str {
        &self.id
    }
}

/// Names of the logs.
pub fn ids(count: u64) -> Vec<String> {
    (0..count).map(|k| null(k, FIRST)).collect()
}

fn explained(drawn: &Drawn) -> Result<Explanation, String> {
    explain(vec![drawn.log()], &drawn.user_model(), &|_| ()).map_err(|e| format!("{}: {e}", drawn.id))
}

/// Plants an effect in the log of a name.
///
/// # Errors
/// There is no such log, or no explanation.
pub fn planted(id: &str) -> Result<(PlantedRecord, String), String> {
    let case = Case::by_name(id, None)?;
    let drawn = case.drawn.ok_or("not a drawn stand")?;
    let limits = explained(&drawn)?.detection_limits;
    let number = id.rsplit('/').next().and_then(|seed| seed.parse::<usize>().ok()).unwrap_or(0);
    let nothing = PlantedRecord {
        id: id.to_owned(),
        effect: String::new(),
        size: 0.0,
        verdict: String::new(),
        missing: List::default(),
        is_named: false,
    };
    let Some(limit) = limits.get(number * STEP % limits.len().max(1)) else { return Ok((nothing, "no limits".to_owned())) };
    let found = explained(&drawn.clone().with_effect_at(limit, 1.0))?;
    let effect = limit.card.id;
    let first = found.candidates.iter().find(|c| found.missing.first() == Some(&c.effect));
    let is_alike = first.is_some_and(|c| c.ambiguous_with.iter().any(|name| same_family(name, effect)));
    let record = PlantedRecord {
        effect: effect.to_owned(),
        size: limit.size,
        verdict: found.verdict.name().to_owned(),
        is_named: is_alike || found.missing.iter().any(|name| same_family(name, effect)),
        missing: List(found.missing),
        ..nothing
    };
    let line = format!("{effect} {:.3e}: {} {:?}", record.size, record.verdict, record.missing.0);
    Ok((record, line))
}

/// Counts of a run.
pub fn counts(records: &[PlantedRecord]) -> String {
    let count = |fate: Fate| records.iter().filter(|record| record.fate() == fate).count();
    let [named, wrong, missed] = [Fate::Named, Fate::OtherName, Fate::Missed].map(count);
    format!(
        "planted {}, named or not distinguishable {named}, another name {wrong}, nothing named {missed} (not found: upper 95 % limit {:.1} %)",
        named + wrong + missed,
        100.0 * upper_limit(missed + wrong, named + missed + wrong)
    )
}

/// Counts of a run, beside those of the accepted one, and what changed.
pub fn text(accepted: &[PlantedRecord], found: &[PlantedRecord]) -> String {
    let mut text = format!("accepted: {}\nnow:      {}\n", counts(accepted), counts(found));
    let before: BTreeMap<&str, &PlantedRecord> = accepted.iter().map(|r| (r.id.as_str(), r)).collect();
    for record in found {
        let was = before.get(record.id.as_str());
        if was.is_some_and(|was| was.is_named != record.is_named) {
            let _ = writeln!(text, "changed: {} {}: {} [{}]", record.id, record.effect, record.verdict, record.missing.0.join(" "));
        } else if matches!(record.fate(), Fate::OtherName | Fate::Missed) {
            let _ = writeln!(
                text,
                "not named: {} {} {:.3e}: {} [{}]",
                record.id,
                record.effect,
                record.size,
                record.verdict,
                record.missing.0.join(" ")
            );
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(effect: &str, missing: &str, is_named: bool) -> PlantedRecord {
        let missing = List(missing.split_whitespace().map(str::to_owned).collect());
        PlantedRecord { id: "nulls/x/1".to_owned(), effect: effect.to_owned(), size: 1.0, verdict: String::new(), missing, is_named }
    }

    #[test]
    fn each_fate_is_counted_once() {
        let records =
            [record("", "", false), record("cogging", "cogging", true), record("cogging", "load", false), record("cogging", "", false)];
        assert_eq!(records.each_ref().map(PlantedRecord::fate), [Fate::NotPlanted, Fate::Named, Fate::OtherName, Fate::Missed]);
        assert!(counts(&records).starts_with("planted 3, named or not distinguishable 1, another name 1, nothing named 1"));
    }

    #[test]
    fn a_planted_effect_that_is_not_named_any_more_is_reported() {
        let text = text(&[record("cogging", "cogging", true)], &[record("cogging", "", false)]);
        assert!(text.contains("changed: nulls/x/1 cogging"), "{text}");
    }
}
