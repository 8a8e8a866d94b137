//! A log written row by row from a stream.
//!
//! In: [`RowFrame`]s. Out: CSV. Every log is a CSV file beside it until the recording is closed ([`LogFile`]), so that an interrupted
//! recording leaves readable rows, and a file with the name of the log is complete. A column without values in the first rows is left out.
//! A later row that lacks a value is left out and counted. The log ends before the first row with a fault.

mod log_file;

pub use log_file::LogFile;

use std::io::Write;

use stand_firmware::speed_loop::Limits;
use stand_firmware::telemetry::{Channels, RowFrame};

use identification::log::{CsvWriter, Note, Notes};

/// Rows after which columns without a value are left out.
const MAX_INITIAL_ROWS: u32 = 100;
/// Frequency of the board clock, Hz.
const CLOCK_HZ: f64 = 1e7;

/// The row has an angle from the index: the index has been seen, and the angles of the next stream count from it.
pub fn shows_index(row: &RowFrame) -> bool {
    row.value("from_index_rad").is_some_and(f64::is_finite)
}

/// Outcome of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowOutcome {
    /// The log has not started: a column has no value yet.
    NotYet,
    /// The row is in the log.
    Written,
    /// The row lacks a value and was left out.
    LeftOut,
    /// A fault is latched; the log ends before this row.
    Fault(u32),
}

/// Writer of a log.
#[derive(Debug)]
pub struct Recorder<W: Write> {
    out: Option<W>,
    channels: Channels,
    notes: Notes,
    /// Columns beside the time, by their channel names.
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
    /// A log of these channels, written to `out`, with notes at its head.
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

    /// Number of rows in the log.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Number of rows left out because they lacked a value.
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Time of the first row since power-on of the stand, s.
    pub fn first_since_power_on_s(&self) -> f64 {
        self.first_at as f64 / CLOCK_HZ
    }

    /// Time of the last row, s.
    pub fn last_s(&self) -> f64 {
        self.last_s
    }

    /// Columns that were left out because the stand has no values for them.
    pub fn absent(&self) -> &[&'static str] {
        &self.absent
    }

    /// Writes the next row.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn take(&mut self, row: &RowFrame) -> std::io::Result<RowOutcome> {
        let value = |name: &str| row.value(name).unwrap_or(f64::NAN);
        if !row.channels.contains(self.channels) {
            // A row of an earlier stream.
            return Ok(RowOutcome::NotYet);
        }
        let fault = value("fault");
        if fault > 0.0 {
            return Ok(RowOutcome::Fault(fault as u32));
        }
        if self.csv.is_none() {
            let lacking: Vec<&'static str> = self.columns.iter().copied().filter(|name| !value(name).is_finite()).collect();
            self.waited += 1;
            if !lacking.is_empty() && self.waited < MAX_INITIAL_ROWS {
                return Ok(RowOutcome::NotYet);
            }
            self.columns.retain(|name| !lacking.contains(name));
            self.absent = lacking;
            self.begin(row.at)?;
        }
        self.cells.clear();
        self.cells.push(row.at.saturating_sub(self.first_at) as f64 / CLOCK_HZ);
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

    /// Flushes the output.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn flush(&mut self) -> std::io::Result<()> {
        self.csv.as_mut().map_or(Ok(()), CsvWriter::flush)
    }

    /// Ends the log with notes on the whole recording.
    ///
    /// # Errors
    /// The output cannot be written.
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
