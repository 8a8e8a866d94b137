//! Start of an attempt: the work folder with logs, instructions and the table of answers.

use schemars::JsonSchema;
use std::path::Path;

use stand_firmware::VERSION;

use super::LabError;
use super::answers::{ANSWERS_FILE, empty_table};
use super::course::{Lab, Language, Task};
use super::journal::{Event, append};
use super::judge::normalized_error;
use super::measurement::{LOGS_FOLDER, record, reference};
use super::real_stand::RealStand;
use super::seal::Key;
use super::stand_recording::{self, WorkOperator};
use super::teacher_reference::TeacherReference;
use super::work::{INSTRUCTIONS_FILE, MODEL_FILE, WORK_FILE, Work, check_student, hashes};
use identification::files;
use stand_acquire::connection::StandConnection;

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
    /// On a real stand: what the reference is worth on these logs, for the teacher; not in the folder.
    pub reference_checks: Vec<ReferenceCheck>,
}

/// A quantity of the teacher's reference beside the reference procedure on the recorded logs.
#[derive(Debug, Clone, PartialEq, serde::Serialize, JsonSchema)]
pub struct ReferenceCheck {
    /// Name of the quantity.
    pub name: String,
    /// U_X of the reference.
    #[serde(rename = "U_X")]
    pub reference_u: f64,
    /// U_ref of the reference procedure on the logs.
    #[serde(rename = "U_ref")]
    pub procedure_u: f64,
    /// |x_ref − X|/√(U_ref² + U_X²), with the value x_ref of the reference procedure.
    pub normalized_error: f64,
}

/// Starts attempt number `attempt` of `student` in a new folder; sealed by `key`, or a practice work without one. `on_progress` as for the
/// recording of the logs: the part that is done, 0 to 1.
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
    let work = new_work(lab, (student, attempt), key.is_some(), language, folder)?;
    let logs = record(lab, &work.key(key)?, &work.attempt(), &folder.join(LOGS_FOLDER), on_progress)?;
    let logs = logs.into_iter().map(|log| format!("{LOGS_FOLDER}/{log}")).collect();
    write_folder(lab, work, logs, folder)
}

/// The description of an attempt whose folder has no files yet.
fn new_work(lab: &Lab, (student, attempt): (&str, u32), sealed: bool, language: Language, folder: &Path) -> Result<Work, LabError> {
    check_student(student)?;
    if attempt == 0 {
        return Err(LabError::Argument("attempts count from 1".to_owned()));
    }
    if folder.read_dir().is_ok_and(|mut entries| entries.next().is_some()) {
        return Err(LabError::invalid(folder, "the folder has files already; give the name of a new one"));
    }
    let (lab, student, build) = (lab.id.to_owned(), student.to_owned(), VERSION.to_owned());
    Ok(Work { lab, student, attempt, sealed, language, build, real_stand: None })
}

/// Writes the files of a work beside its `logs`, which are in the folder, and the first entry of its journal.
fn write_folder(lab: &Lab, work: Work, logs: Vec<String>, folder: &Path) -> Result<Started, LabError> {
    let (language, attempt) = (work.language, work.attempt);
    let description = toml::to_string(&work).map_err(|e| LabError::invalid(&folder.join(WORK_FILE), e.to_string()))?;
    let mut written = Vec::new();
    let mut write = |name: &str, text: &str| {
        written.push(name.to_owned());
        files::replace_text(&folder.join(name), text).map_err(|source| LabError::file(&folder.join(name), "write", source))
    };
    write(WORK_FILE, &description)?;
    write(INSTRUCTIONS_FILE, &work.instructions(lab))?;
    write(ANSWERS_FILE, &empty_table(lab, language))?;
    if lab.hunt().is_some() {
        write(MODEL_FILE, lab.model())?;
    }
    let fixed = logs.iter().map(String::as_str).chain([WORK_FILE]);
    let event = Event::Started { lab: work.lab.clone(), student: work.student.clone(), attempt };
    let code = append(folder, event, hashes(folder, fixed)?)?;
    written.extend(logs);
    Ok(Started { work, title: lab.title.in_language(language).to_owned(), files: written, code, reference_checks: Vec::new() })
}

