//! Judgement of a work folder with the key: journal, origin of the logs, answers.
//!
//! Simulated stand: the measurement is recorded anew from the key in virtual time and its files are compared with the logs of the folder by
//! their hash. Real stand: the logs are compared with the hashes that were sealed with the key at the start, and the teacher's reference
//! with its code. The result is data for the teacher; the conclusion and the answers in words are for the teacher to judge.

use std::collections::BTreeSet;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;
use stand_firmware::VERSION;

use super::LabError;
use super::answers::{ANSWERS_FILE, AnswerProblem, Answers, by_class};
use super::check::read_answers;
use super::course::{HuntTask, Lab, When};
use super::journal::{ChainError, Event, JOURNAL_FILE, Journal, append};
use super::judge::{JudgedQuantity, MAX_UNCERTAINTY_RATIO, brier_score, mark, mark_on_real_stand, normalized_error};
use super::measurement::{Hidden, LOGS_FOLDER, Truth, record, reference, truth};
use super::seal::Key;
use super::teacher_reference::TeacherReference;
use super::work::{WORK_FILE, Work, hashes, path_in};

/// What speaks against a work apart from its values.
#[derive(Debug, Clone, PartialEq, Serialize, thiserror::Error, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Objection {
    /// The chain of the journal is broken.
    #[error("{error}")]
    Journal {
        /// Where.
        error: ChainError,
    },
    /// The journal begins with another work, student or attempt.
    #[error("the journal belongs to another work, student or attempt")]
    OtherWork,
    /// The noted code is not in the journal.
    #[error("the noted code is not in the journal: the journal was written anew, or the code is of another work")]
    CodeNotFound,
    /// A file differs from its hash in the first entry of the journal.
    #[error("{file}: changed since the start of the work")]
    Changed {
        /// The file.
        file: String,
    },
    /// A log is not that of this attempt.
    #[error("{file}: not the log of this student and attempt{}", if *other_build { "; the log was recorded by another build, which the replay needs" } else { "" })]
    OtherLog {
        /// The file.
        file: String,
        /// The log was recorded by another build of the program.
        other_build: bool,
    },
    /// The description of a real stand does not have the seal of this key.
    #[error(
        "work.toml: the seal is not that of this key: the description or the hashes of the logs were changed, or the work was started with another key"
    )]
    Seal,
    /// A log is not that which was recorded from the real stand.
    #[error("{file}: not the log that was recorded at the start: its sealed hash is another")]
    Replaced {
        /// The file.
        file: String,
    },
    /// The reference of a real stand is not that of the start.
    #[error("the reference is not the file that was fixed at the start of the work")]
    OtherReference,
    /// The answers were not checked in their final form, or only after the truth was shown.
    #[error(
        "the answers in their present form are not in the journal before the true values were shown: run `stand lab check` after the last change"
    )]
    NotChecked,
    /// `stand explain` was run before the student's own answers were recorded.
    #[error("`stand explain` was run on {log} before the student's own answers were complete and checked")]
    ExplainedFirst {
        /// The log.
        log: String,
    },
    /// An answer is missing or malformed.
    #[error("{problem}")]
    Answer {
        /// Which, and why.
        problem: AnswerProblem,
    },
}

/// A judged log of a hunt.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JudgedLog {
    /// What the log hides.
    #[serde(flatten)]
    pub hidden: Hidden,
    /// Brier score of the student's own probabilities.
    pub score_before: f64,
    /// Brier score of the final probabilities.
    pub score_after: f64,
}

/// The judged hunt.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JudgedHunt {
    /// The logs.
    pub logs: Vec<JudgedLog>,
    /// Mean of the final scores.
    pub mean_score: f64,
    /// A mean below this meets the criterion.
    pub max_score: f64,
}

/// The judgement.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Grade {
    /// The work.
    pub work: Work,
    /// What speaks against it.
    pub objections: Vec<Objection>,
    /// Measured values; empty for a hunt.
    pub quantities: Vec<JudgedQuantity>,
    /// The hunt; `None` for quantities.
    pub hunt: Option<JudgedHunt>,
    /// The true values or the reference are part of this judgement.
    pub values_shown: bool,
    /// The numerical criteria are met and nothing speaks against the work. Answers in words are not judged.
    pub criteria_met: bool,
}

