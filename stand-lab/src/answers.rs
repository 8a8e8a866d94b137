//! The student's table of answers: `answers.toml` in the work folder.
//!
//! Input: the text of the file and the work. Output: [`Answers`] and their [`AnswerProblem`]s: what is missing or malformed, without a look
//! at true values.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use drive_model::{Card, card, cards};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::course::{HuntTask, Lab, Language, QuantitySpec, When};

/// Name of the file in the work folder.
pub const ANSWERS_FILE: &str = "answers.toml";
/// Class of a log in which nothing is hidden.
pub const NONE: &str = "none";
/// Class of a log with a disturbance that the catalogue lacks.
pub const UNKNOWN: &str = "unknown";
/// Tolerance of a sum of probabilities that were rounded by hand.
const MAX_SUM_EXCESS: f64 = 0.01;

/// A measured value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuantityAnswer {
    /// Value; NaN: not filled in.
    pub value: f64,
    /// Expanded uncertainty, coverage probability 95 %; NaN: not filled in.
    #[serde(rename = "U")]
    pub expanded_u: f64,
    /// Unit of both.
    pub unit: String,
    /// Uncertainty budget, as text: the contributions and how they are combined.
    #[serde(default)]
    pub budget: String,
}

/// Probabilities for one log.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct HuntAnswer {
    /// Where the model fails, in words.
    pub reason: String,
    /// Probability that a class is present, by the student's own analysis.
    pub before: BTreeMap<String, f64>,
    /// The same after `stand explain`: the answer that is scored.
    pub after: BTreeMap<String, f64>,
}

/// All answers.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Answers {
    /// The student's conclusion.
    pub conclusion: String,
    /// Answers to the questions by their keys.
    pub questions: BTreeMap<String, String>,
    /// Measured values by name.
    pub quantities: BTreeMap<String, QuantityAnswer>,
    /// Probabilities by log.
    pub hunt: BTreeMap<String, HuntAnswer>,
}

/// What is missing or malformed.
#[derive(Debug, Clone, PartialEq, Serialize, thiserror::Error, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum AnswerProblem {
    /// No answer.
    #[error("{entry}: not filled in")]
    Empty {
        /// The entry.
        entry: String,
    },
    /// A value that is not a positive number.
    #[error("{entry}: {value} must be a positive number")]
    NotPositive {
        /// The entry.
        entry: String,
        /// Its value.
        value: f64,
    },
    /// Another unit.
    #[error("{entry}: the unit is `{unit}`, the table asks for `{expected}`")]
    Unit {
        /// The entry.
        entry: String,
        /// As given.
        unit: String,
        /// As asked.
        expected: String,
    },
    /// An entry that the work does not have.
    #[error("{entry}: the work has no such entry")]
    Unasked {
        /// The entry.
        entry: String,
    },
    /// A class that is neither an effect, a family, `none` nor `unknown`.
    #[error("{entry}: `{class}` is neither an effect of the catalogue (`stand effects`), nor `none`, nor `unknown`")]
    Class {
        /// The entry.
        entry: String,
        /// The class.
        class: String,
    },
    /// A class that the given model contains, so that no log can lack it.
    #[error("{entry}: `{class}` is part of the given model (model.toml) already; only what the model lacks has a probability")]
    InModel {
        /// The entry.
        entry: String,
        /// The class.
        class: String,
    },
    /// Two effects of one family, which count as one class.
    #[error("{entry}: `{class}` belongs to the family `{family}`, which is listed already; give one probability for the family")]
    SameFamily {
        /// The entry.
        entry: String,
        /// The effect.
        class: String,
        /// Its family.
        family: String,
    },
    /// A probability outside 0 to 1.
    #[error("{entry}: {value} is not a probability from 0 to 1")]
    Probability {
        /// The entry.
        entry: String,
        /// Its value.
        value: f64,
    },
    /// `none` excludes every other class.
    #[error("{entry}: the probability of `none` and the greatest other one sum to {sum:.2}; nothing and something cannot both be present")]
    NoneBeside {
        /// The entry.
        entry: String,
        /// The sum.
        sum: f64,
    },
    /// All classes together are less likely than 1.
    #[error(
        "{entry}: the probabilities sum to {sum:.2}; one class at least is present (`none` and `unknown` are classes), so that the sum is 1 or more"
    )]
    TooLittle {
        /// The entry.
        entry: String,
        /// The sum.
        sum: f64,
    },
}

