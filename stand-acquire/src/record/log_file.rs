//! The file of a log, and the CSV file that is written during a recording.

use std::fs::{File, OpenOptions, remove_file};
use std::io::{BufWriter, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use identification::files;
use identification::log::{Format, Log, LogError, LogErrorKind};

/// The file of a log, and the CSV file that precedes it.
#[derive(Debug, Clone)]
pub struct LogFile {
    path: PathBuf,
    partial: PathBuf,
}

impl LogFile {
    /// The file `path`, in the format of its ending.
    ///
    /// # Errors
    /// The ending is not a log format.
    pub fn of(path: &Path) -> Result<Self, LogError> {
        let partial = match Format::of(path)? {
            Format::Csv => path.with_extension("part.csv"),
            Format::Parquet => path.with_extension("parquet.csv"),
        };
        Ok(Self { path: path.to_owned(), partial })
    }

    /// The CSV file that exists during the recording, and remains if the program is killed.
    pub fn partial_path(&self) -> &Path {
        &self.partial
    }

    /// A file that a recording would destroy: the log, or the rows of a recording of it that was interrupted.
    pub fn existing(&self) -> Option<&Path> {
        [&self.path, &self.partial].into_iter().find(|path| path.exists()).map(PathBuf::as_path)
    }

    /// Creates the CSV file, empty. What is flushed is on the disk.
    ///
    /// # Errors
    /// The file system fails.
    pub fn create(&self) -> std::io::Result<BufWriter<SyncedFile>> {
        Ok(BufWriter::with_capacity(1 << 18, SyncedFile(File::create(&self.partial)?)))
    }

    /// Removes an incomplete last row, left by a full disk or a killed program, from the CSV file; a file without a line end becomes empty.
    ///
    /// # Errors
    /// The file system fails.
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

    /// Makes the complete CSV file the log, by renaming or conversion.
    ///
    /// # Errors
    /// The CSV file cannot be read, or the log cannot be written; the CSV file is then kept.
    pub fn close(&self) -> Result<(), LogError> {
        if Format::of(&self.path)? == Format::Csv {
            return files::rename_synced(&self.partial, &self.path).map_err(|e| LogError::new(&self.path, LogErrorKind::Write(e)));
        }
        Log::read(&self.partial)?.write(&self.path)?;
        // A remaining CSV file is harmless.
        let _ = remove_file(&self.partial);
        Ok(())
    }
}

/// A file whose `flush` waits until the disk has its contents.
#[derive(Debug)]
pub struct SyncedFile(File);

impl Write for SyncedFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.sync_data()
    }
}