/// Judges the work in `folder` with the teacher's key; `noted_code`: a code of the journal that was noted outside of the folder. The
/// journal keeps that the true values were shown. `on_progress` as for the recording of the logs.
///
/// # Errors
/// The folder is no work folder or cannot be read; a sealed work without a key; a work on a real stand; interrupted.
pub fn grade(folder: &Path, key: Option<Key>, noted_code: Option<&str>, on_progress: impl FnMut(f64) -> bool) -> Result<Grade, LabError> {
    let work = Work::read(folder)?;
    if work.real_stand.is_some() {
        return Err(LabError::Argument(
            "this work was recorded on a real stand: give the reference that was fixed at its start (--reference)".to_owned(),
        ));
    }
    let lab = work.lab()?;
    let key = work.key(key)?;
    let mut objections = journal_objections(&work, &lab, folder, noted_code)?;
    let replayed = replay(&lab, &key, &work, folder, on_progress, &mut objections)?;
    let answers = read_answers(folder)?;
    let (mut quantities, mut hunt) = (Vec::new(), None);
    match (lab.hunt(), truth(&lab, &key, &work.attempt())?) {
        (None, Truth::Quantities(values)) => {
            let exact = |name: &str| values.get(name).map(|value| Reference::Exact(*value));
            quantities = judge_quantities(&lab, &answers, exact, replayed.path())?;
        }
        (Some(task), Truth::Hidden(hidden)) => hunt = Some(judge_hunt(task, &answers, hidden)),
        _ => {}
    }
    finish(work, &lab, folder, &answers, (quantities, hunt), objections)
}

/// Judges the work of a real stand in `folder` with the teacher's key and the reference of its start. As [`grade`]; nothing is judged, and
/// no value shown, where the seal, a log or the reference is another.
///
/// # Errors
/// As [`grade`]; a work on the simulated stand; the reference is in the work folder.
pub fn grade_on_real_stand(folder: &Path, key: Option<Key>, reference: &Path, noted_code: Option<&str>) -> Result<Grade, LabError> {
    let work = Work::read(folder)?;
    let Some(stand) = &work.real_stand else {
        return Err(LabError::Argument(
            "this work was recorded on the simulated stand, whose true values follow from the key: it has no reference".to_owned(),
        ));
    };
    let is_inside = |path: &Path| Some(std::fs::canonicalize(path).ok()?.starts_with(std::fs::canonicalize(folder).ok()?));
    if is_inside(reference) == Some(true) {
        return Err(LabError::invalid(
            reference,
            "the reference is in the work folder, where the student can read it: the work has no sealed reference any more",
        ));
    }
    let (lab, attempt) = (work.lab()?, work.attempt());
    let (key, given) = (work.key(key)?, TeacherReference::read(reference, &lab)?);
    let mut origin = Vec::new();
    if !stand.is_sealed_by(&key, &attempt) {
        origin.push(Objection::Seal);
    }
    if !stand.has_reference(&key, &attempt, &given.sha256) {
        origin.push(Objection::OtherReference);
    }
    for (name, sha256) in &stand.logs {
        let path = path_in(folder, name);
        if !path.is_file() || super::journal::file_sha256(&path)? != *sha256 {
            origin.push(Objection::Replaced { file: name.clone() });
        }
    }
    let mut objections = journal_objections(&work, &lab, folder, noted_code)?;
    let answers = read_answers(folder)?;
    let (mut quantities, mut hunt) = (Vec::new(), None);
    if origin.is_empty() {
        let measured = |name: &str| given.quantities.get(name).map(|x| Reference::Measured { value: x.value, expanded_u: x.expanded_u });
        quantities = judge_quantities(&lab, &answers, measured, &folder.join(LOGS_FOLDER))?;
        hunt = lab.hunt().map(|task| judge_hunt(task, &answers, given.hidden.clone()));
    }
    objections.extend(origin);
    finish(work, &lab, folder, &answers, (quantities, hunt), objections)
}

