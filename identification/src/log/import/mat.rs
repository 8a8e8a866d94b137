//! Reads tables from MATLAB files of version 5 (`save -v6`, `save -v7`).
//!
//! In: a `.mat` file. Out: a column for each numeric vector of the most frequent length, for each column of a matrix with that many rows
//! (`data_2`), and for each such field of a structure (`run.speed`). Other arrays are left out. Format: MathWorks, MAT-File Format
//! (R2024a), chapter 1.
//!
//! The crate matfile calls itself alpha software and skips structures, in which most loggers save; the format needs little more than its
//! tags. Files of version 7.3 are HDF5: [`super::hdf5`].

use std::io::Read;
use std::path::Path;

use flate2::read::ZlibDecoder;

use super::arrays::{Array, table};
use super::hdf5;
use super::table::Table;
use crate::log::error::{LogError, LogErrorKind};
use crate::log::limits;

/// Bytes before the first element.
const HEADER_BYTES: usize = 128;
/// Bytes of a number.
const NUMBER_BYTES: u64 = 8;
/// Structures within structures that are read at most.
const MAX_DEPTH: usize = 4;

/// Types of data elements.
mod data_type {
    pub const MATRIX: u32 = 14;
    pub const COMPRESSED: u32 = 15;
}
/// Classes of arrays.
mod class {
    pub const STRUCTURE: u8 = 2;
    pub const FIRST_NUMERIC: u8 = 6;
    pub const LAST_NUMERIC: u8 = 15;
}

/// Bytes from which text is told from an array: a binary file has others than printable ones among its first.
const SAMPLED_BYTES: usize = 512;

/// The file is text, which is no array of MATLAB whatever its ending says.
pub fn is_text(path: &Path) -> Result<bool, LogError> {
    let fail = |e: std::io::Error| LogError::new(path, LogErrorKind::Read(e));
    let mut sample = Vec::with_capacity(SAMPLED_BYTES);
    std::fs::File::open(path).map_err(fail)?.take(SAMPLED_BYTES as u64).read_to_end(&mut sample).map_err(fail)?;
    let is_printable = |b: &u8| b.is_ascii_graphic() || b.is_ascii_whitespace() || *b >= 0x80;
    Ok(!sample.is_empty() && !sample.starts_with(b"MATLAB") && sample.iter().all(is_printable))
}

/// Reads the table in `path`.
pub fn read(path: &Path) -> Result<Table, LogError> {
    let bytes = std::fs::read(path).map_err(|e| LogError::new(path, LogErrorKind::Read(e)))?;
    if hdf5::is_hdf5(&bytes) {
        return hdf5::read(path);
    }
    parse(&bytes).map_err(|kind| LogError::new(path, kind))
}

fn parse(bytes: &[u8]) -> Result<Table, LogErrorKind> {
    if bytes.is_empty() {
        return Err(LogErrorKind::Empty);
    }
    let little = match bytes.get(126..128) {
        Some(b"IM") => true,
        Some(b"MI") => false,
        _ => return Err(LogErrorKind::Matlab("this is not a MATLAB file of version 5, which save(…, '-v7') writes")),
    };
    let mut arrays = Vec::new();
    let mut elements = Elements { bytes: &bytes[HEADER_BYTES..], little };
    while let Some((kind, data)) = elements.next()? {
        if kind == data_type::COMPRESSED {
            let mut inner = Vec::new();
            // A stream without its end still gives its bytes.
            let most = limits::max_values().saturating_add(1).saturating_mul(NUMBER_BYTES);
            let read = ZlibDecoder::new(data).take(most).read_to_end(&mut inner);
            read.map_err(|_| LogErrorKind::Matlab("a compressed variable is damaged"))?;
            limits::check_size(inner.len() / NUMBER_BYTES as usize, 1)?;
            if let Some((data_type::MATRIX, data)) = (Elements { bytes: &inner, little }).next()? {
                matrix(data, little, "", 0, &mut arrays)?;
            }
        } else if kind == data_type::MATRIX {
            matrix(data, little, "", 0, &mut arrays)?;
        }
    }
    table(arrays)
}

/// The data elements of a file or of an array.
struct Elements<'a> {
    bytes: &'a [u8],
    little: bool,
}

