//! The table as a Parquet file: one row a log, Zstandard, lists of structures in the form that DuckDB, polars, pandas and Spark read
//! (three-level lists).

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::{Compression, ZstdLevel};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::record::{Field, Row as ParquetRow};
use parquet::schema::parser::parse_message_type;

use super::row::{Alternative, OutputError, ParameterValue, Row};
use identification::files;

/// Rows of a row group, at most.
const MAX_GROUP_ROWS: usize = 1 << 16;

/// The columns, in the order of the fields of [`Row`].
const SCHEMA: &str = "message answers {
    required binary path (STRING);
    optional binary sha256 (STRING);
    optional int64 bytes;
    optional int64 samples;
    optional double duration_s;
    optional int64 began (TIMESTAMP(MICROS, true));
    optional binary stand (STRING);
    optional binary device (STRING);
    optional binary batch (STRING);
    required binary model (STRING);
    required binary settings (STRING);
    required binary build (STRING);
    required binary verdict (STRING);
    required group effects (LIST) { repeated group list { required binary element (STRING); } }
    required group not_distinguishable (LIST) { repeated group list { required group element {
        required binary effect (STRING); required binary alternative (STRING); } } }
    required group parameters (LIST) { repeated group list { required group element {
        required binary name (STRING); required double value; optional double standard_uncertainty; required binary unit (STRING); } } }
    optional boolean uncertainty_is_lower_bound;
    required group outputs (LIST) { repeated group list { required group element {
        required binary output (STRING); required binary unit (STRING); required double noise; required double ratio_given; required double ratio; } } }
    optional binary error (STRING);
    optional int64 effort_limit_passes;
    optional double effort_passes;
    optional double time_limit_s;
    required double seconds;
}";

/// Why a table cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be opened, or the folder has no table.
    #[error("{path}: cannot read: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Cause.
        source: io::Error,
    },
    /// It is not a Parquet file.
    #[error("{path}: cannot be read as Parquet: {message}")]
    Parquet {
        /// The file.
        path: PathBuf,
        /// Cause.
        message: String,
    },
    /// It is another table.
    #[error("{path}: this is no table of stand explain --table: it has no column {column}")]
    Column {
        /// The file.
        path: PathBuf,
        /// The missing column.
        column: &'static str,
    },
}

/// Writes the table as a whole: a reader sees the previous one or the new one.
///
/// # Errors
/// The file system fails.
pub fn write(path: &Path, rows: &[Row]) -> io::Result<()> {
    files::replace(path, |out| {
        let mut bytes = Vec::new();
        encode(&mut bytes, rows).map_err(io::Error::other)?;
        out.write_all(&bytes)
    })
}

