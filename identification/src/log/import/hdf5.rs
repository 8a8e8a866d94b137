//! Reads tables from HDF5 files: MATLAB files of version 7.3 (`save -v7.3`), and those of h5py.
//!
//! In: a `.mat`, `.h5` or `.hdf5` file. Out: as in [`super::mat`], a column for each numeric vector of the most frequent length, for each
//! column of a matrix with that many rows, and for each such data set of a group or structure (`run.speed`). MATLAB stores a matrix column
//! by column, so that HDF5 shows it transposed; the attribute `MATLAB_class` tells which is meant.

use std::path::Path;

use hdf5_pure::{DType, File, Group};

use super::arrays::{Array, table};
use super::table::Table;
use crate::log::caught::caught;
use crate::log::error::{LogError, LogErrorKind};
use crate::log::limits;

/// Groups within groups that are read at most.
const MAX_DEPTH: usize = 4;
/// Groups of MATLAB's own.
const INTERNAL: [&str; 2] = ["#refs#", "#subsystem#"];

/// The bytes begin an HDF5 file, alone or behind the 512 bytes of a MATLAB header.
pub(super) fn is_hdf5(bytes: &[u8]) -> bool {
    const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
    bytes.starts_with(SIGNATURE) || bytes.get(512..).is_some_and(|b| b.starts_with(SIGNATURE))
}

/// Reads the table in `path`.
pub(super) fn read(path: &Path) -> Result<Table, LogError> {
    let damaged = |message: String| LogError::new(path, LogErrorKind::Hdf5(message));
    // A damaged file must not end the program, whatever it makes of the library.
    let arrays = caught(|| {
        let file = File::open(path).map_err(|e| e.to_string())?;
        let mut arrays = Vec::new();
        group(&file.root(), "", 0, &mut arrays).map(|()| arrays)
    });
    let arrays = arrays.unwrap_or_else(|| Err("its contents are inconsistent".to_owned())).map_err(damaged)?;
    table(arrays).map_err(|kind| LogError::new(path, kind))
}

/// Adds the numeric arrays of a group and of the groups in it, in the order of their names.
fn group(group: &Group, prefix: &str, depth: usize, arrays: &mut Vec<Array>) -> Result<(), String> {
    let name = |own: &str| if prefix.is_empty() { own.to_owned() } else { format!("{prefix}.{own}") };
    for own in group.datasets().map_err(|e| e.to_string())? {
        let data = group.dataset(&own).map_err(|e| format!("{own}: {e}"))?;
        let kind = data.dtype().map_err(|e| format!("{own}: {e}"))?;
        let is_integer =
            matches!(kind, DType::I8 | DType::I16 | DType::I32 | DType::I64 | DType::U8 | DType::U16 | DType::U32 | DType::U64);
        let is_number = is_integer || matches!(kind, DType::F32 | DType::F64);
        let shape = data.shape().map_err(|e| format!("{own}: {e}"))?;
        let (rows, columns) = match shape[..] {
            [n] => (n as usize, 1),
            [a, b] => (a as usize, b as usize),
            _ => continue,
        };
        if !is_number {
            continue;
        }
        limits::check_size(rows, columns).map_err(|kind| format!("{own}: {kind}"))?;
        let values = data.read_f64().map_err(|e| format!("{own}: {e}"))?;
        if values.len() != rows * columns {
            return Err(format!("{own} has {} of {} numbers", values.len(), rows * columns));
        }
        let class = data.attrs().ok().and_then(|attributes| attributes.get("MATLAB_class").map(|c| format!("{c:?}")));
        match class {
            Some(class) if class.contains("char") || class.contains("cell") => {}
            // Column by column already.
            Some(_) => arrays.push(Array { name: name(&own), rows: columns.max(1), columns: rows, values }),
            None => {
                let by_column = (0..columns).flat_map(|c| values.iter().skip(c).step_by(columns).copied()).collect();
                arrays.push(Array { name: name(&own), rows, columns, values: by_column });
            }
        }
    }
    if depth >= MAX_DEPTH {
        return Ok(());
    }
    for own in group.groups().map_err(|e| e.to_string())? {
        if !INTERNAL.contains(&own.as_str()) {
            let inner = group.group(&own).map_err(|e| format!("{own}: {e}"))?;
            self::group(&inner, &name(&own), depth + 1, arrays)?;
        }
    }
    Ok(())
}
