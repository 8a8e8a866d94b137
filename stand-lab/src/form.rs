//! The table of answers as a form: every entry as text.
//!
//! Input: a work folder, a filled form. Output: the entries of `answers.toml` as text, and the file with the entries of the form. Comments,
//! order, notation of numbers and entries without a field stay as the student wrote them: only an entry whose text differs is replaced, and
//! one that is missing is added.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml_edit::{DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::LabError;
use super::answers::{ANSWERS_FILE, AnswerProblem, Answers};
use super::course::{Lab, QuantitySpec};
use super::journal::sha256_of;
use super::work::Work;
use identification::files;

/// A measured value; empty numbers: not filled in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuantityForm {
    /// Value.
    pub value: String,
    /// Expanded uncertainty.
    #[serde(rename = "U")]
    pub expanded_u: String,
    /// Unit of both.
    pub unit: String,
    /// Uncertainty budget.
    pub budget: String,
}

/// Probabilities for one log; a class with an empty one is not in the table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HuntForm {
    /// Where the model fails.
    pub reason: String,
    /// By the student's own analysis.
    pub before: BTreeMap<String, String>,
    /// After `stand explain`.
    pub after: BTreeMap<String, String>,
}

/// The entries that a work asks for. An entry that a filled form lacks stays as it is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AnswersForm {
    /// Conclusion; `None`: no change.
    pub conclusion: Option<String>,
    /// Answers to the questions.
    pub questions: BTreeMap<String, String>,
    /// Measured values.
    pub quantities: BTreeMap<String, QuantityForm>,
    /// Probabilities by log.
    pub hunt: BTreeMap<String, HuntForm>,
}

/// A form with the file that it shows.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LoadedForm {
    /// SHA-256 of the file.
    pub sha256: String,
    /// Its entries.
    pub answers: AnswersForm,
}

/// Reads the answers of a work folder as a form.
///
/// # Errors
/// A file cannot be read, or is no table of answers.
pub fn load(folder: &Path) -> Result<LoadedForm, LabError> {
    let (lab, text) = (Work::read(folder)?.lab()?, read(folder)?);
    Ok(LoadedForm { sha256: sha256_of(text.as_bytes()), answers: AnswersForm::of(&document(folder, &text)?, &lab) })
}

/// Writes a form into the answers of a work folder; returns the SHA-256 of the file. `loaded_sha256`: that of the file from which the form
/// was loaded.
///
/// # Errors
/// [`LabError::AnswersChanged`]: the file is another one now. A number that is none or an entry that the work does not have, by name. A
/// file cannot be read or written.
pub fn save(folder: &Path, form: &AnswersForm, loaded_sha256: &str) -> Result<String, LabError> {
    let (lab, path) = (Work::read(folder)?.lab()?, folder.join(ANSWERS_FILE));
    let _locked = files::lock(&path).map_err(|source| LabError::file(&path, "lock", source))?;
    let text = read(folder)?;
    if sha256_of(text.as_bytes()) != loaded_sha256 {
        return Err(LabError::AnswersChanged { path });
    }
    let mut document = document(folder, &text)?;
    form.write(&mut document, &lab)?;
    let text = document.to_string();
    Answers::parse(&text).map_err(|message| LabError::invalid(&path, message))?;
    files::replace_text(&path, &text).map_err(|source| LabError::file(&path, "write", source))?;
    Ok(sha256_of(text.as_bytes()))
}

fn read(folder: &Path) -> Result<String, LabError> {
    let path = folder.join(ANSWERS_FILE);
    std::fs::read_to_string(&path).map_err(|source| LabError::file(&path, "read", source))
}

/// The text as a document whose entries have the types of [`Answers`].
fn document(folder: &Path, text: &str) -> Result<DocumentMut, LabError> {
    let invalid = |message| LabError::invalid(&folder.join(ANSWERS_FILE), message);
    Answers::parse(text).map_err(invalid)?;
    text.parse().map_err(|error: toml_edit::TomlError| invalid(error.to_string()))
}

/// Text of an entry; a number in the notation of the file. Empty: no entry, or `nan`.
fn text_of(item: Option<&Item>) -> String {
    match item.and_then(Item::as_value) {
        Some(Value::String(text)) => text.value().replace("\r\n", "\n"),
        Some(Value::Float(number)) if !number.value().is_nan() => number.display_repr().into_owned(),
        Some(Value::Integer(number)) => number.display_repr().into_owned(),
        _ => String::new(),
    }
}

fn item<'d>(document: &'d DocumentMut, path: &[&str]) -> Option<&'d Item> {
    path.iter().try_fold(document.as_item(), |item, key| item.get(key))
}

