//! Reads a log from CSV text line by line: memory for the columns and one line.
//!
//! The csv crate is not used: it drops comment lines, which are the notes of a log, and a log has no quoted line breaks.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use super::csv_write::{ENDS_WITH, ROWS, RowsDigest, SHA256};
use super::error::{LogError, LogErrorKind};
use super::warning::LogWarning;
use super::{Column, FileContents, Selection};

/// Longest line, bytes: a file without line breaks must not fill the memory.
const MAX_LINE_BYTES: u64 = 1 << 20;
/// Memory is reserved for at most this number of rows; the size of the file may be misleading.
const MAX_RESERVED_ROWS: usize = 1 << 26;

/// Reads the selected columns; checks that each cell is a number and that time increases.
pub(super) fn read(path: &Path, selection: &mut Selection<'_>) -> Result<FileContents, LogError> {
    let file = File::open(path).map_err(|e| LogError::new(path, LogErrorKind::Read(e)))?;
    let bytes = file.metadata().map(|m| m.len()).unwrap_or(0);
    let mut lines = Lines { path, input: BufReader::with_capacity(1 << 18, file), text: Vec::with_capacity(256), number: 0, ended: true };
    let mut contents = FileContents::default();
    let Some(header) = header(&mut lines, &mut contents, selection.column)? else {
        let kind = if contents.notes.is_empty() { LogErrorKind::Empty } else { LogErrorKind::NotesOnly };
        return Err(LogError::new(path, kind));
    };
    contents.ignored = header.iter().filter(|c| c.target.is_none()).map(|c| c.name.clone()).collect();

    // Only a log that announces its end is hashed; a Parquet file without its end cannot be read at all.
    let mut digest = contents.notes.take_text(ENDS_WITH).map(|_| RowsDigest::default());
    let mut row = 0;
    let mut last_t_s = f64::NEG_INFINITY;
    while lines.next()? {
        if let Some(note) = note(&lines)? {
            contents.notes.push_text(note.0, note.1);
            continue;
        }
        if lines.is_blank() {
            continue;
        }
        if digest.is_some() && !lines.ended {
            // The writer ends each row with a line break: it was stopped within this one.
            contents.warnings.push(LogWarning::RowCutShort { line: lines.number });
            break;
        }
        row += 1;
        if row == 1 {
            let rows = (bytes / (lines.text.len() as u64 + 1)) as usize + 16;
            let kept = contents.columns.iter_mut().filter(|c| selection.keeps(&c.name));
            kept.for_each(|c| c.values.reserve(rows.min(MAX_RESERVED_ROWS)));
        }
        if let Err(error) = take_row(path, &lines.text, &header, &mut contents.columns, &mut last_t_s, &mut selection.times) {
            let line = lines.number;
            let has = count_cells(&lines.text);
            // A short row before blank lines only, or an incomplete number at the end of the file, is an interrupted recording.
            let cut = match *error.kind {
                LogErrorKind::CellCount { has, expected, .. } if has < expected => only_blank_follows(&mut lines)?,
                LogErrorKind::NotANumber { .. } | LogErrorKind::EmptyCell => !lines.ended && has == header.len(),
                _ => false,
            };
            let error = if cut { LogError::new(path, LogErrorKind::CutShort { has, expected: header.len() }) } else { error };
            return Err(error.row(row).line(line));
        }
        if let Some(digest) = &mut digest {
            digest.take(&lines.text);
        }
    }
    if let Some(digest) = digest {
        let found = digest.values();
        let [rows, sha256] = [ROWS, SHA256].map(|key| contents.notes.take_text(key));
        contents.warnings.extend(match (rows, sha256) {
            (Some(rows), Some(sha256)) if [&rows, &sha256] == [&found[0], &found[1]] => None,
            (Some(written), Some(_)) => Some(LogWarning::RowsChanged { rows: row, written }),
            _ => Some(LogWarning::EndMissing { rows: row }),
        });
    } else if row > 0 && !lines.ended {
        contents.warnings.push(LogWarning::UnterminatedRow { line: lines.number });
    }
    contents.columns.iter_mut().for_each(|c| c.values.shrink_to_fit());
    Ok(contents)
}

