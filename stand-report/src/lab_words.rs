//! Words of the laboratory course in both languages: headings, sentences, marks, problems of answers, objections.
//!
//! The English of problems and objections is that of their `Display`, which the JSON contains too.

use super::numbers::plain;
use stand_lab::answers::AnswerProblem;
use stand_lab::course::Language;
use stand_lab::grade::Objection;
use stand_lab::journal::{ChainError, Event};
use stand_lab::judge::{MAX_ERROR_RATIO, MAX_GOOD_ERROR, MAX_REPEATED_ERROR, MAX_UNCERTAINTY_RATIO, Mark};

/// Headings, terms and sentences.
pub(super) struct Words {
    pub(super) report: &'static str,
    pub(super) judgement: &'static str,
    pub(super) student: &'static str,
    pub(super) attempt: &'static str,
    pub(super) practice: &'static str,
    pub(super) sealed: &'static str,
    pub(super) not_sealed: &'static str,
    pub(super) values: &'static str,
    pub(super) quantity: &'static str,
    pub(super) unit: &'static str,
    pub(super) true_value: &'static str,
    pub(super) mark: &'static str,
    pub(super) budgets: &'static str,
    pub(super) log: &'static str,
    pub(super) reason: &'static str,
    pub(super) before: &'static str,
    pub(super) after: &'static str,
    pub(super) probabilities: &'static str,
    pub(super) present: &'static str,
    pub(super) hidden: &'static str,
    pub(super) score: &'static str,
    pub(super) mean_score: &'static str,
    pub(super) limit: &'static str,
    pub(super) questions: &'static str,
    pub(super) conclusion: &'static str,
    pub(super) open: &'static str,
    pub(super) journal: &'static str,
    pub(super) time: &'static str,
    pub(super) event: &'static str,
    pub(super) code: &'static str,
    pub(super) judged: &'static str,
    pub(super) objection: &'static str,
    pub(super) objections: &'static str,
    pub(super) criteria_met: &'static str,
    pub(super) criteria_not_met: &'static str,
    pub(super) left_to_the_teacher: &'static str,
    pub(super) truth_shown: &'static str,
    pub(super) reference_shown: &'static str,
    pub(super) nothing_shown: &'static str,
    pub(super) real_stand: &'static str,
    pub(super) reference: &'static str,
    pub(super) reference_source: &'static str,
    pub(super) all_complete: &'static str,
    pub(super) before_complete: &'static str,
    pub(super) open_above: &'static str,
    pub(super) explain_allowed: &'static str,
    pub(super) explain_forbidden: &'static str,
    pub(super) code_to_note: &'static str,
    pub(super) own_files: &'static str,
    pub(super) left_out: &'static str,
}

const EN: Words = Words {
    report: "Report",
    judgement: "Judgement",
    student: "Student",
    attempt: "attempt",
    practice: "Practice work: its true values are public.",
    sealed: "sealed",
    not_sealed: "practice work, not sealed",
    values: "Measured values",
    quantity: "quantity",
    unit: "unit",
    true_value: "true",
    mark: "mark",
    budgets: "Uncertainty budgets",
    log: "log",
    reason: "where the model fails",
    before: "before",
    after: "after",
    probabilities: "Probabilities",
    present: "present",
    hidden: "hidden",
    score: "score",
    mean_score: "mean score",
    limit: "must be below",
    questions: "Questions",
    conclusion: "Conclusion",
    open: "not filled in",
    journal: "Journal",
    time: "time",
    event: "event",
    code: "code",
    judged: "U: expanded uncertainty, coverage probability 95 %. This page contains no judgement; the work is judged by the teacher.",
    objection: "objection",
    objections: "Objections",
    criteria_met: "Numerical criteria: met.",
    criteria_not_met: "Numerical criteria: not met.",
    left_to_the_teacher: "Answers in words and the conclusion are for the teacher to judge.",
    truth_shown: "The true values of this attempt were shown: answers that are changed from now on do not count. A new attempt has another device:",
    reference_shown: "The reference values of this work were shown: answers that are changed from now on do not count. A new attempt on the same device has the same reference: give the student another device.",
    nothing_shown: "The logs, the description or the reference are not those of the start: no value was judged or shown.",
    real_stand: "real stand",
    reference: "reference",
    reference_source: "reference values",
    all_complete: "All answers are given and well formed. Their values were not compared with anything.",
    before_complete: "The answers before the measurement are complete and recorded; those above are open.",
    open_above: "The answers above are open. The answers before the measurement are NOT complete.",
    explain_allowed: "`before` of all logs is recorded: `stand explain` may be run.",
    explain_forbidden: "`before` is NOT complete: do not run `stand explain` on these logs yet.",
    code_to_note: "Recorded in the journal. Code of this entry, to be noted by the teacher:",
    own_files: "own files in the archive",
    left_out: "left out of the archive, too large or too many",
};

