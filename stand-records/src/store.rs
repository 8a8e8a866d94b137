//! The record store: calibration records of many devices in one folder, as a SQLite database with the raw logs beside it.
//!
//! `records.sqlite` has the tables `parts`, `sessions`, `quantities` and `logs`; `logs/` has each raw log once, named by its SHA-256.
//! Input: the folder of a session with its record. Output: records as [`ArchivedRecord`] and rows of quantities.
//!
//! A session is in the store once [`RecordStore::add`] has returned: its logs are on the disk before the database, which is written in one
//! transaction with full synchronisation. A killed program or a full disk leaves the store as it was before; several programs may add at
//! the same time.

use super::archive::ArchivedRecord;
use super::stored_record::{RECORD_FILE, StoredRecord};
use identification::files;
use identification::statistics::uncertainty::COVERAGE_PROBABILITY;
use rusqlite::{Connection, OptionalExtension, TransactionBehavior, params};
use schemars::JsonSchema;
use stand_acquire::calibration_session::journal::{JournalError, sha256};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Name of the database in the folder of a store.
pub const STORE_FILE: &str = "records.sqlite";
/// Folder of the raw logs.
const LOGS: &str = "logs";
/// Longest wait for another program that writes.
const BUSY_TIMEOUT: Duration = Duration::from_secs(30);
/// Version of the tables.
const SCHEMA_VERSION: i64 = 1;

const SCHEMA: &str = "
CREATE TABLE parts (id INTEGER PRIMARY KEY, kind TEXT NOT NULL, serial TEXT NOT NULL, sensor TEXT NOT NULL, UNIQUE (kind, serial));
CREATE TABLE sessions (
    id INTEGER PRIMARY KEY, part INTEGER NOT NULL REFERENCES parts, began TEXT NOT NULL, computed TEXT NOT NULL, stand TEXT NOT NULL, operator TEXT NOT NULL,
    complete INTEGER NOT NULL, folder TEXT NOT NULL, record TEXT NOT NULL, sha256 TEXT NOT NULL UNIQUE);
CREATE TABLE quantities (
    session INTEGER NOT NULL REFERENCES sessions, name TEXT NOT NULL, unit TEXT NOT NULL, value REAL, u REAL, dof REAL, k REAL, U_95 REAL, temperature_C REAL,
    PRIMARY KEY (session, name));
CREATE TABLE logs (
    session INTEGER NOT NULL REFERENCES sessions, step TEXT NOT NULL, file TEXT NOT NULL, sha256 TEXT NOT NULL, rows INTEGER NOT NULL, lost_rows INTEGER NOT NULL,
    PRIMARY KEY (session, file));
";

/// Why the store was not read or written.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The database.
    #[error("{path}: {message}")]
    Database {
        /// The file.
        path: PathBuf,
        /// Message of SQLite.
        message: String,
    },
    /// A file of the session or of the store.
    #[error("{path}: {message}")]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// A folder that is not that of a calibration session with a record.
    #[error("{path}: not the folder of a calibration session, whose record is {RECORD_FILE}: {message}")]
    NoRecord {
        /// The folder.
        path: PathBuf,
        /// What is wrong with its record.
        message: String,
    },
    /// A raw log is missing or has changed.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// No session has this number.
    #[error("{path}: no session {number}; `stand records list` prints the numbers")]
    Session {
        /// The store.
        path: PathBuf,
        /// The number.
        number: i64,
    },
}

/// A store, open.
pub struct RecordStore {
    folder: PathBuf,
    connection: Connection,
}

/// A quantity of a session in the store.
#[derive(Debug, Clone, PartialEq, serde::Serialize, JsonSchema)]
pub struct QuantityRow {
    /// Number of the session.
    pub session: i64,
    /// Kind of the device.
    pub kind: String,
    /// Serial number.
    pub serial: String,
    /// When the session began.
    pub began: String,
    /// Name of the quantity.
    pub quantity: String,
    /// Value.
    pub value: Option<f64>,
    /// Standard uncertainty.
    pub u: Option<f64>,
    /// Effective degrees of freedom; `None`: infinite.
    pub dof: Option<f64>,
    /// Coverage factor for 95 %.
    pub k: Option<f64>,
    /// Expanded uncertainty.
    #[serde(rename = "U")]
    pub expanded_u: Option<f64>,
    /// Unit.
    pub unit: String,
    /// Temperature of the device, °C.
    pub temperature_C: Option<f64>,
}

impl RecordStore {
    /// Whether a folder is a store.
    pub fn is_store(folder: &Path) -> bool {
        folder.join(STORE_FILE).is_file()
    }

