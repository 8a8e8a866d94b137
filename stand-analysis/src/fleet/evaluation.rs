//! What a table says about the fleet: changes since a date, effects of batches, outliers, logs without an explanation.
//!
//! Used are logs with the verdicts `adequate`, `effect-found` and `partly-explained`; for findings `unknown-structure` too. Parameters are
//! amplitudes: no phases, orders and times, whose differences mean nothing. A log without a date is in no comparison over time; one without
//! a stand counts as a stand of its own between stands, and is in no comparison over time.

use std::collections::{BTreeMap, BTreeSet};

use drive_model::ParameterKind;

use super::batch::{BatchEffect, StandEffects, batch_effects};
use super::change::{
    ByParameter, FindingChange, Observation, ParameterChange, Periods, Variation, finding_changes, mean, parameter_changes,
};
use super::outlier::{ParameterSpread, spreads};
use super::row::{NOT_FINISHED, ParameterValue, Row};

/// Verdicts of a log whose effects count.
const WITH_FINDINGS: [&str; 4] = ["adequate", "effect-found", "partly-explained", "unknown-structure"];
/// Verdicts of a log whose parameters count.
const WITH_PARAMETERS: [&str; 3] = ["adequate", "effect-found", "partly-explained"];
/// Verdicts that are findings themselves.
const FINDINGS: [&str; 2] = ["partly-explained", "unknown-structure"];

/// The evaluation.
#[derive(Debug, Clone)]
pub struct FleetEvaluation {
    /// Number of logs.
    pub logs: usize,
    /// Number of stands that the logs name.
    pub stands: usize,
    /// Number of batches.
    pub batches: usize,
    /// Logs without a stand.
    pub without_stand: usize,
    /// Logs without a date.
    pub without_date: usize,
    /// Times of the first and the last log, µs since 1970.
    pub range_us: Option<(i64, i64)>,
    /// The date that divides the logs, µs since 1970; `None`: no log has a date.
    pub since_us: Option<i64>,
    /// Logs with a date before it, and since.
    pub logs_by_period: (usize, usize),
    /// Number of logs by verdict.
    pub verdicts: BTreeMap<String, usize>,
    /// Number of logs by effect.
    pub effects: BTreeMap<String, usize>,
    /// Number of different settings: models, builds.
    pub settings: usize,
    /// Changes of parameters, the most significant first.
    pub parameter_changes: Vec<ParameterChange>,
    /// Variation of the parameters between logs of one stand.
    pub variations: BTreeMap<String, Variation>,
    /// Effects and verdicts that are more frequent since the date.
    pub finding_changes: Vec<FindingChange>,
    /// Effects of batches, the most significant first.
    pub batch_effects: Vec<BatchEffect>,
    /// Parameters over the stands.
    pub spreads: Vec<ParameterSpread>,
    /// Logs without an explanation, or whose search a limit ended: path, verdict, reason.
    pub failed: Vec<(String, String, String)>,
}

/// Evaluates a table. `since_us`: the date that divides the logs; by default one month before the last log.
pub fn evaluate(rows: &[Row], since_us: Option<i64>) -> FleetEvaluation {
    let dates = || rows.iter().filter_map(|row| row.began_us);
    let range_us = dates().min().zip(dates().max());
    let since_us = since_us.or_else(|| range_us.map(|(_, last_us)| month_before(last_us)));
    let is_since = |row: &Row| row.began_us.zip(since_us).map(|(began, since)| began >= since);
    let count = |is: bool| rows.iter().filter(|row| is_since(row) == Some(is)).count();

    let mut observations = ByParameter::new();
    let mut findings: BTreeMap<String, Periods<BTreeSet<String>>> = BTreeMap::new();
    for row in rows {
        let (Some(stand), Some(is_since)) = (&row.stand, is_since(row)) else { continue };
        if WITH_FINDINGS.contains(&row.verdict.as_str()) {
            add(findings.entry(stand.clone()).or_default(), is_since, findings_of(row));
        }
        for (name, observation) in observations_of(row) {
            add(observations.entry(name).or_default().entry(stand.clone()).or_default(), is_since, observation);
        }
    }
    let (parameter_changes, variations) = parameter_changes(&observations);
    // Between stands the state since the date counts, and all of a log without a date.
    let current: Vec<&Row> = rows.iter().filter(|row| is_since(row) != Some(false)).collect();
    FleetEvaluation {
        logs: rows.len(),
        stands: rows.iter().filter_map(|row| row.stand.as_ref()).collect::<BTreeSet<_>>().len(),
        batches: rows.iter().filter_map(|row| row.batch.as_ref()).collect::<BTreeSet<_>>().len(),
        without_stand: rows.iter().filter(|row| row.stand.is_none()).count(),
        without_date: rows.iter().filter(|row| row.began_us.is_none()).count(),
        range_us,
        since_us,
        logs_by_period: (count(false), count(true)),
        verdicts: counted(rows.iter().map(|row| row.verdict.clone())),
        effects: counted(rows.iter().flat_map(effects_of)),
        settings: rows.iter().map(|row| &row.settings).collect::<BTreeSet<_>>().len(),
        parameter_changes,
        finding_changes: finding_changes(&findings),
        batch_effects: batch_effects(&stand_effects(&current)),
        spreads: spreads(&stand_means(&current, &variations)),
        variations,
        failed: failed(rows),
    }
}

