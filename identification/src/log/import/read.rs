//! The columns of a table by its mapping, in SI units, with increasing time.

use std::path::Path;

use super::clock::{self, Clock, ClockEvent, Disorder};
use super::mapping::{ImportMapping, file_of};
use super::table::{SkipReason, Table, TableColumn};
use super::units::{Quantity, Unit};
use crate::log::error::{LogError, LogErrorKind};
use crate::log::warning::LogWarning;
use crate::log::{Column, FileContents, Notes, Selection};

/// Time after which a clock is not that of a recording but of the day, s: it is counted from the first row.
const MAX_CLOCK_S: f64 = 1e5;
/// Fraction of rows that may lack a used cell.
const MAX_MISSING_FRACTION: f64 = 0.5;
/// Fraction of rows with the time of the row before from which the clock is coarser than the rows.
const MIN_COARSE_FRACTION: f64 = 0.1;

/// A used column of a table, what it is, and the unit of its numbers.
struct Used<'a> {
    column: &'a TableColumn,
    target: &'a str,
    unit: Option<Unit>,
}

/// The columns that the mapping names.
pub(super) fn contents(
    path: &Path,
    table: &Table,
    mapping: &ImportMapping,
    selection: &mut Selection<'_>,
) -> Result<FileContents, LogError> {
    let used = used_columns(path, table, mapping)?;
    let mut warnings = skipped_lines(table);
    // A column that nobody asked for costs no row, and a slow one is interpolated.
    let asked: Vec<&Used> = used.iter().filter(|u| u.target == "t_s" || (selection.column)(u.target)).collect();
    // A column that is read alone, as for an Allan deviation, keeps its gaps.
    let is_slow = |u: &Used| asked.iter().filter(|a| a.target != "t_s").count() > 1 && is_slow(u);
    let needed: Vec<&Used> = asked.iter().copied().filter(|u| !is_slow(u)).collect();
    let mut complete = complete_rows(path, table, &needed, &mut warnings)?;
    let mut notes = Notes::from(table.notes.clone());
    let time = used.iter().find(|u| u.target == "t_s");
    let mut runs = Vec::new();
    let times = match (time, mapping.sample_rate_Hz) {
        (Some(_), Some(_)) => return Err(LogError::new(&file_of(path), LogErrorKind::TimeAndRate)),
        (None, Some(rate_Hz)) if !(rate_Hz > 0.0 && rate_Hz.is_finite()) => {
            return Err(LogError::new(&file_of(path), LogErrorKind::SampleRate(rate_Hz)));
        }
        // Rows that are left out leave a gap.
        (None, Some(rate_Hz)) => Some(complete.iter().map(|&row| row as f64 / rate_Hz).collect()),
        (Some(time), None) => {
            without_repeated_rows(&needed, &mut complete, &mut warnings);
            let (times, zero_s) = times(path, time, &mut complete, &mut runs, &mut warnings)?;
            if let Some(zero_s) = zero_s {
                notes.push_text("time_zero_s", format!("{zero_s}"));
            }
            Some(times)
        }
        (None, None) => None,
    };
    let mut columns: Vec<Column> = Vec::new();
    if let Some(times) = times {
        let mut column = Column { name: "t_s".to_owned(), values: times };
        if let Some(callback) = &mut selection.times {
            std::mem::take(&mut column.values).into_iter().for_each(callback);
        }
        columns.push(column);
    }
    let mut ignored: Vec<String> = Vec::new();
    for one in used.iter().filter(|u| u.target != "t_s") {
        let Used { column, target, unit } = one;
        if !(selection.column)(target) {
            ignored.push((*target).to_owned());
            continue;
        }
        let mut values: Vec<f64> = if is_slow(one) {
            warnings.push(LogWarning::SlowColumn {
                column: (*target).to_owned(),
                readings: table.rows() - column.missing(),
                rows: table.rows(),
            });
            interpolated(&column.values, &complete).into_iter().map(|value| value + column.origin).collect()
        } else {
            complete.iter().map(|&row| column.values[row] + column.origin).collect()
        };
        let is_raw = unit.as_ref().is_some_and(|u| matches!(u.quantity, Quantity::Rate | Quantity::Current | Quantity::Torque));
        if is_raw && let Some((bits, form, rows)) = clock::sign_of_words(&mut values) {
            warnings.push(LogWarning::SignedWords { column: column.name.clone(), bits, form, rows });
        }
        if let Some(count_rad) = unit.as_ref().and_then(Unit::count_rad) {
            notes.push_text(format!("{target}_lsb"), format!("{count_rad}"));
            if let Some((bits, overflows)) = clock::continue_counter(&mut values) {
                warnings.push(LogWarning::CounterContinued { column: column.name.clone(), bits, overflows });
            }
        }
        if let Some(unit) = unit {
            values.iter_mut().for_each(|v| *v = unit.to_si(*v));
        }
        columns.push(Column { name: (*target).to_owned(), values });
    }
    if used.iter().any(|u| u.unit.as_ref().is_some_and(|u| u.linear)) {
        notes.push_text("axis", "linear");
    }
    notes.replace(Notes::from(mapping.notes.iter().map(|(k, v)| (k.clone(), v.clone())).collect::<Vec<_>>()));
    ignored.extend(table.columns.iter().map(|c| &c.name).filter(|name| !mapping.columns.contains_key(*name)).cloned());
    let described = used.iter().map(|Used { column, target, unit }| match unit.as_ref().filter(|u| !is_si(u)) {
        Some(unit) => format!("{target} from “{}” in {}", column.name, unit.text),
        None => format!("{target} from “{}”", column.name),
    });
    let noted = mapping.notes.iter().map(|(key, text)| match text.trim() {
        "" => format!("no note “{key}”"),
        text => format!("the note “{key}: {text}”"),
    });
    warnings.insert(0, LogWarning::Imported { statements: described.chain(noted).collect(), import_file: file_of(path) });
    Ok(FileContents { columns, ignored, notes, warnings, runs })
}