fn encode(out: &mut Vec<u8>, rows: &[Row]) -> Result<(), ParquetError> {
    let properties = WriterProperties::builder().set_compression(Compression::ZSTD(ZstdLevel::default())).build();
    let schema = Arc::new(parse_message_type(SCHEMA)?);
    let mut writer = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    for rows in rows.chunks(MAX_GROUP_ROWS) {
        let mut group = GroupWriter { group: writer.next_row_group()?, rows };
        group.required::<ByteArrayType>(|r| text(&r.path))?;
        group.optional::<ByteArrayType>(|r| r.sha256.as_deref().map(text))?;
        group.optional::<Int64Type>(|r| r.bytes)?;
        group.optional::<Int64Type>(|r| r.samples)?;
        group.optional::<DoubleType>(|r| r.duration_s)?;
        group.optional::<Int64Type>(|r| r.began_us)?;
        group.optional::<ByteArrayType>(|r| r.stand.as_deref().map(text))?;
        group.optional::<ByteArrayType>(|r| r.device.as_deref().map(text))?;
        group.optional::<ByteArrayType>(|r| r.batch.as_deref().map(text))?;
        group.required::<ByteArrayType>(|r| text(&r.model))?;
        group.required::<ByteArrayType>(|r| text(&r.settings))?;
        group.required::<ByteArrayType>(|r| text(&r.build))?;
        group.required::<ByteArrayType>(|r| text(&r.verdict))?;
        group.list::<ByteArrayType, _>(|r| &r.effects, |e| text(e))?;
        group.list::<ByteArrayType, _>(|r| &r.not_distinguishable, |a| text(&a.effect))?;
        group.list::<ByteArrayType, _>(|r| &r.not_distinguishable, |a| text(&a.alternative))?;
        group.list::<ByteArrayType, _>(|r| &r.parameters, |p| text(&p.name))?;
        group.list::<DoubleType, _>(|r| &r.parameters, |p| p.value)?;
        group.list_of_optional::<DoubleType, _>(|r| &r.parameters, |p| p.standard_uncertainty)?;
        group.list::<ByteArrayType, _>(|r| &r.parameters, |p| text(&p.unit))?;
        group.optional::<BoolType>(|r| r.uncertainty_is_lower_bound)?;
        group.list::<ByteArrayType, _>(|r| &r.outputs, |o| text(&o.output))?;
        group.list::<ByteArrayType, _>(|r| &r.outputs, |o| text(&o.unit))?;
        group.list::<DoubleType, _>(|r| &r.outputs, |o| o.noise)?;
        group.list::<DoubleType, _>(|r| &r.outputs, |o| o.ratio_given)?;
        group.list::<DoubleType, _>(|r| &r.outputs, |o| o.ratio)?;
        group.optional::<ByteArrayType>(|r| r.error.as_deref().map(text))?;
        group.optional::<Int64Type>(|r| r.effort_limit_passes)?;
        group.optional::<DoubleType>(|r| r.effort_passes)?;
        group.optional::<DoubleType>(|r| r.time_limit_s)?;
        group.required::<DoubleType>(|r| r.seconds)?;
        group.group.close()?;
    }
    writer.close().map(drop)
}

fn text(text: &str) -> ByteArray {
    ByteArray::from(text)
}

/// Writes the columns of a row group one after the other. Levels as in the format's specification: an optional value has definition level 1
/// where it is present; an element of a list has definition level 1 (2 for a value that may be absent in it), an empty list 0; repetition
/// level 1 continues a list.
struct GroupWriter<'a, 'b> {
    group: SerializedRowGroupWriter<'b, &'a mut Vec<u8>>,
    rows: &'a [Row],
}

impl<'a> GroupWriter<'a, '_> {
    fn write<T: DataType>(&mut self, values: &[T::T], definition: Option<&[i16]>, repetition: Option<&[i16]>) -> Result<(), ParquetError> {
        let mut column = self.group.next_column()?.ok_or_else(|| ParquetError::General("the schema has fewer columns".to_owned()))?;
        column.typed::<T>().write_batch(values, definition, repetition)?;
        column.close()
    }

    fn required<T: DataType>(&mut self, value: impl Fn(&Row) -> T::T) -> Result<(), ParquetError> {
        let values: Vec<T::T> = self.rows.iter().map(value).collect();
        self.write::<T>(&values, None, None)
    }

    fn optional<T: DataType>(&mut self, value: impl Fn(&Row) -> Option<T::T>) -> Result<(), ParquetError> {
        let all: Vec<Option<T::T>> = self.rows.iter().map(value).collect();
        let levels: Vec<i16> = all.iter().map(|v| i16::from(v.is_some())).collect();
        let values: Vec<T::T> = all.into_iter().flatten().collect();
        self.write::<T>(&values, Some(&levels), None)
    }

    fn list<T: DataType, E: 'a>(&mut self, list: impl Fn(&'a Row) -> &'a Vec<E>, value: impl Fn(&E) -> T::T) -> Result<(), ParquetError> {
        self.list_with::<T, E>(list, |element| (1, Some(value(element))))
    }

    fn list_of_optional<T: DataType, E: 'a>(
        &mut self,
        list: impl Fn(&'a Row) -> &'a Vec<E>,
        value: impl Fn(&E) -> Option<T::T>,
    ) -> Result<(), ParquetError> {
        self.list_with::<T, E>(list, |element| {
            let value = value(element);
            (1 + i16::from(value.is_some()), value)
        })
    }

    fn list_with<T: DataType, E: 'a>(
        &mut self,
        list: impl Fn(&'a Row) -> &'a Vec<E>,
        value: impl Fn(&E) -> (i16, Option<T::T>),
    ) -> Result<(), ParquetError> {
        let (mut values, mut definition, mut repetition) = (Vec::new(), Vec::new(), Vec::new());
        let rows = self.rows;
        for row in rows {
            let elements = list(row);
            if elements.is_empty() {
                definition.push(0);
                repetition.push(0);
            }
            for (k, element) in elements.iter().enumerate() {
                let (level, value) = value(element);
                definition.push(level);
                repetition.push(i16::from(k > 0));
                values.extend(value);
            }
        }
        self.write::<T>(&values, Some(&definition), Some(&repetition))
    }
}