impl AnswerProblem {
    /// The entry that has it.
    pub fn entry(&self) -> &str {
        match self {
            Self::Empty { entry }
            | Self::NotPositive { entry, .. }
            | Self::Unit { entry, .. }
            | Self::Unasked { entry }
            | Self::Class { entry, .. }
            | Self::InModel { entry, .. }
            | Self::SameFamily { entry, .. }
            | Self::Probability { entry, .. }
            | Self::NoneBeside { entry, .. }
            | Self::TooLittle { entry, .. } => entry,
        }
    }
}

/// The class of an effect: its family, whose members some logs cannot distinguish, or the effect itself.
pub fn class_of(effect: &str) -> Option<&'static str> {
    card(effect).map(class_of_card)
}

fn class_of_card(card: &Card) -> &'static str {
    if card.family.is_empty() { card.id } else { card.family }
}

/// The class that is meant by a word in the table: an effect, a family, `none` or `unknown`.
fn class_named(word: &str) -> Option<&'static str> {
    match word {
        NONE => Some(NONE),
        UNKNOWN => Some(UNKNOWN),
        _ => class_of(word).or_else(|| cards().iter().map(|card| card.family).find(|family| !family.is_empty() && *family == word)),
    }
}

/// The classes of a hunt with their effects, by name; effects of `in_model` are left out. First `none` and `unknown`, which have no
/// effects.
pub fn classes(in_model: &[&str]) -> Vec<(&'static str, Vec<&'static str>)> {
    let mut classes: Vec<(&str, Vec<&str>)> = vec![(NONE, Vec::new()), (UNKNOWN, Vec::new())];
    for card in cards().iter().filter(|card| !in_model.contains(&card.id)) {
        let class = class_of_card(card);
        match classes.iter_mut().find(|(name, _)| *name == class) {
            Some((_, effects)) => effects.push(card.id),
            None => classes.push((class, vec![card.id])),
        }
    }
    classes[2..].sort_unstable();
    classes
}

/// Probabilities by class; words that are no class are left out.
pub fn by_class(probabilities: &BTreeMap<String, f64>) -> BTreeMap<String, f64> {
    probabilities.iter().filter_map(|(word, p)| class_named(word).map(|class| (class.to_owned(), *p))).collect()
}

/// Checks the probabilities of one log; `in_model`: the effects of the given model.
fn check_probabilities(entry: &str, probabilities: &BTreeMap<String, f64>, in_model: &[&str], problems: &mut Vec<AnswerProblem>) {
    let entry = || entry.to_owned();
    if probabilities.is_empty() {
        problems.push(AnswerProblem::Empty { entry: entry() });
        return;
    }
    let mut seen = BTreeSet::new();
    let count = problems.len();
    for (word, p) in probabilities {
        match class_named(word) {
            None => problems.push(AnswerProblem::Class { entry: entry(), class: word.clone() }),
            Some(_) if in_model.contains(&word.as_str()) => {
                problems.push(AnswerProblem::InModel { entry: entry(), class: word.clone() });
            }
            Some(class) if !seen.insert(class) => {
                problems.push(AnswerProblem::SameFamily { entry: entry(), class: word.clone(), family: class.to_owned() });
            }
            Some(_) => {}
        }
        if !(0.0..=1.0).contains(p) {
            problems.push(AnswerProblem::Probability { entry: format!("{}.{word}", entry()), value: *p });
        }
    }
    if problems.len() > count {
        return;
    }
    let none = probabilities.get(NONE).copied().unwrap_or(0.0);
    let others = probabilities.iter().filter(|(word, _)| *word != NONE).map(|(_, p)| *p);
    let greatest = others.clone().fold(0.0, f64::max);
    let sum = none + others.sum::<f64>();
    if none + greatest > 1.0 + MAX_SUM_EXCESS {
        problems.push(AnswerProblem::NoneBeside { entry: entry(), sum: none + greatest });
    } else if sum < 1.0 - MAX_SUM_EXCESS {
        problems.push(AnswerProblem::TooLittle { entry: entry(), sum });
    }
}

