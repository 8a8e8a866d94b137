//! A converted log, as text and JSON.

use crate::json::schema_of;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::json::value;
use super::log_warning::log_warning;
use super::numbers::grouped;
use identification::log::Log;

/// The result as text.
pub fn text(log: &Log, out: &Path) -> String {
    let mut text =
        format!("{}: {} rows, {} columns, {} notes\n", out.display(), grouped(log.len()), log.columns().len(), log.notes().len());
    log.warnings().iter().for_each(|warning| text += &format!("warning: {}\n", log_warning(warning)));
    text
}

#[derive(Serialize, JsonSchema)]
struct ConversionJson<'a> {
    log: String,
    out: String,
    rows: usize,
    columns: Vec<&'a str>,
    warnings: Vec<String>,
}

/// The result as JSON.
pub fn json(log: &Log, out: &Path) -> Value {
    value(&ConversionJson {
        log: log.path().display().to_string(),
        out: out.display().to_string(),
        rows: log.len(),
        columns: log.columns().iter().map(|column| column.name.as_str()).collect(),
        warnings: log.warnings().iter().map(log_warning).collect(),
    })
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("convert", schema_of::<ConversionJson<'_>>())]
}
