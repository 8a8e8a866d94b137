//! The notes of a log, `# key: value`: how it was recorded and how its columns were made.
//!
//! [`Note`] is the only writer of notes that the program reads again; the methods of [`Notes`] are the only reader. Notes of other loggers
//! are read too, as far as they are understood; a note about a column of a model that is not understood causes a warning.

mod read;
mod write;

use super::warning::LogWarning;
pub use read::{FaultNote, Provenance, RateSource, VoltageSource};
use read::{is_about_column, warnings};
pub use write::{Note, microseconds, timestamp};

/// The notes of a log, in their order. A `#` line without a key has the key `comment`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Notes(Vec<(String, String)>);

impl Notes {
    /// Adds a note.
    pub fn push(&mut self, note: Note) {
        self.0.push(note.entry());
    }

    /// Adds a note of the user or of another logger.
    pub fn push_text(&mut self, key: impl Into<String>, value: impl Into<String>) {
        self.0.push((key.into(), value.into()));
    }

    /// Adds `more`, which replace notes of the same key.
    pub fn replace(&mut self, more: Notes) {
        self.0.retain(|(key, _)| !more.0.iter().any(|(k, _)| k == key));
        self.0.extend(more.0);
    }

    /// Renames the keys that `new_key` names.
    pub(super) fn rename(&mut self, new_key: impl Fn(&str) -> Option<String>) {
        for (key, _) in &mut self.0 {
            if let Some(new) = new_key(key) {
                *key = new;
            }
        }
    }

    /// Drops the notes about the column `new` and gives those about `old` to it.
    pub(super) fn replace_subject(&mut self, old: &str, new: &str) {
        self.0.retain(|(key, _)| !is_about_column(key, new));
        self.rename(|key| is_about_column(key, old).then(|| new.to_owned()));
    }

    /// Removes the notes with that key; the value of the last one.
    pub(super) fn take_text(&mut self, key: &str) -> Option<String> {
        let value = self.0.iter().rev().find(|(k, _)| k == key).map(|(_, value)| value.clone());
        self.0.retain(|(k, _)| k != key);
        value
    }

    /// A warning for each note about a column of the drive that is not understood.
    pub fn not_understood(&self) -> Vec<LogWarning> {
        warnings(&self.0)
    }

    /// The value of the first note with that key.
    pub fn text(&self, key: &str) -> Option<&str> {
        self.0.iter().find(|(k, _)| k == key).map(|(_, value)| value.as_str())
    }
}

impl std::ops::Deref for Notes {
    type Target = [(String, String)];
    fn deref(&self) -> &[(String, String)] {
        &self.0
    }
}

impl From<Vec<(String, String)>> for Notes {
    fn from(notes: Vec<(String, String)>) -> Self {
        Notes(notes)
    }
}

impl Extend<Note> for Notes {
    fn extend<I: IntoIterator<Item = Note>>(&mut self, notes: I) {
        self.0.extend(notes.into_iter().map(|note| note.entry()));
    }
}

impl FromIterator<Note> for Notes {
    fn from_iter<I: IntoIterator<Item = Note>>(notes: I) -> Self {
        Notes(notes.into_iter().map(|note| note.entry()).collect())
    }
}

impl<'a> IntoIterator for &'a Notes {
    type Item = &'a (String, String);
    type IntoIter = std::slice::Iter<'a, (String, String)>;
    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}
