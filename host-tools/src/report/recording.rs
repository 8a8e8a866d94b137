//! A recorded log, summarised as text and JSON.

use serde_json::{Value, json};

use crate::acquire::profile_recording::{ProfileRecording, early_end};

/// Summary as text.
pub fn text(r: &ProfileRecording) -> String {
    let mut text = format!("{}: {} rows, {:.3} s, in {:.1} s\n", r.log.path().display(), r.log.len(), r.log.duration_s(), r.elapsed_s);
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
    if let Some(reason) = early_end(&r.end) {
        text += &format!("ended early: {reason}\n");
    }
    text
}

/// Summary as JSON.
pub fn json(r: &ProfileRecording) -> Value {
    json!({
        "log": r.log.path().display().to_string(), "samples": r.log.len(), "duration_s": r.log.duration_s(),
        "lost_rows": r.lost_rows, "lost_frames": r.line_losses.frames, "damaged": r.line_losses.damaged, "left_out": r.incomplete_rows,
        "theta_zero": if r.has_index { json!("index") } else { Value::Null },
        "ended": early_end(&r.end),
    })
}
