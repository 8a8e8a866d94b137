//! Which stand a log is of, when it was recorded, and of which batch the stand is: a table of the user, where the logs do not say so.
//!
//! In: a CSV file with the columns `path,stand,date,batch`, and `device` if wanted; columns may be missing except `path`. A path is
//! relative to the file's folder or to the current folder. Out: rows whose fields are replaced by cells that are not empty.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::row::{Row, microseconds_of};

/// Columns of the file.
const COLUMNS: [&str; 5] = ["path", "stand", "date", "batch", "device"];

/// Why a table of identities cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum IdentityError {
    /// The file cannot be read.
    #[error("{path}: cannot read: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// The head is wrong.
    #[error("{path}: the first line must name the column path, and of stand, date, batch, device those that the file has; it is `{head}`")]
    Head {
        /// The file.
        path: PathBuf,
        /// Its first line.
        head: String,
    },
    /// A line is wrong.
    #[error("{path}: line {line}: {message}")]
    Line {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
}

/// What the user states of one log.
#[derive(Debug, Clone, Default)]
struct Identity {
    line: usize,
    stand: Option<String>,
    began_us: Option<i64>,
    batch: Option<String>,
    device: Option<String>,
}

/// The table. The default states nothing.
#[derive(Debug, Clone, Default)]
pub struct IdentityTable {
    by_path: BTreeMap<PathBuf, Identity>,
}

impl IdentityTable {
    /// Reads the file.
    ///
    /// # Errors
    /// It cannot be read, has no column `path`, an unknown column, a line of another length, or a date that is none.
    pub fn read(path: &Path) -> Result<Self, IdentityError> {
        let text = std::fs::read_to_string(path).map_err(|source| IdentityError::Read { path: path.to_owned(), source })?;
        let mut lines = text.trim_start_matches('\u{feff}').lines();
        let head = lines.next().unwrap_or_default();
        let names = fields(head);
        let column = |name: &str| names.iter().position(|n| n == name);
        let Some(of_path) = column("path").filter(|_| names.iter().all(|n| COLUMNS.contains(&n.as_str()))) else {
            return Err(IdentityError::Head { path: path.to_owned(), head: head.to_owned() });
        };
        let (stand, date, batch, device) = (column("stand"), column("date"), column("batch"), column("device"));
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut by_path = BTreeMap::new();
        for (k, text) in lines.enumerate().filter(|(_, text)| !text.trim().is_empty()) {
            let (line, cells) = (k + 2, fields(text));
            let wrong = |message: String| IdentityError::Line { path: path.to_owned(), line, message };
            if cells.len() != names.len() {
                return Err(wrong(format!("{} cells, the first line has {}", cells.len(), names.len())));
            }
            let cell = |index: Option<usize>| index.map(|k| cells[k].clone()).filter(|cell| !cell.is_empty());
            let began_us = match cell(date) {
                Some(text) => Some(
                    microseconds_of(&text)
                        .ok_or_else(|| wrong(format!("`{text}` is no date such as 2026-11-22 or 2026-11-22T08:30:00+01:00")))?,
                ),
                None => None,
            };
            let identity = Identity { line, stand: cell(stand), began_us, batch: cell(batch), device: cell(device) };
            for base in [Path::new(""), folder] {
                by_path.insert(absolute(&base.join(&cells[of_path])), identity.clone());
            }
        }
        Ok(IdentityTable { by_path })
    }

    /// Replaces the fields of a row by those that the table states of its path.
    pub fn apply(&self, row: &mut Row) {
        let Some(identity) = self.by_path.get(&absolute(Path::new(&row.path))) else { return };
        let replace = |field: &mut Option<String>, stated: &Option<String>| {
            if stated.is_some() {
                field.clone_from(stated);
            }
        };
        replace(&mut row.stand, &identity.stand);
        replace(&mut row.batch, &identity.batch);
        replace(&mut row.device, &identity.device);
        row.began_us = identity.began_us.or(row.began_us);
    }

    /// Numbers of the lines whose path is none of `paths`.
    pub fn unmatched<'a>(&self, paths: impl IntoIterator<Item = &'a str>) -> Vec<usize> {
        let known: BTreeSet<PathBuf> = paths.into_iter().map(|path| absolute(Path::new(path))).collect();
        let matched: BTreeSet<usize> = self.by_path.iter().filter(|(path, _)| known.contains(*path)).map(|(_, i)| i.line).collect();
        let all: BTreeSet<usize> = self.by_path.values().map(|identity| identity.line).collect();
        all.difference(&matched).copied().collect()
    }
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).components().collect()
}

/// Cells of a line of CSV; a cell in double quotes may contain commas, two quotes in it are one.
fn fields(line: &str) -> Vec<String> {
    let (mut cells, mut quoted) = (vec![String::new()], false);
    let mut letters = line.chars().peekable();
    while let Some(letter) = letters.next() {
        let is_empty = cells.last().is_some_and(|cell| cell.trim().is_empty());
        match letter {
            '"' if quoted && letters.next_if_eq(&'"').is_some() => push(&mut cells, '"'),
            '"' if quoted => quoted = false,
            '"' if is_empty => quoted = true,
            ',' if !quoted => cells.push(String::new()),
            other => push(&mut cells, other),
        }
    }
    cells.iter().map(|cell| cell.trim().to_owned()).collect()
}

fn push(cells: &mut [String], letter: char) {
    if let Some(cell) = cells.last_mut() {
        cell.push(letter);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn read(text: &str) -> (tempfile::TempDir, Result<IdentityTable, IdentityError>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("stands.csv");
        std::fs::write(&path, text).unwrap();
        let table = IdentityTable::read(&path);
        (folder, table)
    }

    #[test]
    fn cells_replace_fields_and_empty_ones_do_not() {
        let (folder, table) = read("path,stand,date,batch\na.csv,\"A, left\",2026-11-22,7\nb.csv,,,8\nc.csv,C,,\n");
        let table = table.unwrap();
        let at = |name: &str| folder.path().join(name).display().to_string();
        let mut row = Row { path: at("a.csv"), stand: Some("note".to_owned()), ..Row::default() };
        table.apply(&mut row);
        assert_eq!((row.stand.as_deref(), row.batch.as_deref()), (Some("A, left"), Some("7")));
        assert_eq!(row.began_us, microseconds_of("2026-11-22"));
        let mut row = Row { path: at("b.csv"), stand: Some("note".to_owned()), ..Row::default() };
        table.apply(&mut row);
        assert_eq!((row.stand.as_deref(), row.batch.as_deref(), row.began_us), (Some("note"), Some("8"), None));
        assert_eq!(table.unmatched([at("a.csv").as_str(), at("b.csv").as_str()]), [4]);
    }

    #[test]
    fn wrong_lines_are_named() {
        for (text, expected) in [
            ("log,stand\n", "the column path"),
            ("path,stand\na.csv\n", "line 2: 1 cells, the first line has 2"),
            ("path,date\na.csv,soon\n", "line 2: `soon` is no date"),
        ] {
            let error = read(text).1.unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
