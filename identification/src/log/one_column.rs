//! Reads one column of a long log: memory for that column only; the times are passed to a callback.

use std::path::Path;

use super::error::{LogError, LogErrorKind};
use super::warning::LogWarning;
use super::{Column, Log, Notes, Selection, names, quantization, read_contents};

/// One column of a log.
#[derive(Debug, Clone)]
pub struct OneColumn {
    /// Name with its unit.
    pub name: String,
    /// One number a row, all finite, at least one.
    pub values: Vec<f64>,
    /// Notes of the file.
    pub notes: Notes,
    /// Warnings about the file.
    pub warnings: Vec<LogWarning>,
}

impl OneColumn {
    /// Reads `column`, of any name but t_s, and calls `on_time` with the time of each row, in order.
    ///
    /// # Errors
    /// As [`super::Log::read`]; also if the column does not exist.
    pub fn read(path: impl AsRef<Path>, column: &str, on_time: &mut dyn FnMut(f64)) -> Result<Self, LogError> {
        let path = path.as_ref();
        let selection = |name: &str| name == column || name == "t_s";
        let contents = read_contents(path, &mut Selection { column: &selection, times: Some(on_time), lenient: false })?;
        let all = names(&contents.columns, &contents.ignored);
        if !contents.columns.iter().any(|c| c.name == "t_s") {
            return Err(LogError::new(path, LogErrorKind::NoTime { has: all }));
        }
        let Some(Column { name, values }) = contents.columns.into_iter().find(|c| c.name == column && column != "t_s") else {
            return Err(LogError::new(path, LogErrorKind::NoColumn { has: all }).column(column));
        };
        if values.is_empty() {
            return Err(LogError::new(path, LogErrorKind::NoRows));
        }
        let mut warnings = contents.warnings;
        warnings.extend(contents.notes.not_understood());
        Ok(Self { name, values, notes: contents.notes, warnings })
    }

    /// `column` of a log in memory, of any name but t_s.
    ///
    /// # Errors
    /// The log has no such column.
    pub fn of(log: &Log, column: &str) -> Result<Self, LogError> {
        let Some(values) = log.column(column).filter(|_| column != "t_s") else {
            let has = names(log.columns(), log.ignored());
            return Err(LogError::new(log.path(), LogErrorKind::NoColumn { has }).column(column));
        };
        Ok(Self { name: column.to_owned(), values: values.to_vec(), notes: log.notes().clone(), warnings: log.warnings().to_vec() })
    }

    /// Quantization step in the unit of the column, from a note or else from the values; `None` if they are continuous.
    pub fn quantization_step(&self) -> Option<f64> {
        self.notes.quantization_step(&self.name).or_else(|| quantization::step(&self.values))
    }
}

/// Calls `on_time` with the time of each row and stores nothing.
///
/// # Errors
/// As [`super::Log::read`].
pub fn times(path: impl AsRef<Path>, on_time: &mut dyn FnMut(f64)) -> Result<(), LogError> {
    let path = path.as_ref();
    let contents = read_contents(path, &mut Selection { column: &|name| name == "t_s", times: Some(on_time), lenient: false })?;
    if !contents.columns.iter().any(|c| c.name == "t_s") {
        return Err(LogError::new(path, LogErrorKind::NoTime { has: names(&contents.columns, &contents.ignored) }));
    }
    Ok(())
}
