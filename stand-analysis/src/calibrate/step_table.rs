//! A session that another program recorded: logs without a journal, with a table of steps.
//!
//! Input: a CSV table with the columns `file`, `from`, `to` (s, in the time of the log), `rate_rad_s` or `rate_deg_s` (of the reference,
//! for instance a rate table) and, optionally, `temperature_C`; the logs beside it. Output: [`Step`]s whose logs have only the rows of the
//! table, with the stated rate as setpoint and its integral as angle. Limits: the reference is as good as stated; its relative error is
//! `crystal_ppm` of the assumptions.

use super::plausibility::objection;
use super::{Mounting, Step};
use identification::log::{Column, Log, LogError};
use identification::statistics::Extremes;
use std::path::{Path, PathBuf};

/// A row of the table.
#[derive(Debug, Clone, PartialEq)]
struct StepRow {
    file: String,
    from_s: f64,
    to_s: f64,
    rate_rad_s: f64,
    temperature_C: Option<f64>,
}

/// Why a table of steps is not used.
#[derive(Debug, thiserror::Error)]
pub enum StepTableError {
    /// The table cannot be read.
    #[error("{path}: cannot be read: {message}")]
    Read {
        /// The table.
        path: PathBuf,
        /// Message of the operating system.
        message: String,
    },
    /// A column is missing.
    #[error(
        "{path}: the column {column} is missing; a table of steps has file, from, to, rate_rad_s or rate_deg_s, and optionally temperature_C"
    )]
    Column {
        /// The table.
        path: PathBuf,
        /// The column.
        column: &'static str,
    },
    /// A row is invalid.
    #[error("{path}: row {row}: {message}")]
    Row {
        /// The table.
        path: PathBuf,
        /// Number of the row, from 1 for the header.
        row: usize,
        /// What is wrong.
        message: String,
    },
    /// The readings are no response of a sensor to the stated rates.
    #[error("{path}: {message}")]
    Implausible {
        /// The table.
        path: PathBuf,
        /// Why not.
        message: String,
    },
    /// A log.
    #[error(transparent)]
    Log(#[from] LogError),
}

/// The sensor whose scale is calibrated.
const SENSOR: &str = "gyro_rad_s";
/// Standard deviations of the noise of a mean by which the thirds of a plateau may differ.
const MAX_CHANGE_SIGMAS: f64 = 10.0;
/// Part of the spread of the stated rates by which the thirds of a plateau may differ: a jump of the rate is more, a drift is less.
const MAX_CHANGE: f64 = 0.02;

/// Mean reading of the sensor in each row of the table; none without the sensor.
///
/// # Errors
/// A row is no plateau of one rate.
fn plateau_means(rows: &[&StepRow], log: &Log, spread_rad_s: f64) -> Result<Vec<f64>, String> {
    let Some(readings) = log.column(SENSOR) else { return Ok(Vec::new()) };
    let t_s = log.t_s();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let of_row = |row: &&StepRow| {
        let (from, to) = (t_s.partition_point(|t| *t < row.from_s), t_s.partition_point(|t| *t < row.to_s));
        let part = &readings[from..to.max(from)];
        let third = part.len() / 3;
        if third > 1 {
            let variance = part.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>() / (2 * (part.len() - 1)) as f64;
            let noise = (2.0 * variance / third as f64).sqrt();
            let change = (mean(&part[part.len() - third..]) - mean(&part[..third])).abs();
            if change > (MAX_CHANGE_SIGMAS * noise).max(MAX_CHANGE * spread_rad_s) {
                return Err(format!(
                    "from {} to {} s {SENSOR} changes by {change:.4} rad/s: this is no plateau of one rate; choose times within the plateaus",
                    row.from_s, row.to_s
                ));
            }
        }
        Ok(mean(part))
    };
    rows.iter().map(of_row).collect()
}

/// Least-squares slope of the readings over the stated rates; `None` for one rate.
fn scale(points: &[(f64, f64)]) -> Option<f64> {
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / n, y + point.1 / n));
    let square: f64 = points.iter().map(|point| (point.0 - x).powi(2)).sum();
    (square > 0.0).then(|| points.iter().map(|point| (point.0 - x) * (point.1 - y)).sum::<f64>() / square)
}

fn parse(path: &Path) -> Result<Vec<StepRow>, StepTableError> {
    let text = std::fs::read_to_string(path).map_err(|e| StepTableError::Read { path: path.to_owned(), message: e.to_string() })?;
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let names: Vec<&str> = lines.next().map_or(Vec::new(), |(_, header)| header.split(',').map(str::trim).collect());
    let place = |column: &str| names.iter().position(|name| *name == column);
    let required = |column: &'static str| place(column).ok_or(StepTableError::Column { path: path.to_owned(), column });
    let (file, from, to) = (required("file")?, required("from")?, required("to")?);
    let (rate, per_rad_s) = match (place("rate_rad_s"), place("rate_deg_s")) {
        (Some(rate), _) => (rate, 1.0),
        (None, Some(rate)) => (rate, 1_f64.to_radians()),
        (None, None) => return Err(StepTableError::Column { path: path.to_owned(), column: "rate_rad_s" }),
    };
    let temperature = place("temperature_C");
    lines
        .map(|(line, text)| {
            let cells: Vec<&str> = text.split(',').map(str::trim).collect();
            let invalid = |message: String| StepTableError::Row { path: path.to_owned(), row: line + 1, message };
            let cell = |at: usize| cells.get(at).copied().ok_or_else(|| invalid(format!("the column {} has no value", names[at])));
            let number = |at: usize| {
                let text = cell(at)?;
                text.parse::<f64>()
                    .ok()
                    .filter(|x| x.is_finite())
                    .ok_or_else(|| invalid(format!("{}: `{text}` is not a number", names[at])))
            };
            let row = StepRow {
                file: cell(file)?.to_owned(),
                from_s: number(from)?,
                to_s: number(to)?,
                rate_rad_s: number(rate)? * per_rad_s,
                temperature_C: temperature.map(number).transpose()?,
            };
            if row.from_s >= row.to_s { Err(invalid(format!("from {} must be before to {}", row.from_s, row.to_s))) } else { Ok(row) }
        })
        .collect()
}

