//! The laboratory course as text, JSON and HTML: list of works, start, check, report of the student, judgement.
//!
//! Words of both languages are in [`super::lab_words`]. The report shows what the student has done, without true values, and is made for
//! print. The page of the judgement is for the teacher. No text says that a work is passed: answers in words and the conclusion are the
//! teacher's to judge.

use crate::json::schema_of;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::html::{Cell, Class, Markup, Page, Table};
use super::json::value;
use super::lab_words::{chain_error_text, event_text, mark_text, objection_text, problem_text, rule_text, words_of};
use super::numbers::{plain, significant, with_sigma};
use stand_lab::answers::Answers;
use stand_lab::archive::OwnFiles;
use stand_lab::check::Checked;
use stand_lab::course::{Lab, Language, When};
use stand_lab::grade::Grade;
use stand_lab::journal::{ChainError, Journal};
use stand_lab::judge::{JudgedQuantity, MAX_GOOD_ERROR, Mark, least_tested_u};
use stand_lab::real_stand::{RealStand, StandIdentity};
use stand_lab::start::{ReferenceCheck, Started};
use stand_lab::work::Work;

/// Digits of a normalised error and of a score.
const DIGITS: u32 = 3;

#[derive(Serialize, JsonSchema)]
struct ListedLab<'a> {
    number: u32,
    id: &'a str,
    title_en: &'a str,
    title_uk: &'a str,
    quantities: Vec<&'a str>,
}

fn listed(lab: &Lab) -> ListedLab<'_> {
    let quantities = lab.quantities().iter().map(|q| q.name.as_str()).collect();
    let title = |language| lab.title.in_language(language);
    ListedLab { number: lab.number, id: lab.id, title_en: title(Language::En), title_uk: title(Language::Uk), quantities }
}

/// The works as text.
pub fn list_text(works: &[Lab], language: Language) -> String {
    works.iter().map(|lab| format!("{:2}  {:13}  {}\n", lab.number, lab.id, lab.title.in_language(language))).collect()
}

/// The works as JSON.
pub fn list_json(works: &[Lab]) -> Value {
    value(&works.iter().map(listed).collect::<Vec<_>>())
}

/// A started work as text.
pub fn started_text(started: &Started, folder: &str) -> String {
    let work = &started.work;
    let seal = if work.sealed {
        "sealed by the key".to_owned()
    } else {
        "practice work: its true values are public; a work that counts is started by the teacher with --key".to_owned()
    };
    let mut text = format!("{}: {}, {}, attempt {}\n{seal}\n", folder, started.title, work.student, work.attempt);
    if let Some(stand) = &work.real_stand {
        text += &format!("{}; the folder has a code of this reference and none of its values\n", stand_text(stand, Language::En));
    }
    for check in &started.reference_checks {
        text += &reference_check_text(check);
    }
    text + &format!("files: {}\nNext: read {folder}/instructions.md.\n", started.files.join(", "))
}

/// The stand and where the reference values are from.
fn stand_text(stand: &RealStand, language: Language) -> String {
    let w = words_of(language);
    format!("{}: {}; {}: {}", w.real_stand, stand.identity, w.reference_source, stand.reference_source)
}

/// What the teacher should know of a reference value before the work is handed out; empty where it suits the logs.
fn reference_check_text(check: &ReferenceCheck) -> String {
    let (name, error) = (&check.name, significant(check.normalized_error, DIGITS));
    let mut text = String::new();
    if check.normalized_error > MAX_GOOD_ERROR {
        text += &format!(
            "warning: {name}: the reference procedure on these logs deviates from the reference, E_n = {error}: check mounting and reference\n"
        );
    }
    if check.procedure_u < least_tested_u(check.reference_u) {
        let [reference, procedure] = [check.reference_u, check.procedure_u].map(|u| significant(u, 2));
        text += &format!("note: {name}: the reference (U {reference}) does not test the uncertainty of these logs (U_ref {procedure})\n");
    }
    text
}

#[derive(Serialize, JsonSchema)]
struct StartedJson<'a> {
    #[serde(flatten)]
    work: &'a Work,
    files: &'a [String],
    code: &'a str,
    reference_checks: &'a [ReferenceCheck],
}

/// A started work as JSON.
pub fn started_json(started: &Started) -> Value {
    value(&StartedJson { work: &started.work, files: &started.files, code: &started.code, reference_checks: &started.reference_checks })
}

