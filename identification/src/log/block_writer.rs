//! Writes a log in blocks of rows, so that it may be longer than the memory.

use std::io::{self, Write};

use super::csv_write::CsvWriter;
use super::parquet::GroupWriter;
use super::{Format, Log};

/// A log that is being written. Each block is a [`Log`] with the next rows and the notes that belong to them; all have the columns of the
/// first.
pub enum BlockWriter<W: Write + Send> {
    /// As text. Notes of later blocks stand between the rows.
    Csv(CsvWriter<W>),
    /// In row groups; the notes are at the end of the file.
    Parquet(Box<GroupWriter<W>>),
}

impl<W: Write + Send> BlockWriter<W> {
    /// Begins with the first block.
    ///
    /// # Errors
    /// Errors of `out`.
    pub fn new(format: Format, out: W, first: &Log) -> io::Result<Self> {
        let axis = first.axis();
        let names: Vec<&str> = first.columns().iter().map(|column| axis.file_column(&column.name)).collect();
        Ok(match format {
            Format::Csv => {
                let notes = first.notes().iter().map(|(key, value)| (key.as_str(), value.as_str()));
                let mut writer = CsvWriter::new(out, notes, &names)?;
                writer.rows(first)?;
                Self::Csv(writer)
            }
            Format::Parquet => {
                let mut writer = GroupWriter::new(out, &names)?;
                writer.notes(first.notes());
                writer.rows(first)?;
                Self::Parquet(Box::new(writer))
            }
        })
    }

    /// Adds a block.
    ///
    /// # Errors
    /// Errors of the output; `InvalidInput` if the columns are not those of the first block.
    pub fn add(&mut self, block: &Log) -> io::Result<()> {
        match self {
            Self::Csv(writer) => writer.rows(block)?,
            Self::Parquet(writer) => writer.rows(block)?,
        }
        self.notes(block.notes())
    }

    /// Adds notes.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn notes(&mut self, notes: &[(String, String)]) -> io::Result<()> {
        match self {
            Self::Csv(writer) => notes.iter().try_for_each(|(key, value)| writer.note(key, value)),
            Self::Parquet(writer) => {
                writer.notes(notes);
                Ok(())
            }
        }
    }

    /// Writes the end and flushes.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn finish(self) -> io::Result<()> {
        match self {
            Self::Csv(writer) => writer.finish().map(drop),
            Self::Parquet(writer) => writer.finish(),
        }
    }
}
