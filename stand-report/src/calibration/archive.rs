//! Record files for a person and as JSON: a list, and one record with its budgets and its verification.

use super::html::evaluation;
use super::{text, unit_suffix};
use crate::json::schema_of;
use crate::json::value;
use crate::{significant, with_sigma};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use stand_analysis::calibrate::DutKind;
use stand_records::archive::{ArchivedRecord, LogState, NotRecomputed, Verification};
use stand_records::store::QuantityRow;
use stand_records::stored_record::StoredRecord;

/// One line per record, then the files that were skipped.
pub fn list_text(records: &[(Option<i64>, ArchivedRecord)], skipped: &[String]) -> String {
    let mut out = String::new();
    for (number, ArchivedRecord { path, record }) in records {
        let place = number.map_or_else(|| path.display().to_string(), |number| format!("session {number}"));
        let header = &record.header;
        let serial = if header.serial.is_empty() { "–" } else { &header.serial };
        let (done, all) = (header.steps.len(), header.session.steps.len());
        let state = if done == all { "complete".to_owned() } else { format!("{done} of {all} steps") };
        let interrupted = match header.interruptions.len() {
            0 => String::new(),
            1 => ", interrupted once".to_owned(),
            n => format!(", interrupted {n} times"),
        };
        out += &format!(
            "{}  {:<5}  {serial:<10}  {state}, {} results{interrupted}  {place}\n",
            header.began,
            header.dut_kind.name(),
            record.quantities.len(),
        );
    }
    if records.is_empty() {
        out += "no records found\n";
    }
    out + &skipped_text(skipped)
}

/// The files that were skipped.
pub fn skipped_text(skipped: &[String]) -> String {
    skipped.iter().map(|why| format!("skipped: {why}\n")).collect()
}

#[derive(Serialize, JsonSchema)]
struct ListEntry<'a> {
    record: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    session: Option<i64>,
    began: &'a str,
    what: DutKind,
    sensor: &'a str,
    serial: &'a str,
    whole: bool,
    results: usize,
    interruptions: usize,
}

#[derive(Serialize, JsonSchema)]
struct List<'a> {
    records: Vec<ListEntry<'a>>,
    passed_over: &'a [String],
}

impl<'a> From<&'a (Option<i64>, ArchivedRecord)> for ListEntry<'a> {
    fn from((session, ArchivedRecord { path, record }): &'a (Option<i64>, ArchivedRecord)) -> Self {
        let header = &record.header;
        ListEntry {
            record: path.display().to_string(),
            session: *session,
            began: &header.began,
            what: header.dut_kind,
            sensor: &header.sensor,
            serial: &header.serial,
            whole: header.steps.len() == header.session.steps.len(),
            results: record.quantities.len(),
            interruptions: header.interruptions.len(),
        }
    }
}

/// The answer of `stand records list --json`.
pub fn list_json(records: &[(Option<i64>, ArchivedRecord)], skipped: &[String]) -> Value {
    value(&List { records: records.iter().map(Into::into).collect(), passed_over: skipped })
}

fn log_state(state: &LogState) -> Option<String> {
    match state {
        LogState::AsRecorded => None,
        LogState::Changed { sha256 } => Some(format!("has changed: its SHA-256 is {sha256}")),
        LogState::Missing => Some("is missing".to_owned()),
    }
}

fn not_recomputed(reason: &NotRecomputed) -> String {
    match reason {
        NotRecomputed::Log { log, state } => format!("{log} {}", log_state(state).unwrap_or_default()),
        NotRecomputed::Quantity { name } => format!("{name} is only in one of the two results: made by another version of these tools?"),
        NotRecomputed::Failed { message } => message.clone(),
    }
}

/// One record with its budgets and its verification.
pub fn show_text(record: &StoredRecord, verification: &Verification) -> String {
    let mut out = text(record);
    for q in &record.quantities {
        out += &format!("\n{}  {}{} (1σ)\n", q.name, with_sigma(q.value, q.combined_u()), unit_suffix(&q.unit));
        let width = q.contributions.iter().map(|c| c.source.chars().count()).max().unwrap_or(0);
        for c in &q.contributions {
            let size = significant(c.contribution(), 2);
            out += &format!("  {:<width$}  {}  {size:>12}{}  {}\n", c.source, evaluation(c.evaluation), unit_suffix(&q.unit), c.basis);
        }
    }
    out.push('\n');
    for (log, state) in &verification.logs {
        out += &format!("{log}: {}\n", log_state(state).as_deref().unwrap_or("unchanged by its SHA-256"));
    }
    out + &match &verification.difference {
        Ok(_) if verification.is_same() => "computed again from these logs: same results\n".to_owned(),
        Ok(difference) => {
            format!("computed again from these logs: DIFFERENT results; greatest relative difference {}\n", significant(*difference, 2))
        }
        Err(reason) => format!("not computed again: {}\n", not_recomputed(reason)),
    }
}

#[derive(Serialize, JsonSchema)]
struct LogEntry<'a> {
    log: &'a str,
    as_recorded: bool,
    says: Option<String>,
}

#[derive(Serialize, JsonSchema)]
struct VerificationEntry<'a> {
    logs: Vec<LogEntry<'a>>,
    same_results: bool,
    greatest_difference: Option<f64>,
    says: Option<String>,
}

#[derive(Serialize, JsonSchema)]
struct Show<'a> {
    #[serde(flatten)]
    record: &'a StoredRecord,
    checked: VerificationEntry<'a>,
}

/// The answer of `stand records show --json`.
pub fn show_json(record: &StoredRecord, verification: &Verification) -> Value {
    let logs = verification.logs.iter();
    let checked = VerificationEntry {
        logs: logs.map(|(log, state)| LogEntry { log, as_recorded: *state == LogState::AsRecorded, says: log_state(state) }).collect(),
        same_results: verification.is_same(),
        greatest_difference: verification.difference.as_ref().ok().copied(),
        says: verification.difference.as_ref().err().map(not_recomputed),
    };
    value(&Show { record, checked })
}

#[derive(Serialize, JsonSchema)]
struct AddedEntry {
    folder: String,
    session: i64,
}

/// The answer of `stand records add --json`.
pub fn added_json(added: &[(&std::path::Path, i64)]) -> Value {
    value(&added.iter().map(|(folder, session)| AddedEntry { folder: folder.display().to_string(), session: *session }).collect::<Vec<_>>())
}

/// Quantities of a store as CSV, one per line.
pub fn export_csv(rows: &[QuantityRow]) -> String {
    let mut out = "session,kind,serial,began,quantity,value,u,dof,k,U,unit,temperature_C\n".to_owned();
    let quoted = |text: &str| if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() };
    let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:?}"));
    for r in rows {
        let texts = [r.session.to_string(), quoted(&r.kind), quoted(&r.serial), quoted(&r.began), quoted(&r.quantity)];
        let numbers = [r.value, r.u, r.dof, r.k, r.expanded_u].map(number);
        out += &format!("{},{},{},{}\n", texts.join(","), numbers.join(","), quoted(&r.unit), number(r.temperature_C));
    }
    out
}

/// The answer of `stand records export --json`.
pub fn export_json(rows: &[QuantityRow]) -> Value {
    value(&rows)
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![
        ("records list", schema_of::<List<'_>>()),
        ("records show", schema_of::<Show<'_>>()),
        ("records add", schema_of::<Vec<AddedEntry>>()),
        ("records export", schema_of::<Vec<QuantityRow>>()),
    ]
}
