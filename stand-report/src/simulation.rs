//! A simulated log, summarised as text and JSON.

use crate::json::schema_of;
use std::collections::BTreeMap;

use hal_sim::gyro::DEG_H;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::json::{Entries, value};
use super::{plain, significant};
use stand_acquire::hidden::HiddenEffect;
use stand_acquire::simulation::LogSummary;
use stand_acquire::three_axis_simulation::PlatformTruth;

/// Summary of the log; `hidden`: the effect added to the stand, disclosed where `reveal` is set.
pub fn text(log: &LogSummary, hidden: Option<&HiddenEffect>, reveal: bool) -> String {
    let mut text = format!(
        "{}: {} rows, {} s at {:.0} Hz: {}\n",
        log.path.display(),
        log.rows,
        plain(log.duration_s, 6),
        1.0 / log.interval_s,
        log.columns.join(", ")
    );
    for key in ["fault", "ended"] {
        if let Some(value) = log.notes.text(key) {
            text += &format!("{key}: {value}\n");
        }
    }
    for (name, rows) in log.notes.limits() {
        text += &format!("limited by {name}: {rows}\n");
    }
    match (hidden, reveal) {
        (Some(hidden), true) => text += &format!("hidden effect: {hidden}\n"),
        (Some(_), false) => text += "hidden effect: one that the model lacks (--reveal names it)\n",
        (None, true) => text += "hidden effect: none\n",
        (None, false) => {}
    }
    text
}

/// Expected azimuth error of a log under vibration, by linear theory.
pub fn vibration_text(part_rad: f64) -> String {
    format!(
        "mean azimuth by the vibration (linear theory) {} rad; the true azimuth is 0 over a whole precession\n",
        significant(part_rad, 4)
    )
}

/// True values of a session of a three-axis platform.
pub fn platform_text(truth: &PlatformTruth) -> String {
    let rates = |rates: [f64; 3]| rates.map(|rate| significant(rate / DEG_H, 5)).join(", ");
    format!(
        "true own drift about x, y, z (mean over the cycles) {} °/h\ntrue apparent drift in the first position {} °/h, azimuth {}°\n",
        rates(truth.own_rad_s),
        rates(truth.apparent_rad_s),
        plain(truth.azimuth_rad.to_degrees(), 6)
    )
}

/// Summary of the log of a three-axis platform as JSON, with the true values.
pub fn platform_json(log: &LogSummary, truth: &PlatformTruth) -> Value {
    let mut summary = json(log, None, false);
    if let Some(entries) = summary.as_object_mut() {
        entries.insert("truth".to_owned(), value(truth));
    }
    summary
}

#[derive(Serialize, JsonSchema)]
struct SimulationJson<'a> {
    log: String,
    samples: usize,
    duration_s: f64,
    columns: Vec<&'a str>,
    notes: Entries<&'a str>,
    hidden: Option<HiddenJson<'a>>,
}

/// The hidden effect, disclosed.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
enum HiddenJson<'a> {
    Effect { effect: &'static str, parameters: &'a BTreeMap<String, f64> },
    None(&'static str),
}

/// Summary of the log as JSON.
pub fn json(log: &LogSummary, hidden: Option<&HiddenEffect>, reveal: bool) -> Value {
    let disclosed = || match hidden {
        Some(hidden) => HiddenJson::Effect { effect: hidden.effect, parameters: &hidden.parameters },
        None => HiddenJson::None("none"),
    };
    value(&SimulationJson {
        log: log.path.display().to_string(),
        samples: log.rows,
        duration_s: log.duration_s,
        columns: log.columns.iter().map(String::as_str).collect(),
        notes: Entries(log.notes.iter().map(|(key, value)| (key.clone(), value.as_str())).collect()),
        hidden: reveal.then(disclosed),
    })
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("sim", schema_of::<SimulationJson<'_>>())]
}

#[cfg(test)]
mod tests {
    use super::*;
    use identification::log::{Column, Log, Note, Notes};

    #[test]
    fn times_are_printed_without_rounding_errors() {
        let t_s: Vec<f64> = (0..2003).map(|k| f64::from(k) * 1e-3).collect();
        let mut notes = Notes::default();
        notes.push(Note::Ended("stopped".to_owned(), 2.0029999999999997));
        let log = Log::new("run.csv", vec![Column { name: "t_s".to_owned(), values: t_s }], notes).unwrap();
        let text = text(&LogSummary::from(&log), None, false);
        assert!(text.starts_with("run.csv: 2003 rows, 2.003 s at 1000 Hz") && text.ends_with("ended: stopped, at 2.003 s\n"), "{text}");
    }
}