fn is_si(unit: &Unit) -> bool {
    unit.scale == 1.0 && unit.offset == 0.0 && (unit.quantity != Quantity::Angle || !unit.linear)
}

/// The columns of the table that the mapping names.
fn used_columns<'a>(path: &Path, table: &'a Table, mapping: &'a ImportMapping) -> Result<Vec<Used<'a>>, LogError> {
    let has = || table.columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
    let mut used: Vec<Used> = Vec::new();
    for (source, mapped) in &mapping.columns {
        let column = table.columns.iter().find(|c| c.name == *source);
        let column = column.ok_or_else(|| LogError::new(path, LogErrorKind::NoColumn { has: has() }).column(source))?;
        if let Some((row, text)) = column.text.as_ref().filter(|_| !column.is_mostly_numbers()) {
            let kind = if text.starts_with("0x") || text.starts_with("0X") {
                LogErrorKind::Hexadecimal(text.clone())
            } else {
                LogErrorKind::NotANumber { text: text.clone(), hint: "" }
            };
            return Err(LogError::new(path, kind).row(*row).column(source));
        }
        if used.iter().any(|u| u.target == mapped.is) {
            return Err(LogError::new(&file_of(path), LogErrorKind::MappedTwice(mapped.is.clone())).column(source));
        }
        let unit = mapped.checked_unit().map_err(|kind| LogError::new(&file_of(path), kind).column(source))?;
        used.push(Used { column, target: &mapped.is, unit });
    }
    Ok(used)
}

/// Warnings about lines that are no rows.
fn skipped_lines(table: &Table) -> Vec<LogWarning> {
    let damaged: Vec<_> = table.skipped.iter().filter(|s| s.reason != SkipReason::RepeatedHeader).collect();
    let Some(first) = damaged.first() else { return Vec::new() };
    vec![LogWarning::LinesSkipped { lines: damaged.len(), line: first.line, text: first.text.clone() }]
}

/// Quantities that change slowly beside a motion, which loggers read more rarely than it.
const SLOW: [&str; 2] = ["temp_C", "supply_V"];
/// Readings of a slow column at least.
const MIN_SLOW_READINGS: usize = 2;

/// A slow quantity that is not in every row, but in some.
fn is_slow(used: &Used) -> bool {
    let missing = used.column.missing();
    SLOW.contains(&used.target) && missing > 0 && used.column.values.len() - missing >= MIN_SLOW_READINGS
}

/// The values in these rows, on straight lines between the readings; before the first and after the last reading its value.
fn interpolated(values: &[f64], rows: &[usize]) -> Vec<f64> {
    let readings: Vec<usize> = (0..values.len()).filter(|&row| values[row].is_finite()).collect();
    let at = |row: &usize| {
        let next = readings.partition_point(|reading| reading < row);
        match (next.checked_sub(1).map(|k| readings[k]), readings.get(next).copied()) {
            (Some(before), Some(after)) => {
                let part = (row - before) as f64 / (after - before) as f64;
                values[before] + part * (values[after] - values[before])
            }
            (Some(one), None) | (None, Some(one)) => values[one],
            (None, None) => f64::NAN,
        }
    };
    rows.iter().map(at).collect()
}

