//! Writes a log as CSV text: notes, header, rows. Each number is the shortest text that reads back as the same value.
//!
//! A note at the beginning announces two at the end, the number of rows and their SHA-256, so that a reader recognises a log without its
//! end.

use std::io::Write;

use sha2::{Digest, Sha256};

use super::Log;

/// Key of the note that announces [`ROWS`] and [`SHA256`].
pub(super) const ENDS_WITH: &str = "ends_with";
/// Its value.
const END_NOTES: &str = "rows, sha256";
/// Key of the note on the number of rows.
pub(super) const ROWS: &str = "rows";
/// Key of the note on the SHA-256 of all rows, each with a line feed.
pub(super) const SHA256: &str = "sha256";

/// Number and SHA-256 of the rows of a log.
#[derive(Debug, Default)]
pub(super) struct RowsDigest {
    rows: u64,
    hash: Sha256,
}

impl RowsDigest {
    /// Takes a row without its line break.
    pub(super) fn take(&mut self, row: &[u8]) {
        self.rows += 1;
        self.hash.update(row);
        self.hash.update(b"\n");
    }

    /// The values of the notes [`ROWS`] and [`SHA256`].
    pub(super) fn values(self) -> [String; 2] {
        [self.rows.to_string(), self.hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()]
    }
}

/// Writes rows one by one, for a recording. The caller decides on buffering and flushing.
#[derive(Debug)]
pub struct CsvWriter<W: Write> {
    out: W,
    columns: usize,
    line: String,
    digest: RowsDigest,
}

impl<W: Write> CsvWriter<W> {
    /// Writes the notes and the header.
    ///
    /// # Errors
    /// Errors of `out`.
    pub fn new<'a>(out: W, notes: impl IntoIterator<Item = (&'a str, &'a str)>, columns: &[&str]) -> std::io::Result<Self> {
        let mut writer = CsvWriter { out, columns: columns.len(), line: String::with_capacity(256), digest: RowsDigest::default() };
        writer.note(ENDS_WITH, END_NOTES)?;
        for (key, value) in notes {
            writer.note(key, value)?;
        }
        writeln!(writer.out, "{}", columns.join(","))?;
        Ok(writer)
    }

    /// Writes a note, also between rows. A line break becomes a space, a colon in the key a dash.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn note(&mut self, key: &str, value: &str) -> std::io::Result<()> {
        let one_line = |text: &str| text.replace(['\n', '\r'], " ").trim().to_owned();
        writeln!(self.out, "# {}: {}", one_line(key).replace(':', "-"), one_line(value))
    }

    /// Writes one row, a number for each column.
    ///
    /// # Errors
    /// Errors of the output; `InvalidInput` if the count differs from the header, or a number is not finite (the log could not be read
    /// again).
    pub fn row(&mut self, cells: &[f64]) -> std::io::Result<()> {
        if cells.len() != self.columns || cells.iter().any(|c| !c.is_finite()) {
            let expected = self.columns;
            let message = format!("a row of the log must be {expected} finite numbers, not {cells:?}");
            return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, message));
        }
        self.line.clear();
        let mut buffer = zmij::Buffer::new();
        for &cell in cells {
            let text = buffer.format_finite(cell);
            self.line.push_str(text.strip_suffix(".0").unwrap_or(text));
            self.line.push(',');
        }
        self.line.pop();
        self.digest.take(self.line.as_bytes());
        self.line.push('\n');
        self.out.write_all(self.line.as_bytes())
    }

    /// Writes all rows of a log, which has the columns of the header.
    ///
    /// # Errors
    /// As [`CsvWriter::row`].
    pub(super) fn rows(&mut self, log: &Log) -> std::io::Result<()> {
        let columns: Vec<&[f64]> = log.columns().iter().map(|column| column.values.as_slice()).collect();
        let mut row = vec![0.0; columns.len()];
        for k in 0..log.len() {
            for (cell, column) in row.iter_mut().zip(&columns) {
                *cell = column[k];
            }
            self.row(&row)?;
        }
        Ok(())
    }

    /// Flushes the output.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }

    /// Writes the notes of the end, flushes and returns the output.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn finish(mut self) -> std::io::Result<W> {
        let [rows, sha256] = std::mem::take(&mut self.digest).values();
        self.note(ROWS, &rows)?;
        self.note(SHA256, &sha256)?;
        self.out.flush()?;
        Ok(self.out)
    }
}
