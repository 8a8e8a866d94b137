//! Where a log is written while it is made, and where it ends.

use std::fs::{File, remove_file};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use crate::log::{Format, Log, LogError};

/// A log's file, and the CSV that is written first.
#[derive(Debug, Clone)]
pub struct Place {
    end: PathBuf,
    meanwhile: PathBuf,
}

impl Place {
    /// The place of the log `path`, in the form that its ending names.
    ///
    /// # Errors
    /// The ending names none.
    pub fn of(path: &Path) -> Result<Self, LogError> {
        let meanwhile = match Format::of(path)? {
            Format::Csv => path.to_owned(),
            Format::Parquet => path.with_extension("parquet.csv"),
        };
        Ok(Self { end: path.to_owned(), meanwhile })
    }

    /// The CSV that is there while the log is made, and stays if its maker is killed.
    pub fn meanwhile(&self) -> &Path {
        &self.meanwhile
    }

    /// The file to write the CSV into.
    ///
    /// # Errors
    /// Of the system.
    pub fn create(&self) -> std::io::Result<BufWriter<File>> {
        Ok(BufWriter::with_capacity(1 << 18, File::create(&self.meanwhile)?))
    }

    /// The CSV is whole: makes of it what was asked for.
    ///
    /// # Errors
    /// The CSV cannot be read again (then it is left), or the log not written.
    pub fn close(&self) -> Result<(), LogError> {
        if self.meanwhile == self.end {
            return Ok(());
        }
        Log::read(&self.meanwhile)?.write(&self.end)?;
        // A copy that stays is in nobody's way.
        let _ = remove_file(&self.meanwhile);
        Ok(())
    }
}
