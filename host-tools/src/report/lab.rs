//! The laboratory course as text, JSON and HTML: list of works, start, check, report of the student, judgement.
//!
//! The report shows what the student has done, without true values, and is made for print. The page of the judgement is for the teacher. No text says that a
//! work is passed: answers in words and the conclusion are the teacher's to judge.

use serde::Serialize;
use serde_json::Value;

use super::html::{Cell, Class, Markup, Page, Table};
use super::json::value;
use super::numbers::{plain, significant, with_sigma};
use crate::lab::answers::Answers;
use crate::lab::check::Checked;
use crate::lab::course::{Lab, Language, When};
use crate::lab::grade::Grade;
use crate::lab::journal::{ChainError, Event, Journal};
use crate::lab::judge::{MAX_GOOD_ERROR, MAX_REPEATED_ERROR, MAX_UNCERTAINTY_RATIO, Mark};
use crate::lab::start::Started;
use crate::lab::work::Work;

/// Digits of a normalised error and of a score.
const DIGITS: u32 = 3;

#[derive(Serialize)]
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
    format!(
        "{}: {}, {}, attempt {}\n{seal}\nfiles: {}\nNext: read {folder}/instructions.md.\n",
        folder,
        started.title,
        work.student,
        work.attempt,
        started.files.join(", ")
    )
}

#[derive(Serialize)]
struct StartedJson<'a> {
    #[serde(flatten)]
    work: &'a Work,
    files: &'a [String],
    code: &'a str,
}

/// A started work as JSON.
pub fn started_json(started: &Started) -> Value {
    value(&StartedJson { work: &started.work, files: &started.files, code: &started.code })
}

/// A check as text.
pub fn checked_text(checked: &Checked) -> String {
    let mut text: String = checked.problems.iter().map(|problem| format!("{problem}\n")).collect();
    text += match (checked.complete, checked.before_complete) {
        (true, _) => "All answers are given and well formed. Their values were not compared with anything.\n",
        (false, true) => "The answers before the measurement are complete and recorded; those above are open.\n",
        (false, false) => "The answers above are open.\n",
    };
    text + &format!("Recorded in the journal. Code of this entry, to be noted by the teacher: {}\n", &checked.code[..16])
}

/// A check as JSON.
pub fn checked_json(checked: &Checked) -> Value {
    value(checked)
}

/// A mark in words.
fn mark_text(mark: Mark) -> &'static str {
    match mark {
        Mark::Good => "agrees",
        Mark::Repeat => "repeat and explain",
        Mark::Wrong => "wrong",
        Mark::UncertaintyTooLarge => "U above its limit",
    }
}

/// Sentence on what a judgement leaves open.
const LEFT_TO_THE_TEACHER: &str = "Answers in words and the conclusion are for the teacher to judge.";

/// A judgement as text.
pub fn grade_text(grade: &Grade) -> String {
    let work = &grade.work;
    let seal = if work.sealed { "sealed" } else { "practice work, not sealed" };
    let mut text = format!("{}, {}, attempt {}, {seal}\n", work.lab, work.student, work.attempt);
    for q in &grade.quantities {
        text += &format!(
            "  {:24} {} {}  true {}  E_n = {}  U ≤ {}  {}\n",
            q.name,
            with_sigma(q.value, q.expanded_u),
            q.unit,
            significant(q.reference, 5),
            significant(q.normalized_error, DIGITS),
            significant(q.u_limit, 2),
            mark_text(q.mark)
        );
    }
    if let Some(hunt) = &grade.hunt {
        for log in &hunt.logs {
            let present: Vec<&str> = log.hidden.present.iter().map(String::as_str).collect();
            let (before, after) = (significant(log.score_before, DIGITS), significant(log.score_after, DIGITS));
            text += &format!("  {}  {}  score {before} before, {after} after\n", log.hidden.log, present.join(" and "));
        }
        let (mean, most) = (significant(hunt.mean_score, DIGITS), plain(hunt.max_score, DIGITS));
        text += &format!("  mean score {mean}, limit {most}\n");
    }
    for objection in &grade.objections {
        text += &format!("objection: {objection}\n");
    }
    let criteria = if grade.criteria_met { "met" } else { "not met" };
    text + &format!("Numerical criteria: {criteria}. {LEFT_TO_THE_TEACHER}\n")
}

#[derive(Serialize)]
struct GradeJson<'a> {
    #[serde(flatten)]
    grade: &'a Grade,
    says: Vec<String>,
}

/// A judgement as JSON; `says` has the objections as sentences.
pub fn grade_json(grade: &Grade) -> Value {
    value(&GradeJson { grade, says: grade.objections.iter().map(ToString::to_string).collect() })
}