/// Names of the logs of a table of steps, each once, in the order of the table.
///
/// # Errors
/// The table cannot be read.
pub fn files(table: &Path) -> Result<Vec<String>, StepTableError> {
    Ok(distinct_files(&parse(table)?).into_iter().map(str::to_owned).collect())
}

fn distinct_files(rows: &[StepRow]) -> Vec<&str> {
    let mut files: Vec<&str> = Vec::new();
    for row in rows {
        if !files.contains(&row.file.as_str()) {
            files.push(&row.file);
        }
    }
    files
}

/// Reads a table of steps and its logs, which are in the folder `logs`; `read` reads one log. One step per file, in the order of the table.
///
/// # Errors
/// The table or a log cannot be read; a row has no rows of its log, or overlaps with the one before; the readings of the sensor are no
/// plateaus, or not near the stated rates.
pub fn read_steps(table: &Path, logs: &Path, mut read: impl FnMut(&Path) -> Result<Log, LogError>) -> Result<Vec<Step>, StepTableError> {
    let rows = parse(table)?;
    let files = distinct_files(&rows);
    let (low, high) = rows.iter().map(|row| row.rate_rad_s).min_max();
    let implausible = |message| StepTableError::Implausible { path: table.to_owned(), message };
    let (mut steps, mut points) = (Vec::new(), Vec::new());
    for file in files {
        let log = read(&logs.join(file))?;
        let mut of_file: Vec<&StepRow> = rows.iter().filter(|row| row.file == file).collect();
        of_file.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
        let row_error = |row: &StepRow, message: String| {
            let number = rows.iter().position(|r| r == row).map_or(0, |k| k + 2);
            StepTableError::Row { path: table.to_owned(), row: number, message }
        };
        if let Some(pair) = of_file.windows(2).find(|pair| pair[1].from_s < pair[0].to_s) {
            return Err(row_error(pair[1], format!("it overlaps with the step from {} to {} s of {file}", pair[0].from_s, pair[0].to_s)));
        }
        steps.push(cut(&log, &of_file, file).map_err(|(row, message)| row_error(row, message))?);
        let means = plateau_means(&of_file, &log, high - low).map_err(implausible)?;
        points.extend(of_file.iter().map(|row| row.rate_rad_s).zip(means));
    }
    match scale(&points).and_then(objection) {
        Some(objection) => Err(implausible(format!("{SENSOR}: {objection}"))),
        None => Ok(steps),
    }
}

/// The rows of a log that are in the table, with the stated rates.
fn cut<'r>(log: &Log, rows: &[&'r StepRow], file: &str) -> Result<Step, (&'r StepRow, String)> {
    let t_s = log.t_s();
    let gap_s = 10.0 * log.median_dt_s();
    let (mut kept, mut setpoints, mut angles, mut temperatures, mut times) = (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut angle = 0.0;
    for row in rows {
        let inside: Vec<usize> = (0..t_s.len()).filter(|k| t_s[*k] >= row.from_s && t_s[*k] < row.to_s).collect();
        let Some(first) = inside.first() else {
            let range = format!("{file} has no rows from {} to {} s; it has {} to {} s", row.from_s, row.to_s, t_s[0], t_s[t_s.len() - 1]);
            return Err((row, range));
        };
        // A gap before each step, so that two steps of one rate remain two plateaus.
        let shift = times.last().map_or(0.0, |last: &f64| (last + gap_s - t_s[*first]).max(0.0));
        for k in &inside {
            times.push(t_s[*k] + shift);
            angles.push(angle + row.rate_rad_s * (t_s[*k] - t_s[*first]));
            setpoints.push(row.rate_rad_s);
            temperatures.push(row.temperature_C.unwrap_or(f64::NAN));
        }
        angle = angles.last().copied().unwrap_or(angle);
        kept.extend(inside);
    }
    let replaced = ["t_s", "theta_rad", "rate_cmd_rad_s"];
    let has_temperature = temperatures.iter().all(|t| t.is_finite());
    let mut columns: Vec<Column> = log
        .columns()
        .iter()
        .filter(|c| !(replaced.contains(&c.name.as_str()) || has_temperature && c.name == "sensor_C"))
        .map(|c| Column { name: c.name.clone(), values: kept.iter().map(|k| c.values[*k]).collect() })
        .collect();
    let mut add = |name: &str, values: Vec<f64>| columns.push(Column { name: name.to_owned(), values });
    add("t_s", times);
    add("theta_rad", angles);
    add("rate_cmd_rad_s", setpoints);
    if has_temperature {
        add("sensor_C", temperatures);
    }
    let cut = Log::new(log.path(), columns, log.notes().to_vec()).map_err(|e| (rows[0], e.to_string()))?;
    Ok(Step { name: file.to_owned(), log: cut, mounting: Mounting::default(), added_inertia_kg_m2: None })
}
