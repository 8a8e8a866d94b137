//! `stand explain FOLDER`: every log of a folder by itself, over all cores.

use std::path::{Path, PathBuf};
use std::time::Instant;

use rayon::prelude::*;
use serde_json::{Value, json};

use super::error::CliError;
use super::explain::{Answer, quietly};
use super::output::{ReportOutput, working};
use crate::model::Model;
use crate::report;

/// What came of one log.
struct Line {
    log: PathBuf,
    verdict: &'static str,
    missing: String,
    seconds: f64,
    answer: Value,
}

/// Explains each log and prints a table; the JSON is a list of answers.
pub(super) fn run(folder: &Path, model: &Model, output: &ReportOutput) -> Result<(), CliError> {
    let logs = logs(folder)?;
    let bar = working(&format!("{} logs", logs.len()));
    let lines: Vec<Line> = logs
        .into_par_iter()
        .map(|log| {
            let line = one(log, model);
            bar.set_message(format!("{}: {}", line.log.display(), line.verdict));
            line
        })
        .collect();
    bar.finish_and_clear();
    output.text(&table(&lines))?;
    let unread = lines.iter().filter(|l| l.verdict == UNREAD).count();
    output.json(|| Value::Array(lines.iter().map(|l| l.answer.clone()).collect()))?;
    match unread {
        0 => Ok(()),
        n => Err(CliError::Input(format!(
            "{}: {n} of {} logs could not be held against {}; the table says why",
            folder.display(),
            lines.len(),
            model.name()
        ))),
    }
}

/// The logs of a folder, by name.
fn logs(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    let entries = std::fs::read_dir(folder).map_err(|e| CliError::file(folder, "read the folder", &e))?;
    let ending =
        |p: &Path| p.extension().and_then(|e| e.to_str()).is_some_and(|e| matches!(e.to_ascii_lowercase().as_str(), "csv" | "parquet"));
    let mut logs: Vec<PathBuf> = entries.filter_map(Result::ok).map(|e| e.path()).filter(|p| p.is_file() && ending(p)).collect();
    logs.sort();
    if logs.is_empty() {
        return Err(CliError::Input(format!("{}: no logs in this folder (files that end in .csv or .parquet)", folder.display())));
    }
    Ok(logs)
}

/// Verdict of a log that could not be held against the model.
const UNREAD: &str = "error";

fn one(log: PathBuf, model: &Model) -> Line {
    let begin = Instant::now();
    let answer = quietly(std::slice::from_ref(&log), model, &|_| ());
    let seconds = begin.elapsed().as_secs_f64();
    let line = |verdict, missing, answer| Line { log: log.clone(), verdict, missing, seconds, answer };
    match answer {
        Ok(Answer::Explained(e)) => line(e.verdict.name(), e.missing.join(", "), report::explain_json(&e)),
        Ok(Answer::BadLog(bad, findings)) => {
            let says = findings.first().map_or(String::new(), |f| f.says.clone());
            line("bad-log", says, report::explain_bad_log_json(&bad, &findings))
        }
        Err(error) => {
            let says = error.to_string();
            line(UNREAD, says.clone(), json!({"log": log.display().to_string(), "verdict": UNREAD, "says": says}))
        }
    }
}

fn table(lines: &[Line]) -> String {
    let name = |l: &Line| l.log.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
    let names = lines.iter().map(|l| name(l).chars().count()).max().unwrap_or(0).max(3);
    let mut text = format!("{:<names$}  {:<17}  {:>7}  missing\n", "log", "verdict", "seconds");
    for l in lines {
        text += &format!("{:<names$}  {:<17}  {:>7.2}  {}\n", name(l), l.verdict, l.seconds, l.missing);
    }
    text
}
