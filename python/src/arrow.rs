//! Logs and the Arrow C stream (PyCapsule interface), which pandas, polars, pyarrow, DuckDB and others give and take.

use std::collections::HashMap;
use std::path::Path;
use std::ptr::NonNull;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::{FFI_ArrowArrayStream, RecordBatchStreamReader};
use arrow_array::types::{Float64Type, Int64Type};
use arrow_array::{Array, ArrayRef, Float64Array, RecordBatch, RecordBatchIterator, RecordBatchReader};
use arrow_buffer::{Buffer, ScalarBuffer};
use arrow_cast::cast;
use arrow_schema::{ArrowError, DataType, Field, Schema, TimeUnit};
use identification::log::Log;
use identification::log::import::table::{Table, TableColumn};
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyCapsuleMethods};

use crate::error::log_error_at;

/// Name of the capsule, by the specification.
const STREAM: &std::ffi::CStr = c"arrow_array_stream";

/// Metadata of other programs about their types, which are not notes.
fn is_note(key: &str) -> bool {
    key != "pandas" && !key.starts_with("ARROW:")
}

/// The log as a stream of one batch. The columns are the memory of the log.
pub fn stream_of<'py>(py: Python<'py>, log: &Arc<Log>) -> PyResult<Bound<'py, PyCapsule>> {
    let axis = log.axis();
    let fields = log.columns().iter().map(|column| Field::new(axis.file_column(&column.name), DataType::Float64, false));
    let notes: HashMap<String, String> = log.notes().iter().cloned().collect();
    let schema = Arc::new(Schema::new_with_metadata(fields.collect::<Vec<_>>(), notes));
    let columns = log.columns().iter().map(|column| shared(log, &column.values)).collect();
    let failed = |error: ArrowError| log_error_at(&error.to_string(), log.path(), None, None);
    let batch = RecordBatch::try_new(schema.clone(), columns).map_err(failed)?;
    let reader = RecordBatchIterator::new([Ok(batch)], schema);
    PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(Box::new(reader)), STREAM)
}

/// An array that is the memory of a column of the log.
fn shared(log: &Arc<Log>, values: &[f64]) -> ArrayRef {
    let pointer = NonNull::from(values).cast::<u8>();
    // SAFETY: `values` belong to the log, which does not change and which the buffer keeps alive.
    let buffer = unsafe { Buffer::from_custom_allocation(pointer, size_of_val(values), log.clone()) };
    Arc::new(Float64Array::new(ScalarBuffer::new(buffer, 0, values.len()), None))
}

/// The table of a stream. Integers, floats, decimals and booleans become numbers, time stamps become seconds; a missing value is NaN.
///
/// # Errors
/// `LogError`: the stream fails, or two columns have one name.
pub fn table_of(path: &Path, capsule: &Bound<'_, PyCapsule>) -> PyResult<Table> {
    let failed = |error: ArrowError| log_error_at(&format!("{}: {error}", path.display()), path, None, None);
    let stream = capsule.pointer_checked(Some(STREAM))?.cast::<FFI_ArrowArrayStream>();
    // SAFETY: a capsule of this name holds such a stream; reading moves it out and marks it as released.
    let reader = unsafe { RecordBatchStreamReader::from_raw(stream.as_ptr()) }.map_err(failed)?;
    let schema = reader.schema();
    let mut columns: Vec<TableColumn> = Vec::new();
    for (k, field) in schema.fields().iter().enumerate() {
        columns.push(TableColumn { name: field.name().clone(), position: k + 1, ..TableColumn::default() });
    }
    for batch in reader {
        let batch = batch.map_err(failed)?;
        for (column, array) in columns.iter_mut().zip(batch.columns()) {
            append(column, array).map_err(failed)?;
        }
    }
    let notes = schema.metadata().iter().filter(|(key, _)| is_note(key)).map(|(key, text)| (key.clone(), text.clone()));
    let mut notes: Vec<(String, String)> = notes.collect();
    // The metadata have no order of their own.
    notes.sort();
    Ok(Table { columns, notes, ..Table::default() })
}

/// Appends the values of an array.
fn append(column: &mut TableColumn, array: &ArrayRef) -> Result<(), ArrowError> {
    match array.data_type() {
        DataType::Timestamp(unit, _) => append_times(column, array, ticks_per_s(*unit)),
        DataType::Date32 | DataType::Date64 => {
            let times = cast(array, &DataType::Timestamp(TimeUnit::Millisecond, None))?;
            append_times(column, &times, ticks_per_s(TimeUnit::Millisecond))
        }
        DataType::Duration(unit) => {
            let ticks = cast(array, &DataType::Int64)?;
            let scale = ticks_per_s(*unit);
            let seconds = ticks.as_primitive::<Int64Type>().iter().map(|tick| tick.map_or(f64::NAN, |tick| tick as f64 / scale));
            column.is_date = true;
            column.values.extend(seconds);
            Ok(())
        }
        DataType::Dictionary(_, values) => append(column, &cast(array, values)?),
        _ => match cast(array, &DataType::Float64) {
            Ok(numbers) => {
                let (first, numbers) = (column.values.len(), numbers.as_primitive::<Float64Type>());
                column.values.extend(numbers.iter().map(|number| number.unwrap_or(f64::NAN)));
                // Text that is a number becomes one; other text becomes a missing value.
                if let Some(k) = (0..array.len()).find(|&k| numbers.is_null(k) && !array.is_null(k)) {
                    let text = cast(array, &DataType::Utf8).map(|text| text.as_string::<i32>().value(k).to_owned());
                    column.text.get_or_insert((first + k + 1, text.unwrap_or_else(|_| array.data_type().to_string())));
                }
                Ok(())
            }
            Err(_) => {
                column.text.get_or_insert((column.values.len() + 1, array.data_type().to_string()));
                column.values.extend(std::iter::repeat_n(f64::NAN, array.len()));
                Ok(())
            }
        },
    }
}

fn ticks_per_s(unit: TimeUnit) -> f64 {
    match unit {
        TimeUnit::Second => 1.0,
        TimeUnit::Millisecond => 1e3,
        TimeUnit::Microsecond => 1e6,
        TimeUnit::Nanosecond => 1e9,
    }
}

/// Appends time stamps as seconds after the first one, which is the origin of the column: an `f64` of the seconds since 1970 resolves 0.2
/// µs.
fn append_times(column: &mut TableColumn, array: &ArrayRef, ticks_per_s: f64) -> Result<(), ArrowError> {
    let ticks = cast(array, &DataType::Int64)?;
    let ticks = ticks.as_primitive::<Int64Type>();
    if !column.is_date {
        column.origin = ticks.iter().flatten().next().map_or(0.0, |first| first as f64 / ticks_per_s);
        column.is_date = true;
    }
    let origin = (column.origin * ticks_per_s).round() as i64;
    column.values.extend(ticks.iter().map(|tick| tick.map_or(f64::NAN, |tick| tick.saturating_sub(origin) as f64 / ticks_per_s)));
    Ok(())
}
