//! The computation of a table that survives its end: each answer is kept in a journal beside the table, on the disk before the next one.
//!
//! The journal of `answers.parquet` is `answers.parquet.journal`, one JSON object a line: `{"begin": KEY}` where a computation begins,
//! `{"key": KEY, "row": {…}}` where it ends. KEY is the hash of the log's contents with that of the model and the build, so that a log is
//! computed once whatever it is called, and again when something that determines its answer has changed. A line that was cut off is
//! ignored. A log whose computation ended the program [`MAX_ATTEMPTS`] times is not tried again.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::identity::IdentityTable;
use super::row::{NOT_FINISHED, Row};
use super::table;
use identification::log::import;

/// Times that the computation of a log may end the program.
pub const MAX_ATTEMPTS: usize = 3;
/// Version of the rows; another one makes the answers of a journal invalid.
const FORMAT: u32 = 1;

/// Why a table cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// Another process computes it.
    #[error("{0}: another process is computing this table")]
    Busy(PathBuf),
    /// The journal or the table cannot be written.
    #[error("{path}: cannot write: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Cause.
        source: io::Error,
    },
}

/// What determines the answer about a log, besides the log.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Name of the model.
    pub model_name: String,
    /// Text of the model file.
    pub model: String,
    /// Version and commit of the program.
    pub build: String,
    /// Limit of effort of each search, passes; `None`: none.
    pub effort_limit_passes: Option<i64>,
    /// Time limit of a search, s. Only searches that it has ended depend on it.
    pub time_limit_s: Option<f64>,
}

impl Settings {
    /// Hash of model and build, 16 hexadecimal digits.
    pub fn hash(&self) -> String {
        let mut hash = Sha256::new();
        for part in [&self.model, &self.build] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
        hash.update(FORMAT.to_le_bytes());
        hexadecimal(&hash.finalize()[..8])
    }
}

/// Hash and size of a log file.
#[derive(Debug, Clone, PartialEq)]
pub struct FileHash {
    /// SHA-256 of the contents, and of the import file where there is one; hexadecimal.
    pub sha256: String,
    /// Size, bytes.
    pub bytes: i64,
}

impl FileHash {
    /// Reads the file.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn of(path: &Path) -> io::Result<FileHash> {
        let mut hash = Sha256::new();
        let bytes = add_file(&mut hash, path)?;
        let import = import::file_of(path);
        if import != path && import.is_file() {
            add_file(&mut hash, &import)?;
        }
        Ok(FileHash { sha256: hexadecimal(&hash.finalize()), bytes })
    }
}

