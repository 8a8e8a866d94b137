//! Several logs as one: end to end in time, each a segment of its own, so that a fit shares the parameters and nothing else.

use std::ops::Range;

use super::ExplainError;
use crate::log::{Column, Log};

/// Time between two logs, in median intervals: a gap by any rule.
const BETWEEN_INTERVALS: f64 = 1000.0;
/// Sampling intervals may differ by this factor.
const SAME_INTERVAL: f64 = 1.2;
/// Notes that say how columns were made: they must agree.
const MADE: [&str; 6] = ["u_V", "i_A", "omega_rad_s", "theta_rad", "temp_C", "supply_nominal_V"];

/// One log of all of them, with the columns that all have, and the rows of each.
///
/// # Errors
/// The logs were not made in the same way: other intervals, or other notes on a column.
pub fn gather(logs: Vec<Log>) -> Result<(Log, Vec<Range<usize>>), ExplainError> {
    let mut logs = logs;
    if logs.len() == 1 {
        let log = logs.remove(0);
        let rows = 0..log.len();
        return Ok((log, vec![rows]));
    }
    let Some(first) = logs.first() else { return Err(ExplainError::Apart("no log was given".to_owned())) };
    let interval = first.median_dt_s();
    for other in &logs[1..] {
        let (a, b) = (first.path().display(), other.path().display());
        let ratio = other.median_dt_s() / interval;
        if !(ratio < SAME_INTERVAL && ratio > 1.0 / SAME_INTERVAL) {
            let (x, y) = (interval * 1e3, other.median_dt_s() * 1e3);
            return Err(ExplainError::Apart(format!(
                "{b}: its rows are {y:.4} ms apart and those of {a} {x:.4} ms: logs that are fitted together need the same interval; explain them one by one"
            )));
        }
        if let Some(key) = MADE.iter().find(|key| first.note(key) != other.note(key)) {
            let said = |log: &Log| log.note(key).map_or("nothing".to_owned(), |n| format!("“{n}”"));
            return Err(ExplainError::Apart(format!(
                "{b}: its note on {key} says {}, that of {a} {}: logs that are fitted together must be made in the same way",
                said(other),
                said(first)
            )));
        }
    }
    let mut columns: Vec<Column> = Vec::new();
    for column in first.columns().iter().filter(|c| logs.iter().all(|l| l.column(&c.name).is_some())) {
        columns.push(Column { name: column.name.clone(), values: Vec::with_capacity(logs.iter().map(Log::len).sum()) });
    }
    let mut rows = Vec::new();
    let (mut from, mut begin_s) = (0, first.t_s()[0]);
    for log in &logs {
        let shift = begin_s - log.t_s()[0];
        for column in &mut columns {
            let values = log.column(&column.name).unwrap_or(&[]);
            match column.name.as_str() {
                "t_s" => column.values.extend(values.iter().map(|t| t + shift)),
                _ => column.values.extend_from_slice(values),
            }
        }
        rows.push(from..from + log.len());
        from += log.len();
        begin_s += log.duration_s() + BETWEEN_INTERVALS * interval;
    }
    let name = logs.iter().map(|l| l.path().display().to_string()).collect::<Vec<_>>().join(" and ");
    let joined = Log::new(name, columns, first.notes().to_vec()).map_err(|e| ExplainError::Apart(e.to_string()))?;
    Ok((joined, rows))
}
