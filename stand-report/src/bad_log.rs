//! A log that is not plausible as a record of a drive: its findings as text, HTML and JSON.

use crate::json::schema_of;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::defects::defect;
use super::html::{Class, Markup, Page};
use super::json::{Entries, value};
use super::log_warnings;
use super::terminal::Style;
use identification::log::Log;
use identification::log::plausible::Defect;

const CONCLUSION: &str =
    "The columns of this log contradict their names, so no model was compared with it. Correct the columns, then run the command again.";

/// The answer about an implausible log.
#[derive(Serialize, JsonSchema)]
pub struct BadLogJson {
    verdict: &'static str,
    problems: Vec<ProblemJson>,
    log: String,
    samples: usize,
    duration_s: f64,
    outputs: Entries<()>,
    failures: [(); 0],
    warnings: Vec<String>,
}

#[derive(Serialize, JsonSchema)]
struct ProblemJson {
    code: &'static str,
    says: String,
    columns: Vec<&'static str>,
}

impl BadLogJson {
    /// The answer.
    pub fn new(log: &Log, findings: &[Defect]) -> Self {
        BadLogJson {
            verdict: "bad-log",
            problems: findings.iter().map(|f| ProblemJson { code: f.code().name(), says: defect(f), columns: f.columns() }).collect(),
            log: log.path().display().to_string(),
            samples: log.len(),
            duration_s: log.duration_s(),
            outputs: Entries(Vec::new()),
            failures: [],
            warnings: log_warnings(log),
        }
    }
}

/// The answer as JSON.
pub fn bad_log_json(log: &Log, findings: &[Defect]) -> Value {
    value(&BadLogJson::new(log, findings))
}

/// Text for a terminal.
pub fn bad_log_text(log: &Log, findings: &[Defect], style: Style) -> String {
    let mut text = format!("{}\n\n", style.strong(&title(log)));
    for finding in findings {
        text.push_str(&style.warn(&style.wrapped("! ", "  ", &defect(finding))));
    }
    for line in log_warnings(log) {
        text.push_str(&style.faint(&style.wrapped("· ", "  ", &line)));
    }
    text.push('\n');
    text.push_str(&style.strong(&style.wrapped("", "", CONCLUSION)));
    text
}

/// The HTML page.
pub fn bad_log_html(log: &Log, findings: &[Defect]) -> String {
    let mut page = Page::new(&title(log));
    for finding in findings {
        page.paragraph(Class::Lead, Markup::span(Class::Warning, Markup::with_code(&defect(finding))));
    }
    for line in log_warnings(log) {
        page.paragraph(Class::Faint, line);
    }
    page.text(CONCLUSION);
    page.finish()
}

fn title(log: &Log) -> String {
    format!("{}: not plausible as a record of a drive", log.path().display())
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("compare and fit, not a plausible record", schema_of::<BadLogJson>())]
}
