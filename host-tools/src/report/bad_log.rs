//! A log that is no record of a drive: what is wrong with it, in the three forms.

use serde_json::{Value, json};

use super::json::{finite, problems_json};
use super::page::{Page, with_code};
use super::terminal::Style;
use crate::log::Log;
use crate::log::plausible::Finding;

/// The answer: verdict and problems, with the keys of every answer.
pub fn bad_log_json(log: &Log, problems: &[Finding]) -> Value {
    json!({
        "verdict": "bad-log",
        "problems": problems_json(problems),
        "log": log.path().display().to_string(),
        "samples": log.len(),
        "duration_s": finite(log.duration_s()),
        "outputs": {},
        "failures": [],
        "warnings": super::log_warnings(log),
    })
}

/// For a terminal.
pub fn bad_log_text(log: &Log, problems: &[Finding], style: Style) -> String {
    let mut text = format!("{}\n\n", style.strong(&title(log)));
    for finding in problems {
        text.push_str(&style.warn(&style.wrapped("! ", "  ", &finding.says)));
    }
    for line in super::log_warnings(log) {
        text.push_str(&style.faint(&style.wrapped("· ", "  ", &line)));
    }
    text.push('\n');
    text.push_str(&style.strong(&style.wrapped("", "", LAST_WORDS)));
    text
}

/// One HTML file.
pub fn bad_log_html(log: &Log, problems: &[Finding]) -> String {
    let mut page = Page::new(&title(log));
    for finding in problems {
        page.push(&format!("<p class=\"warn lead\">{}</p>", with_code(&finding.says)));
    }
    for line in super::log_warnings(log) {
        page.paragraph("faint", &line);
    }
    page.paragraph("", LAST_WORDS);
    page.finish()
}

fn title(log: &Log) -> String {
    format!("{}: not the record of a drive", log.path().display())
}

const LAST_WORDS: &str = "This log is not what its columns say, so that no model was held against it; mend the columns, then ask again.";
