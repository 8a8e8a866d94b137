//! Where a log is written while it is made, and where it ends.

use std::fs::{File, OpenOptions, remove_file};
use std::io::{BufWriter, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crate::log::{Format, Log, LogError};

/// A log's file, and the CSV that is written first.
#[derive(Debug, Clone)]
pub struct LogFile {
    end: PathBuf,
    partial: PathBuf,
}

impl LogFile {
    /// The place of the log `path`, in the form that its ending names.
    ///
    /// # Errors
    /// The ending names none.
    pub fn of(path: &Path) -> Result<Self, LogError> {
        let partial = match Format::of(path)? {
            Format::Csv => path.to_owned(),
            Format::Parquet => path.with_extension("parquet.csv"),
        };
        Ok(Self { end: path.to_owned(), partial })
    }

    /// The CSV that is there while the log is made, and stays if its maker is killed.
    pub fn partial_path(&self) -> &Path {
        &self.partial
    }

    /// The file to write the CSV into.
    ///
    /// # Errors
    /// Of the system.
    pub fn create(&self) -> std::io::Result<BufWriter<File>> {
        Ok(BufWriter::with_capacity(1 << 18, File::create(&self.partial)?))
    }

    /// Cuts what a full disk or a kill has left of a last row off the CSV; nothing where there is none.
    ///
    /// # Errors
    /// Of the system.
    pub fn cut_to_whole_rows(&self) -> std::io::Result<()> {
        let mut file = match OpenOptions::new().read(true).write(true).open(&self.partial) {
            Ok(file) => file,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
            Err(e) => return Err(e),
        };
        let length = file.seek(SeekFrom::End(0))?;
        let mut end = length;
        let mut part = vec![0; 4096];
        while end > 0 {
            let from = end.saturating_sub(part.len() as u64);
            let piece = &mut part[..(end - from) as usize];
            file.seek(SeekFrom::Start(from))?;
            file.read_exact(piece)?;
            if let Some(at) = piece.iter().rposition(|byte| *byte == b'\n') {
                end = from + at as u64 + 1;
                break;
            }
            end = from;
        }
        if end < length { file.set_len(end) } else { Ok(()) }
    }

    /// The CSV is whole: makes of it what was asked for.
    ///
    /// # Errors
    /// The CSV cannot be read again (then it is left), or the log not written.
    pub fn close(&self) -> Result<(), LogError> {
        if self.partial == self.end {
            return Ok(());
        }
        Log::read(&self.partial)?.write(&self.end)?;
        // A copy that stays is in nobody's way.
        let _ = remove_file(&self.partial);
        Ok(())
    }
}
