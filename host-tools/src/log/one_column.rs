//! One column of a log that may be long: memory is that of the column, the times pass by.

use std::path::Path;

use super::error::{LogError, Trouble};
use super::{Column, Wanted, names, notes, quantum, read_parts};

/// One column, its times told while they were read.
#[derive(Debug, Clone)]
pub struct OneColumn {
    /// Name with its unit.
    pub name: String,
    /// One number a row, all finite, at least one.
    pub values: Vec<f64>,
    /// Notes of the file.
    pub notes: Vec<(String, String)>,
    /// What the person should hear about the file, a line each.
    pub warnings: Vec<String>,
}

impl OneColumn {
    /// Reads `column`, whatever its name but t_s, and tells the time of each row to `told`, in order; either all values or all times come first.
    ///
    /// # Errors
    /// As [`super::Log::read`]; and where there is no such column, with those that there are.
    pub fn read(path: impl AsRef<Path>, column: &str, told: &mut dyn FnMut(f64)) -> Result<Self, LogError> {
        let path = path.as_ref();
        let wanted = |name: &str| name == column || name == "t_s";
        let parts = read_parts(path, &mut Wanted { column: &wanted, times: Some(told) })?;
        let all = names(&parts.columns, &parts.ignored);
        if !parts.columns.iter().any(|c| c.name == "t_s") {
            return Err(LogError::new(path, Trouble::NoTime { has: all }));
        }
        let Some(Column { name, values }) = parts.columns.into_iter().find(|c| c.name == column && column != "t_s") else {
            return Err(LogError::new(path, Trouble::NoColumn { has: all }).column(column));
        };
        if values.is_empty() {
            return Err(LogError::new(path, Trouble::NoRows));
        }
        let mut warnings = parts.warnings;
        warnings.extend(notes::warnings(&parts.notes));
        Ok(Self { name, values, notes: parts.notes, warnings })
    }

    /// Least significant bit in the column's unit: from a note, else from the numbers; `None` where they are continuous.
    pub fn quantum(&self) -> Option<f64> {
        notes::quantum(&self.notes, &self.name).or_else(|| quantum::found(&self.values))
    }
}

/// Tells the time of each row to `told`, and keeps nothing.
///
/// # Errors
/// As [`super::Log::read`].
pub fn times(path: impl AsRef<Path>, told: &mut dyn FnMut(f64)) -> Result<(), LogError> {
    let path = path.as_ref();
    let parts = read_parts(path, &mut Wanted { column: &|name| name == "t_s", times: Some(told) })?;
    if !parts.columns.iter().any(|c| c.name == "t_s") {
        return Err(LogError::new(path, Trouble::NoTime { has: names(&parts.columns, &parts.ignored) }));
    }
    Ok(())
}