    /// Opens the store in a folder; creates it where there is none.
    ///
    /// # Errors
    /// The folder cannot be written; the database is damaged, or of a later version of these tools.
    pub fn open(folder: &Path) -> Result<Self, StoreError> {
        let path = folder.join(STORE_FILE);
        std::fs::create_dir_all(folder.join(LOGS)).map_err(|e| StoreError::File { path: folder.to_owned(), message: e.to_string() })?;
        let database = |e: rusqlite::Error| StoreError::Database { path: path.clone(), message: e.to_string() };
        let mut connection = Connection::open(&path).map_err(database)?;
        connection.busy_timeout(BUSY_TIMEOUT).map_err(database)?;
        connection.execute_batch("PRAGMA synchronous = EXTRA; PRAGMA foreign_keys = ON;").map_err(database)?;
        let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate).map_err(database)?;
        let version: i64 = transaction.query_row("PRAGMA user_version", [], |row| row.get(0)).map_err(database)?;
        match version {
            0 => {
                transaction.execute_batch(SCHEMA).map_err(database)?;
                transaction.pragma_update(None, "user_version", SCHEMA_VERSION).map_err(database)?;
            }
            SCHEMA_VERSION => {}
            later => {
                return Err(StoreError::Database { path, message: format!("version {later} of the store needs later tools than these") });
            }
        }
        transaction.commit().map_err(database)?;
        Ok(Self { folder: folder.to_owned(), connection })
    }

    fn database(&self, error: rusqlite::Error) -> StoreError {
        StoreError::Database { path: self.folder.join(STORE_FILE), message: error.to_string() }
    }

    fn log_path(&self, sha256: &str, file: &str) -> PathBuf {
        let ending = Path::new(file).extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy()));
        self.folder.join(LOGS).join(format!("{sha256}{ending}"))
    }

    /// Adds the session of a folder with its record; returns its number. A session that is in the store already keeps its number.
    ///
    /// # Errors
    /// A file cannot be read or written; a raw log has changed; the database.
    pub fn add(&mut self, folder: &Path) -> Result<i64, StoreError> {
        let path = folder.join(RECORD_FILE);
        let file_error = |path: &Path, message: String| StoreError::File { path: path.to_owned(), message };
        let no_record = |message: String| StoreError::NoRecord { path: folder.to_owned(), message };
        let text = std::fs::read_to_string(&path).map_err(|e| no_record(e.to_string()))?;
        let json = serde_json::from_str(&text).map_err(|e| no_record(e.to_string()))?;
        let record = StoredRecord::from_json(&json).map_err(no_record)?;
        let hash = sha256(&path)?;
        for step in &record.header.steps {
            let from = folder.join(&step.log);
            let found = sha256(&from)?;
            if found != step.sha256 {
                return Err(JournalError::Hash { path: from, found, recorded: step.sha256.clone() }.into());
            }
            let to = self.log_path(&step.sha256, &step.log);
            if !to.exists() {
                let copy =
                    |out: &mut std::io::BufWriter<&mut std::fs::File>| std::io::copy(&mut std::fs::File::open(&from)?, out).map(drop);
                files::replace(&to, copy).map_err(|e| file_error(&to, e.to_string()))?;
            }
        }
        let inserted = insert(&mut self.connection, &record, &text, &hash, folder);
        inserted.map_err(|e| self.database(e))
    }

    /// Numbers and records of all sessions, by date.
    ///
    /// # Errors
    /// The database; a record that cannot be read.
    pub fn records(&self) -> Result<Vec<(i64, ArchivedRecord)>, StoreError> {
        let mut statement = self.connection.prepare("SELECT id, record FROM sessions ORDER BY began, id").map_err(|e| self.database(e))?;
        let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).map_err(|e| self.database(e))?;
        let rows: Vec<(i64, String)> = rows.collect::<Result<_, _>>().map_err(|e| self.database(e))?;
        rows.into_iter().map(|(number, text)| Ok((number, self.parsed(number, &text)?))).collect()
    }

    fn parsed(&self, number: i64, text: &str) -> Result<ArchivedRecord, StoreError> {
        let path = self.folder.join(STORE_FILE);
        let invalid = |message: String| StoreError::Database { path: path.clone(), message: format!("session {number}: {message}") };
        let json = serde_json::from_str(text).map_err(|e| invalid(e.to_string()))?;
        Ok(ArchivedRecord { path: path.clone(), record: StoredRecord::from_json(&json).map_err(invalid)? })
    }

    /// Writes a session with its raw logs into a new folder, as it was recorded; returns its record.
    ///
    /// # Errors
    /// No such session; a file cannot be written.
    pub fn check_out(&self, number: i64, folder: &Path) -> Result<ArchivedRecord, StoreError> {
        let missing = || StoreError::Session { path: self.folder.clone(), number };
        let query = self.connection.query_row("SELECT record FROM sessions WHERE id = ?1", [number], |row| row.get::<_, String>(0));
        let text = query.optional().map_err(|e| self.database(e))?.ok_or_else(missing)?;
        let archived = self.parsed(number, &text)?;
        let file_error = |path: &Path, e: std::io::Error| StoreError::File { path: path.to_owned(), message: e.to_string() };
        std::fs::create_dir_all(folder).map_err(|e| file_error(folder, e))?;
        for step in &archived.record.header.steps {
            let (from, to) = (self.log_path(&step.sha256, &step.log), folder.join(&step.log));
            if from.exists() {
                std::fs::copy(&from, &to).map_err(|e| file_error(&from, e))?;
            }
        }
        let path = folder.join(RECORD_FILE);
        files::replace_text(&path, &text).map_err(|e| file_error(&path, e))?;
        Ok(ArchivedRecord { path, ..archived })
    }

    /// All quantities of all sessions, by serial number, date and name.
    ///
    /// # Errors
    /// The database.
    pub fn quantities(&self) -> Result<Vec<QuantityRow>, StoreError> {
        const QUERY: &str = "SELECT s.id, p.kind, p.serial, s.began, q.name, q.value, q.u, q.dof, q.k, q.U_95, q.unit, q.temperature_C
            FROM quantities q JOIN sessions s ON s.id = q.session JOIN parts p ON p.id = s.part ORDER BY p.kind, p.serial, s.began, s.id, q.rowid";
        let mut statement = self.connection.prepare(QUERY).map_err(|e| self.database(e))?;
        let row = |row: &rusqlite::Row| {
            Ok(QuantityRow {
                session: row.get(0)?,
                kind: row.get(1)?,
                serial: row.get(2)?,
                began: row.get(3)?,
                quantity: row.get(4)?,
                value: row.get(5)?,
                u: row.get(6)?,
                dof: row.get(7)?,
                k: row.get(8)?,
                expanded_u: row.get(9)?,
                unit: row.get(10)?,
                temperature_C: row.get(11)?,
            })
        };
        let rows = statement.query_map([], row).map_err(|e| self.database(e))?;
        rows.collect::<Result<_, _>>().map_err(|e| self.database(e))
    }
}