/// A column of the header.
struct Cell {
    name: String,
    /// Index among the selected columns; `None` if the column is not selected.
    target: Option<usize>,
    is_time: bool,
}

/// Reads the notes before the header, and the header; `None` if the file ends before the header.
fn header(lines: &mut Lines<'_>, contents: &mut FileContents, selection: &dyn Fn(&str) -> bool) -> Result<Option<Vec<Cell>>, LogError> {
    while lines.next()? {
        if let Some(note) = note(lines)? {
            contents.notes.push_text(note.0, note.1);
            continue;
        }
        if lines.is_blank() {
            continue;
        }
        let fail = |kind| LogError::new(lines.path, kind).line(lines.number);
        let text = std::str::from_utf8(&lines.text).map_err(|_| fail(LogErrorKind::NotText("")))?;
        let names: Vec<&str> = text.split(',').map(unquoted).collect();
        super::limits::check_columns(names.len()).map_err(fail)?;
        if names.len() == 1 {
            for (mark, name) in [(';', "semicolons"), ('\t', "tabs")] {
                if text.contains(mark) {
                    return Err(fail(LogErrorKind::Separator(name)));
                }
            }
        }
        if names.iter().all(|n| n.parse::<f64>().is_ok()) {
            return Err(fail(LogErrorKind::NoHeader));
        }
        let mut header: Vec<Cell> = Vec::with_capacity(names.len());
        for (k, &name) in names.iter().enumerate() {
            if name.is_empty() {
                return Err(fail(LogErrorKind::EmptyName(k + 1)));
            }
            if header.iter().any(|c| c.name == name) {
                return Err(fail(LogErrorKind::DuplicateName).column(name));
            }
            let target = selection(name).then_some(contents.columns.len());
            if target.is_some() {
                contents.columns.push(Column { name: name.to_owned(), values: Vec::new() });
            }
            header.push(Cell { name: name.to_owned(), target, is_time: name == "t_s" });
        }
        return Ok(Some(header));
    }
    Ok(None)
}

/// Adds one row to the columns. After an error the columns may have different lengths; reading ends then.
fn take_row(
    path: &Path,
    text: &[u8],
    header: &[Cell],
    columns: &mut [Column],
    last_t_s: &mut f64,
    times: &mut Option<&mut dyn FnMut(f64)>,
) -> Result<(), LogError> {
    let mut cells = text.split(|&b| b == b',');
    for cell in header {
        let Some(bytes) = cells.next() else { return Err(wrong_count(path, text, header)) };
        let Some(target) = cell.target else { continue };
        let value = match std::str::from_utf8(bytes).ok().and_then(|t| t.parse::<f64>().ok()) {
            Some(value) if value.is_finite() => value,
            _ => match number(bytes) {
                Ok(value) => value,
                // If both the cell and the count are wrong, the count is more informative.
                Err(_) if count_cells(text) != header.len() => return Err(wrong_count(path, text, header)),
                Err(kind) => return Err(LogError::new(path, kind).column(&cell.name)),
            },
        };
        if cell.is_time {
            if value <= *last_t_s {
                if count_cells(text) != header.len() {
                    return Err(wrong_count(path, text, header));
                }
                return Err(LogError::new(path, LogErrorKind::time(*last_t_s, value)).column(&cell.name));
            }
            *last_t_s = value;
            if let Some(times) = times {
                times(value);
                continue;
            }
        }
        columns[target].values.push(value);
    }
    if cells.next().is_some() { Err(wrong_count(path, text, header)) } else { Ok(()) }
}

fn count_cells(text: &[u8]) -> usize {
    text.iter().filter(|&&b| b == b',').count() + 1
}

