//! Archive of a work: one zip file with logs, journal, answers and the report.

use std::io::{Cursor, Write};
use std::path::Path;

use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

use super::LabError;
use super::work::path_in;
use crate::files;

/// Writes the files `names` of the work folder and `further` texts (name, content) into a zip file at `path`.
///
/// # Errors
/// A file cannot be read, or the archive cannot be written; no archive remains then.
pub fn write_archive(path: &Path, folder: &Path, names: &[String], further: &[(&str, String)]) -> Result<(), LabError> {
    // Logs are compressed already, the rest is small.
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let mut add = |name: &str, content: &[u8]| -> Result<(), LabError> {
        let failed = |error: zip::result::ZipError| LabError::file(path, "write", std::io::Error::other(error));
        archive.start_file(name, options).map_err(failed)?;
        archive.write_all(content).map_err(|source| LabError::file(path, "write", source))
    };
    for name in names {
        let file = path_in(folder, name);
        add(name, &std::fs::read(&file).map_err(|source| LabError::file(&file, "read", source))?)?;
    }
    for (name, text) in further {
        add(name, text.as_bytes())?;
    }
    let bytes = archive.finish().map_err(|error| LabError::file(path, "write", std::io::Error::other(error)))?.into_inner();
    files::replace(path, |file| file.write_all(&bytes)).map_err(|source| LabError::file(path, "write", source))
}
