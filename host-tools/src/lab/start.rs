//! Start of an attempt: the work folder with logs, instructions and the table of answers.

use std::path::Path;

use stand_firmware::VERSION;

use super::LabError;
use super::answers::{ANSWERS_FILE, empty_table};
use super::course::{Lab, Language};
use super::journal::{Event, append};
use super::measurement::{LOGS_FOLDER, record};
use super::seal::Key;
use super::work::{INSTRUCTIONS_FILE, MODEL_FILE, WORK_FILE, Work, check_student, hashes};
use crate::files;

/// What was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Started {
    /// The work.
    pub work: Work,
    /// Title of the work in the language of its texts.
    pub title: String,
    /// Names of the files in the work folder; the logs begin with `logs/`.
    pub files: Vec<String>,
    /// Code of the first entry of the journal.
    pub code: String,
}

/// Starts attempt number `attempt` of `student` in a new folder; sealed by `key`, or a practice work without one. `on_progress` as for the recording of the
/// logs: the part that is done, 0 to 1.
///
/// # Errors
/// The folder has files, or cannot be written; an invalid name or number; interrupted.
pub fn start(
    lab: &Lab,
    (student, attempt): (&str, u32),
    key: Option<Key>,
    language: Language,
    folder: &Path,
    on_progress: impl FnMut(f64) -> bool,
) -> Result<Started, LabError> {
    check_student(student)?;
    if attempt == 0 {
        return Err(LabError::Argument("attempts count from 1".to_owned()));
    }
    if folder.read_dir().is_ok_and(|mut entries| entries.next().is_some()) {
        return Err(LabError::invalid(folder, "the folder has files already; give the name of a new one"));
    }
    let work =
        Work { lab: lab.id.to_owned(), student: student.to_owned(), attempt, sealed: key.is_some(), language, build: VERSION.to_owned() };
    let logs = record(lab, &work.key(key)?, &work.attempt(), &folder.join(LOGS_FOLDER), on_progress)?;
    let description = toml::to_string(&work).map_err(|e| LabError::invalid(&folder.join(WORK_FILE), e.to_string()))?;
    let mut written = Vec::new();
    let mut write = |name: &str, text: &str| {
        written.push(name.to_owned());
        files::replace_text(&folder.join(name), text).map_err(|source| LabError::file(&folder.join(name), "write", source))
    };
    write(WORK_FILE, &description)?;
    write(INSTRUCTIONS_FILE, lab.instructions(language))?;
    write(ANSWERS_FILE, &empty_table(lab, language))?;
    if lab.hunt().is_some() {
        write(MODEL_FILE, lab.model())?;
    }
    let logs: Vec<String> = logs.into_iter().map(|log| format!("{LOGS_FOLDER}/{log}")).collect();
    let fixed = logs.iter().map(String::as_str).chain([WORK_FILE]);
    let event = Event::Started { lab: work.lab.clone(), student: work.student.clone(), attempt };
    let code = append(folder, event, hashes(folder, fixed)?)?;
    written.extend(logs);
    Ok(Started { work, title: lab.title.in_language(language).to_owned(), files: written, code })
}
