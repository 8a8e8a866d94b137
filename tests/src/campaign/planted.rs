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

/// Seed of the first log.
const FIRST: u64 = 7001;
/// Step from one effect to the next in the list of limits; prime to its length.
const STEP: usize = 7;

/// What became of a planted effect.
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

/// Counts of a run, beside those of the accepted one.
pub fn text(accepted: &[PlantedRecord], found: &[PlantedRecord]) -> String {
    let of = |records: &[PlantedRecord]| {
        let planted = records.iter().filter(|r| !r.effect.is_empty());
        let named = planted.clone().filter(|r| r.is_named).count();
        let wrong = planted.clone().filter(|r| !r.is_named && !r.missing.0.is_empty()).count();
        let missed = planted.clone().count() - named - wrong;
        format!(
            "planted {}, named or not distinguishable {named}, another name {wrong}, nothing named {missed} (upper 95 % limit {:.1} %)",
            planted.count(),
            100.0 * upper_limit(missed + wrong, named + missed + wrong)
        )
    };
    let mut text = format!("accepted: {}\nnow:      {}\n", of(accepted), of(found));
    let before: BTreeMap<&str, &PlantedRecord> = accepted.iter().map(|r| (r.id.as_str(), r)).collect();
    for record in found {
        let was = before.get(record.id.as_str());
        if was.is_some_and(|was| was.is_named != record.is_named) {
            let _ = writeln!(text, "changed: {} {}: {} [{}]", record.id, record.effect, record.verdict, record.missing.0.join(" "));
        } else if !record.is_named && !record.effect.is_empty() {
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
