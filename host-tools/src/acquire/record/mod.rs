//! Rows of a stream become a log, as they come.
//!
//! In: [`RowFrame`]s. Out: CSV, flushed as often as the caller likes; what is to be a Parquet file is CSV beside it until it is closed
//! ([`LogFile`]), so that whatever happens there is a whole log. A column that the first rows do not have is left out; a later row that lacks a value is left
//! out, too, and counted: nothing is made up. The rows end with the first fault.

mod log_file;

pub use log_file::LogFile;

use std::io::Write;

use stand_firmware::speed_loop::Limits;
use stand_firmware::telemetry::{Channels, RowFrame};

use crate::log::{CsvWriter, Note, Notes};

/// Rows for which is waited until each column has a value.
const PATIENCE_ROWS: u32 = 100;
/// Board clock steps in a second.
const STEPS_PER_S: f64 = 1e7;

/// Whether the row says how far the platform is from its index: the index was seen, and the stand counts the angles of the next stream from there.
pub fn shows_index(row: &RowFrame) -> bool {
    row.value("from_index_rad").is_some_and(f64::is_finite)
}

/// What becomes of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowOutcome {
    /// The log has not begun: not all columns have values yet.
    NotYet,
    /// It is in the log.
    Written,
    /// It lacks a value, and is left out.
    LeftOut,
    /// A fault has latched; the log ends before this row.
    Fault(u32),
}

/// A log that is being written.
#[derive(Debug)]
pub struct Recorder<W: Write> {
    out: Option<W>,
    channels: Channels,
    notes: Notes,
    /// Columns beside the time, by their names in a row.
    columns: Vec<&'static str>,
    absent: Vec<&'static str>,
    csv: Option<CsvWriter<W>>,
    waited: u32,
    first_at: u64,
    cells: Vec<f64>,
    limited: [u64; Limits::NAMES.len()],
    rows: u64,
    left_out: u64,
    last_s: f64,
}

impl<W: Write> Recorder<W> {
    /// A log of these channels into `out`, with these notes at its head.
    pub fn new(out: W, channels: Channels, notes: Notes) -> Self {
        let columns: Vec<&'static str> = channels.iter().filter(|channel| channel.is_column()).map(|channel| channel.name).collect();
        Self {
            out: Some(out),
            channels,
            notes,
            columns,
            absent: Vec::new(),
            csv: None,
            waited: 0,
            first_at: 0,
            cells: Vec::new(),
            limited: [0; Limits::NAMES.len()],
            rows: 0,
            left_out: 0,
            last_s: 0.0,
        }
    }

    /// Rows in the log.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Rows that lacked a value.
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// The time of the last row, s.
    pub fn last_s(&self) -> f64 {
        self.last_s
    }

    /// Columns that were left out because the stand has no values for them.
    pub fn absent(&self) -> &[&'static str] {
        &self.absent
    }

    /// Takes the next row.
    ///
    /// # Errors
    /// Of the output.
    pub fn take(&mut self, row: &RowFrame) -> std::io::Result<RowOutcome> {
        let value = |name: &str| row.value(name).unwrap_or(f64::NAN);
        if !row.channels.contains(self.channels) {
            // Of a stream before this one.
            return Ok(RowOutcome::NotYet);
        }
        let fault = value("fault");
        if fault > 0.0 {
            return Ok(RowOutcome::Fault(fault as u32));
        }
        if self.csv.is_none() {
            let lacking: Vec<&'static str> = self.columns.iter().copied().filter(|name| !value(name).is_finite()).collect();
            self.waited += 1;
            if !lacking.is_empty() && self.waited < PATIENCE_ROWS {
                return Ok(RowOutcome::NotYet);
            }
            self.columns.retain(|name| !lacking.contains(name));
            self.absent = lacking;
            self.begin(row.at)?;
        }
        self.cells.clear();
        self.cells.push(row.at.saturating_sub(self.first_at) as f64 / STEPS_PER_S);
        for name in &self.columns {
            self.cells.push(value(name));
        }
        if self.cells.iter().any(|cell| !cell.is_finite()) {
            self.left_out += 1;
            return Ok(RowOutcome::LeftOut);
        }
        let limits = value("limits");
        for (bit, count) in self.limited.iter_mut().enumerate() {
            *count += u64::from(limits > 0.0 && (limits as u32) >> bit & 1 == 1);
        }
        if let Some(csv) = &mut self.csv {
            csv.row(&self.cells)?;
        }
        self.rows += 1;
        self.last_s = self.cells[0];
        Ok(RowOutcome::Written)
    }

    /// What was written so far is with the system.
    ///
    /// # Errors
    /// Of the output.
    pub fn flush(&mut self) -> std::io::Result<()> {
        self.csv.as_mut().map_or(Ok(()), CsvWriter::flush)
    }

    /// Ends the log with what there is to say of the whole of it.
    ///
    /// # Errors
    /// Of the output.
    pub fn finish(mut self, more: &Notes) -> std::io::Result<()> {
        if self.csv.is_none() {
            self.begin(0)?;
        }
        let Some(mut csv) = self.csv.take() else { return Ok(()) };
        let limited = Limits::NAMES.iter().zip(self.limited).filter(|(_, count)| *count > 0);
        let mut notes: Notes = limited.map(|(name, count)| Note::Limited(name, count as usize)).collect();
        notes.extend((self.left_out > 0).then_some(Note::RowsLeftOut(self.left_out)));
        for (key, value) in notes.iter().chain(more.iter()) {
            csv.note(key, value)?;
        }
        csv.finish().map(|_| ())
    }

    fn begin(&mut self, at: u64) -> std::io::Result<()> {
        self.first_at = at;
        let Some(out) = self.out.take() else { return Ok(()) };
        let names: Vec<&str> = std::iter::once("t_s").chain(self.columns.iter().copied()).collect();
        let notes = self.notes.iter().map(|(k, v)| (k.as_str(), v.as_str()));
        self.csv = Some(CsvWriter::new(out, notes, &names)?);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
