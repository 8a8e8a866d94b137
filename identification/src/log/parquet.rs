//! Reads and writes a log as Parquet, column by column; notes are the key-value metadata of the file.
//!
//! Read: double, float, 32- and 64-bit integers in any codec that pandas writes. Written: required doubles, Zstandard, row groups of at
//! most a million rows. The low-level readers and writers of the parquet crate are used, without Arrow.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType, Repetition, Type as Physical, ZstdLevel};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{DataType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::metadata::{KeyValue, ParquetMetaData};
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnDescriptor, Type};

use super::caught::caught;
use super::error::{LogError, LogErrorKind};
use super::{Column, FileContents, Log, Selection};

/// Number of rows of a written row group, at most.
const MAX_GROUP_ROWS: usize = 1 << 20;
/// Number of rows that are decoded at once.
const BATCH_ROWS: usize = 1 << 16;
/// Metadata of other programs about their types, which are not notes.
const FOREIGN_METADATA: [&str; 2] = ["ARROW:schema", "pandas"];

/// Memory is reserved for at most this number of rows; the metadata may be misleading.
const MAX_RESERVED_ROWS: usize = 1 << 26;

/// Reads the selected columns; checks that each value is finite and that time increases.
pub(super) fn read(path: &Path, selection: &mut Selection<'_>) -> Result<FileContents, LogError> {
    // The parquet crate panics on some damaged files; the known cases are checked before.
    caught(|| read_columns(path, selection))
        .unwrap_or_else(|| Err(LogError::new(path, LogErrorKind::Parquet("its contents are inconsistent".to_owned()))))
}

fn read_columns(path: &Path, selection: &mut Selection<'_>) -> Result<FileContents, LogError> {
    let damaged = |e: ParquetError| LogError::new(path, LogErrorKind::Parquet(e.to_string()));
    let mut file = File::open(path).map_err(|e| LogError::new(path, LogErrorKind::Read(e)))?;
    let length = check_magic_bytes(&mut file).map_err(|kind| LogError::new(path, kind))?;
    let reader = SerializedFileReader::new(file).map_err(damaged)?;
    check_offsets(reader.metadata(), length).map_err(|kind| LogError::new(path, kind))?;
    let meta = reader.metadata().file_metadata();
    let mut contents = FileContents::default();
    for pair in meta.key_value_metadata().into_iter().flatten() {
        if !FOREIGN_METADATA.contains(&pair.key.as_str()) {
            contents.notes.push_text(pair.key.clone(), pair.value.clone().unwrap_or_default());
        }
    }
    let rows = usize::try_from(meta.num_rows()).unwrap_or(0);
    let schema = meta.schema_descr();
    super::limits::check_columns(schema.num_columns()).map_err(|kind| LogError::new(path, kind))?;
    let mut columns: Vec<(usize, Column)> = Vec::new();
    for (index, descriptor) in schema.columns().iter().enumerate() {
        let name = descriptor.path().parts().join(".");
        if columns.iter().any(|(_, c)| c.name == name) || contents.ignored.contains(&name) {
            return Err(LogError::new(path, LogErrorKind::DuplicateName).column(&name));
        }
        // The elements of a list are called `name.list.element`; a log has no lists.
        if !(selection.column)(&name) && !(selection.column)(&descriptor.path().parts()[0]) {
            contents.ignored.push(name);
            continue;
        }
        if selection.lenient && number_scale(descriptor).is_none() {
            contents.ignored.push(name);
            continue;
        }
        if !selection.lenient {
            is_numeric(descriptor).map_err(|kind| LogError::new(path, kind).column(&name))?;
        }
        columns.push((index, Column { name, values: Vec::new() }));
    }
    let kept = columns.iter().filter(|(_, column)| selection.keeps(&column.name)).count();
    super::limits::check_size(rows, kept).map_err(|kind| LogError::new(path, kind))?;
    for (index, column) in &mut columns {
        let lenient = selection.lenient;
        let mut sink = ColumnSink {
            path,
            name: &column.name,
            is_time: column.name == "t_s" && !lenient,
            lenient,
            rows: 0,
            expected: rows,
            last: f64::NEG_INFINITY,
            values: &mut column.values,
            times: None,
        };
        let scale = if lenient { number_scale(&schema.columns()[*index]).unwrap_or(1.0) } else { 1.0 };
        if selection.keeps(sink.name) {
            sink.values.reserve_exact(rows.min(MAX_RESERVED_ROWS));
        } else {
            sink.times = selection.times.as_deref_mut();
        }
        for group in 0..reader.num_row_groups() {
            let reader = reader.get_row_group(group).and_then(|g| g.get_column_reader(*index));
            match reader.map_err(damaged)? {
                ColumnReader::DoubleColumnReader(r) => sink.all::<DoubleType>(r, |v| v)?,
                ColumnReader::FloatColumnReader(r) => sink.all::<parquet::data_type::FloatType>(r, f64::from)?,
                ColumnReader::Int32ColumnReader(r) => sink.all::<parquet::data_type::Int32Type>(r, |v| f64::from(v) * scale)?,
                ColumnReader::Int64ColumnReader(r) => sink.all::<parquet::data_type::Int64Type>(r, |v| v as f64 * scale)?,
                ColumnReader::BoolColumnReader(r) => sink.all::<parquet::data_type::BoolType>(r, |v| f64::from(u8::from(v)))?,
                _ => return Err(sink.error(LogErrorKind::NotNumeric("something else".to_owned()))),
            }
        }
        if sink.rows != rows {
            let message = format!("{} of {rows} values are present", sink.rows);
            return Err(sink.error(LogErrorKind::Parquet(message)));
        }
    }
    contents.columns = columns.into_iter().map(|(_, c)| c).collect();
    Ok(contents)
}