/// The table at a path; one that is missing is added.
fn table<'d>(document: &'d mut DocumentMut, path: &[&str]) -> Result<&'d mut dyn TableLike, LabError> {
    let no_table = || LabError::Argument(format!("{} in {ANSWERS_FILE} is no table", path.join(".")));
    let mut at = document.as_item_mut();
    for key in path {
        let is_inline = at.is_inline_table();
        let inside = at.as_table_like_mut().ok_or_else(no_table)?;
        if !inside.contains_key(key) {
            let new = if is_inline { Item::Value(InlineTable::new().into()) } else { Item::Table(Table::new()) };
            inside.insert(key, new);
        }
        at = inside.get_mut(key).ok_or_else(no_table)?;
    }
    at.as_table_like_mut().ok_or_else(no_table)
}

/// Replaces the value of a key and keeps the comments around it.
fn set(table: &mut dyn TableLike, key: &str, mut value: Value) {
    match table.get_mut(key) {
        Some(item) => {
            if let Some(before) = item.as_value() {
                *value.decor_mut() = before.decor().clone();
            }
            *item = Item::Value(value);
        }
        None => drop(table.insert(key, Item::Value(value))),
    }
}

fn set_text(document: &mut DocumentMut, path: &[&str], text: &str) -> Result<(), LabError> {
    let Some((key, parents)) = path.split_last() else { return Ok(()) };
    let before = item(document, path);
    if before.is_none() || text_of(before) != text {
        set(table(document, parents)?, key, Value::from(text));
    }
    Ok(())
}

/// Sets a number as it was typed, with a decimal point or comma; an empty one is `nan`.
fn set_number(document: &mut DocumentMut, path: &[&str], typed: &str) -> Result<(), LabError> {
    let Some((key, parents)) = path.split_last() else { return Ok(()) };
    let text = typed.trim().replace(',', ".");
    let before = item(document, path);
    if before.is_some() && text_of(before) == text {
        return Ok(());
    }
    let value = match text.parse::<f64>() {
        _ if text.is_empty() => Value::from(f64::NAN),
        // What Rust reads and TOML does not, such as `.5`, is written in the notation of TOML.
        Ok(number) if number.is_finite() => text.parse().unwrap_or_else(|_| Value::from(number)),
        _ => return Err(LabError::Argument(format!("{}: `{}` is not a number", path.join("."), typed.trim()))),
    };
    set(table(document, parents)?, key, value);
    Ok(())
}

/// Sets the probabilities of a table; a class whose probability is empty or missing is removed.
fn set_probabilities(document: &mut DocumentMut, path: [&str; 3], typed: &BTreeMap<String, String>) -> Result<(), LabError> {
    let [hunt, log, time] = path;
    if item(document, &path).is_none() {
        set(table(document, &[hunt, log])?, time, InlineTable::new().into());
    }
    let stays = |class: &str| typed.get(class).is_some_and(|p| !p.trim().is_empty());
    let probabilities = table(document, &path)?;
    let removed: Vec<String> = probabilities.iter().map(|(class, _)| class.to_owned()).filter(|class| !stays(class)).collect();
    for class in removed {
        probabilities.remove(&class);
    }
    typed.iter().filter(|(class, _)| stays(class)).try_for_each(|(class, p)| set_number(document, &[hunt, log, time, class], p))
}

impl AnswersForm {
    /// The entries of a document that the work asks for.
    fn of(document: &DocumentMut, lab: &Lab) -> Self {
        let text = |path: &[&str]| text_of(item(document, path));
        let question = |id: &String| (id.clone(), text(&["questions", id]));
        let quantity = |asked: &QuantitySpec| {
            let field = |key| text(&["quantities", &asked.name, key]);
            let unit = item(document, &["quantities", &asked.name]).map_or_else(|| asked.unit.clone(), |_| field("unit"));
            (asked.name.clone(), QuantityForm { value: field("value"), expanded_u: field("U"), unit, budget: field("budget") })
        };
        let hunt = |log: &String| {
            let probabilities = |time: &str| {
                let table = item(document, &["hunt", log, time]).and_then(Item::as_table_like);
                let entries = table.into_iter().flat_map(TableLike::iter);
                entries.map(|(class, p)| (class.to_owned(), text_of(Some(p)))).collect()
            };
            let reason = text(&["hunt", log, "reason"]);
            (log.clone(), HuntForm { reason, before: probabilities("before"), after: probabilities("after") })
        };
        AnswersForm {
            conclusion: Some(text(&["conclusion"])),
            questions: lab.questions.iter().map(|asked| question(&asked.id)).collect(),
            quantities: lab.quantities().iter().map(quantity).collect(),
            hunt: lab.hunt().into_iter().flat_map(|task| &task.logs).map(hunt).collect(),
        }
    }