fn check_quantities(answers: &Answers, quantities: &[QuantitySpec], problems: &mut Vec<AnswerProblem>) {
    for asked in quantities {
        let entry = |field: &str| format!("quantities.{}{field}", asked.name);
        let Some(given) = answers.quantities.get(&asked.name) else {
            problems.push(AnswerProblem::Empty { entry: entry("") });
            continue;
        };
        for (field, number) in [(".value", given.value), (".U", given.expanded_u)] {
            if number.is_nan() {
                problems.push(AnswerProblem::Empty { entry: entry(field) });
            }
        }
        if given.value.is_infinite() {
            problems.push(AnswerProblem::NotPositive { entry: entry(".value"), value: given.value });
        }
        if given.expanded_u <= 0.0 || given.expanded_u.is_infinite() {
            problems.push(AnswerProblem::NotPositive { entry: entry(".U"), value: given.expanded_u });
        }
        if given.budget.trim().is_empty() {
            problems.push(AnswerProblem::Empty { entry: entry(".budget") });
        }
        if given.unit != asked.unit {
            problems.push(AnswerProblem::Unit { entry: entry(".unit"), unit: given.unit.clone(), expected: asked.unit.clone() });
        }
    }
}

/// Whether a line of the table has a number with a decimal comma: a digit, a comma and a digit outside of quotation marks.
fn has_decimal_comma(line: &str) -> bool {
    let content = line.split(['#', '"']).next().unwrap_or_default();
    content.contains('=') && content.as_bytes().windows(3).any(|w| w[0].is_ascii_digit() && w[1] == b',' && w[2].is_ascii_digit())
}

impl Answers {
    /// Parses the text of `answers.toml`.
    ///
    /// # Errors
    /// The error of the TOML parser, with its line, and a hint where that line has a decimal comma.
    pub fn parse(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|error: toml::de::Error| {
            let message = error.to_string().trim_end().to_owned();
            let start = error.span().map_or(0, |span| span.start);
            let number = text.bytes().take(start).filter(|byte| *byte == b'\n').count();
            // The parser may report the line after the one that it could not end.
            let has_comma = text.lines().skip(number.saturating_sub(1)).take(2).any(has_decimal_comma);
            if has_comma { format!("{message}\nuse a decimal point, not a decimal comma: 0.0234") } else { message }
        })
    }

    /// What is missing or malformed of the answers of a time. After the measurement all answers are asked.
    pub fn problems(&self, lab: &Lab, when: When) -> Vec<AnswerProblem> {
        let mut problems = Vec::new();
        let is_asked = |question: When| question == When::Before || when == When::After;
        for question in lab.questions.iter().filter(|question| is_asked(question.when)) {
            if self.questions.get(&question.id).is_none_or(|answer| answer.trim().is_empty()) {
                problems.push(AnswerProblem::Empty { entry: format!("questions.{}", question.id) });
            }
        }
        if when == When::After {
            check_quantities(self, lab.quantities(), &mut problems);
        }
        if let Some(task) = lab.hunt() {
            self.check_hunt(task, &lab.effects_in_model(), when, &mut problems);
        }
        if when == When::After && self.conclusion.trim().is_empty() {
            problems.push(AnswerProblem::Empty { entry: "conclusion".to_owned() });
        }
        let quantities = lab.quantities().iter().map(|q| q.name.as_str()).collect();
        let logs = lab.hunt().map_or_else(BTreeSet::new, |task| task.logs.iter().map(String::as_str).collect());
        let questions: BTreeSet<&str> = lab.questions.iter().map(|question| question.id.as_str()).collect();
        let unasked = |table: &str, given: Vec<&String>, asked: &BTreeSet<&str>| -> Vec<AnswerProblem> {
            let entries = given.into_iter().filter(|key| !asked.contains(key.as_str()));
            entries.map(|key| AnswerProblem::Unasked { entry: format!("{table}.{key}") }).collect()
        };
        problems.extend(unasked("quantities", self.quantities.keys().collect(), &quantities));
        problems.extend(unasked("hunt", self.hunt.keys().collect(), &logs));
        problems.extend(unasked("questions", self.questions.keys().collect(), &questions));
        problems
    }

    fn check_hunt(&self, task: &HuntTask, in_model: &[&str], when: When, problems: &mut Vec<AnswerProblem>) {
        let empty = HuntAnswer::default();
        for log in &task.logs {
            let given = self.hunt.get(log).unwrap_or(&empty);
            check_probabilities(&format!("hunt.{log}.before"), &given.before, in_model, problems);
            if given.reason.trim().is_empty() {
                problems.push(AnswerProblem::Empty { entry: format!("hunt.{log}.reason") });
            }
            if when == When::After {
                check_probabilities(&format!("hunt.{log}.after"), &given.after, in_model, problems);
            }
        }
    }
}

