//! Explanations of the logs of a folder: a table for the terminal, a JSON list.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::{explain_bad_log_json, explain_json};
use crate::json::value;
use identification::identify::explain_logs::{FolderEntry, LogExplanation};

/// Verdict of a log for which there is no explanation.
const ERROR_VERDICT: &str = "error";

/// Verdict of one log, by its name in the JSON.
pub fn folder_verdict(entry: &FolderEntry) -> &'static str {
    match &entry.result {
        Ok(LogExplanation::Explained(e)) => e.verdict.name(),
        Ok(LogExplanation::ImplausibleLog(..)) => "bad-log",
        Err(_) => ERROR_VERDICT,
    }
}

/// The answer about a log for which there is no explanation.
#[derive(Serialize, JsonSchema)]
struct ErrorJson {
    log: String,
    verdict: &'static str,
    says: String,
}

/// The results as a list of JSON objects, one for each log.
pub fn folder_json(entries: &[FolderEntry]) -> Value {
    let one = |entry: &FolderEntry| match &entry.result {
        Ok(LogExplanation::Explained(e)) => explain_json(e),
        Ok(LogExplanation::ImplausibleLog(log, findings)) => explain_bad_log_json(log, findings),
        Err(error) => value(&ErrorJson { log: entry.path.display().to_string(), verdict: ERROR_VERDICT, says: error.to_string() }),
    };
    Value::Array(entries.iter().map(one).collect())
}

/// The results as a table, one line for each log.
pub fn folder_text(entries: &[FolderEntry]) -> String {
    let name = |e: &FolderEntry| e.path.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
    let missing = |e: &FolderEntry| match &e.result {
        Ok(LogExplanation::Explained(e)) => super::words::named(e).join(", "),
        Ok(LogExplanation::ImplausibleLog(_, findings)) => findings.first().map_or(String::new(), crate::defect),
        Err(error) => error.to_string(),
    };
    let width = entries.iter().map(|e| name(e).chars().count()).max().unwrap_or(0).max(3);
    let mut text = format!("{:<width$}  {:<17}  {:>7}  missing\n", "log", "verdict", "seconds");
    for e in entries {
        text += &format!("{:<width$}  {:<17}  {:>7.2}  {}\n", name(e), folder_verdict(e), e.seconds, missing(e));
    }
    text
}
