//! A log from CSV text, read line by line: memory is that of the columns and one line.
//!
//! Not the csv crate: its comment lines are dropped and they are our notes, and a log has no quoted line breaks.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use super::error::{LogError, Trouble};
use super::{Column, Parts, Wanted};

/// Longest line that is taken for text, bytes: a file without line breaks must not fill the memory.
const LONGEST_LINE: u64 = 1 << 20;
/// Most rows that are reserved at once on the file's own account of its length.
const MOST_RESERVED: usize = 1 << 26;

/// Reads the columns that are wanted, checks each number, and that time rises.
pub(super) fn read(path: &Path, wanted: &mut Wanted<'_>) -> Result<Parts, LogError> {
    let file = File::open(path).map_err(|e| LogError::new(path, Trouble::Read(e)))?;
    let bytes = file.metadata().map(|m| m.len()).unwrap_or(0);
    let mut lines = Lines { path, input: BufReader::with_capacity(1 << 18, file), text: Vec::with_capacity(256), number: 0, ended: true };
    let mut parts = Parts::default();
    let Some(header) = header(&mut lines, &mut parts, wanted.column)? else {
        let trouble = if parts.notes.is_empty() { Trouble::Empty } else { Trouble::NotesOnly };
        return Err(LogError::new(path, trouble));
    };
    parts.ignored = header.iter().filter(|c| c.target.is_none()).map(|c| c.name.clone()).collect();

    let mut row = 0;
    let mut last_t_s = f64::NEG_INFINITY;
    while lines.next()? {
        if let Some(note) = note(&lines)? {
            parts.notes.push(note);
            continue;
        }
        if lines.is_blank() {
            continue;
        }
        row += 1;
        if row == 1 {
            let rows = (bytes / (lines.text.len() as u64 + 1)) as usize + 16;
            let kept = parts.columns.iter_mut().filter(|c| wanted.keeps(&c.name));
            kept.for_each(|c| c.values.reserve(rows.min(MOST_RESERVED)));
        }
        if let Err(error) = take_row(path, &lines.text, &header, &mut parts.columns, &mut last_t_s, &mut wanted.times) {
            let line = lines.number;
            let has = count_cells(&lines.text);
            // A short row is a recording that broke off if nothing but blank lines follows it; so is half a number at the very end.
            let cut = match *error.trouble {
                Trouble::Cells { has, wants, .. } if has < wants => only_blank_follows(&mut lines)?,
                Trouble::NotANumber { .. } | Trouble::EmptyCell => !lines.ended && has == header.len(),
                _ => false,
            };
            let error = if cut { LogError::new(path, Trouble::CutShort { has, wants: header.len() }) } else { error };
            return Err(error.row(row).line(line));
        }
    }
    if row > 0 && !lines.ended {
        let line = lines.number;
        parts.warnings.push(format!("the last row (line {line}) does not end with a line break: its last number may be cut short"));
    }
    parts.columns.iter_mut().for_each(|c| c.values.shrink_to_fit());
    Ok(parts)
}

/// A column of the header.
struct Cell {
    name: String,
    /// Index among the columns that are read.
    target: Option<usize>,
    is_time: bool,
}

/// Notes up to the header, and the header; `None` where the file ends before.
fn header(lines: &mut Lines<'_>, parts: &mut Parts, wanted: &dyn Fn(&str) -> bool) -> Result<Option<Vec<Cell>>, LogError> {
    while lines.next()? {
        if let Some(note) = note(lines)? {
            parts.notes.push(note);
            continue;
        }
        if lines.is_blank() {
            continue;
        }
        let fail = |trouble| LogError::new(lines.path, trouble).line(lines.number);
        let text = std::str::from_utf8(&lines.text).map_err(|_| fail(Trouble::NotText("")))?;
        let names: Vec<&str> = text.split(',').map(unquoted).collect();
        if names.len() == 1 {
            for (mark, name) in [(';', "semicolons"), ('\t', "tabs")] {
                if text.contains(mark) {
                    return Err(fail(Trouble::Separator(name)));
                }
            }
        }
        if names.iter().all(|n| n.parse::<f64>().is_ok()) {
            return Err(fail(Trouble::NoHeader));
        }
        let mut header: Vec<Cell> = Vec::with_capacity(names.len());
        for (k, &name) in names.iter().enumerate() {
            if name.is_empty() {
                return Err(fail(Trouble::Nameless(k + 1)));
            }
            if header.iter().any(|c| c.name == name) {
                return Err(fail(Trouble::Doubled).column(name));
            }
            let target = wanted(name).then_some(parts.columns.len());
            if target.is_some() {
                parts.columns.push(Column { name: name.to_owned(), values: Vec::new() });
            }
            header.push(Cell { name: name.to_owned(), target, is_time: name == "t_s" });
        }
        return Ok(Some(header));
    }
    Ok(None)
}