/// The empty table of a work, with its questions as comments.
pub fn empty_table(lab: &Lab, language: Language) -> String {
    let mut text = String::new();
    let mut line = |content: &str| {
        let _ = writeln!(text, "{content}");
    };
    let comment = |en: &'static str, uk: &'static str| if language == Language::En { en } else { uk };
    line(&format!("# {}. {}", lab.number, lab.title.in_language(language)));
    let questions = |line: &mut dyn FnMut(&str), when: When| {
        for question in lab.questions(when) {
            line(&format!("# {}", question.text.in_language(language)));
            line(&format!("{} = \"\"", question.id));
        }
    };
    line(comment("conclusion = \"\"  # after the measurement", "conclusion = \"\"  # висновок, після вимірювань"));
    line("");
    line("[questions]");
    line(comment("# Before the measurement.", "# До вимірювань."));
    questions(&mut line, When::Before);
    line(comment("# After the measurement.", "# Після вимірювань."));
    questions(&mut line, When::After);
    match lab.hunt() {
        None => {
            line("");
            line(comment(
                "# Measured values, with a decimal point. U: expanded uncertainty, coverage probability 95 %. nan: not filled in.",
                "# Виміряні значення, з десятковою крапкою. U — розширена невизначеність, імовірність охоплення 95 %. nan — не заповнено.",
            ));
            line(comment(
                "# budget: contributions (type A, type B with half-widths), and the coverage factor. Several lines stand between three quotation marks.",
                "# budget — складові (тип A, тип B з півширинами) і коефіцієнт охоплення. Кілька рядків беруть у потрійні лапки \"\"\".",
            ));
            for quantity in lab.quantities() {
                line("");
                line(&format!("[quantities.{}]  # {}", quantity.name, quantity.text.in_language(language)));
                line("value = nan");
                line("U = nan");
                line(&format!("unit = \"{}\"", quantity.unit));
                line("budget = \"\"");
            }
        }
        Some(task) => {
            line("");
            line(comment(
                "# Probability that each is present, 0 to 1: effects by their names in `stand effects`, none, unknown. What is not listed has 0.",
                "# Імовірність присутності кожного, від 0 до 1: ефекти за назвами зі `stand effects`, none, unknown. Не назване має 0.",
            ));
            line(comment(
                "# Their sum is 1 or more, because one class at least is present; more than 1 where you expect two effects. none and any other class sum to 1 at most.",
                "# Їхня сума — 1 або більше, бо принаймні один клас присутній; понад 1, якщо ви очікуєте двох ефектів. none разом із будь-яким іншим класом — не більш як 1.",
            ));
            let in_model = lab.effects_in_model().join(", ");
            line(&match language {
                Language::En => format!("# Effects of the given model ({in_model}) are not hidden and have no probability."),
                Language::Uk => format!("# Ефекти заданої моделі ({in_model}) не сховані й імовірності не мають."),
            });
            line(comment(
                "# Example: before = { cogging = 0.6, torque-ripple = 0.3, none = 0.1 }",
                "# Приклад: before = { cogging = 0.6, torque-ripple = 0.3, none = 0.1 }",
            ));
            for log in &task.logs {
                line("");
                line(&format!("[hunt.{log}]  # logs/{log}.parquet"));
                line("before = {}");
                line("reason = \"\"");
                line("after = {}");
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probabilities(text: &str) -> Vec<AnswerProblem> {
        let answer: HuntAnswer = toml::from_str(&format!("before = {text}")).expect("a table");
        let mut problems = Vec::new();
        check_probabilities("A", &answer.before, &["viscous"], &mut problems);
        problems
    }

    #[test]
    fn decimal_comma_is_named() {
        let table = |line: &str| Answers::parse(&format!("conclusion = \"1,5\"\n[quantities.scale]\n{line}\nU = 0.1\nunit = \"1\"\n"));
        assert!(table("value = 1,02").expect_err("no number").contains("use a decimal point"));
        assert!(!table("value = 1.o2").expect_err("no number").contains("decimal point"));
        let hunt = Answers::parse("[hunt.A]\nbefore = { cogging = 0,6, none = 0,4 }\n").expect_err("no numbers");
        assert!(hunt.contains("use a decimal point"), "{hunt}");
    }

    #[test]
    fn empty_table_asks_for_every_entry_once() {
        for lab in super::super::course::works().expect("works") {
            for language in [Language::En, Language::Uk] {
                let answers = Answers::parse(&empty_table(&lab, language)).expect("a table");
                let before = answers.problems(&lab, When::Before);
                let after = answers.problems(&lab, When::After);
                assert!(before.iter().chain(&after).all(|p| matches!(p, AnswerProblem::Empty { .. })), "{after:?}");
                let entries: BTreeSet<&str> = after.iter().map(AnswerProblem::entry).collect();
                assert_eq!(entries.len(), after.len());
                assert!(before.len() < after.len());
            }
        }
    }

    #[test]
    fn valid_probabilities_have_no_problem() {
        assert_eq!(probabilities("{ cogging = 0.6, none = 0.4 }"), []);
        assert_eq!(probabilities("{ cogging = 1.0, load = 1.0 }"), []);
        assert_eq!(probabilities("{ none = 1 }"), []);
    }

    #[test]
    fn contradictory_probabilities_are_named() {
        assert!(matches!(probabilities("{ coging = 1.0 }")[..], [AnswerProblem::Class { .. }]));
        assert!(matches!(probabilities("{ none = 0.5, load = 0.9 }")[..], [AnswerProblem::NoneBeside { .. }]));
        assert!(matches!(probabilities("{ load = 0.2 }")[..], [AnswerProblem::TooLittle { .. }]));
        assert!(matches!(probabilities("{ none = 1.2 }")[..], [AnswerProblem::Probability { .. }]));
        assert!(matches!(probabilities("{ load = nan, none = 1.0 }")[..], [AnswerProblem::Probability { .. }]));
        assert!(matches!(probabilities("{ viscous = 0.5, none = 0.5 }")[..], [AnswerProblem::InModel { .. }]));
        assert!(matches!(probabilities("{ brush-drop = 0.5, dead-time = 0.5 }")[..], [AnswerProblem::SameFamily { .. }]));
    }

    #[test]
    fn units_and_uncertainties_are_checked() {
        let lab = Lab::find("motor").expect("a work");
        let table = empty_table(&lab, Language::En).replace("nan", "0.02").replace("N m/A\"", "mN m/A\"").replacen("U = 0.02", "U = -1", 1);
        let problems = Answers::parse(&table).expect("a table").problems(&lab, When::After);
        assert!(problems.iter().any(|p| matches!(p, AnswerProblem::Unit { .. })), "{problems:?}");
        assert!(problems.iter().any(|p| matches!(p, AnswerProblem::NotPositive { .. })), "{problems:?}");
    }
}