/// Reads tables: files, or folders whose `.parquet` files are tables.
///
/// # Errors
/// A file cannot be read, or is no table.
pub fn read(paths: &[PathBuf]) -> Result<Vec<Row>, TableError> {
    let mut rows = Vec::new();
    for path in paths {
        if path.is_dir() {
            for file in tables_in(path).map_err(|source| TableError::Read { path: path.clone(), source })? {
                read_file(&file, &mut rows)?;
            }
        } else {
            read_file(path, &mut rows)?;
        }
    }
    Ok(rows)
}

fn tables_in(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder)?.collect::<Result<Vec<_>, _>>()?;
    let mut tables: Vec<PathBuf> =
        entries.into_iter().map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "parquet")).collect();
    tables.sort();
    if tables.is_empty() {
        Err(io::Error::new(io::ErrorKind::NotFound, "the folder has no file that ends in .parquet"))
    } else {
        Ok(tables)
    }
}

fn read_file(path: &Path, rows: &mut Vec<Row>) -> Result<(), TableError> {
    let failed = |error: ParquetError| TableError::Parquet { path: path.to_owned(), message: error.to_string() };
    let file = File::open(path).map_err(|source| TableError::Read { path: path.to_owned(), source })?;
    let reader = SerializedFileReader::new(file).map_err(failed)?;
    let columns: Vec<String> = reader.metadata().file_metadata().schema().get_fields().iter().map(|f| f.name().to_owned()).collect();
    for column in ["path", "verdict", "effects", "parameters", "began", "stand", "batch"] {
        if !columns.iter().any(|name| name == column) {
            return Err(TableError::Column { path: path.to_owned(), column });
        }
    }
    for row in reader.get_row_iter(None).map_err(failed)? {
        rows.push(row_of(&row.map_err(failed)?));
    }
    Ok(())
}

fn row_of(columns: &ParquetRow) -> Row {
    let mut row = Row::default();
    for (name, field) in columns.get_column_iter() {
        match name.as_str() {
            "path" => row.path = words(field),
            "sha256" => row.sha256 = word(field),
            "bytes" => row.bytes = whole(field),
            "samples" => row.samples = whole(field),
            "duration_s" => row.duration_s = number(field),
            "began" => row.began_us = whole(field),
            "stand" => row.stand = word(field),
            "device" => row.device = word(field),
            "batch" => row.batch = word(field),
            "model" => row.model = words(field),
            "settings" => row.settings = words(field),
            "build" => row.build = words(field),
            "verdict" => row.verdict = words(field),
            "effects" => row.effects = elements(field).iter().map(words).collect(),
            "not_distinguishable" => {
                row.not_distinguishable = structures(field, |a: &mut Alternative, name, field| match name {
                    "effect" => a.effect = words(field),
                    "alternative" => a.alternative = words(field),
                    _ => {}
                })
            }
            "parameters" => {
                row.parameters = structures(field, |p: &mut ParameterValue, name, field| match name {
                    "name" => p.name = words(field),
                    "value" => p.value = number(field).unwrap_or(f64::NAN),
                    "standard_uncertainty" => p.standard_uncertainty = number(field),
                    "unit" => p.unit = words(field),
                    _ => {}
                })
            }
            "uncertainty_is_lower_bound" => row.uncertainty_is_lower_bound = if let Field::Bool(flag) = field { Some(*flag) } else { None },
            "outputs" => {
                row.outputs = structures(field, |o: &mut OutputError, name, field| match name {
                    "output" => o.output = words(field),
                    "unit" => o.unit = words(field),
                    "noise" => o.noise = number(field).unwrap_or(f64::NAN),
                    "ratio_given" => o.ratio_given = number(field).unwrap_or(f64::NAN),
                    "ratio" => o.ratio = number(field).unwrap_or(f64::NAN),
                    _ => {}
                })
            }
            "error" => row.error = word(field),
            "effort_limit_passes" => row.effort_limit_passes = whole(field),
            "effort_passes" => row.effort_passes = number(field),
            "time_limit_s" => row.time_limit_s = number(field),
            "seconds" => row.seconds = number(field).unwrap_or(0.0),
            _ => {}
        }
    }
    row
}

