//! Named numeric arrays as a table: what files of MATLAB and HDF5 contain.

use super::table::{Table, TableColumn};
use crate::log::error::LogErrorKind;

/// Columns of a matrix that are read at most; a wider one is no table of channels.
const MAX_MATRIX_COLUMNS: usize = 64;

/// A numeric array, column by column.
pub(super) struct Array {
    pub name: String,
    pub rows: usize,
    pub columns: usize,
    pub values: Vec<f64>,
}

/// The arrays of the most frequent number of rows as columns.
pub(super) fn table(arrays: Vec<Array>) -> Result<Table, LogErrorKind> {
    let length = |a: &Array| if a.rows == 1 || a.columns == 1 { a.rows * a.columns } else { a.rows };
    let mut lengths: Vec<(usize, usize)> = Vec::new();
    for length in arrays.iter().map(length).filter(|l| *l > 1) {
        match lengths.iter_mut().find(|(l, _)| *l == length) {
            Some((_, n)) => *n += 1,
            None => lengths.push((length, 1)),
        }
    }
    let rows = lengths.into_iter().max_by_key(|(length, n)| (*n, *length)).map(|(length, _)| length);
    let rows = rows.ok_or(LogErrorKind::Matlab("there is no numeric vector in the file"))?;
    let mut columns = Vec::new();
    for array in arrays.into_iter().filter(|a| length(a) == rows) {
        let count = array.values.len() / rows;
        if count > MAX_MATRIX_COLUMNS {
            continue;
        }
        for (k, values) in array.values.chunks_exact(rows).enumerate() {
            let name = if count == 1 { array.name.clone() } else { format!("{}_{}", array.name, k + 1) };
            columns.push(TableColumn { name, position: columns.len() + 1, values: values.to_vec(), ..TableColumn::default() });
        }
    }
    Ok(Table { columns, ..Table::default() })
}