fn journal_objections(work: &Work, lab: &Lab, folder: &Path, noted_code: Option<&str>) -> Result<Vec<Objection>, LabError> {
    let mut objections = Vec::new();
    match Journal::read(folder)? {
        Ok(journal) => {
            check_journal(&journal, work, lab, folder, &mut objections)?;
            if noted_code.is_some_and(|noted| !journal.codes.iter().any(|code| is_code(noted, code))) {
                objections.push(Objection::CodeNotFound);
            }
        }
        Err(error) => objections.push(Objection::Journal { error }),
    }
    Ok(objections)
}

/// The judgement; the journal keeps that values were shown.
fn finish(
    work: Work,
    lab: &Lab,
    folder: &Path,
    answers: &Answers,
    (quantities, hunt): (Vec<JudgedQuantity>, Option<JudgedHunt>),
    mut objections: Vec<Objection>,
) -> Result<Grade, LabError> {
    objections.extend(answers.problems(lab, When::After).into_iter().map(|problem| Objection::Answer { problem }));
    let good = quantities.iter().all(|q| q.mark.agrees()) && hunt.as_ref().is_none_or(|hunt| hunt.mean_score < hunt.max_score);
    let values_shown = !quantities.is_empty() || hunt.is_some();
    // Without a whole journal there is nothing to add to.
    if values_shown && !objections.iter().any(|o| matches!(o, Objection::Journal { .. })) {
        append(folder, Event::Graded, hashes(folder, [ANSWERS_FILE])?)?;
    }
    Ok(Grade { work, criteria_met: good && objections.is_empty(), objections, quantities, hunt, values_shown })
}

/// Shortest beginning of a code that counts, characters: 12 hexadecimal digits are 48 bits.
const MIN_CODE: usize = 12;

/// `noted` is a code or its beginning.
fn is_code(noted: &str, code: &str) -> bool {
    let noted = noted.trim().to_ascii_lowercase();
    noted.len() >= MIN_CODE && code.starts_with(&noted)
}

fn check_journal(journal: &Journal, work: &Work, lab: &Lab, folder: &Path, objections: &mut Vec<Objection>) -> Result<(), LabError> {
    let expected = Event::Started { lab: work.lab.clone(), student: work.student.clone(), attempt: work.attempt };
    let first = &journal.entries[0];
    if first.event != expected {
        objections.push(Objection::OtherWork);
    }
    for (name, sha256) in &first.files {
        let path = path_in(folder, name);
        if !path.is_file() || super::journal::file_sha256(&path)? != *sha256 {
            objections.push(Objection::Changed { file: name.clone() });
        }
    }
    let answers = hashes(folder, [ANSWERS_FILE])?;
    let until_truth = journal.entries.iter().take_while(|entry| entry.event != Event::Graded);
    let checks = until_truth.clone().filter(|entry| matches!(entry.event, Event::Checked { complete: true, .. }));
    if checks.last().is_none_or(|entry| entry.files != answers) {
        objections.push(Objection::NotChecked);
    }
    if lab.hunt().is_some() {
        let own = |event: &Event| matches!(event, Event::Checked { before_complete: true, .. });
        let explained: BTreeSet<&String> = until_truth
            .take_while(|entry| !own(&entry.event))
            .filter_map(|entry| if let Event::Explained { log } = &entry.event { Some(log) } else { None })
            .collect();
        objections.extend(explained.into_iter().map(|log| Objection::ExplainedFirst { log: log.clone() }));
    }
    Ok(())
}