fn add_file(hash: &mut Sha256, path: &Path) -> io::Result<i64> {
    let (mut file, mut buffer, mut bytes) = (File::open(path)?, vec![0; 1 << 16], 0);
    loop {
        let count = file.read(&mut buffer)?;
        if count == 0 {
            return Ok(bytes);
        }
        hash.update(&buffer[..count]);
        bytes += count as i64;
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A line of the journal: the begin of a computation, or its key and row.
#[derive(Debug, Default, Serialize, Deserialize)]
struct JournalLine {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    begin: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    key: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    row: Option<Row>,
}

/// A table under computation.
#[derive(Debug)]
pub struct Session {
    table: PathBuf,
    path: PathBuf,
    journal: File,
    settings: Settings,
    settings_hash: String,
    done: BTreeMap<String, Row>,
    attempts: BTreeMap<String, usize>,
}

impl Session {
    /// Opens the journal of `table`, or creates it, and reads the answers that it has.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn open(table: &Path, settings: Settings) -> Result<Session, SessionError> {
        let path = journal_of(table);
        let failed = |source| SessionError::Write { path: path.clone(), source };
        let mut journal = OpenOptions::new().create(true).read(true).append(true).open(&path).map_err(failed)?;
        match journal.try_lock() {
            Ok(()) => {}
            Err(std::fs::TryLockError::WouldBlock) => return Err(SessionError::Busy(table.to_owned())),
            Err(std::fs::TryLockError::Error(source)) => return Err(failed(source)),
        }
        let settings_hash = settings.hash();
        let (mut done, mut attempts) = (BTreeMap::new(), BTreeMap::<String, usize>::new());
        let mut ends_in_a_line = true;
        let mut reader = BufReader::new(&mut journal);
        reader.seek(SeekFrom::Start(0)).map_err(failed)?;
        let mut bytes = Vec::new();
        while reader.read_until(b'\n', &mut bytes).map_err(failed)? > 0 {
            ends_in_a_line = bytes.ends_with(b"\n");
            match serde_json::from_slice(&bytes) {
                Ok(JournalLine { key: Some(key), row: Some(row), .. }) if row.settings == settings_hash => drop(done.insert(key, row)),
                Ok(JournalLine { begin: Some(begin), .. }) if begin.ends_with(&settings_hash) => *attempts.entry(begin).or_default() += 1,
                _ => {}
            }
            bytes.clear();
        }
        drop(reader);
        if !ends_in_a_line {
            journal.write_all(b"\n").map_err(failed)?;
        }
        Ok(Session { table: table.to_owned(), path, journal, settings, settings_hash, done, attempts })
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    fn key(&self, sha256: &str) -> String {
        format!("{sha256}:{}", self.settings_hash)
    }

    /// The answer about the log with this hash; not that of a search which a smaller limit has ended.
    pub fn answer(&self, sha256: &str) -> Option<&Row> {
        let is_above = |is: Option<f64>, was: Option<f64>| was.is_some_and(|was| is.is_none_or(|is| is > was));
        let passes = |limit: Option<i64>| limit.map(|limit| limit as f64);
        let longer = |row: &Row| {
            is_above(self.settings.time_limit_s, row.time_limit_s)
                || is_above(passes(self.settings.effort_limit_passes), passes(row.effort_limit_passes))
        };
        self.done.get(&self.key(sha256)).filter(|row| !(row.verdict == NOT_FINISHED && longer(row)))
    }

    /// The computation of this log has ended the program so often that it is not tried again.
    pub fn is_abandoned(&self, sha256: &str) -> bool {
        let key = self.key(sha256);
        !self.done.contains_key(&key) && self.attempts.get(&key).is_some_and(|attempts| *attempts >= MAX_ATTEMPTS)
    }

    /// Notes that the computation of a log begins.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn begin(&mut self, sha256: &str) -> Result<(), SessionError> {
        let begin = Some(self.key(sha256));
        self.append(&JournalLine { begin, ..JournalLine::default() })
    }

    /// Keeps the answer about a log; it is on the disk when this returns. An answer without a hash is not kept.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn record(&mut self, mut row: Row) -> Result<(), SessionError> {
        let Some(key) = row.sha256.as_deref().map(|sha256| self.key(sha256)) else { return Ok(()) };
        self.complete(&mut row);
        self.append(&JournalLine { key: Some(key.clone()), row: Some(row.clone()), begin: None })?;
        self.journal.sync_data().map_err(|source| SessionError::Write { path: self.path.clone(), source })?;
        self.done.insert(key, row);
        Ok(())
    }

    /// Enters the settings into a row.
    fn complete(&self, row: &mut Row) {
        row.model.clone_from(&self.settings.model_name);
        row.settings.clone_from(&self.settings_hash);
        row.build.clone_from(&self.settings.build);
        row.effort_limit_passes = self.settings.effort_limit_passes;
        row.time_limit_s = self.settings.time_limit_s;
    }

    fn append(&mut self, line: &JournalLine) -> Result<(), SessionError> {
        let failed = |source| SessionError::Write { path: self.path.clone(), source };
        let mut text = serde_json::to_vec(line).map_err(|error| failed(io::Error::other(error)))?;
        text.push(b'\n');
        self.journal.write_all(&text).map_err(failed)
    }

    /// Writes the table of these logs: path with hash, or with the reason why there is none. Logs without an answer are left out, unless
    /// `failures` has a reason for their hash. Sorted by path.
    ///
    /// # Errors
    /// The table cannot be written.
    pub fn write_table(
        &self,
        logs: &[(String, Result<FileHash, String>)],
        failures: &BTreeMap<String, String>,
        identities: &IdentityTable,
    ) -> Result<Vec<Row>, SessionError> {
        let row = |(path, hash): &(String, Result<FileHash, String>)| {
            let failed = |hash: Option<&FileHash>, error: &String| {
                let mut row = Row::failed(path, hash.map(|hash| (hash.sha256.clone(), hash.bytes)), error.clone());
                self.complete(&mut row);
                row
            };
            let mut row = match hash {
                Err(error) => failed(None, error),
                Ok(hash) => match self.answer(&hash.sha256) {
                    Some(row) => Row { path: path.clone(), ..row.clone() },
                    None => failed(Some(hash), failures.get(&hash.sha256)?),
                },
            };
            identities.apply(&mut row);
            Some(row)
        };
        let mut rows: Vec<Row> = logs.iter().filter_map(row).collect();
        rows.sort_by(|a, b| a.path.cmp(&b.path));
        table::write(&self.table, &rows).map_err(|source| SessionError::Write { path: self.table.clone(), source })?;
        Ok(rows)
    }
}

/// The journal of a table.
pub fn journal_of(table: &Path) -> PathBuf {
    let mut name = table.as_os_str().to_owned();
    name.push(".journal");
    name.into()
}

