//! Import of logs that other programs wrote: their columns, units and separators.
//!
//! In: a text file, a Parquet file or a MATLAB file. [`inspect`] returns what its columns are believed to be ([`guess`]); an [`ImportMapping`], stored
//! beside the file as `NAME.import.toml`, is the user's consent. [`contents`] reads the file by that mapping, in SI units. Without a mapping, a file that is not in the
//! project's own format is refused.

pub mod guess;
mod inspection;
pub mod mapping;
mod mat;
pub mod table;
mod text;
pub mod units;

use std::path::Path;

use super::error::{LogError, LogErrorKind};
use super::warning::LogWarning;
use super::{Column, FileContents, Notes, Selection, parquet};
use table::{Dialect, Table, TableColumn};
use units::Quantity;

pub use guess::{Belief, Evidence};
pub use inspection::{ColumnInspection, Inspection, inspect};
pub use mapping::{ImportMapping, MappedColumn, Statements, file_of};

/// Time after which a clock is not that of a recording but of the day, s: it is counted from the first row.
const MAX_CLOCK_S: f64 = 1e5;
/// Fraction of rows that may lack a used cell.
const MAX_MISSING_FRACTION: f64 = 0.5;

/// The table of a file of another program.
///
/// # Errors
/// The file cannot be read, or its ending names no format.
pub fn read_table(path: &Path, text: Option<&mapping::TextFormat>) -> Result<Table, LogError> {
    let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match ending.as_deref() {
        Some("csv" | "txt" | "tsv" | "dat" | "asc") => {
            text::read(path, text.map(|t| Dialect { separator: t.separator, decimal: t.decimal, has_header: true }))
        }
        Some("parquet") => parquet_table(path),
        Some("mat") => mat::read(path),
        _ => Err(LogError::new(path, LogErrorKind::ForeignEnding)),
    }
}

fn parquet_table(path: &Path) -> Result<Table, LogError> {
    let contents = parquet::read(path, &mut Selection { column: &|_| true, times: None, lenient: true })?;
    let column = |c: Column| TableColumn { name: c.name, unit: String::new(), values: c.values, text: None, is_date: false };
    let mut columns: Vec<TableColumn> = contents.columns.into_iter().map(column).collect();
    let rows = columns.first().map_or(0, |c| c.values.len());
    columns.extend(contents.ignored.into_iter().map(|name| TableColumn {
        name,
        unit: String::new(),
        values: vec![f64::NAN; rows],
        text: Some((1, "not a number".to_owned())),
        is_date: false,
    }));
    Ok(Table { columns, notes: contents.notes.to_vec(), ..Table::default() })
}

