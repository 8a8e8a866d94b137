//! A recorded log, summarised as text and JSON.

use crate::json::schema_of;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::json::value;
use stand_acquire::profile_recording::{ProfileRecording, early_end};

/// Summary as text.
pub fn text(r: &ProfileRecording) -> String {
    let mut text = early_end(&r.end).map_or(String::new(), |reason| format!("ended early: {reason}\n"));
    text += &format!("{}: {} rows, {:.3} s, in {:.1} s\n", r.log.path().display(), r.log.len(), r.log.duration_s(), r.elapsed_s);
    if r.lost_rows > 0 || !r.line_losses.is_none() {
        text += &format!("lost on the serial line: {} rows; {} damaged frames or lines discarded\n", r.lost_rows, r.line_losses.damaged);
    }
    if r.incomplete_rows > 0 {
        text += &format!("left out: {} rows that lacked a value\n", r.incomplete_rows);
    }
    if !r.absent_columns.is_empty() {
        text += &format!("columns left out because the stand has no values for them: {}\n", r.absent_columns.join(", "));
    }
    if !r.has_index {
        text += "the index was not seen: the zero of the angle is arbitrary (--find-index turns the platform to its index first)\n";
    }
    text
}

#[derive(Serialize, JsonSchema)]
struct RecordingJson {
    log: String,
    samples: usize,
    duration_s: f64,
    lost_rows: u64,
    lost_frames: u64,
    damaged: u64,
    #[serde(rename = "left_out")]
    incomplete_rows: u64,
    theta_zero: Option<&'static str>,
    ended: Option<String>,
}

/// Summary as JSON.
pub fn json(r: &ProfileRecording) -> Value {
    value(&RecordingJson {
        log: r.log.path().display().to_string(),
        samples: r.log.len(),
        duration_s: r.log.duration_s(),
        lost_rows: r.lost_rows,
        lost_frames: r.line_losses.frames,
        damaged: r.line_losses.damaged,
        incomplete_rows: r.incomplete_rows,
        theta_zero: r.has_index.then_some("index"),
        ended: early_end(&r.end),
    })
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("record", schema_of::<RecordingJson>())]
}