/// One calendar month earlier.
fn month_before(time_us: i64) -> i64 {
    let earlier = jiff::Timestamp::from_microsecond(time_us).ok().and_then(|time| {
        let zoned = time.to_zoned(jiff::tz::TimeZone::UTC);
        zoned.checked_sub(jiff::Span::new().months(1)).ok()
    });
    earlier.map_or(time_us, |time| time.timestamp().as_microsecond())
}

fn add<T>(periods: &mut Periods<T>, is_since: bool, entry: T) {
    if is_since { periods.since.push(entry) } else { periods.before.push(entry) }
}

fn counted(names: impl Iterator<Item = String>) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    names.for_each(|name| *counts.entry(name).or_default() += 1);
    counts
}

/// The name of an effect or a parameter without the number of its instance: `cogging` of `cogging#2`.
fn base(name: &str) -> &str {
    name.split('#').next().unwrap_or(name)
}

fn effects_of(row: &Row) -> BTreeSet<String> {
    row.effects.iter().map(|effect| base(effect).to_owned()).collect()
}

fn findings_of(row: &Row) -> BTreeSet<String> {
    let mut findings = effects_of(row);
    findings.extend(FINDINGS.contains(&row.verdict.as_str()).then(|| row.verdict.clone()));
    findings
}

/// The amplitudes of a row with their standard uncertainties.
fn observations_of(row: &Row) -> Vec<((String, String), Observation)> {
    if !WITH_PARAMETERS.contains(&row.verdict.as_str()) {
        return Vec::new();
    }
    let observed = |p: &ParameterValue| {
        let u = p.standard_uncertainty.filter(|u| u.is_finite() && *u > 0.0)?;
        (is_amplitude(&p.name) && p.value.is_finite()).then(|| ((p.name.clone(), p.unit.clone()), Observation { value: p.value, u }))
    };
    row.parameters.iter().filter_map(observed).collect()
}

/// A parameter whose differences mean something: of the drive itself or of the user, or no phase, order or time of an effect.
fn is_amplitude(name: &str) -> bool {
    let parameters = drive_model::cards().iter().flat_map(|card| card.parameters);
    let kind = parameters.filter(|parameter| parameter.name == base(name)).map(|parameter| parameter.kind).next();
    !kind.is_some_and(|kind| {
        matches!(kind, ParameterKind::Phase | ParameterKind::HarmonicOrder | ParameterKind::Periodicity | ParameterKind::EventTime)
    })
}

/// The stand of a row; a log that names none is one of its own.
fn stand_or_log(row: &Row) -> String {
    row.stand.clone().unwrap_or_else(|| row.path.clone())
}

/// The logs of a stand: its batch, their number, and how many of them have an effect.
#[derive(Default)]
struct StandLogs {
    batch: Option<String>,
    count: usize,
    with_effect: BTreeMap<String, usize>,
}

