//! Hash of what an analysis is given, to tell a changed simulator from a changed analysis.

use identification::log::Log;
use sha2::{Digest, Sha256};

/// Notes of a log that change with each commit or recording.
const VOLATILE_NOTES: [&str; 3] = ["firmware", "date", "stand"];

/// SHA-256 of logs, models and recordings.
#[derive(Default)]
pub struct InputHash(Sha256);

impl InputHash {
    /// Adds the columns of a log, and its notes except those that change with each commit.
    pub fn log(mut self, log: &Log) -> Self {
        for column in log.columns() {
            self.0.update(column.name.as_bytes());
            column.values.iter().for_each(|value| self.0.update(value.to_le_bytes()));
        }
        for (key, value) in log.notes().iter().filter(|(key, _)| !VOLATILE_NOTES.contains(&key.as_str())) {
            self.0.update(format!("{key}: {value}\n").as_bytes());
        }
        self
    }

    /// Adds a text.
    pub fn text(mut self, text: &str) -> Self {
        self.0.update(text.as_bytes());
        self
    }

    /// The first 8 bytes, hexadecimal.
    pub fn short(self) -> String {
        self.0.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect()
    }
}