/// Checks the magic bytes at both ends of the file; returns its length, bytes.
fn check_magic_bytes(file: &mut File) -> Result<u64, LogErrorKind> {
    let length = file.metadata().map_err(LogErrorKind::Read)?.len();
    if length == 0 {
        return Err(LogErrorKind::Empty);
    }
    let mut begin = [0; 4];
    if length < 12 || file.read_exact(&mut begin).is_err() || &begin != b"PAR1" {
        return Err(LogErrorKind::NotParquet("; the name of a CSV file must end in .csv"));
    }
    let mut end = [0; 4];
    file.seek(SeekFrom::End(-4)).and_then(|_| file.read_exact(&mut end)).map_err(LogErrorKind::Read)?;
    file.rewind().map_err(LogErrorKind::Read)?;
    match &end {
        b"PAR1" => Ok(length),
        b"PARE" => Err(LogErrorKind::NotParquet(" that can be read; it is encrypted")),
        _ => Err(LogErrorKind::NotParquet("; its end is cut off, which contains the positions of the columns")),
    }
}

/// Checks that every column chunk lies inside the file.
fn check_offsets(meta: &ParquetMetaData, length: u64) -> Result<(), LogErrorKind> {
    for chunk in meta.row_groups().iter().flat_map(|group| group.columns()) {
        let begin = chunk.dictionary_page_offset().unwrap_or(chunk.data_page_offset()).min(chunk.data_page_offset());
        let end = u64::try_from(begin).ok().zip(u64::try_from(chunk.compressed_size()).ok()).and_then(|(b, size)| b.checked_add(size));
        if chunk.data_page_offset() < 0 || chunk.num_values() < 0 || end.is_none_or(|end| end > length) {
            return Err(LogErrorKind::Parquet("a column lies outside the file".to_owned()));
        }
    }
    Ok(())
}

