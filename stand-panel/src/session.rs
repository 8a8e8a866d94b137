//! The session's folder: logs, models, answers and `commands.txt`, all of which the command line reads; and the laboratory works in it.
//!
//! Names come from the page, so a name is one plain file name, or for files of a laboratory work `WORK/NAME`, `WORK/logs/NAME` or
//! `logs/NAME`, and a file reached through a symbolic link has to be inside the folder as well.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use identification::log::import::{ENDINGS, file_of};
use identification::model::{Input, Model};
use stand_lab::answers::ANSWERS_FILE;
use stand_lab::journal::JOURNAL_FILE;
use stand_lab::measurement::LOGS_FOLDER;
use stand_lab::work::WORK_FILE;

/// Longest name of a file.
const MAX_NAME: usize = 100;
/// Model of a new session.
pub const MODEL: &str = "model.toml";
/// Name of the laboratory work whose folder is that of the session.
const THIS: &str = ".";

/// Effects of the first model: what every drive has. Without friction the search has too much to explain at once.
const FIRST_EFFECTS: [&str; 2] = ["viscous", "coulomb"];

/// Why a file of the session cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// Not a plain file name.
    #[error("`{0}`: not a file name of the session (letters, digits, `.`, `-`, `_`; no folders)")]
    Name(String),
    /// No such laboratory work.
    #[error("`{0}`: no laboratory work of the session")]
    Work(String),
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
    Model(#[from] identification::model::ModelError),
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

/// A name from the page for a message.
fn escaped(name: &str) -> String {
    name.chars().take(MAX_NAME).flat_map(char::escape_debug).collect()
}

/// A plain file name, as it may come from the page.
fn check_plain(name: &str) -> Result<(), SessionError> {
    let is_plain = !name.is_empty()
        && name.len() <= MAX_NAME
        && !name.starts_with('.')
        && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_'));
    is_plain.then_some(()).ok_or_else(|| SessionError::Name(escaped(name)))
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

    /// Path of a file that exists, in the session or in a laboratory work.
    ///
    /// # Errors
    /// No plain name, no such file, or a link out of the folder.
    pub fn existing(&self, name: &str) -> Result<PathBuf, SessionError> {
        let path = match name.rsplit_once('/') {
            Some((folder, file)) if self.work_folders().iter().any(|known| known == folder) => {
                check_plain(file)?;
                self.inside(name)?
            }
            _ => self.new_file(name)?,
        };
        if path.is_file() { Ok(path) } else { Err(SessionError::Absent(name.to_owned())) }
    }

    /// The laboratory works: `.` where the session's folder is a work folder, and the names of work folders in it.
    pub fn works(&self) -> Vec<String> {
        let names = std::iter::once(THIS.to_owned()).chain(self.folders());
        names.filter(|name| self.folder.join(name).join(WORK_FILE).is_file()).collect()
    }

    /// Folder of a laboratory work whose description, answers and journal are inside the session's folder.
    ///
    /// # Errors
    /// No such work, or a link out of the folder.
    pub fn work(&self, name: &str) -> Result<PathBuf, SessionError> {
        if !self.works().iter().any(|work| work == name) {
            return Err(SessionError::Work(escaped(name)));
        }
        for file in [WORK_FILE, ANSWERS_FILE, JOURNAL_FILE] {
            self.inside(&format!("{name}/{file}"))?;
        }
        Ok(if name == THIS { self.folder.clone() } else { self.folder.join(name) })
    }

    /// Name of a file of a laboratory work, as [`Self::existing`] takes it.
    pub fn name_in(work: &str, file: &str) -> String {
        if work == THIS { file.to_owned() } else { format!("{work}/{file}") }
    }

    /// The folders of the works with logs and models, but for the session's own.
    fn work_folders(&self) -> Vec<String> {
        let works = self.works().into_iter();
        works.flat_map(|work| [Self::name_in(&work, LOGS_FOLDER), work]).filter(|folder| folder != THIS).collect()
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
        check_plain(name)?;
        self.inside(name)
    }

    /// The path in the folder; where a link leads, if there is one.
    fn inside(&self, name: &str) -> Result<PathBuf, SessionError> {
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
        self.files_in(None, endings)
    }

    /// The same for a folder of a laboratory work.
    fn files_in(&self, folder: Option<&str>, endings: &[&str]) -> Vec<SessionFile> {
        let entries = std::fs::read_dir(self.folder.join(folder.unwrap_or(THIS))).into_iter().flatten().flatten();
        let mut files: Vec<SessionFile> = entries
            .filter_map(|entry| {
                let file = entry.file_name().into_string().ok()?;
                let is_listed =
                    endings.iter().any(|ending| file.ends_with(ending)) && !file.ends_with(".part.csv") && !file.ends_with(".parquet.csv");
                let name = folder.map_or_else(|| file.clone(), |folder| format!("{folder}/{file}"));
                let bytes = self.existing(&name).ok()?.metadata().ok()?.len();
                is_listed.then_some(SessionFile { name, bytes })
            })
            .collect();
        files.sort_by_cached_key(|file| numbered(&file.name));
        files
    }

    /// Files of the session, and of the folders of works that `is_asked` chooses.
    fn files_with_works(&self, is_asked: impl Fn(&str) -> bool, endings: &[&str]) -> Vec<SessionFile> {
        let of_works = self.work_folders().into_iter().filter(|folder| is_asked(folder));
        let of_works: Vec<SessionFile> = of_works.flat_map(|folder| self.files_in(Some(&folder), endings)).collect();
        // The last one is chosen where none is: a recording comes behind the logs of a work.
        of_works.into_iter().chain(self.files(endings)).collect()
    }

    /// The logs: those of laboratory works, recordings, and files of other programs once their import file exists. The series of answers
    /// are not among them.
    pub fn logs(&self) -> Vec<SessionFile> {
        let endings: Vec<String> = ENDINGS.iter().map(|ending| format!(".{ending}")).collect();
        let endings: Vec<&str> = endings.iter().map(String::as_str).collect();
        let is_own = |name: &str| name.ends_with(".csv") || name.ends_with(".parquet");
        let is_imported = |name: &str| file_of(&self.folder.join(name)).is_file();
        let is_series =
            |name: &str| name.strip_suffix("-series.parquet").is_some_and(|answer| self.folder.join(format!("{answer}.json")).is_file());
        let mut files = self.files_with_works(|folder| folder.rsplit('/').next() == Some(LOGS_FOLDER), &endings);
        files.retain(|file| (is_own(&file.name) || is_imported(&file.name)) && !is_series(&file.name));
        files
    }

    /// The models, those of laboratory works among them.
    pub fn models(&self) -> Vec<SessionFile> {
        let works = self.works();
        let is_of_work = |name: &str| {
            let (folder, file) = name.rsplit_once('/').unwrap_or((THIS, name));
            [WORK_FILE, ANSWERS_FILE].contains(&file) && works.iter().any(|work| work == folder)
        };
        let mut files = self.files_with_works(|folder| folder.rsplit('/').next() != Some(LOGS_FOLDER), &[".toml"]);
        files.retain(|file| !file.name.ends_with(".import.toml") && !is_of_work(&file.name));
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

    #[test]
    fn files_of_works_are_found_and_stay_in_the_folder() {
        let parent = tempfile::tempdir().unwrap();
        let session = Session::open(&parent.path().join("s")).unwrap();
        for work in [".", "olena"] {
            let logs = session.folder().join(work).join(LOGS_FOLDER);
            std::fs::create_dir_all(&logs).unwrap();
            std::fs::write(logs.join("A.csv"), "x").unwrap();
            std::fs::write(session.folder().join(work).join("secret.csv"), "x").unwrap();
        }
        std::fs::create_dir(session.folder().join("other")).unwrap();
        std::fs::write(session.folder().join("other/A.csv"), "x").unwrap();
        assert!(session.works().is_empty() && session.existing("logs/A.csv").is_err() && session.work(".").is_err());
        for work in [".", "olena"] {
            for file in [WORK_FILE, ANSWERS_FILE, MODEL] {
                std::fs::write(session.folder().join(work).join(file), "").unwrap();
            }
        }
        assert_eq!(session.works(), [".", "olena"]);
        let names = |files: Vec<SessionFile>| files.into_iter().map(|file| file.name).collect::<Vec<_>>();
        assert_eq!(names(session.logs()), ["logs/A.csv", "olena/logs/A.csv", "secret.csv"]);
        assert_eq!(names(session.models()), ["olena/model.toml", "model.toml"]);
        for name in
            ["other/A.csv", "olena/../secret.csv", "olena/logs/../secret.csv", "./logs/A.csv", "olena//secret.csv", "logs/.", "logs/"]
        {
            assert!(session.existing(name).is_err(), "{name}");
        }
        for name in ["..", "other", "olena/logs", "../s", ""] {
            assert!(matches!(session.work(name), Err(SessionError::Work(_))), "{name}");
        }
        #[cfg(unix)]
        {
            std::fs::write(parent.path().join("secret.toml"), "x").unwrap();
            std::os::unix::fs::symlink(parent.path().join("secret.toml"), session.folder().join("olena/logs/B.csv")).unwrap();
            assert!(matches!(session.existing("olena/logs/B.csv"), Err(SessionError::Outside(_))));
            std::fs::remove_file(session.folder().join("olena").join(ANSWERS_FILE)).unwrap();
            std::os::unix::fs::symlink(parent.path().join("secret.toml"), session.folder().join("olena").join(ANSWERS_FILE)).unwrap();
            assert!(matches!(session.work("olena"), Err(SessionError::Outside(_))) && session.work(".").is_ok());
        }
    }
}