/// Inserts a session in one transaction; an equal record keeps its number.
fn insert(connection: &mut Connection, record: &StoredRecord, text: &str, hash: &str, folder: &Path) -> Result<i64, rusqlite::Error> {
    let header = &record.header;
    let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
    let known = transaction.query_row("SELECT id FROM sessions WHERE sha256 = ?1", [hash], |row| row.get(0)).optional()?;
    if let Some(number) = known {
        return Ok(number);
    }
    let kind = header.dut_kind.name();
    transaction.execute(
        "INSERT INTO parts (kind, serial, sensor) VALUES (?1, ?2, ?3) ON CONFLICT (kind, serial) DO NOTHING",
        params![kind, header.serial, header.sensor],
    )?;
    let part: i64 =
        transaction.query_row("SELECT id FROM parts WHERE kind = ?1 AND serial = ?2", params![kind, header.serial], |row| row.get(0))?;
    transaction.execute(
        "INSERT INTO sessions (part, began, computed, stand, operator, complete, folder, record, sha256) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
        params![
            part,
            header.began,
            header.computed,
            header.stand,
            header.operator,
            header.is_complete,
            folder.display().to_string(),
            text,
            hash
        ],
    )?;
    let number = transaction.last_insert_rowid();
    for q in &record.quantities {
        // SQLite stores NaN and infinity as NULL.
        let finite = |x: f64| x.is_finite().then_some(x);
        transaction.execute(
            "INSERT INTO quantities (session, name, unit, value, u, dof, k, U_95, temperature_C) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
            params![
                number,
                q.name,
                q.unit,
                finite(q.value),
                finite(q.combined_u()),
                finite(q.effective_dof()),
                finite(q.coverage_factor(COVERAGE_PROBABILITY)),
                finite(q.expanded_u()),
                q.conditions.temperature.map(|t| t.at_C)
            ],
        )?;
    }
    for step in &header.steps {
        transaction.execute(
            "INSERT INTO logs (session, step, file, sha256, rows, lost_rows) VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
            params![number, step.name, step.log, step.sha256, step.rows as i64, step.lost_rows as i64],
        )?;
    }
    transaction.commit()?;
    Ok(number)
}