/// A check of a work as text.
pub fn checked_text(checked: &Checked, lab: &Lab, work: &Work) -> String {
    let language = work.language;
    let w = words_of(language);
    let stand = work.real_stand.as_ref().map_or(String::new(), |stand| format!("{}\n", stand_text(stand, language)));
    let mut text: String = stand;
    text.extend(checked.problems.iter().map(|problem| format!("{}\n", problem_text(problem, language))));
    let state = match (checked.complete, checked.before_complete) {
        (true, _) => w.all_complete,
        (false, true) => w.before_complete,
        (false, false) => w.open_above,
    };
    text += &format!("{state}\n");
    if lab.hunt().is_some() {
        text += &format!("{}\n", if checked.before_complete { w.explain_allowed } else { w.explain_forbidden });
    }
    text + &format!("{} {}\n", w.code_to_note, &checked.code[..16])
}

#[derive(Serialize, JsonSchema)]
struct CheckedJson<'a> {
    #[serde(flatten)]
    checked: &'a Checked,
    #[serde(skip_serializing_if = "Option::is_none")]
    real_stand: Option<CheckedStandJson<'a>>,
}

#[derive(Serialize, JsonSchema)]
struct CheckedStandJson<'a> {
    identity: &'a StandIdentity,
    reference_source: &'a str,
}

/// A check as JSON.
pub fn checked_json(checked: &Checked, work: &Work) -> Value {
    let real_stand =
        work.real_stand.as_ref().map(|stand| CheckedStandJson { identity: &stand.identity, reference_source: &stand.reference_source });
    value(&CheckedJson { checked, real_stand })
}

/// The student's own files of an archive as text; empty where there are none.
pub fn archive_text(own: &OwnFiles, language: Language) -> String {
    let w = words_of(language);
    let lines = [(w.own_files, &own.names), (w.left_out, &own.left_out)].into_iter().filter(|(_, names)| !names.is_empty());
    lines.map(|(word, names)| format!("{word}: {}\n", names.join(", "))).collect()
}

/// `stand lab start` of the next attempt.
fn next_attempt(work: &Work) -> String {
    format!("stand lab start {} --student \"{}\" --attempt {} --out FOLDER", work.lab, work.student, work.attempt + 1)
}

/// A judgement as text, in the language of the work.
pub fn grade_text(grade: &Grade) -> String {
    let work = &grade.work;
    let w = words_of(work.language);
    let seal = if work.sealed { w.sealed } else { w.not_sealed };
    let mut text = format!("{}, {}, {} {}, {seal}\n", work.lab, work.student, w.attempt, work.attempt);
    if let Some(stand) = &work.real_stand {
        text += &format!("{}\n", stand_text(stand, work.language));
    }
    for q in &grade.quantities {
        text += &format!(
            "  {:24} {} {}  {} {}  E_n = {}  |x − X|/U = {}  U ≤ {}  {}\n",
            q.name,
            with_sigma(q.value, q.expanded_u),
            q.unit,
            if work.real_stand.is_some() { w.reference } else { w.true_value },
            reference_text(q, 5),
            significant(q.normalized_error, DIGITS),
            significant(q.error_ratio, DIGITS),
            significant(q.u_limit, 2),
            mark_text(q.mark, work.language)
        );
    }
    if let Some(hunt) = &grade.hunt {
        for log in &hunt.logs {
            let present: Vec<&str> = log.hidden.present.iter().map(String::as_str).collect();
            let (before, after) = (significant(log.score_before, DIGITS), significant(log.score_after, DIGITS));
            text += &format!("  {}  {}  {}: {before} {}, {after} {}\n", log.hidden.log, present.join(" + "), w.score, w.before, w.after);
        }
        let (mean, most) = (significant(hunt.mean_score, DIGITS), plain(hunt.max_score, DIGITS));
        text += &format!("  {}: {mean}, {} {most}\n", w.mean_score, w.limit);
    }
    for objection in &grade.objections {
        text += &format!("{}: {}\n", w.objection, objection_text(objection, work.language));
    }
    let criteria = if grade.criteria_met { w.criteria_met } else { w.criteria_not_met };
    let next = match (&work.real_stand, grade.values_shown) {
        (None, _) => format!("{} {}", w.truth_shown, next_attempt(work)),
        (Some(_), true) => w.reference_shown.to_owned(),
        (Some(_), false) => w.nothing_shown.to_owned(),
    };
    text + &format!("{criteria} {}\n{next}\n", w.left_to_the_teacher)
}