/// One row into the columns. On an error the columns may be of unequal length: the read ends there.
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
                // The count tells more than the cell where both are wrong.
                Err(_) if count_cells(text) != header.len() => return Err(wrong_count(path, text, header)),
                Err(trouble) => return Err(LogError::new(path, trouble).column(&cell.name)),
            },
        };
        if cell.is_time {
            if value <= *last_t_s {
                if count_cells(text) != header.len() {
                    return Err(wrong_count(path, text, header));
                }
                return Err(LogError::new(path, Trouble::time(*last_t_s, value)).column(&cell.name));
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
    let (has, wants) = (count_cells(text), header.len());
    LogError::new(path, Trouble::Cells { has, wants, comma: has > wants && has <= 2 * wants })
}

/// The slow way to a number: spaces, quotes, and the words for what it is not.
fn number(bytes: &[u8]) -> Result<f64, Trouble> {
    let text = String::from_utf8_lossy(bytes);
    let text = unquoted(&text);
    if text.is_empty() {
        return Err(Trouble::EmptyCell);
    }
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(Trouble::NotFinite(text.to_owned())),
        Err(_) => {
            let hint = if text.contains(',') || text.contains(';') {
                " (a decimal comma? write decimal points and separate by commas)"
            } else if text.starts_with(|c: char| c.is_ascii_digit() || c == '-') && text.ends_with(char::is_alphabetic) {
                " (a unit belongs into the column's name)"
            } else {
                ""
            };
            Err(Trouble::NotANumber { text: text.chars().take(40).collect(), hint })
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
    let text = std::str::from_utf8(text).map_err(|_| LogError::new(lines.path, Trouble::NotText("")).line(lines.number))?;
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

/// The lines of a file, each into the same memory; CR and LF, and a byte order mark, taken off.
struct Lines<'a> {
    path: &'a Path,
    input: BufReader<File>,
    text: Vec<u8>,
    /// Of the line in `text`, from 1.
    number: usize,
    /// The line ended with a line break.
    ended: bool,
}

impl Lines<'_> {
    fn next(&mut self) -> Result<bool, LogError> {
        use std::io::Read;
        self.text.clear();
        let read = (&mut self.input).take(LONGEST_LINE).read_until(b'\n', &mut self.text);
        let length = read.map_err(|e| LogError::new(self.path, Trouble::Read(e)))?;
        if length == 0 {
            return Ok(false);
        }
        self.number += 1;
        if self.number == 1 {
            self.first_bytes()?;
        }
        self.ended = self.text.ends_with(b"\n");
        if !self.ended && length as u64 == LONGEST_LINE {
            let trouble = Trouble::NotText(": a line longer than a megabyte");
            return Err(LogError::new(self.path, trouble).line(self.number));
        }
        while let Some(b'\n' | b'\r') = self.text.last() {
            self.text.pop();
        }
        Ok(true)
    }

    fn first_bytes(&mut self) -> Result<(), LogError> {
        let hint = if self.text.starts_with(b"PAR1") {
            "; it is a Parquet file: let its name end in .parquet"
        } else if self.text.starts_with(b"\xff\xfe") || self.text.starts_with(b"\xfe\xff") {
            " but in UTF-16; save it as UTF-8"
        } else if self.text.starts_with(b"PK\x03\x04") {
            "; it is a spreadsheet or another packed file: export it as CSV"
        } else {
            if self.text.starts_with(b"\xef\xbb\xbf") {
                self.text.drain(..3);
            }
            return Ok(());
        };
        Err(LogError::new(self.path, Trouble::NotText(hint)))
    }

    fn is_blank(&self) -> bool {
        self.text.iter().all(u8::is_ascii_whitespace)
    }
}
