//! Archive of a work: one zip file with logs, journal, answers, the report, and the student's own files (scripts, plots) up to a size.

use std::io::{Cursor, Write};
use std::path::Path;

use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

use super::LabError;
use super::work::path_in;
use identification::files;

/// Greatest size of one of the student's own files, bytes: scripts and plots; converted logs are ten times larger and can be made again.
pub const MAX_OWN_FILE_BYTES: u64 = 2 << 20;
/// Greatest size of all of them, bytes, and their greatest number.
pub const MAX_OWN_BYTES: u64 = 20 << 20;
const MAX_OWN_FILES: usize = 200;
/// Depth of folders that are searched for them.
const MAX_DEPTH: usize = 3;
/// Files that the archive gets anew.
const REPORTS: [&str; 2] = ["report.html", "report.json"];

/// The student's own files of a work folder.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct OwnFiles {
    /// Those of the archive, by their paths in the folder.
    pub names: Vec<String>,
    /// Those that are too large, or one too many.
    pub left_out: Vec<String>,
}

/// The student's own files in `folder`: regular files apart from `names`, archives, keys, hidden files and links, which may point out of
/// the folder.
///
/// # Errors
/// A folder cannot be read.
pub fn own_files(folder: &Path, names: &[String]) -> Result<OwnFiles, LabError> {
    let (mut found, mut bytes) = (OwnFiles::default(), 0);
    let mut folders = vec![(String::new(), 0)];
    while let Some((prefix, depth)) = folders.pop() {
        let path = if prefix.is_empty() { folder.to_owned() } else { path_in(folder, prefix.trim_end_matches('/')) };
        let failed = |source| LabError::file(&path, "read", source);
        let mut entries = std::fs::read_dir(&path).map_err(failed)?.collect::<Result<Vec<_>, _>>().map_err(failed)?;
        entries.sort_by_key(std::fs::DirEntry::file_name);
        for entry in entries {
            let file_name = entry.file_name();
            let Some(file_name) = file_name.to_str().filter(|name| !name.starts_with('.') && !name.contains('\\')) else { continue };
            let name = format!("{prefix}{file_name}");
            // Of the entry itself, not of the target of a link.
            let metadata = entry.metadata().map_err(failed)?;
            if metadata.is_dir() && depth < MAX_DEPTH {
                folders.push((format!("{name}/"), depth + 1));
            }
            let is_other = Path::new(file_name).extension().is_some_and(|ending| ending == "zip" || ending == "key");
            if !metadata.is_file() || is_other || names.contains(&name) || REPORTS.contains(&name.as_str()) {
                continue;
            }
            let size = metadata.len();
            if size > MAX_OWN_FILE_BYTES || bytes + size > MAX_OWN_BYTES || found.names.len() == MAX_OWN_FILES {
                found.left_out.push(name);
            } else {
                bytes += size;
                found.names.push(name);
            }
        }
    }
    Ok(found)
}

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