fn wrong_count(path: &Path, text: &[u8], header: &[Cell]) -> LogError {
    let (has, expected) = (count_cells(text), header.len());
    LogError::new(path, LogErrorKind::CellCount { has, expected, comma: has > expected && has <= 2 * expected })
}

/// Parses a number with spaces or quotes, or returns the defect.
fn number(bytes: &[u8]) -> Result<f64, LogErrorKind> {
    let text = String::from_utf8_lossy(bytes);
    let text = unquoted(&text);
    if text.is_empty() {
        return Err(LogErrorKind::EmptyCell);
    }
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(LogErrorKind::NotFinite(text.to_owned())),
        Err(_) => {
            let hint = if text.contains(',') || text.contains(';') {
                " (a decimal comma? use decimal points, and commas between columns)"
            } else if text.starts_with(|c: char| c.is_ascii_digit() || c == '-') && text.ends_with(char::is_alphabetic) {
                " (units belong in the column name)"
            } else {
                ""
            };
            Err(LogErrorKind::NotANumber { text: text.chars().take(40).collect(), hint })
        }
    }
}

fn unquoted(text: &str) -> &str {
    let text = text.trim();
    text.strip_prefix('"').and_then(|t| t.strip_suffix('"')).map_or(text, str::trim)
}

/// The note in a line that begins with `#`.
fn note(lines: &Lines<'_>) -> Result<Option<(String, String)>, LogError> {
    let Some(text) = lines.text.strip_prefix(b"#") else { return Ok(None) };
    let text = std::str::from_utf8(text).map_err(|_| LogError::new(lines.path, LogErrorKind::NotText("")).line(lines.number))?;
    let (key, value) = text.split_once(':').unwrap_or(("comment", text));
    Ok(Some((key.trim().to_owned(), value.trim().to_owned())))
}

fn only_blank_follows(lines: &mut Lines<'_>) -> Result<bool, LogError> {
    while lines.next()? {
        if !lines.is_blank() {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The lines of a file, without CR, LF and byte order mark; one buffer serves all lines.
struct Lines<'a> {
    path: &'a Path,
    input: BufReader<File>,
    text: Vec<u8>,
    /// Number of the line in `text`, from 1.
    number: usize,
    /// The line ended with a line break.
    ended: bool,
}

impl Lines<'_> {
    fn next(&mut self) -> Result<bool, LogError> {
        use std::io::Read;
        self.text.clear();
        let read = (&mut self.input).take(MAX_LINE_BYTES).read_until(b'\n', &mut self.text);
        let length = read.map_err(|e| LogError::new(self.path, LogErrorKind::Read(e)))?;
        if length == 0 {
            return Ok(false);
        }
        self.number += 1;
        if self.number == 1 {
            self.first_bytes()?;
        }
        self.ended = self.text.ends_with(b"\n");
        if !self.ended && length as u64 == MAX_LINE_BYTES {
            let kind = LogErrorKind::NotText(": a line longer than a megabyte");
            return Err(LogError::new(self.path, kind).line(self.number));
        }
        while let Some(b'\n' | b'\r') = self.text.last() {
            self.text.pop();
        }
        Ok(true)
    }

    fn first_bytes(&mut self) -> Result<(), LogError> {
        let hint = if self.text.starts_with(b"PAR1") {
            "; it is a Parquet file, whose name must end in .parquet"
        } else if self.text.starts_with(b"\xff\xfe") || self.text.starts_with(b"\xfe\xff") {
            " but UTF-16; save it as UTF-8"
        } else if self.text.starts_with(b"PK\x03\x04") {
            "; it is a spreadsheet or another compressed file; export it as CSV"
        } else {
            if self.text.starts_with(b"\xef\xbb\xbf") {
                self.text.drain(..3);
            }
            return Ok(());
        };
        Err(LogError::new(self.path, LogErrorKind::NotText(hint)))
    }

    fn is_blank(&self) -> bool {
        self.text.iter().all(u8::is_ascii_whitespace)
    }
}
