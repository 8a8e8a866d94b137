//! The session's folder: logs, models, answers and `commands.txt`, all of which the command line reads.
//!
//! Names come from the page, so a name is one plain file name, and a file reached through a symbolic link has to be inside the folder as well.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::log::import::{ENDINGS, file_of};
use crate::model::{Input, Model};

/// Longest name of a file.
const MAX_NAME: usize = 100;
/// Model of a new session.
pub const MODEL: &str = "model.toml";

/// Effects of the first model: what every drive has. Without friction the search has too much to explain at once.
const FIRST_EFFECTS: [&str; 2] = ["viscous", "coulomb"];

/// Why a file of the session cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// Not a plain file name.
    #[error("`{0}`: not a file name of the session (letters, digits, `.`, `-`, `_`; no folders)")]
    Name(String),
    /// It leads out of the folder.
    #[error("`{0}`: the file is outside the session's folder")]
    Outside(String),
    /// No such file.
    #[error("`{0}`: no such file in the session")]
    Absent(String),
    /// The operating system refused.
    #[error("{0}: {1}")]
    Io(PathBuf, std::io::Error),
    /// The first model cannot be made.
    #[error(transparent)]
    Model(#[from] crate::model::ModelError),
}

/// A file of the session.
#[derive(Debug, Clone, Serialize)]
pub struct SessionFile {
    /// Name in the folder.
    pub name: String,
    /// Size, bytes.
    pub bytes: u64,
}

/// The folder of a session.
#[derive(Debug)]
pub struct Session {
    folder: PathBuf,
    commands: std::sync::Mutex<File>,
}

/// A word of a shell.
pub fn quoted(word: &str) -> String {
    let is_plain = !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || "_-.:/=".contains(c));
    if is_plain { word.to_owned() } else { format!("'{}'", word.replace('\'', r"'\''")) }
}

/// A name with its last number apart: `run-10.parquet` comes behind `run-9.parquet`.
fn numbered(name: &str) -> (String, u64, String) {
    let stem = name.split('.').next().unwrap_or(name);
    let begin = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    (begin.to_owned(), stem[begin.len()..].parse().unwrap_or(0), name.to_owned())
}

impl Session {
    /// Opens the folder, or creates it with a first model.
    ///
    /// # Errors
    /// The folder or its files cannot be written.
    pub fn open(folder: &Path) -> Result<Self, SessionError> {
        let failed = |error| SessionError::Io(folder.to_owned(), error);
        std::fs::create_dir_all(folder).map_err(failed)?;
        let folder = folder.canonicalize().map_err(failed)?;
        let model = folder.join(MODEL);
        if !model.exists() {
            let mut first = Model::new(Input::Voltage, MODEL)?;
            FIRST_EFFECTS.iter().try_for_each(|effect| first.add(effect))?;
            first.write(&model)?;
        }
        let path = folder.join("commands.txt");
        let commands = OpenOptions::new().create(true).append(true).open(&path).map_err(|error| SessionError::Io(path, error))?;
        Ok(Session { folder, commands: commands.into() })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Path of a file that exists.
    ///
    /// # Errors
    /// No plain name, no such file, or a link out of the folder.
    pub fn existing(&self, name: &str) -> Result<PathBuf, SessionError> {
        let path = self.new_file(name)?;
        if path.is_file() { Ok(path) } else { Err(SessionError::Absent(name.to_owned())) }
    }

    /// Names of the folders in the session, by name; links are not among them.
    pub fn folders(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let is_folder =
            |name: &String| self.new_file(name).is_ok() && self.folder.join(name).symlink_metadata().is_ok_and(|data| data.is_dir());
        let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).filter(is_folder).collect();
        names.sort_by_cached_key(|name| numbered(name));
        names
    }

    /// Path of a file that may be created or replaced.
    ///
    /// # Errors
    /// No plain name, or a link out of the folder.
    pub fn new_file(&self, name: &str) -> Result<PathBuf, SessionError> {
        let is_plain = !name.is_empty()
            && name.len() <= MAX_NAME
            && !name.starts_with('.')
            && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_'));
        if !is_plain {
            return Err(SessionError::Name(name.chars().take(MAX_NAME).flat_map(char::escape_debug).collect()));
        }
        let path = self.folder.join(name);
        match path.symlink_metadata() {
            Err(_) => Ok(path),
            Ok(_) => match path.canonicalize() {
                Ok(target) if target.starts_with(&self.folder) => Ok(target),
                _ => Err(SessionError::Outside(name.to_owned())),
            },
        }
    }

