//! How much a file may contain: a small file that decodes to a large table must not fill the memory of a program that drives a stand.

use super::error::LogErrorKind;

/// Columns of a table.
pub(super) const MAX_COLUMNS: usize = 10_000;
/// Numbers in memory, rows times columns that are read: 1 GiB.
const DEFAULT_MAX_VALUES: u64 = 1 << 27;
/// Environment variable with another limit of the numbers in memory.
const MAX_VALUES: &str = "STAND_MAX_VALUES";

/// Numbers in memory, rows times columns that are read.
pub(super) fn max_values() -> u64 {
    std::env::var(MAX_VALUES).ok().and_then(|text| text.trim().parse().ok()).unwrap_or(DEFAULT_MAX_VALUES)
}

/// Checks a table before it is read.
///
/// # Errors
/// It has more than [`max_values`] numbers.
pub(super) fn check_size(rows: usize, columns: usize) -> Result<(), LogErrorKind> {
    let limit = max_values();
    if (rows as u64).saturating_mul(columns as u64) > limit { Err(LogErrorKind::TooLarge { rows, columns, limit }) } else { Ok(()) }
}

/// Checks the number of columns.
///
/// # Errors
/// There are more than [`MAX_COLUMNS`].
pub(super) fn check_columns(columns: usize) -> Result<(), LogErrorKind> {
    if columns > MAX_COLUMNS { Err(LogErrorKind::TooManyColumns { columns, limit: MAX_COLUMNS }) } else { Ok(()) }
}