impl<'a> Elements<'a> {
    fn word(&self, at: usize) -> Option<u32> {
        let bytes: [u8; 4] = self.bytes.get(at..at + 4)?.try_into().ok()?;
        Some(if self.little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    /// Type and data of the next element; `None` at the end.
    fn next(&mut self) -> Result<Option<(u32, &'a [u8])>, LogErrorKind> {
        const CUT: LogErrorKind = LogErrorKind::Matlab("the file is cut short");
        if self.bytes.len() < 8 {
            return Ok(None);
        }
        let (tag, size) = (self.word(0).ok_or(CUT)?, self.word(4).ok_or(CUT)?);
        if tag >> 16 != 0 {
            let size = (tag >> 16) as usize;
            let data = self.bytes.get(4..4 + size.min(4)).ok_or(CUT)?;
            self.bytes = &self.bytes[8..];
            return Ok(Some((tag & 0xffff, data)));
        }
        let size = size as usize;
        let data = self.bytes.get(8..8 + size).ok_or(CUT)?;
        // Elements are padded to eight bytes, compressed ones are not.
        let padded = if tag == data_type::COMPRESSED { size } else { size.div_ceil(8) * 8 };
        self.bytes = self.bytes.get(8 + padded..).unwrap_or(&[]);
        Ok(Some((tag, data)))
    }
}

/// Adds the numeric arrays of a matrix element.
fn matrix(data: &[u8], little: bool, prefix: &str, depth: usize, arrays: &mut Vec<Array>) -> Result<(), LogErrorKind> {
    let mut parts = Elements { bytes: data, little };
    let Some((_, flags)) = parts.next()? else { return Ok(()) };
    let class = if little { flags.first() } else { flags.get(3) }.copied().unwrap_or(0);
    let Some((kind, dimensions)) = parts.next()? else { return Ok(()) };
    let dimensions: Vec<usize> = numbers(kind, dimensions, little).into_iter().map(|d| d as usize).collect();
    let Some((_, name)) = parts.next()? else { return Ok(()) };
    let own = String::from_utf8_lossy(name).into_owned();
    let name = match (prefix, own.as_str()) {
        ("", _) => own,
        (prefix, "") => prefix.to_owned(),
        (prefix, own) => format!("{prefix}.{own}"),
    };
    let [rows, columns] = dimensions[..] else { return Ok(()) };
    if class == class::STRUCTURE && depth < MAX_DEPTH && rows == 1 && columns == 1 {
        let Some((kind, length)) = parts.next()? else { return Ok(()) };
        let length = numbers(kind, length, little).first().copied().unwrap_or(0.0) as usize;
        let Some((_, names)) = parts.next()? else { return Ok(()) };
        if length == 0 {
            return Ok(());
        }
        for field in names.chunks(length) {
            let Some((_, data)) = parts.next()? else { break };
            let field: String = field.iter().take_while(|b| **b != 0).map(|b| char::from(*b)).collect();
            matrix(data, little, &format!("{name}.{field}"), depth + 1, arrays)?;
        }
    } else if (class::FIRST_NUMERIC..=class::LAST_NUMERIC).contains(&class) {
        let Some((kind, data)) = parts.next()? else { return Ok(()) };
        let values = numbers(kind, data, little);
        if Some(values.len()) == rows.checked_mul(columns) {
            arrays.push(Array { name, rows, columns, values });
        }
    }
    Ok(())
}

/// The numbers of a data element of this type.
fn numbers(kind: u32, data: &[u8], little: bool) -> Vec<f64> {
    macro_rules! of {
        ($type:ty, $size:literal) => {
            data.chunks_exact($size)
                .filter_map(|b| <[u8; $size]>::try_from(b).ok())
                .map(|b| (if little { <$type>::from_le_bytes(b) } else { <$type>::from_be_bytes(b) }) as f64)
                .collect()
        };
    }
    match kind {
        1 => of!(i8, 1),
        2 => of!(u8, 1),
        3 => of!(i16, 2),
        4 => of!(u16, 2),
        5 => of!(i32, 4),
        6 => of!(u32, 4),
        7 => of!(f32, 4),
        9 => of!(f64, 8),
        12 => of!(i64, 8),
        13 => of!(u64, 8),
        _ => Vec::new(),
    }
}
