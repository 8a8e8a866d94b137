//! Several logs as one: one after the other in time, each a segment of its own. A fit shares the parameters and nothing else.

use std::ops::Range;

use crate::identify::explain::criteria::JoiningCriteria;
use crate::log::{Column, Log, LogError, LogWarning, Run};

/// Why logs cannot be fitted together.
#[derive(Debug, thiserror::Error)]
pub enum JoinError {
    /// There is none.
    #[error("no log was given")]
    NoLog,
    /// Their sampling intervals differ.
    #[error(
        "{log}: the sampling interval is {dt_ms:.4} ms, that of {first} {first_dt_ms:.4} ms. Logs that are explained together need the same interval; explain them one by one"
    )]
    DifferentInterval {
        /// The log.
        log: String,
        /// Its sampling interval, ms.
        dt_ms: f64,
        /// The first log.
        first: String,
        /// The first log's interval, ms.
        first_dt_ms: f64,
    },
    /// Their notes on a column differ.
    #[error("{log}: the note on {column} is {}, that of {first} is {}. Logs that are explained together must be recorded in the same way", quoted(.note), quoted(.first_note))]
    DifferentNote {
        /// The log.
        log: String,
        /// The column.
        column: &'static str,
        /// Its note.
        note: Option<String>,
        /// The first log.
        first: String,
        /// The first log's note.
        first_note: Option<String>,
    },
    /// The joined columns are no log.
    #[error(transparent)]
    Log(#[from] LogError),
}

fn quoted(note: &Option<String>) -> String {
    note.as_ref().map_or("missing".to_owned(), |note| format!("“{note}”"))
}

/// The flag of a disconnected motor.
const OPEN_CIRCUIT: &str = "open_circuit";
/// Notes that state how columns were recorded.
const RECORDING_NOTES: [&str; 7] = ["axis", "u_V", "i_A", "omega_rad_s", "theta_rad", "temp_C", "supply_nominal_V"];

/// One log with the columns that all logs have, and the rows of each log in it.
///
/// # Errors
/// The logs were not recorded in the same way: other intervals, or other notes on a column.
pub fn join(mut logs: Vec<Log>, criteria: &JoiningCriteria) -> Result<(Log, Vec<Range<usize>>), JoinError> {
    if logs.len() == 1 {
        let log = logs.remove(0);
        let rows = 0..log.len();
        return Ok((log, vec![rows]));
    }
    let Some(first) = logs.first() else { return Err(JoinError::NoLog) };
    let interval_s = first.median_dt_s();
    logs[1..].iter().try_for_each(|other| check(first, other, criteria))?;
    let mut columns: Vec<Column> = Vec::new();
    let rows_of_all = logs.iter().map(Log::len).sum();
    for column in first.columns().iter().filter(|c| logs.iter().all(|l| l.column(&c.name).is_some())) {
        columns.push(Column { name: column.name.clone(), values: Vec::with_capacity(rows_of_all) });
    }
    // A log without this flag is of a motor that was connected.
    if columns.iter().all(|c| c.name != OPEN_CIRCUIT) && logs.iter().any(|l| l.column(OPEN_CIRCUIT).is_some()) {
        columns.push(Column { name: OPEN_CIRCUIT.to_owned(), values: Vec::with_capacity(rows_of_all) });
    }
    let (mut rows, mut runs) = (Vec::new(), Vec::new());
    let (mut from, mut begin_s) = (0, first.t_s()[0]);
    for log in &logs {
        let shift = begin_s - log.t_s()[0];
        for column in &mut columns {
            let values = log.column(&column.name).unwrap_or(&[]);
            match column.name.as_str() {
                OPEN_CIRCUIT if values.is_empty() => column.values.resize(column.values.len() + log.len(), 0.0),
                "t_s" => column.values.extend(values.iter().map(|t| t + shift)),
                _ => column.values.extend_from_slice(values),
            }
        }
        runs.extend(log.runs().iter().map(|r| Run { rows: from + r.rows.start..from + r.rows.end, shift_s: shift + r.shift_s }));
        rows.push(from..from + log.len());
        from += log.len();
        begin_s += log.duration_s() + criteria.gap_intervals * interval_s;
    }
    let name = logs.iter().map(name).collect::<Vec<_>>().join(" and ");
    let warnings = logs.iter().flat_map(|log| {
        let log_name = self::name(log);
        log.warnings().iter().map(move |w| LogWarning::InLog { log: log_name.clone(), warning: Box::new(w.clone()) })
    });
    let warnings = warnings.collect();
    Ok((Log::new(name, columns, first.notes().to_vec())?.with_runs(runs, warnings), rows))
}

fn name(log: &Log) -> String {
    log.path().display().to_string()
}

/// Checks that two logs were recorded in the same way.
fn check(first: &Log, other: &Log, criteria: &JoiningCriteria) -> Result<(), JoinError> {
    let ratio = other.median_dt_s() / first.median_dt_s();
    if !(ratio < criteria.max_interval_ratio && ratio > 1.0 / criteria.max_interval_ratio) {
        let (dt_ms, first_dt_ms) = (other.median_dt_s() * 1e3, first.median_dt_s() * 1e3);
        return Err(JoinError::DifferentInterval { log: name(other), dt_ms, first: name(first), first_dt_ms });
    }
    match RECORDING_NOTES.iter().find(|key| first.note(key) != other.note(key)) {
        None => Ok(()),
        Some(column) => Err(JoinError::DifferentNote {
            log: name(other),
            column,
            note: other.note(column).map(str::to_owned),
            first: name(first),
            first_note: first.note(column).map(str::to_owned),
        }),
    }
}