/// X, with U_X where it has one.
fn reference_text(q: &JudgedQuantity, digits: u32) -> String {
    if q.true_value_u > 0.0 { with_sigma(q.reference, q.true_value_u) } else { significant(q.reference, digits) }
}

#[derive(Serialize, JsonSchema)]
struct GradeJson<'a> {
    #[serde(flatten)]
    grade: &'a Grade,
    says: Vec<String>,
}

/// A judgement as JSON; `says` has the objections as sentences.
pub fn grade_json(grade: &Grade) -> Value {
    value(&GradeJson { grade, says: grade.objections.iter().map(ToString::to_string).collect() })
}

/// The judgement as a page for the teacher, in the language of the work.
pub fn grade_html(grade: &Grade, lab: &Lab, answers: &Answers) -> String {
    let work = &grade.work;
    let w = words_of(work.language);
    let mut page = Page::new(&format!("{}: {}. {}", w.judgement, lab.number, lab.title.in_language(work.language)));
    let criteria = if grade.criteria_met { w.criteria_met } else { w.criteria_not_met };
    page.paragraph(Class::Lead, format!("{}, {} {}. {criteria} {}", work.student, w.attempt, work.attempt, w.left_to_the_teacher));
    if !work.sealed {
        page.paragraph(Class::Warning, w.practice);
    }
    if let Some(stand) = &work.real_stand {
        page.text(stand_text(stand, work.language));
    }
    if work.real_stand.is_some() && !grade.values_shown {
        page.paragraph(Class::Warning, w.nothing_shown);
    }
    if !grade.objections.is_empty() {
        page.section(w.objections, |page| page.list(grade.objections.iter().map(|o| objection_text(o, work.language))));
    }
    if !grade.quantities.is_empty() {
        page.section(w.values, |page| {
            let reference = if work.real_stand.is_some() { "X ± U_X" } else { w.true_value };
            let mut table = Table::new([w.quantity, "x ± U", w.unit, reference, "U_ref", "E_n", "|x − X|/U", w.mark]);
            for q in &grade.quantities {
                let class = if q.mark == Mark::Good { Class::Good } else { Class::Warning };
                table.row([
                    Cell::code(&q.name),
                    Cell::number(with_sigma(q.value, q.expanded_u)),
                    Cell::text(&q.unit),
                    Cell::number(reference_text(q, 6)),
                    Cell::number(significant(q.reference_u, 2)),
                    Cell::number(significant(q.normalized_error, DIGITS)),
                    Cell::number(significant(q.error_ratio, DIGITS)),
                    Cell::text(mark_text(q.mark, work.language)).class(class),
                ]);
            }
            page.table(table);
            page.paragraph(Class::Faint, rule_text(work.language, work.real_stand.is_some()));
        });
        budgets(&mut page, lab, work.language, answers);
    }
    if let Some(hunt) = &grade.hunt {
        page.section(w.probabilities, |page| {
            let score = |when| format!("{}: {when}", w.score);
            let mut table = Table::new([w.log.to_owned(), w.present.to_owned(), w.hidden.to_owned(), score(w.before), score(w.after)]);
            for log in &hunt.logs {
                let present: Vec<&str> = log.hidden.present.iter().map(String::as_str).collect();
                table.row([
                    Cell::code(&log.hidden.log),
                    Cell::text(present.join(", ")),
                    Cell::text(&log.hidden.description),
                    Cell::number(significant(log.score_before, DIGITS)),
                    Cell::number(significant(log.score_after, DIGITS)),
                ]);
            }
            page.table(table);
            let (mean, most) = (significant(hunt.mean_score, DIGITS), plain(hunt.max_score, DIGITS));
            page.text(format!("{}: {mean}, {} {most}.", w.mean_score, w.limit));
        });
    }
    words(&mut page, lab, work.language, answers);
    page.finish()
}

/// The budgets of the quantities, as the student wrote them.
fn budgets(page: &mut Page, lab: &Lab, language: Language, answers: &Answers) {
    let w = words_of(language);
    page.section(w.budgets, |page| {
        for asked in lab.quantities() {
            page.text(Markup::code(&asked.name));
            match answers.quantities.get(&asked.name).map(|given| given.budget.trim()).filter(|budget| !budget.is_empty()) {
                Some(budget) => page.preformatted(budget),
                None => page.paragraph(Class::Warning, w.open),
            }
        }
    });
}