const UK: Words = Words {
    report: "Звіт",
    judgement: "Результати перевірки",
    student: "Студент",
    attempt: "спроба",
    practice: "Тренувальна робота: її істинні значення відкриті.",
    sealed: "захищено ключем",
    not_sealed: "тренувальна робота, без ключа",
    values: "Виміряні значення",
    quantity: "величина",
    unit: "одиниця",
    true_value: "істинне",
    mark: "результат",
    budgets: "Бюджети невизначеності",
    log: "запис",
    reason: "де модель помиляється",
    before: "до",
    after: "після",
    probabilities: "Імовірності",
    present: "присутнє",
    hidden: "сховано",
    score: "оцінка",
    mean_score: "середня оцінка",
    limit: "має бути меншою за",
    questions: "Запитання",
    conclusion: "Висновок",
    open: "не заповнено",
    journal: "Журнал",
    time: "час",
    event: "подія",
    code: "код",
    judged: "U — розширена невизначеність, імовірність охоплення 95 %. Ця сторінка не містить оцінки; роботу оцінює викладач.",
    objection: "зауваження",
    objections: "Зауваження",
    criteria_met: "Числові критерії виконано.",
    criteria_not_met: "Числові критерії не виконано.",
    left_to_the_teacher: "Словесні відповіді та висновок оцінює викладач.",
    truth_shown: "Істинні значення цієї спроби показано: зміни відповідей відтепер не враховуються. Нова спроба має інший об'єкт вимірювання:",
    reference_shown: "Еталонні значення цієї роботи показано: зміни відповідей відтепер не враховуються. Нова спроба з тим самим об'єктом має ті самі еталонні значення: дайте студентові інший об'єкт.",
    nothing_shown: "Записи, опис або еталонні значення не ті, що на початку роботи: жодного значення не перевірено й не показано.",
    real_stand: "реальний стенд",
    reference: "еталонне",
    reference_source: "еталонні значення",
    all_complete: "Усі відповіді наведено в правильній формі. Їхніх значень ні з чим не порівнювали.",
    before_complete: "Відповіді «до вимірювань» повні й зафіксовані; наведені вище ще не заповнено.",
    open_above: "Наведені вище відповіді ще не заповнено. Відповіді «до вимірювань» НЕПОВНІ.",
    explain_allowed: "`before` для всіх записів зафіксовано: можна запускати `stand explain`.",
    explain_forbidden: "`before` НЕПОВНЕ: ще не запускайте `stand explain` для цих записів.",
    code_to_note: "Зафіксовано в журналі. Код цього рядка для викладача:",
    own_files: "власні файли в архіві",
    left_out: "не ввійшли до архіву (завеликі або їх забагато)",
};

/// The words of a language.
pub(super) fn words_of(language: Language) -> &'static Words {
    match language {
        Language::En => &EN,
        Language::Uk => &UK,
    }
}

/// A mark in words.
pub(super) fn mark_text(mark: Mark, language: Language) -> &'static str {
    let (en, uk) = match mark {
        Mark::Good => ("agrees", "узгоджується"),
        Mark::Repeat => ("repeat and explain", "повторити й пояснити"),
        Mark::Wrong => ("wrong", "неправильно"),
        Mark::UncertaintyTooLarge => ("U above its limit", "U понад верхню межу"),
        Mark::UncertaintyTooSmall => ("U too small for the error", "U замала для похибки"),
        Mark::UncertaintyNotTested => {
            ("agrees; U below what the reference tests", "узгоджується; таку малу U еталонне значення не перевіряє")
        }
        Mark::NotFilledIn => ("not filled in", "не заповнено"),
    };
    if language == Language::En { en } else { uk }
}

/// The rule of the judgement of values.
pub(super) fn rule_text(language: Language, on_real_stand: bool) -> String {
    let number = |value| plain(value, 2);
    let (good, repeated) = (number(MAX_GOOD_ERROR), number(MAX_REPEATED_ERROR));
    let (own, most) = (number(MAX_ERROR_RATIO), number(MAX_UNCERTAINTY_RATIO));
    match language {
        Language::En if on_real_stand => format!(
            "E_n = |x − X|/√(U² + U_X²): up to {good} agrees, up to {repeated} repeat and explain. U up to {most} U_ref; a U below U_X/√3 is not tested by the reference."
        ),
        Language::Uk if on_real_stand => format!(
            "E_n = |x − X|/√(U² + U_X²): до {good} — узгоджується, до {repeated} — повторити й пояснити. U — до {most} U_ref; U, меншу за U_X/√3, еталонне значення не перевіряє."
        ),
        Language::En => format!(
            "E_n = |x − X|/√(U² + U_ref²): up to {good} agrees, up to {repeated} repeat and explain. U up to {most} U_ref, and |x − X| up to {own} U."
        ),
        Language::Uk => format!(
            "E_n = |x − X|/√(U² + U_ref²): до {good} — узгоджується, до {repeated} — повторити й пояснити. U — до {most} U_ref, а |x − X| — до {own} U."
        ),
    }
}