/// Rows in which every column that is needed has a number.
fn complete_rows(path: &Path, table: &Table, used: &[&Used], warnings: &mut Vec<LogWarning>) -> Result<Vec<usize>, LogError> {
    let rows = table.rows();
    let complete: Vec<usize> = (0..rows).filter(|&row| used.iter().all(|u| u.column.values[row].is_finite())).collect();
    let left_out = rows - complete.len();
    let Some(emptiest) = used.iter().map(|u| u.column).max_by_key(|c| c.missing()).filter(|_| left_out > 0) else { return Ok(complete) };
    if left_out as f64 > MAX_MISSING_FRACTION * rows as f64 {
        let kind = LogErrorKind::MostlyEmpty { missing: emptiest.missing(), rows };
        return Err(LogError::new(path, kind).column(&emptiest.name));
    }
    let first = (0..rows).find(|&row| !emptiest.values[row].is_finite()).unwrap_or(0) + 1;
    warnings.push(LogWarning::RowsLeftOut { rows: left_out, column: emptiest.name.clone(), first });
    Ok(complete)
}

/// Leaves out rows that repeat the row before in all used columns.
fn without_repeated_rows(used: &[&Used], complete: &mut Vec<usize>, warnings: &mut Vec<LogWarning>) {
    let before = complete.len();
    let mut first = None;
    complete.dedup_by(|row, last| {
        let same = used.iter().all(|u| u.column.values[*row] == u.column.values[*last]);
        if same {
            first.get_or_insert(*row + 1);
        }
        same
    });
    if let Some(first) = first {
        warnings.push(LogWarning::RepeatedRows { rows: before - complete.len(), first });
    }
}

/// Times of the rows, s, and the time of the first, s, where the clock is not that of the recording. Rows out of order at the begin are
/// left out.
fn times(
    path: &Path,
    time: &Used,
    complete: &mut Vec<usize>,
    runs: &mut Vec<usize>,
    warnings: &mut Vec<LogWarning>,
) -> Result<(Vec<f64>, Option<f64>), LogError> {
    let scale = time.unit.as_ref().map_or(1.0, |u| u.scale);
    let reading = |row: usize| time.column.values[row];
    // The first line of a serial port may be cut in front.
    if complete.len() > 2 && reading(complete[0]) >= reading(complete[1]) {
        let rest: Vec<f64> = complete[1..].iter().map(|&row| reading(row)).collect();
        if Clock::of(&rest, time.column.is_date).is_ok_and(|c| c.events.is_empty()) {
            complete.remove(0);
            warnings.push(LogWarning::FirstRowLeftOut);
        }
    }
    let readings: Vec<f64> = complete.iter().map(|&row| reading(row)).collect();
    let clock = Clock::of(&readings, time.column.is_date).map_err(|Disorder { row, before, now }| {
        let repeats = readings.windows(2).filter(|w| w[1] == w[0]).count();
        let in_seconds = |v: f64| (v + time.column.origin) * scale;
        let kind = match readings.windows(2).any(|w| w[1] < w[0]) {
            false if repeats as f64 > MIN_COARSE_FRACTION * readings.len() as f64 => {
                let duration = (readings[readings.len() - 1] - readings[0]) * scale;
                // Equal rows of a coarse clock were left out, but are rows.
                let intervals = complete[complete.len() - 1] - complete[0];
                LogErrorKind::CoarseTime { repeats, rows: readings.len(), rate_Hz: intervals as f64 / duration }
            }
            _ => LogErrorKind::time(in_seconds(before), in_seconds(now)),
        };
        LogError::new(path, kind).row(complete[row] + 1).column(&time.column.name)
    })?;
    for event in clock.events {
        match event {
            ClockEvent::Overflow(bits, row) => warnings.push(LogWarning::ClockOverflow { bits, row: complete[row] + 1 }),
            ClockEvent::Midnight(row) => warnings.push(LogWarning::Midnight { row: complete[row] + 1 }),
            ClockEvent::Restart(row) => runs.push(row),
        }
    }
    if let Some(first) = runs.first() {
        warnings.push(LogWarning::ClockRestarts { runs: runs.len() + 1, row: complete[*first] + 1 });
    }
    let first = (reading(complete[0]) + time.column.origin) * scale;
    // The difference before the conversion keeps the digits of a clock that counts from 1970.
    let is_clock = time.column.is_date || first.abs() > MAX_CLOCK_S;
    let zero = if is_clock { 0.0 } else { first };
    Ok((clock.times.iter().map(|t| zero + t * scale).collect(), is_clock.then_some(first)))
}