/// Checks that the column contains numbers: no lists, times or decimals.
fn is_numeric(column: &ColumnDescriptor) -> Result<(), LogErrorKind> {
    use ConvertedType as C;
    if column.max_rep_level() > 0 || column.path().parts().len() > 1 {
        return Err(LogErrorKind::NotNumeric("lists or groups".to_owned()));
    }
    let integer = matches!(column.converted_type(), C::NONE | C::INT_8 | C::INT_16 | C::INT_32 | C::INT_64 | C::UINT_8 | C::UINT_16);
    match column.physical_type() {
        Physical::DOUBLE | Physical::FLOAT => Ok(()),
        Physical::INT32 | Physical::INT64 if integer && !is_time(column) => Ok(()),
        Physical::INT32 | Physical::INT64 => Err(LogErrorKind::NotNumeric("dates, decimals or unsigned integers".to_owned())),
        Physical::BOOLEAN => Err(LogErrorKind::NotNumeric("booleans".to_owned())),
        Physical::INT96 => Err(LogErrorKind::NotNumeric("dates".to_owned())),
        Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY => Err(LogErrorKind::NotNumeric("text or bytes".to_owned())),
    }
}

/// Size of a number of the column of another program's file: 1, or seconds for a point in time. `None` if the column has no numbers.
fn number_scale(column: &ColumnDescriptor) -> Option<f64> {
    use parquet::basic::{LogicalType as L, TimeUnit};
    if column.max_rep_level() > 0 || column.path().parts().len() > 1 {
        return None;
    }
    let of_unit = |unit: &TimeUnit| match unit {
        TimeUnit::MILLIS => 1e-3,
        TimeUnit::MICROS => 1e-6,
        TimeUnit::NANOS => 1e-9,
    };
    match (column.physical_type(), column.logical_type_ref()) {
        (Physical::DOUBLE | Physical::FLOAT | Physical::BOOLEAN, _) => Some(1.0),
        (Physical::INT32 | Physical::INT64, None | Some(L::Integer { .. })) => match column.converted_type() {
            ConvertedType::TIMESTAMP_MILLIS | ConvertedType::TIME_MILLIS => Some(1e-3),
            ConvertedType::TIMESTAMP_MICROS | ConvertedType::TIME_MICROS => Some(1e-6),
            ConvertedType::DECIMAL => None,
            _ => Some(1.0),
        },
        (Physical::INT32 | Physical::INT64, Some(L::Timestamp(time) | L::Time(time))) => Some(of_unit(&time.unit)),
        _ => None,
    }
}

/// The column has a logical type of times or decimals; times in nanoseconds have no converted type.
fn is_time(column: &ColumnDescriptor) -> bool {
    use parquet::basic::LogicalType as L;
    !matches!(column.logical_type_ref(), None | Some(L::Integer { .. }))
}

/// Takes the values of one column: checks each, then stores it or passes it to `times`.
struct ColumnSink<'a, 'b, 'c> {
    path: &'a Path,
    name: &'a str,
    is_time: bool,
    lenient: bool,
    rows: usize,
    /// Rows that the file states.
    expected: usize,
    last: f64,
    values: &'a mut Vec<f64>,
    times: Option<&'b mut (dyn FnMut(f64) + 'c)>,
}