/// A problem of an answer.
pub(super) fn problem_text(problem: &AnswerProblem, language: Language) -> String {
    use AnswerProblem as P;
    if language == Language::En {
        return problem.to_string();
    }
    match problem {
        P::Empty { entry } => format!("{entry}: не заповнено"),
        P::NotPositive { entry, value } => format!("{entry}: {value} має бути додатним числом"),
        P::Unit { entry, unit, expected } => format!("{entry}: одиниця `{unit}`, а в таблиці має бути `{expected}`"),
        P::Unasked { entry } => format!("{entry}: у роботі немає такого рядка"),
        P::Class { entry, class } => format!("{entry}: `{class}` — не ефект каталогу (`stand effects`), не `none` і не `unknown`"),
        P::InModel { entry, class } => {
            format!("{entry}: `{class}` уже входить до заданої моделі (model.toml); імовірність має лише те, чого моделі бракує")
        }
        P::SameFamily { entry, class, family } => {
            format!("{entry}: `{class}` належить до родини `{family}`, яку вже названо; наведіть одну ймовірність для родини")
        }
        P::Probability { entry, value } => format!("{entry}: {value} — не ймовірність від 0 до 1"),
        P::NoneBeside { entry, sum } => {
            format!("{entry}: сума ймовірностей `none` і найбільшої з решти — {sum:.2}; ніщо і щось не можуть бути присутні разом")
        }
        P::TooLittle { entry, sum } => format!(
            "{entry}: сума ймовірностей — {sum:.2}; принаймні один клас присутній (`none` і `unknown` — теж класи), тому сума має бути 1 або більше"
        ),
    }
}

/// A broken chain.
pub(super) fn chain_error_text(error: &ChainError, language: Language) -> String {
    if language == Language::En {
        return error.to_string();
    }
    match error {
        ChainError::Empty => "журнал порожній".to_owned(),
        ChainError::Line { line, message } => format!("рядок {line} журналу — не запис журналу: {message}"),
        ChainError::Broken { line } => {
            format!("рядок {line} журналу не продовжує попереднього: рядок змінено, вилучено або вставлено")
        }
    }
}

/// An objection.
pub(super) fn objection_text(objection: &Objection, language: Language) -> String {
    use Objection as O;
    match objection {
        O::Journal { error } => chain_error_text(error, language),
        O::Answer { problem } => problem_text(problem, language),
        _ if language == Language::En => objection.to_string(),
        O::OtherWork => "журнал належить іншій роботі, іншому студентові або іншій спробі".to_owned(),
        O::CodeNotFound => "записаного коду немає в журналі: журнал написано наново, або код з іншої роботи".to_owned(),
        O::Changed { file } => format!("{file}: змінено після початку роботи"),
        O::OtherLog { file, other_build } => {
            let build = if *other_build { "; запис зробила інша збірка програми, яка й потрібна для повторення" } else { "" };
            format!("{file}: це не запис цього студента й цієї спроби{build}")
        }
        O::Seal => "work.toml: печатка не належить цьому ключеві: змінено опис чи хеші записів, або роботу розпочато з іншим ключем".to_owned(),
        O::Replaced { file } => format!("{file}: це не той запис, що зроблено на початку роботи: його захищений хеш інший"),
        O::OtherReference => "еталонні значення — не той файл, що закріплено на початку роботи".to_owned(),
        O::NotChecked => "відповідей у теперішньому вигляді немає в журналі до показу істинних значень: після останньої зміни треба запустити `stand lab check`".to_owned(),
        O::ExplainedFirst { log } => {
            format!("`stand explain` запущено для {log} до того, як власні відповіді студента стали повними й перевіреними")
        }
    }
}

/// An event of the journal.
pub(super) fn event_text(event: &Event, language: Language) -> String {
    let (en, uk) = match event {
        Event::Started { .. } => ("started", "розпочато"),
        Event::Checked { complete: true, .. } => ("answers checked: complete", "відповіді перевірено: повні"),
        Event::Checked { before_complete: true, .. } => {
            ("answers checked: those before the measurement complete", "відповіді перевірено: повні ті, що до вимірювань")
        }
        Event::Checked { .. } => ("answers checked: incomplete", "відповіді перевірено: неповні"),
        Event::Explained { log } => return format!("stand explain {log}"),
        Event::Graded => ("true values shown", "істинні значення показано"),
    };
    if language == Language::En { en } else { uk }.to_owned()
}