/// The logs that these paths name: files as they are, of folders the logs with all subfolders. Sorted, each once.
///
/// # Errors
/// A folder cannot be read.
pub fn logs_of(paths: &[PathBuf]) -> io::Result<Vec<String>> {
    let mut found = BTreeSet::new();
    let mut open: Vec<PathBuf> = paths.to_vec();
    while let Some(path) = open.pop() {
        if !path.is_dir() {
            found.insert(path.display().to_string());
            continue;
        }
        let at = |error: io::Error| io::Error::new(error.kind(), format!("{}: {error}", path.display()));
        for entry in std::fs::read_dir(&path).map_err(at)? {
            let entry = entry.map_err(at)?.path();
            // A link to a folder may lead back to it.
            if entry.is_dir() && !entry.is_symlink() || entry.is_file() && is_log(&entry) {
                open.push(entry);
            }
        }
    }
    Ok(found.into_iter().collect())
}

/// The file has an ending of the project, or an import file.
fn is_log(path: &Path) -> bool {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("csv" | "parquet") => true,
        Some(other) => import::ENDINGS.contains(&other) && import::file_of(path).is_file(),
        None => false,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn settings() -> Settings {
        Settings {
            model_name: "drive".to_owned(),
            model: "[drive]".to_owned(),
            build: "1".to_owned(),
            effort_limit_passes: Some(100),
            time_limit_s: Some(1.0),
        }
    }

    fn row(sha256: &str, verdict: &str) -> Row {
        Row { path: format!("{sha256}.csv"), sha256: Some(sha256.to_owned()), verdict: verdict.to_owned(), ..Row::default() }
    }

    #[test]
    fn answers_survive_and_a_torn_line_is_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let table = folder.path().join("a.parquet");
        let mut session = Session::open(&table, settings()).unwrap();
        assert!(matches!(Session::open(&table, settings()), Err(SessionError::Busy(_))));
        session.record(row("aa", "adequate")).unwrap();
        session.record(row("bb", "adequate")).unwrap();
        drop(session);
        let journal = journal_of(&table);
        let text = std::fs::read_to_string(&journal).unwrap();
        std::fs::write(&journal, &text[..text.len() - 9]).unwrap();
        let mut session = Session::open(&table, settings()).unwrap();
        assert!(session.answer("aa").is_some() && session.answer("bb").is_none());
        session.record(row("cc", "adequate")).unwrap();
        drop(session);
        let session = Session::open(&table, settings()).unwrap();
        assert!(session.answer("cc").is_some(), "a line after the torn one is whole");
        let hash = |sha256: &str| Ok(FileHash { sha256: sha256.to_owned(), bytes: 0 });
        let logs = [("z.csv", hash("aa")), ("b.csv", hash("aa")), ("q.csv", hash("bb")), ("m.csv", Err("gone".to_owned()))];
        let rows = session.write_table(&logs.map(|(p, h)| (p.to_owned(), h)), &BTreeMap::new(), &IdentityTable::default()).unwrap();
        assert_eq!(rows.iter().map(|r| r.path.as_str()).collect::<Vec<_>>(), ["b.csv", "m.csv", "z.csv"]);
        assert_eq!(rows[1].error.as_deref(), Some("gone"));
    }

    #[test]
    fn other_settings_and_a_larger_limit_ask_again() {
        let folder = tempfile::tempdir().unwrap();
        let table = folder.path().join("a.parquet");
        let mut session = Session::open(&table, settings()).unwrap();
        session.record(row("aa", "adequate")).unwrap();
        session.record(row("bb", NOT_FINISHED)).unwrap();
        drop(session);
        let known = |settings: Settings| {
            let session = Session::open(&table, settings).unwrap();
            ["aa", "bb"].map(|sha256| session.answer(sha256).is_some())
        };
        assert_eq!(known(settings()), [true, true]);
        assert_eq!(known(Settings { time_limit_s: Some(2.0), ..settings() }), [true, false]);
        assert_eq!(known(Settings { time_limit_s: None, ..settings() }), [true, false]);
        assert_eq!(known(Settings { effort_limit_passes: Some(101), ..settings() }), [true, false]);
        assert_eq!(known(Settings { effort_limit_passes: Some(99), ..settings() }), [true, true]);
        assert_eq!(known(Settings { build: "2".to_owned(), ..settings() }), [false, false]);
    }

    #[test]
    fn log_that_ends_the_program_is_abandoned() {
        let folder = tempfile::tempdir().unwrap();
        let table = folder.path().join("a.parquet");
        for _ in 0..MAX_ATTEMPTS {
            let mut session = Session::open(&table, settings()).unwrap();
            assert!(!session.is_abandoned("aa"));
            session.begin("aa").unwrap();
        }
        let mut session = Session::open(&table, settings()).unwrap();
        assert!(session.is_abandoned("aa") && !session.is_abandoned("bb"));
        session.record(row("aa", "adequate")).unwrap();
        assert!(!session.is_abandoned("aa"));
    }
}