/// Reads a file by its mapping, in SI units.
pub(super) fn contents(path: &Path, mapping: &ImportMapping, selection: &mut Selection<'_>) -> Result<FileContents, LogError> {
    let table = read_table(path, mapping.text.as_ref())?;
    let has = || table.columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
    let mut used: Vec<(&TableColumn, &str, Option<units::Unit>)> = Vec::new();
    for (source, column) in &mapping.columns {
        let found = table.columns.iter().find(|c| c.name == *source);
        let found = found.ok_or_else(|| LogError::new(path, LogErrorKind::NoColumn { has: has() }).column(source))?;
        if let Some((row, text)) = &found.text {
            let kind = LogErrorKind::NotANumber { text: text.clone(), hint: "" };
            return Err(LogError::new(path, kind).row(*row).column(source));
        }
        if used.iter().any(|(_, target, _)| *target == column.is) {
            return Err(LogError::new(&file_of(path), LogErrorKind::MappedTwice(column.is.clone())).column(source));
        }
        let unit = column.checked_unit().map_err(|kind| LogError::new(&file_of(path), kind).column(source))?;
        used.push((found, &column.is, unit));
    }
    let rows = table.rows();
    let complete: Vec<usize> = (0..rows).filter(|&row| used.iter().all(|(c, ..)| c.values[row].is_finite())).collect();
    let left_out = rows - complete.len();
    let emptiest = used.iter().max_by_key(|(c, ..)| c.missing());
    if let Some((column, ..)) = emptiest
        && left_out as f64 > MAX_MISSING_FRACTION * rows as f64
    {
        let kind = LogErrorKind::MostlyEmpty { missing: column.missing(), rows };
        return Err(LogError::new(path, kind).column(&column.name));
    }
    let mut warnings = Vec::new();
    if left_out > 0
        && let Some((column, ..)) = emptiest
    {
        let first = (0..rows).find(|&row| !column.values[row].is_finite()).unwrap_or(0) + 1;
        warnings.push(LogWarning::RowsLeftOut { rows: left_out, column: column.name.clone(), first });
    }
    let mut notes = Notes::from(table.notes.clone());
    let mut columns: Vec<Column> = Vec::new();
    let mut ignored: Vec<String> = Vec::new();
    for (column, target, unit) in &used {
        let si = |value: f64| unit.as_ref().map_or(value, |u| u.to_si(value));
        if *target != "t_s" && !(selection.column)(target) {
            ignored.push((*target).to_owned());
            continue;
        }
        let mut values: Vec<f64> = complete.iter().map(|&row| si(column.values[row])).collect();
        if *target == "t_s" {
            let zero = values.first().copied().filter(|t| column.is_date || t.abs() > MAX_CLOCK_S).unwrap_or(0.0);
            // The difference before the conversion keeps the digits of a clock that counts from 1970.
            if zero != 0.0 {
                let first = complete.first().map_or(0.0, |&row| column.values[row]);
                let scale = unit.as_ref().map_or(1.0, |u| u.scale);
                values = complete.iter().map(|&row| (column.values[row] - first) * scale).collect();
                notes.push_text("time_zero_s", format!("{zero}"));
            }
            if let Some(k) = values.windows(2).position(|w| w[1] <= w[0]) {
                let kind = LogErrorKind::time(values[k], values[k + 1]);
                return Err(LogError::new(path, kind).row(complete[k + 1] + 1).column(&column.name));
            }
        }
        if let Some(count_rad) = unit.as_ref().and_then(units::Unit::count_rad) {
            notes.push_text(format!("{target}_lsb"), format!("{count_rad}"));
        }
        columns.push(Column { name: (*target).to_owned(), values });
    }
    if used.iter().any(|(_, _, unit)| unit.as_ref().is_some_and(|u| u.linear)) {
        notes.push_text("axis", "linear");
    }
    let has_time = columns.iter().any(|c| c.name == "t_s");
    if let Some(rate_Hz) = mapping.sample_rate_Hz {
        if has_time {
            return Err(LogError::new(&file_of(path), LogErrorKind::TimeAndRate));
        }
        if !(rate_Hz > 0.0 && rate_Hz.is_finite()) {
            return Err(LogError::new(&file_of(path), LogErrorKind::SampleRate(rate_Hz)));
        }
        // Rows that are left out leave a gap.
        columns.insert(0, Column { name: "t_s".to_owned(), values: complete.iter().map(|&row| row as f64 / rate_Hz).collect() });
    }
    if let (Some(times), Some(time)) = (&mut selection.times, columns.iter_mut().find(|c| c.name == "t_s")) {
        std::mem::take(&mut time.values).into_iter().for_each(times);
    }
    notes.replace(Notes::from(mapping.notes.iter().map(|(k, v)| (k.clone(), v.clone())).collect::<Vec<_>>()));
    ignored.extend(table.columns.iter().map(|c| &c.name).filter(|name| !mapping.columns.contains_key(*name)).cloned());
    let described = used.iter().map(|(column, target, unit)| match unit.as_ref().filter(|u| !is_si(u)) {
        Some(unit) => format!("{target} from “{}” in {}", column.name, unit.text),
        None => format!("{target} from “{}”", column.name),
    });
    warnings.push(LogWarning::Imported { columns: described.collect(), import_file: file_of(path) });
    Ok(FileContents { columns, ignored, notes, warnings })
}

fn is_si(unit: &units::Unit) -> bool {
    unit.scale == 1.0 && unit.offset == 0.0 && (unit.quantity != Quantity::Angle || !unit.linear)
}