impl ColumnSink<'_, '_, '_> {
    fn error(&self, kind: LogErrorKind) -> LogError {
        LogError::new(self.path, kind).column(self.name)
    }

    /// Takes one row group; a missing value is an error.
    fn all<T: DataType>(&mut self, mut reader: ColumnReaderImpl<T>, number: impl Fn(T::T) -> f64) -> Result<(), LogError> {
        let mut batch: Vec<T::T> = Vec::with_capacity(BATCH_ROWS);
        let mut levels: Vec<i16> = Vec::with_capacity(BATCH_ROWS);
        loop {
            batch.clear();
            levels.clear();
            let result = reader.read_records(BATCH_ROWS, Some(&mut levels), None, &mut batch);
            let (records, present, _) = result.map_err(|e| self.error(LogErrorKind::Parquet(e.to_string())))?;
            if present < records && self.lenient {
                let mut values = batch.drain(..);
                for level in &levels {
                    self.one(if *level == 0 { f64::NAN } else { values.next().map_or(f64::NAN, &number) })?;
                }
                continue;
            }
            if present < records {
                // The column is at most one level deep: level 1 means present.
                let before = levels.iter().position(|&l| l == 0).unwrap_or(0);
                for value in batch.drain(..before.min(batch.len())) {
                    self.one(number(value))?;
                }
                return Err(self.error(LogErrorKind::Null).row(self.rows + 1));
            }
            if records == 0 {
                return Ok(());
            }
            for value in batch.drain(..) {
                self.one(number(value))?;
            }
        }
    }

    #[inline]
    fn one(&mut self, value: f64) -> Result<(), LogError> {
        self.rows += 1;
        if self.rows > self.expected {
            return Err(self.error(LogErrorKind::Parquet(format!("more than the {} values that are stated", self.expected))));
        }
        if !value.is_finite() && !self.lenient {
            return Err(self.error(LogErrorKind::NotFinite(value.to_string())).row(self.rows));
        }
        if self.is_time {
            if value <= self.last {
                return Err(self.error(LogErrorKind::time(self.last, value)).row(self.rows));
            }
            self.last = value;
        }
        match &mut self.times {
            Some(times) => times(value),
            None => self.values.push(value),
        }
        Ok(())
    }
}

/// Writes rows in groups, for logs that may be longer than the memory.
pub struct GroupWriter<W: Write + Send> {
    writer: SerializedFileWriter<W>,
    columns: usize,
}

impl<W: Write + Send> GroupWriter<W> {
    /// Begins a file with these columns.
    pub(super) fn new(out: W, names: &[&str]) -> io::Result<Self> {
        let begin = || {
            let fields = names.iter().map(|name| {
                let field = Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::REQUIRED);
                Ok(Arc::new(field.build()?))
            });
            let fields = fields.collect::<Result<Vec<_>, ParquetError>>()?;
            let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build()?);
            let properties = WriterProperties::builder()
                .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
                .set_dictionary_enabled(false) // measured values hardly repeat: files are a tenth smaller, and are written faster
                .set_created_by(concat!("rotary stand ", env!("CARGO_PKG_VERSION")).to_owned());
            SerializedFileWriter::new(out, schema, Arc::new(properties.build()))
        };
        Ok(Self { writer: begin().map_err(io_error)?, columns: names.len() })
    }

    /// Adds notes.
    pub(super) fn notes(&mut self, notes: &[(String, String)]) {
        notes.iter().for_each(|(key, value)| self.writer.append_key_value_metadata(KeyValue::new(key.clone(), value.clone())));
    }

    /// Writes all rows of a log, which has the columns of the file.
    pub(super) fn rows(&mut self, log: &Log) -> io::Result<()> {
        if log.columns().len() != self.columns {
            let message = format!("a block of the log must have {} columns, not {}", self.columns, log.columns().len());
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        (0..log.len())
            .step_by(MAX_GROUP_ROWS)
            .try_for_each(|from| self.group(log, from..(from + MAX_GROUP_ROWS).min(log.len())).map_err(io_error))
    }

    fn group(&mut self, log: &Log, rows: Range<usize>) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for column in log.columns() {
            let Some(mut chunk) = group.next_column()? else { break };
            chunk.typed::<DoubleType>().write_batch(&column.values[rows.clone()], None, None)?;
            chunk.close()?;
        }
        group.close().map(drop)
    }

    /// Writes the end and flushes.
    pub(super) fn finish(self) -> io::Result<()> {
        self.writer.into_inner().map_err(io_error)?.flush()
    }
}

/// The error of the output behind an error of the parquet crate.
fn io_error(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(source) => match source.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(other) => io::Error::other(other),
        },
        other => io::Error::other(other),
    }
}