/// Records the measurement anew and compares the files; the folder with the replayed logs.
fn replay(
    lab: &Lab,
    key: &Key,
    work: &Work,
    folder: &Path,
    on_progress: impl FnMut(f64) -> bool,
    objections: &mut Vec<Objection>,
) -> Result<tempfile::TempDir, LabError> {
    let replayed = tempfile::tempdir().map_err(|source| LabError::file(folder, "create a temporary folder beside", source))?;
    for file in record(lab, key, &work.attempt(), replayed.path(), on_progress)? {
        let name = format!("{LOGS_FOLDER}/{file}");
        let given = path_in(folder, &name);
        let is_equal =
            given.is_file() && super::journal::file_sha256(&given)? == super::journal::file_sha256(&replayed.path().join(&file))?;
        if !is_equal {
            objections.push(Objection::OtherLog { file: name, other_build: work.build != VERSION });
        }
    }
    Ok(replayed)
}

/// With what an answer is compared.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Reference {
    /// The true value of a simulated device.
    Exact(f64),
    /// A value of the teacher's reference.
    Measured { value: f64, expanded_u: f64 },
}

fn judge_quantities(
    lab: &Lab,
    answers: &Answers,
    reference_of: impl Fn(&str) -> Option<Reference>,
    logs: &Path,
) -> Result<Vec<JudgedQuantity>, LabError> {
    let procedure = reference(lab, logs)?;
    let mut judged = Vec::new();
    for asked in lab.quantities() {
        let missing = || LabError::Definition { lab: lab.id.to_owned(), message: format!("the reference procedure has no {}", asked.name) };
        let (_, procedure_u) = *procedure.get(&asked.name).ok_or_else(missing)?;
        let given = answers.quantities.get(&asked.name);
        let (value, expanded_u) = given.map_or((f64::NAN, f64::NAN), |given| (given.value, given.expanded_u));
        let answer = (value, expanded_u);
        let (true_value, true_value_u, compared_u, mark) = match reference_of(&asked.name).ok_or_else(missing)? {
            Reference::Exact(x) => (x, 0.0, procedure_u, mark(answer, (x, procedure_u))),
            Reference::Measured { value: x, expanded_u: u } => (x, u, u, mark_on_real_stand(answer, (x, u), procedure_u)),
        };
        judged.push(JudgedQuantity {
            name: asked.name.clone(),
            unit: asked.unit.clone(),
            value,
            expanded_u,
            reference: true_value,
            true_value_u,
            reference_u: procedure_u,
            normalized_error: normalized_error(value, expanded_u, true_value, compared_u),
            u_limit: MAX_UNCERTAINTY_RATIO * procedure_u,
            error_ratio: (value - true_value).abs() / expanded_u,
            mark,
        });
    }
    Ok(judged)
}

fn judge_hunt(task: &HuntTask, answers: &Answers, hidden: Vec<Hidden>) -> JudgedHunt {
    let empty = super::answers::HuntAnswer::default();
    let logs: Vec<JudgedLog> = hidden
        .into_iter()
        .map(|hidden| {
            let given = answers.hunt.get(&hidden.log).unwrap_or(&empty);
            let score = |probabilities| brier_score(&by_class(probabilities), &hidden.present);
            let (score_before, score_after) = (score(&given.before), score(&given.after));
            JudgedLog { hidden, score_before, score_after }
        })
        .collect();
    let mean_score = logs.iter().map(|log| log.score_after).sum::<f64>() / logs.len() as f64;
    JudgedHunt { logs, mean_score, max_score: task.max_brier_score }
}

/// The files that a teacher needs to judge a work: all of the folder that the work has.
pub fn files_of(folder: &Path, journal: &Journal) -> Vec<String> {
    let logs = journal.entries.first().map_or(Vec::new(), |entry| entry.files.keys().cloned().collect());
    let own = [WORK_FILE, super::work::INSTRUCTIONS_FILE, super::work::MODEL_FILE, ANSWERS_FILE, JOURNAL_FILE].map(str::to_owned);
    let names: BTreeSet<String> = own.into_iter().chain(logs).collect();
    // Names in a journal are a student's: no other file of the computer gets into an archive.
    let is_inside = |name: &String| !name.contains(['\\', ':']) && name.split('/').all(|part| !matches!(part, "" | "." | ".."));
    names.into_iter().filter(|name| is_inside(name) && path_in(folder, name).is_file()).collect()
}