/// The judgement as a page for the teacher.
pub fn grade_html(grade: &Grade, lab: &Lab, answers: &Answers) -> String {
    let work = &grade.work;
    let mut page = Page::new(&format!("Judgement: {}. {}", lab.number, lab.title.in_language(work.language)));
    let criteria = if grade.criteria_met { "met" } else { "not met" };
    page.paragraph(
        Class::Lead,
        format!("{}, attempt {}: numerical criteria {criteria}. {LEFT_TO_THE_TEACHER}", work.student, work.attempt),
    );
    if !work.sealed {
        page.paragraph(Class::Warning, "Practice work: its true values are public.");
    }
    if !grade.objections.is_empty() {
        page.section("Objections", |page| page.list(grade.objections.iter().map(ToString::to_string)));
    }
    if !grade.quantities.is_empty() {
        page.section("Values", |page| {
            let mut table = Table::new(["quantity", "value ± U", "unit", "true value", "U of the reference", "E_n", "mark"]);
            for q in &grade.quantities {
                let class = if q.mark == Mark::Good { Class::Good } else { Class::Warning };
                table.row([
                    Cell::code(&q.name),
                    Cell::number(with_sigma(q.value, q.expanded_u)),
                    Cell::text(&q.unit),
                    Cell::number(significant(q.reference, 6)),
                    Cell::number(significant(q.reference_u, 2)),
                    Cell::number(significant(q.normalized_error, DIGITS)),
                    Cell::text(mark_text(q.mark)).class(class),
                ]);
            }
            page.table(table);
            page.paragraph(
                Class::Faint,
                format!(
                    "E_n = |x − X|/√(U² + U_ref²): up to {} agrees, up to {} repeat and explain. U up to {} U_ref.",
                    plain(MAX_GOOD_ERROR, 2),
                    plain(MAX_REPEATED_ERROR, 2),
                    plain(MAX_UNCERTAINTY_RATIO, 2)
                ),
            );
        });
    }
    if let Some(hunt) = &grade.hunt {
        page.section("Hunt", |page| {
            let mut table = Table::new(["log", "present", "hidden", "score before", "score after"]);
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
            page.text(format!("Mean score {}, limit {}.", significant(hunt.mean_score, DIGITS), plain(hunt.max_score, DIGITS)));
        });
    }
    words(&mut page, lab, work.language, answers);
    page.finish()
}

/// Headings and terms of the student's report.
struct Words {
    report: &'static str,
    student: &'static str,
    attempt: &'static str,
    practice: &'static str,
    values: &'static str,
    quantity: &'static str,
    unit: &'static str,
    log: &'static str,
    reason: &'static str,
    before: &'static str,
    after: &'static str,
    probabilities: &'static str,
    questions: &'static str,
    conclusion: &'static str,
    open: &'static str,
    journal: &'static str,
    time: &'static str,
    event: &'static str,
    code: &'static str,
    judged: &'static str,
}

fn words_of(language: Language) -> Words {
    match language {
        Language::En => Words {
            report: "Report",
            student: "Student",
            attempt: "attempt",
            practice: "Practice work: its true values are public.",
            values: "Measured values",
            quantity: "quantity",
            unit: "unit",
            log: "log",
            reason: "where the model fails",
            before: "before",
            after: "after",
            probabilities: "Probabilities",
            questions: "Questions",
            conclusion: "Conclusion",
            open: "not filled in",
            journal: "Journal",
            time: "time",
            event: "event",
            code: "code",
            judged: "U: expanded uncertainty, coverage probability 95 %. This page contains no judgement; the work is judged by the teacher.",
        },
        Language::Uk => Words {
            report: "Звіт",
            student: "Студент",
            attempt: "спроба",
            practice: "Тренувальна робота: її істинні значення відкриті.",
            values: "Виміряні значення",
            quantity: "величина",
            unit: "одиниця",
            log: "запис",
            reason: "де модель помиляється",
            before: "до",
            after: "після",
            probabilities: "Імовірності",
            questions: "Запитання",
            conclusion: "Висновок",
            open: "не заповнено",
            journal: "Журнал",
            time: "час",
            event: "подія",
            code: "код",
            judged: "U — розширена невизначеність, імовірність охоплення 95 %. Ця сторінка не містить оцінки; роботу оцінює викладач.",
        },
    }
}

fn event_text(event: &Event, language: Language) -> String {
    let en = language == Language::En;
    match event {
        Event::Started { .. } => if en { "started" } else { "розпочато" }.to_owned(),
        Event::Checked { complete: true, .. } => {
            if en { "answers checked: complete" } else { "відповіді перевірено: повні" }.to_owned()
        }
        Event::Checked { before_complete: true, .. } => if en {
            "answers checked: those before the measurement complete"
        } else {
            "відповіді перевірено: повні ті, що до вимірювань"
        }
        .to_owned(),
        Event::Checked { .. } => if en { "answers checked: incomplete" } else { "відповіді перевірено: неповні" }.to_owned(),
        Event::Explained { log } => format!("stand explain {log}"),
        Event::Graded => if en { "true values shown" } else { "істинні значення показано" }.to_owned(),
    }
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
        Err(error) => page.paragraph(Class::Warning, error.to_string()),
    });
    page.paragraph(Class::Faint, w.judged);
    page.finish()
}

#[derive(Serialize)]
struct ReportJson<'a> {
    #[serde(flatten)]
    work: &'a Work,
    answers: &'a Answers,
    journal: Option<&'a [crate::lab::journal::Entry]>,
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