    /// A name `STEM-N.ENDING` that no file has.
    pub fn free_name(&self, stem: &str, ending: &str) -> String {
        (1_u32..)
            .map(|k| format!("{stem}-{k}.{ending}"))
            .find(|name| self.folder.join(name).symlink_metadata().is_err())
            .unwrap_or_else(|| format!("{stem}.{ending}"))
    }

    /// A name `STEM-N` that no folder has, nor a file with an ending.
    pub fn free_folder(&self, stem: &str) -> String {
        let is_free = |name: &String| {
            ["", ".json", ".html", ".parquet"].iter().all(|ending| self.folder.join(format!("{name}{ending}")).symlink_metadata().is_err())
        };
        (1_u32..).map(|k| format!("{stem}-{k}")).find(is_free).unwrap_or_else(|| stem.to_owned())
    }

    /// Files whose names end with one of these endings, by name.
    pub fn files(&self, endings: &[&str]) -> Vec<SessionFile> {
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let mut files: Vec<SessionFile> = entries
            .filter_map(|entry| {
                let name = entry.file_name().into_string().ok()?;
                let is_listed =
                    endings.iter().any(|ending| name.ends_with(ending)) && !name.ends_with(".part.csv") && !name.ends_with(".parquet.csv");
                let bytes = self.existing(&name).ok()?.metadata().ok()?.len();
                is_listed.then_some(SessionFile { name, bytes })
            })
            .collect();
        files.sort_by_cached_key(|file| numbered(&file.name));
        files
    }

    /// The logs: recordings, and files of other programs once their import file exists. The series of answers are not among them.
    pub fn logs(&self) -> Vec<SessionFile> {
        let endings: Vec<String> = ENDINGS.iter().map(|ending| format!(".{ending}")).collect();
        let endings: Vec<&str> = endings.iter().map(String::as_str).collect();
        let is_own = |name: &str| name.ends_with(".csv") || name.ends_with(".parquet");
        let is_imported = |name: &str| file_of(&self.folder.join(name)).is_file();
        let is_series =
            |name: &str| name.strip_suffix("-series.parquet").is_some_and(|answer| self.folder.join(format!("{answer}.json")).is_file());
        let mut files = self.files(&endings);
        files.retain(|file| (is_own(&file.name) || is_imported(&file.name)) && !is_series(&file.name));
        files
    }

    /// The models.
    pub fn models(&self) -> Vec<SessionFile> {
        let mut files = self.files(&[".toml"]);
        files.retain(|file| !file.name.ends_with(".import.toml"));
        files
    }

    /// Appends a command of the shell to `commands.txt`.
    pub fn note_command(&self, command: &str) {
        let mut file = self.commands.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        // The list is an aid; a full disk must not end a session that drives.
        if let Err(error) = writeln!(file, "{command}") {
            eprintln!("stand: commands.txt: {error}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_the_folder() {
        let parent = tempfile::tempdir().unwrap();
        let session = Session::open(&parent.path().join("s")).unwrap();
        std::fs::write(parent.path().join("secret.csv"), "x").unwrap();
        for name in ["../secret.csv", "/etc/passwd", "a/b.csv", "", ".", "..", ".hidden", "a\0b", "a b", "<img src=x>.csv", "%2e%2e"] {
            assert!(matches!(session.new_file(name), Err(SessionError::Name(_))), "{name:?}");
        }
        assert!(session.existing(MODEL).is_ok());
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(parent.path().join("secret.csv"), session.folder().join("link.csv")).unwrap();
            std::os::unix::fs::symlink(parent.path().join("new.csv"), session.folder().join("dangling.csv")).unwrap();
            for name in ["link.csv", "dangling.csv"] {
                assert!(matches!(session.new_file(name), Err(SessionError::Outside(_))), "{name}");
            }
            assert!(session.files(&[".csv"]).is_empty());
        }
    }
}