    /// Writes the entries into a document.
    fn write(&self, document: &mut DocumentMut, lab: &Lab) -> Result<(), LabError> {
        let asked = AnswersForm::of(document, lab);
        let unasked =
            |table: &str, key: &String| LabError::Argument(AnswerProblem::Unasked { entry: format!("{table}.{key}") }.to_string());
        for (id, answer) in &self.questions {
            asked.questions.get(id).ok_or_else(|| unasked("questions", id))?;
            set_text(document, &["questions", id], answer)?;
        }
        for (name, given) in &self.quantities {
            asked.quantities.get(name).ok_or_else(|| unasked("quantities", name))?;
            set_number(document, &["quantities", name, "value"], &given.value)?;
            set_number(document, &["quantities", name, "U"], &given.expanded_u)?;
            set_text(document, &["quantities", name, "unit"], &given.unit)?;
            set_text(document, &["quantities", name, "budget"], &given.budget)?;
        }
        for (log, given) in &self.hunt {
            asked.hunt.get(log).ok_or_else(|| unasked("hunt", log))?;
            set_probabilities(document, ["hunt", log, "before"], &given.before)?;
            set_text(document, &["hunt", log, "reason"], &given.reason)?;
            set_probabilities(document, ["hunt", log, "after"], &given.after)?;
        }
        self.conclusion.as_ref().map_or(Ok(()), |conclusion| set_text(document, &["conclusion"], conclusion))
    }
}

#[cfg(test)]
mod tests {
    use super::super::answers::empty_table;
    use super::super::course::Language;
    use super::*;

    fn form_of(text: &str, lab: &Lab) -> AnswersForm {
        AnswersForm::of(&text.parse().expect("TOML"), lab)
    }

    fn written(text: &str, form: &AnswersForm, lab: &Lab) -> String {
        let mut document = text.parse().expect("TOML");
        form.write(&mut document, lab).expect("written");
        document.to_string()
    }

    #[test]
    fn form_without_changes_leaves_every_table_as_it_is() {
        for lab in super::super::course::works().expect("works") {
            for language in [Language::En, Language::Uk] {
                let text = empty_table(&lab, language);
                assert_eq!(written(&text, &form_of(&text, &lab), &lab), text, "{}", lab.id);
            }
        }
    }

    #[test]
    fn changed_entries_are_written_and_all_else_stays_by_hand() {
        let lab = Lab::find("gyro").expect("a work");
        let name = &lab.quantities()[0].name;
        let text = empty_table(&lab, Language::En)
            .replacen("value = nan", "value = 1.0200  # mine", 1)
            .replace("[questions]", "[questions]  # kept")
            + "\n[quantities.extra]\nvalue = 7\nU = 1\nunit = \"1\"\n";
        let mut form = form_of(&text, &lab);
        let quantity = form.quantities.get_mut(name).expect("asked");
        assert_eq!(quantity.value, "1.0200");
        (quantity.expanded_u, quantity.budget) = ("0,0030".to_owned(), "type A\n\"type B\"".to_owned());
        let after = written(&text, &form, &lab);
        assert!(after.contains("value = 1.0200  # mine") && after.contains("U = 0.0030\n"), "{after}");
        assert!(after.contains("[questions]  # kept") && after.contains("[quantities.extra]\nvalue = 7\n"), "{after}");
        assert_eq!(Answers::parse(&after).expect("answers").quantities[name].budget, "type A\n\"type B\"");
        assert_eq!(form_of(&after, &lab).quantities[name].expanded_u, "0.0030");
    }

    #[test]
    fn missing_tables_are_added() {
        for (lab, inline) in [("gyro", "quantities = {}\n"), ("hunt", "hunt = { A = {} }\n")] {
            let lab = Lab::find(lab).expect("a work");
            let mut form = form_of(&empty_table(&lab, Language::En), &lab);
            form.questions.values_mut().for_each(|answer| *answer = "an answer".to_owned());
            for given in form.hunt.values_mut() {
                given.before = BTreeMap::from([("none".to_owned(), ".5".to_owned()), ("load".to_owned(), String::new())]);
            }
            for text in ["", inline] {
                let answers = Answers::parse(&written(text, &form, &lab)).expect("answers");
                assert!(answers.questions.values().all(|answer| answer == "an answer") && answers.questions.len() == lab.questions.len());
                assert!(lab.quantities().iter().all(|asked| answers.quantities[&asked.name].unit == asked.unit));
                assert!(answers.hunt.values().all(|given| given.before == BTreeMap::from([("none".to_owned(), 0.5)])), "{answers:?}");
            }
        }
    }

    #[test]
    fn bad_numbers_and_unknown_entries_are_named() {
        let lab = Lab::find("gyro").expect("a work");
        let text = empty_table(&lab, Language::En);
        let name = lab.quantities()[0].name.clone();
        for bad in ["1.o2", "inf", "1.000,5", "nan", "0x10"] {
            let mut form = form_of(&text, &lab);
            form.quantities.get_mut(&name).expect("asked").value = bad.to_owned();
            let error = form.write(&mut text.parse().expect("TOML"), &lab).expect_err("no number").to_string();
            assert!(error.contains(&format!("quantities.{name}.value")) && error.contains(bad), "{error}");
        }
        let mut form = AnswersForm::default();
        form.questions.insert("mine".to_owned(), String::new());
        let error = form.write(&mut text.parse().expect("TOML"), &lab).expect_err("unasked").to_string();
        assert!(error.contains("questions.mine"), "{error}");
    }
}