fn stand_effects(rows: &[&Row]) -> BTreeMap<String, StandEffects> {
    let mut stands: BTreeMap<String, StandLogs> = BTreeMap::new();
    for row in rows.iter().filter(|row| WITH_FINDINGS.contains(&row.verdict.as_str())) {
        let logs = stands.entry(stand_or_log(row)).or_default();
        if row.batch.is_some() {
            logs.batch.clone_from(&row.batch);
        }
        logs.count += 1;
        effects_of(row).into_iter().for_each(|effect| *logs.with_effect.entry(effect).or_default() += 1);
    }
    let of = |logs: StandLogs| StandEffects {
        batch: logs.batch,
        effects: logs.with_effect.into_iter().filter(|(_, with)| 2 * with >= logs.count).map(|(effect, _)| effect).collect(),
    };
    stands.into_iter().map(|(stand, logs)| (stand, of(logs))).collect()
}

fn stand_means(rows: &[&Row], variations: &BTreeMap<String, Variation>) -> BTreeMap<(String, String), BTreeMap<String, Observation>> {
    let mut groups: BTreeMap<(String, String), BTreeMap<String, Vec<Observation>>> = BTreeMap::new();
    for row in rows {
        for (name, observation) in observations_of(row) {
            groups.entry(name).or_default().entry(stand_or_log(row)).or_default().push(observation);
        }
    }
    let means = |name: &str, stands: BTreeMap<String, Vec<Observation>>| {
        let tau = variations.get(name).map_or(0.0, |variation| variation.tau);
        stands.into_iter().map(|(stand, group)| (stand, mean(&group, tau * tau))).collect()
    };
    groups.into_iter().map(|(name, stands)| (name.clone(), means(&name.0, stands))).collect()
}

fn failed(rows: &[Row]) -> Vec<(String, String, String)> {
    let reason = |row: &Row| match &row.error {
        Some(error) => Some(error.clone()),
        None if row.verdict == NOT_FINISHED => Some("a limit ended the search".to_owned()),
        None => None,
    };
    rows.iter().filter_map(|row| Some((row.path.clone(), row.verdict.clone(), reason(row)?))).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::fleet::row::microseconds_of;

    fn row(stand: &str, date: &str, inertia: f64, effects: &[&str]) -> Row {
        Row {
            path: format!("{stand} {date}"),
            stand: Some(stand.to_owned()),
            began_us: microseconds_of(date),
            verdict: if effects.is_empty() { "adequate" } else { "effect-found" }.to_owned(),
            effects: effects.iter().map(|e| (*e).to_owned()).collect(),
            parameters: vec![
                ParameterValue {
                    name: "inertia_kg_m2".to_owned(),
                    value: inertia,
                    standard_uncertainty: Some(1e-7),
                    unit: "kg m²".to_owned(),
                },
                ParameterValue {
                    name: "cogging_phase_rad".to_owned(),
                    value: 1e3 * inertia,
                    standard_uncertainty: Some(1e-9),
                    unit: "rad".to_owned(),
                },
            ],
            ..Row::default()
        }
    }

    #[test]
    fn stand_with_a_new_inertia_is_named_and_phases_are_not_compared() {
        let mut rows = Vec::new();
        for (k, stand) in ["A", "B", "C"].into_iter().enumerate() {
            for day in 1..=3 {
                let wobble = 1e-7 * f64::from(day);
                rows.push(row(stand, &format!("2026-09-0{day}"), 2e-4 + wobble, &[]));
                rows.push(row(stand, &format!("2026-10-2{day}"), if k == 1 { 2.1e-4 } else { 2e-4 } + wobble, &[]));
            }
        }
        let found = evaluate(&rows, None);
        assert_eq!((found.stands, found.logs_by_period), (3, (9, 9)));
        let significant: Vec<&str> = found.parameter_changes.iter().filter(|c| c.is_significant()).map(|c| c.stand.as_str()).collect();
        assert_eq!(significant, ["B"]);
        assert!(found.parameter_changes.iter().all(|change| change.parameter == "inertia_kg_m2"));
    }

    #[test]
    fn month_is_a_calendar_month() {
        let at = |text: &str| microseconds_of(text).unwrap();
        assert_eq!(month_before(at("2026-03-31T12:00:00Z")), at("2026-02-28T12:00:00Z"));
    }
}
