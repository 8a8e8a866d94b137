//! A log from and to Parquet, column by column; notes are the file's key-value metadata.
//!
//! Read: double, float, 32- and 64-bit integers in any codec that pandas writes. Written: doubles, none of them optional, Zstandard,
//! row groups of at most a million rows. The low-level readers and writers of the parquet crate serve; Arrow is not needed.

use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
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

use super::error::{LogError, Trouble};
use super::{Column, Log, Parts, Wanted};

/// Rows of a row group that we write.
const GROUP_ROWS: usize = 1 << 20;
/// Rows that are decoded at once.
const BATCH_ROWS: usize = 1 << 16;
/// Metadata of other programs, about their own types.
const NOT_NOTES: [&str; 2] = ["ARROW:schema", "pandas"];

/// Most rows that are reserved at once on the file's own account of its length.
const MOST_RESERVED: usize = 1 << 26;

/// Reads the columns that are wanted, checks each number, and that time rises.
pub(super) fn read(path: &Path, wanted: &mut Wanted<'_>) -> Result<Parts, LogError> {
    // The parquet crate asserts where a damaged file contradicts itself; what is known of that is checked before.
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| read_columns(path, wanted)))
        .unwrap_or_else(|_| Err(LogError::new(path, Trouble::Parquet("its parts contradict each other".to_owned()))))
}

fn read_columns(path: &Path, wanted: &mut Wanted<'_>) -> Result<Parts, LogError> {
    let damaged = |e: ParquetError| LogError::new(path, Trouble::Parquet(e.to_string()));
    let mut file = File::open(path).map_err(|e| LogError::new(path, Trouble::Read(e)))?;
    let length = check_marks(&mut file).map_err(|trouble| LogError::new(path, trouble))?;
    let reader = SerializedFileReader::new(file).map_err(damaged)?;
    check_places(reader.metadata(), length).map_err(|trouble| LogError::new(path, trouble))?;
    let meta = reader.metadata().file_metadata();
    let mut parts = Parts::default();
    for pair in meta.key_value_metadata().into_iter().flatten() {
        if !NOT_NOTES.contains(&pair.key.as_str()) {
            parts.notes.push((pair.key.clone(), pair.value.clone().unwrap_or_default()));
        }
    }
    let rows = usize::try_from(meta.num_rows()).unwrap_or(0);
    let schema = meta.schema_descr();
    let mut columns: Vec<(usize, Column)> = Vec::new();
    for (index, descriptor) in schema.columns().iter().enumerate() {
        let name = descriptor.path().parts().join(".");
        if columns.iter().any(|(_, c)| c.name == name) || parts.ignored.contains(&name) {
            return Err(LogError::new(path, Trouble::Doubled).column(&name));
        }
        // A list's leaves are called `name.list.element`: of no use, and no column of ours.
        if !(wanted.column)(&name) && !(wanted.column)(&descriptor.path().parts()[0]) {
            parts.ignored.push(name);
            continue;
        }
        is_numeric(descriptor).map_err(|trouble| LogError::new(path, trouble).column(&name))?;
        columns.push((index, Column { name, values: Vec::new() }));
    }
    for (index, column) in &mut columns {
        let is_time = column.name == "t_s";
        let mut take =
            Taken { path, name: &column.name, is_time, rows: 0, last: f64::NEG_INFINITY, values: &mut column.values, times: None };
        if wanted.keeps(take.name) {
            take.values.reserve_exact(rows.min(MOST_RESERVED));
        } else {
            take.times = wanted.times.as_deref_mut();
        }
        for group in 0..reader.num_row_groups() {
            let reader = reader.get_row_group(group).and_then(|g| g.get_column_reader(*index));
            match reader.map_err(damaged)? {
                ColumnReader::DoubleColumnReader(r) => take.all::<DoubleType>(r, |v| v)?,
                ColumnReader::FloatColumnReader(r) => take.all::<parquet::data_type::FloatType>(r, f64::from)?,
                ColumnReader::Int32ColumnReader(r) => take.all::<parquet::data_type::Int32Type>(r, f64::from)?,
                ColumnReader::Int64ColumnReader(r) => take.all::<parquet::data_type::Int64Type>(r, |v| v as f64)?,
                _ => return Err(take.error(Trouble::NotNumeric("something else".to_owned()))),
            }
        }
        if take.rows != rows {
            let says = format!("{} of {rows} values are there", take.rows);
            return Err(take.error(Trouble::Parquet(says)));
        }
    }
    parts.columns = columns.into_iter().map(|(_, c)| c).collect();
    Ok(parts)
}

/// The file begins and ends as Parquet does, in words where it does not; its length, bytes.
fn check_marks(file: &mut File) -> Result<u64, Trouble> {
    let length = file.metadata().map_err(Trouble::Read)?.len();
    if length == 0 {
        return Err(Trouble::Empty);
    }
    let mut begin = [0; 4];
    if length < 12 || file.read_exact(&mut begin).is_err() || &begin != b"PAR1" {
        return Err(Trouble::NotParquet("; if it is CSV text, let its name end in .csv"));
    }
    let mut end = [0; 4];
    file.seek(SeekFrom::End(-4)).and_then(|_| file.read_exact(&mut end)).map_err(Trouble::Read)?;
    file.rewind().map_err(Trouble::Read)?;
    match &end {
        b"PAR1" => Ok(length),
        b"PARE" => Err(Trouble::NotParquet(" that can be read: it is encrypted")),
        _ => Err(Trouble::NotParquet(" any more: its end is cut off, and the end says where the columns are")),
    }
}

