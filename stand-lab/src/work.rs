//! The work folder of an attempt.
//!
//! | file | content |
//! |---|---|
//! | `work.toml` | work, student, attempt, whether it is sealed, build; on a real stand [`RealStand`] |
//! | `instructions.md` | aim, theory, steps |
//! | `answers.toml` | the table to fill in |
//! | `logs/` | the measurement |
//! | `model.toml` | a hunt: the model by the data sheet |
//! | `lab-journal.jsonl` | the journal |

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::LabError;
use super::course::{Lab, Language};
use super::journal::file_sha256;
use super::real_stand::RealStand;
use super::seal::{Attempt, Key};

/// Name of the file that describes the work.
pub const WORK_FILE: &str = "work.toml";
/// Name of the instructions.
pub const INSTRUCTIONS_FILE: &str = "instructions.md";
/// Name of the model of a hunt.
pub const MODEL_FILE: &str = "model.toml";
/// Greatest length of a student's name, characters.
const MAX_NAME: usize = 100;

/// Description of the work in a folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Work {
    /// Identifier of the work.
    pub lab: String,
    /// The student.
    pub student: String,
    /// Number of the attempt, from 1.
    pub attempt: u32,
    /// Sealed by a teacher's key; otherwise a practice work, whose true values are public.
    pub sealed: bool,
    /// Language of the texts.
    pub language: Language,
    /// Build that recorded the logs.
    pub build: String,
    /// The real stand on which the logs were recorded; `None`: the simulated one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub real_stand: Option<RealStand>,
}

impl Work {
    /// Reads the description of the work in `folder`.
    ///
    /// # Errors
    /// The folder is no work folder.
    pub fn read(folder: &Path) -> Result<Self, LabError> {
        let path = folder.join(WORK_FILE);
        let text = std::fs::read_to_string(&path).map_err(|source| LabError::file(&path, "read", source))?;
        let work: Self = toml::from_str(&text).map_err(|e| LabError::invalid(&path, e.to_string().trim_end().to_owned()))?;
        check_student(&work.student)?;
        Ok(work)
    }

    /// The attempt.
    pub fn attempt(&self) -> Attempt {
        Attempt { lab: self.lab.clone(), student: self.student.clone(), number: self.attempt }
    }

    /// The work of the course.
    ///
    /// # Errors
    /// There is no such work; values of the real stand that do not suit it.
    pub fn lab(&self) -> Result<Lab, LabError> {
        let lab = Lab::find(&self.lab)?;
        match &self.real_stand {
            Some(stand) => lab.on_real_stand(&stand.known, stand.model.as_deref()),
            None => Ok(lab),
        }
    }

    /// The instructions of the work in its language (Markdown); on a real stand, what differs stands after the title.
    pub fn instructions(&self, lab: &Lab) -> String {
        let text = lab.instructions(self.language);
        let Some(stand) = &self.real_stand else { return text.to_owned() };
        let known: String = stand.known.iter().map(|(name, value)| format!("| `{name}` | {value} |\n")).collect();
        let none = if self.language == Language::En { "| none | |\n" } else { "| немає | |\n" };
        let section = lab
            .real_stand_text(self.language)
            .replace("{stand}", &stand.identity.to_string())
            .replace("{source}", &stand.reference_source)
            .replace("{known}\n", if known.is_empty() { none } else { &known });
        match text.split_once('\n') {
            Some((title, rest)) => format!("{title}\n\n{section}{rest}"),
            None => section,
        }
    }

    /// The key of a practice work, or the given one of a sealed work.
    ///
    /// # Errors
    /// A sealed work without a key.
    pub fn key(&self, given: Option<Key>) -> Result<Key, LabError> {
        match given {
            Some(_) if !self.sealed => Err(LabError::Argument("this is a practice work, which has no key".to_owned())),
            None if self.sealed => {
                Err(LabError::Argument("this work is sealed: only the teacher's key shows its true values (--key)".to_owned()))
            }
            given => Ok(given.unwrap_or_else(Key::practice)),
        }
    }
}

/// Checks the name or number of a student: not empty, without control characters, which separate the fields of a seal.
///
/// # Errors
/// An invalid name.
pub fn check_student(student: &str) -> Result<(), LabError> {
    let is_valid = !student.trim().is_empty() && student.chars().count() <= MAX_NAME && !student.chars().any(char::is_control);
    let invalid = || LabError::Argument(format!("the student's name must have 1 to {MAX_NAME} characters, without control characters"));
    is_valid.then_some(()).ok_or_else(invalid)
}

/// SHA-256 of the files at `names` in a work folder, by name.
///
/// # Errors
/// A file cannot be read.
pub fn hashes<'a>(folder: &Path, names: impl IntoIterator<Item = &'a str>) -> Result<BTreeMap<String, String>, LabError> {
    names.into_iter().map(|name| Ok((name.to_owned(), file_sha256(&path_in(folder, name))?))).collect()
}

/// The file `name` of a work folder; names have `/` on every system.
pub fn path_in(folder: &Path, name: &str) -> PathBuf {
    name.split('/').fold(folder.to_owned(), |path, part| path.join(part))
}