/// Questions with their answers, and the conclusion.
fn words(page: &mut Page, lab: &Lab, language: Language, answers: &Answers) {
    let w = words_of(language);
    let given = |text: Option<&String>| {
        let text = text.map_or("", |text| text.trim());
        if text.is_empty() { Markup::span(Class::Warning, w.open) } else { Markup::from(text) }
    };
    page.section(w.questions, |page| {
        let questions = lab.questions(When::Before).chain(lab.questions(When::After));
        page.definitions(questions.map(|q| (q.text.in_language(language).to_owned(), given(answers.questions.get(&q.id)))));
    });
    page.section(w.conclusion, |page| page.text(given(Some(&answers.conclusion))));
}

/// The student's report as a page for print: answers and journal, without true values.
pub fn report_html(work: &Work, lab: &Lab, answers: &Answers, journal: &Result<Journal, ChainError>) -> String {
    let w = words_of(work.language);
    let mut page = Page::new(&format!("{}: {}. {}", w.report, lab.number, lab.title.in_language(work.language)));
    page.paragraph(Class::Lead, format!("{}: {}, {} {}", w.student, work.student, w.attempt, work.attempt));
    if !work.sealed {
        page.paragraph(Class::Warning, w.practice);
    }
    if let Some(stand) = &work.real_stand {
        page.text(stand_text(stand, work.language));
    }
    match lab.hunt() {
        None => page.section(w.values, |page| {
            let mut table = Table::new([w.quantity, "", "± U", w.unit]);
            for asked in lab.quantities() {
                let filled = answers.quantities.get(&asked.name).filter(|given| given.value.is_finite() && given.expanded_u.is_finite());
                let number = match filled {
                    Some(given) => Cell::number(with_sigma(given.value, given.expanded_u)),
                    None => Cell::text(w.open).class(Class::Warning),
                };
                table.row([Cell::text(asked.text.in_language(work.language)), Cell::code(&asked.name), number, Cell::text(&asked.unit)]);
            }
            page.table(table);
        }),
        Some(task) => page.section(w.probabilities, |page| {
            let mut table = Table::new([w.log, w.reason, w.before, w.after]);
            let list = |probabilities: &std::collections::BTreeMap<String, f64>| {
                probabilities.iter().map(|(class, p)| format!("{class} {}", plain(*p, 3))).collect::<Vec<_>>().join(", ")
            };
            for log in &task.logs {
                let given = answers.hunt.get(log).cloned().unwrap_or_default();
                table.row([Cell::code(log), Cell::text(&given.reason), Cell::text(list(&given.before)), Cell::text(list(&given.after))]);
            }
            page.table(table);
        }),
    }
    if lab.hunt().is_none() {
        budgets(&mut page, lab, work.language, answers);
    }
    words(&mut page, lab, work.language, answers);
    page.section(w.journal, |page| match journal {
        Ok(journal) => {
            let mut table = Table::new(["", w.time, w.event, w.code]);
            for (entry, code) in journal.entries.iter().zip(&journal.codes) {
                let event = event_text(&entry.event, work.language);
                table.row([Cell::number(entry.number.to_string()), Cell::text(&entry.time), Cell::text(event), Cell::code(&code[..16])]);
            }
            page.table(table);
        }
        Err(error) => page.paragraph(Class::Warning, chain_error_text(error, work.language)),
    });
    page.paragraph(Class::Faint, w.judged);
    page.finish()
}

#[derive(Serialize, JsonSchema)]
struct ReportJson<'a> {
    #[serde(flatten)]
    work: &'a Work,
    answers: &'a Answers,
    journal: Option<&'a [stand_lab::journal::Entry]>,
    journal_error: Option<&'a ChainError>,
    code: Option<&'a str>,
}

/// The student's report as JSON.
pub fn report_json(work: &Work, answers: &Answers, journal: &Result<Journal, ChainError>) -> Value {
    let whole = journal.as_ref().ok();
    value(&ReportJson {
        work,
        answers,
        journal: whole.map(|journal| &journal.entries[..]),
        journal_error: journal.as_ref().err(),
        code: whole.map(Journal::code),
    })
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![
        ("lab list", schema_of::<Vec<ListedLab<'_>>>()),
        ("lab start", schema_of::<StartedJson<'_>>()),
        ("lab check", schema_of::<CheckedJson<'_>>()),
        ("lab grade", schema_of::<GradeJson<'_>>()),
        ("lab report", schema_of::<ReportJson<'_>>()),
    ]
}