/// Every column chunk lies inside the file.
fn check_places(meta: &ParquetMetaData, length: u64) -> Result<(), Trouble> {
    for chunk in meta.row_groups().iter().flat_map(|group| group.columns()) {
        let begin = chunk.dictionary_page_offset().unwrap_or(chunk.data_page_offset()).min(chunk.data_page_offset());
        let end = u64::try_from(begin).ok().zip(u64::try_from(chunk.compressed_size()).ok()).and_then(|(b, size)| b.checked_add(size));
        if chunk.data_page_offset() < 0 || chunk.num_values() < 0 || end.is_none_or(|end| end > length) {
            return Err(Trouble::Parquet("a column lies outside the file".to_owned()));
        }
    }
    Ok(())
}

/// Plain numbers only: no lists, no times, no decimals.
fn is_numeric(column: &ColumnDescriptor) -> Result<(), Trouble> {
    use ConvertedType as C;
    if column.max_rep_level() > 0 || column.path().parts().len() > 1 {
        return Err(Trouble::NotNumeric("lists or groups".to_owned()));
    }
    let integer = matches!(column.converted_type(), C::NONE | C::INT_8 | C::INT_16 | C::INT_32 | C::INT_64 | C::UINT_8 | C::UINT_16);
    match column.physical_type() {
        Physical::DOUBLE | Physical::FLOAT => Ok(()),
        Physical::INT32 | Physical::INT64 if integer && !is_time(column) => Ok(()),
        Physical::INT32 | Physical::INT64 => Err(Trouble::NotNumeric("dates, decimals or unsigned integers".to_owned())),
        Physical::BOOLEAN => Err(Trouble::NotNumeric("yes and no".to_owned())),
        Physical::INT96 => Err(Trouble::NotNumeric("dates".to_owned())),
        Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY => Err(Trouble::NotNumeric("text or bytes".to_owned())),
    }
}

/// Times of nanoseconds have a logical type and no converted one.
fn is_time(column: &ColumnDescriptor) -> bool {
    use parquet::basic::LogicalType as L;
    !matches!(column.logical_type_ref(), None | Some(L::Integer { .. }))
}

/// One column under way: each number is checked, then kept or, where it is a time that somebody listens to, told.
struct Taken<'a, 'b, 'c> {
    path: &'a Path,
    name: &'a str,
    is_time: bool,
    rows: usize,
    last: f64,
    values: &'a mut Vec<f64>,
    times: Option<&'b mut (dyn FnMut(f64) + 'c)>,
}

impl Taken<'_, '_, '_> {
    fn error(&self, trouble: Trouble) -> LogError {
        LogError::new(self.path, trouble).column(self.name)
    }

    /// One row group; a missing value is an error.
    fn all<T: DataType>(&mut self, mut reader: ColumnReaderImpl<T>, number: impl Fn(T::T) -> f64) -> Result<(), LogError> {
        let mut batch: Vec<T::T> = Vec::with_capacity(BATCH_ROWS);
        let mut levels: Vec<i16> = Vec::with_capacity(BATCH_ROWS);
        loop {
            batch.clear();
            levels.clear();
            let result = reader.read_records(BATCH_ROWS, Some(&mut levels), None, &mut batch);
            let (records, present, _) = result.map_err(|e| self.error(Trouble::Parquet(e.to_string())))?;
            if present < records {
                // At most one level deep: present is 1.
                let before = levels.iter().position(|&l| l == 0).unwrap_or(0);
                for value in batch.drain(..before.min(batch.len())) {
                    self.one(number(value))?;
                }
                return Err(self.error(Trouble::Null).row(self.rows + 1));
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
        if !value.is_finite() {
            return Err(self.error(Trouble::NotFinite(value.to_string())).row(self.rows));
        }
        if self.is_time {
            if value <= self.last {
                return Err(self.error(Trouble::time(self.last, value)).row(self.rows));
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

/// Writes the whole log.
pub(super) fn write(log: &Log, path: &Path) -> Result<(), LogError> {
    let file = File::create(path).map_err(|e| LogError::new(path, Trouble::Write(e)))?;
    write_groups(log, BufWriter::new(file)).map_err(|e| {
        let e = std::io::Error::other(e.to_string());
        LogError::new(path, Trouble::Write(e))
    })
}

fn write_groups(log: &Log, out: BufWriter<File>) -> Result<(), ParquetError> {
    let fields = log.columns().iter().map(|c| {
        let field = Type::primitive_type_builder(&c.name, Physical::DOUBLE).with_repetition(Repetition::REQUIRED);
        Ok(Arc::new(field.build()?))
    });
    let fields = fields.collect::<Result<Vec<_>, ParquetError>>()?;
    let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build()?);
    let notes = log.notes().iter().map(|(k, v)| KeyValue::new(k.clone(), v.clone())).collect();
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
        .set_key_value_metadata(Some(notes))
        .set_created_by(concat!("rotary stand ", env!("CARGO_PKG_VERSION")).to_owned());
    let mut writer = SerializedFileWriter::new(out, schema, Arc::new(properties.build()))?;
    for from in (0..log.len()).step_by(GROUP_ROWS) {
        let rows = from..(from + GROUP_ROWS).min(log.len());
        let mut group = writer.next_row_group()?;
        for column in log.columns() {
            let Some(mut chunk) = group.next_column()? else { break };
            chunk.typed::<DoubleType>().write_batch(&column.values[rows.clone()], None, None)?;
            chunk.close()?;
        }
        group.close()?;
    }
    let mut out = writer.into_inner()?;
    out.flush()?;
    Ok(())
}