fn word(field: &Field) -> Option<String> {
    if let Field::Str(text) = field { Some(text.clone()) } else { None }
}

fn words(field: &Field) -> String {
    word(field).unwrap_or_default()
}

fn number(field: &Field) -> Option<f64> {
    if let Field::Double(value) = field { Some(*value) } else { None }
}

fn whole(field: &Field) -> Option<i64> {
    match field {
        Field::Long(value) | Field::TimestampMicros(value) => Some(*value),
        Field::TimestampMillis(value) => value.checked_mul(1000),
        _ => None,
    }
}

fn elements(field: &Field) -> &[Field] {
    if let Field::ListInternal(list) = field { list.elements() } else { &[] }
}

fn structures<T: Default>(field: &Field, set: impl Fn(&mut T, &str, &Field)) -> Vec<T> {
    let structure = |field: &Field| {
        let mut value = T::default();
        if let Field::Group(columns) = field {
            columns.get_column_iter().for_each(|(name, field)| set(&mut value, name, field));
        }
        value
    };
    elements(field).iter().map(structure).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn table_is_read_as_it_was_written() {
        let full = Row {
            path: "a.csv".to_owned(),
            sha256: Some("00ff".to_owned()),
            bytes: Some(17),
            samples: Some(3000),
            duration_s: Some(3.0),
            began_us: Some(1_790_000_000_000_001),
            stand: Some("Prüfstand 1".to_owned()),
            device: None,
            batch: Some("7".to_owned()),
            model: "drive".to_owned(),
            settings: "abc".to_owned(),
            build: "0.1.0".to_owned(),
            verdict: "effect-found".to_owned(),
            effects: vec!["cogging".to_owned(), "load".to_owned()],
            not_distinguishable: vec![Alternative { effect: "load".to_owned(), alternative: "asymmetric-friction".to_owned() }],
            parameters: vec![
                ParameterValue {
                    name: "inertia_kg_m2".to_owned(),
                    value: 2.5e-4,
                    standard_uncertainty: Some(1e-7),
                    unit: "kg m²".to_owned(),
                },
                ParameterValue { name: "cogging_order".to_owned(), value: 8.0, standard_uncertainty: None, unit: String::new() },
            ],
            uncertainty_is_lower_bound: Some(false),
            outputs: vec![OutputError { output: "i_A".to_owned(), unit: "A".to_owned(), noise: 1e-3, ratio_given: 9.0, ratio: 1.0 }],
            error: None,
            effort_limit_passes: Some(400_000),
            effort_passes: Some(1234.5),
            time_limit_s: Some(60.0),
            seconds: 0.5,
        };
        let rows = vec![
            Row::failed("b.csv", None, "no such file".to_owned()),
            full,
            Row::failed("c.csv", Some(("11".to_owned(), 0)), "empty".to_owned()),
        ];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("answers.parquet");
        write(&path, &rows).unwrap();
        assert_eq!(read(std::slice::from_ref(&path)).unwrap(), rows);
        assert_eq!(read(&[folder.path().to_owned()]).unwrap(), rows);
        write(&path, &[]).unwrap();
        assert!(read(&[path]).unwrap().is_empty());
    }

    #[test]
    fn other_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.parquet");
        std::fs::write(&path, "text").unwrap();
        assert!(matches!(read(std::slice::from_ref(&path)), Err(TableError::Parquet { .. })));
        assert!(matches!(read(&[folder.path().join("none.parquet")]), Err(TableError::Read { .. })));
    }
}