/// An attempt on a real stand that can be started.
#[derive(Debug)]
pub struct RealStandStart<'a> {
    lab: Lab,
    work: Work,
    key: Key,
    reference: &'a TeacherReference,
    model: Option<String>,
    folder: &'a Path,
}

impl<'a> RealStandStart<'a> {
    /// Checks all that needs no stand. `model`: of a hunt, the drive with nothing hidden.
    ///
    /// # Errors
    /// As [`start`]; values of the reference that do not suit the work.
    pub fn new(
        lab: &Lab,
        attempt: (&str, u32),
        key: Key,
        (reference, model): (&'a TeacherReference, Option<&str>),
        language: Language,
        folder: &'a Path,
    ) -> Result<Self, LabError> {
        let work = new_work(lab, attempt, true, language, folder)?;
        let lab = lab.clone().on_real_stand(&reference.known, model)?;
        if let Task::Session(task) = &lab.task {
            lab.session(task.device)?;
        }
        if let Some(class) = reference.class_in_model(&lab.effects_in_model()) {
            return Err(LabError::Argument(format!("the reference hides `{class}`, which is part of the model: answers cannot name it")));
        }
        Ok(RealStandStart { lab, work, key, reference, model: model.map(str::to_owned), folder })
    }

    /// Records the logs from the stand and writes the work folder. No folder remains of a recording that ends early.
    ///
    /// # Errors
    /// The recording ends early; the reference procedure gives no result on the logs; a file cannot be written.
    pub async fn run(
        self,
        stand: &mut impl StandConnection,
        operator: &mut impl WorkOperator,
        on_progress: impl FnMut(f64) -> bool,
    ) -> Result<Started, LabError> {
        let RealStandStart { lab, mut work, key, reference, model, folder } = self;
        let is_new = !folder.exists();
        let logs = folder.join(LOGS_FOLDER);
        let recorded = async {
            let identity = stand_recording::identity(stand).await?;
            let files = stand_recording::record(&lab, stand, &logs, &reference.hidden, operator, on_progress).await?;
            Ok::<_, LabError>((identity, files, reference_checks(&lab, &logs, reference)?))
        };
        let recorded = recorded.await;
        if recorded.is_err() {
            let _ = std::fs::remove_dir_all(if is_new { folder } else { &logs });
        }
        let (identity, files, reference_checks) = recorded?;
        let names: Vec<String> = files.into_iter().map(|log| format!("{LOGS_FOLDER}/{log}")).collect();
        let real_stand = RealStand {
            reference_source: reference.source.clone(),
            reference_code: String::new(),
            seal: String::new(),
            model,
            identity,
            known: reference.known.clone(),
            logs: hashes(folder, names.iter().map(String::as_str))?,
        };
        work.real_stand = Some(real_stand.sealed(&key, &work.attempt(), &reference.sha256));
        Ok(Started { reference_checks, ..write_folder(&lab, work, names, folder)? })
    }
}

/// Compares the reference with the reference procedure on the logs in `folder`, which must give every quantity: otherwise the work could
/// not be judged.
fn reference_checks(lab: &Lab, folder: &Path, given: &TeacherReference) -> Result<Vec<ReferenceCheck>, LabError> {
    let found = reference(lab, folder)?;
    let check = |name: &String, x: f64, reference_u: f64| {
        let missing = || LabError::NoReferenceValue { name: name.clone() };
        let (value, procedure_u) = *found.get(name).filter(|(value, u)| value.is_finite() && u.is_finite()).ok_or_else(missing)?;
        Ok(ReferenceCheck {
            name: name.clone(),
            reference_u,
            procedure_u,
            normalized_error: normalized_error(value, procedure_u, x, reference_u),
        })
    };
    given.quantities.iter().map(|(name, x)| check(name, x.value, x.expanded_u)).collect()
}
