//! The words of the page: one table of keys, each in both languages; every key of the page is in it and every key in it is used. What the
//! program gives as a kind with numbers has a key for each kind, whose arguments are those that the program gives: the source of the
//! program is read for them.
#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

fn read(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../stand-panel/page").join(name)).unwrap()
}

/// The keys of the table with their texts.
fn table() -> Vec<(String, [String; 2])> {
    let text = read("text.js");
    let (_, table) = text.split_once("export const TEXT = {\n").unwrap();
    let (table, _) = table.split_once("\n};").unwrap();
    let entry = |line: &str| {
        let (key, texts) = line.trim().trim_end_matches(',').split_once(": ").unwrap();
        (key.to_owned(), serde_json::from_str(texts).unwrap_or_else(|e| panic!("{line}: {e}")))
    };
    table.lines().map(entry).collect()
}

/// The words behind `before` up to the next quotation mark.
fn quoted(source: &str, before: &str) -> Vec<String> {
    // `getContext("` is no `text("`, and `.fill(" "` is not of the table.
    let is_word = |at: usize| at > 0 && (source.as_bytes()[at - 1].is_ascii_alphabetic() || source.as_bytes()[at - 1] == b'.');
    source
        .match_indices(before)
        .filter(|(at, _)| !is_word(*at))
        .map(|(at, _)| source[at + before.len()..].split('"').next().unwrap().to_owned())
        .collect()
}

#[test]
fn every_key_has_both_languages_and_the_ukrainian_text_is_cyrillic() {
    let table = table();
    assert!(table.len() > 60);
    for (key, [english, ukrainian]) in table {
        assert!(!english.is_empty() && !ukrainian.is_empty() && english.chars().all(|c| c.is_ascii() || "Δ±°²√".contains(c)), "{key}");
        let is_symbol = ["evidence", "evidence_of"].contains(&key.as_str());
        assert!(
            is_symbol || ukrainian.to_lowercase().chars().any(|c| ('а'..='я').contains(&c) || "іїєґ".contains(c)),
            "{key}: {ukrainian}"
        );
    }
}

#[test]
fn page_uses_the_keys_of_the_table_and_no_others() {
    let keys: BTreeSet<String> = table().into_iter().map(|(key, _)| key).collect();
    let modules: String = [
        "main.js",
        "live.js",
        "drive.js",
        "identify.js",
        "residuals.js",
        "explanation.js",
        "signature.js",
        "plot-group.js",
        "import.js",
        "compensate.js",
        "measure.js",
        "laboratory.js",
        "fields.js",
        "plot.js",
        "connection.js",
    ]
    .map(read)
    .concat();
    let mut asked: BTreeSet<String> = quoted(&read("index.html"), "data-text=\"").into_iter().collect();
    for before in
        ["text(\"", "fill(\"", "field(\"", "button(\"", "entry(\"", "typed(\"setpoint\", \"", "offer(\"log-choice\", session.logs, log, \""]
    {
        asked.extend(quoted(&modules, before));
    }
    let missing: Vec<&String> = asked.iter().filter(|key| !keys.contains(*key)).collect();
    assert!(missing.is_empty(), "not in text.js: {missing:?}");
    let by_kind: BTreeSet<String> = kinds().into_keys().collect();
    let is_used = |key: &String| asked.contains(key) || by_kind.contains(key) || modules.contains(&format!("\"{key}\""));
    let unused: Vec<&String> = keys.iter().filter(|key| !is_used(key)).collect();
    assert!(unused.is_empty(), "not used: {unused:?}");
}

/// Source of the program, from the folder of the workspace.
fn program(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)).unwrap()
}

/// The item that begins with `head`, up to the bracket that ends it.
fn item<'a>(source: &'a str, head: &str) -> &'a str {
    let from = source.find(head).unwrap_or_else(|| panic!("{head}"));
    let indent = &source[..from].rsplit('\n').next().unwrap().len();
    let end = format!("\n{}}}", " ".repeat(*indent));
    &source[from..from + source[from..].find(&end).unwrap()]
}

/// The kinds of a function that makes JSON, with their fields: `json!({"kind": "x", "a": …})`.
fn of_function(path: &str, head: &str) -> BTreeMap<String, BTreeSet<String>> {
    let source = program(path);
    let objects = item(&source, head).split("json!({").skip(1);
    let kind = |object: &str| {
        let object = object.split("})").next().unwrap();
        let name = object.split("\"kind\": \"").nth(1).unwrap().split('"').next().unwrap().replace('-', "_");
        (name, object.split(", \"").skip(1).map(|field| field.split('"').next().unwrap().to_owned()).collect())
    };
    objects.map(kind).collect()
}

/// The variants of an enum that is serialized by `kind`, with their fields.
fn of_enum(path: &str, head: &str) -> BTreeMap<String, BTreeSet<String>> {
    let source = program(path);
    let (mut all, mut renamed) = (Vec::<(String, BTreeSet<String>)>::new(), None);
    for line in item(&source, head).lines().skip(1) {
        let indent = line.len() - line.trim_start().len();
        let name: String = line.trim_start().chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
        if let Some(rename) = line.trim().strip_prefix("#[serde(rename = \"") {
            renamed = Some(rename.split('"').next().unwrap().replace('-', "_"));
        } else if indent == 4 && name.starts_with(|c: char| c.is_ascii_uppercase()) && !line.contains('(') {
            let snake = |c: char| if c.is_ascii_uppercase() { format!("_{}", c.to_ascii_lowercase()) } else { c.to_string() };
            let plain = name.chars().map(snake).collect::<String>().trim_start_matches('_').to_owned();
            all.push((renamed.take().unwrap_or(plain), BTreeSet::new()));
        } else if indent == 8 && line.trim_start()[name.len()..].starts_with(':') {
            all.last_mut().unwrap().1.insert(name);
        }
    }
    all.into_iter().collect()
}

/// The names that a function gives: `=> "x y"`.
fn of_names(path: &str, head: &str) -> BTreeMap<String, BTreeSet<String>> {
    quoted(item(&program(path), head), "=> \"").into_iter().map(|name| (name.replace([' ', '-'], "_"), BTreeSet::new())).collect()
}

/// The keys that the program's kinds need, with the arguments that the program gives. Kinds whose sentence the program itself has are left
/// out.
fn kinds() -> BTreeMap<String, BTreeSet<String>> {
    let report = "stand-report/src";
    let sentences = format!("{report}/explanation/sentences.rs");
    let stage = "stand-panel/src/stage.rs";
    let note = "stand-analysis/src/calibrate/note.rs";
    let families = [
        ("form", of_function(&format!("{report}/misfits.rs"), "fn form_json(")),
        ("refusal", of_function(&sentences, "pub fn refusal_json(")),
        ("hidden", of_function(&sentences, "pub fn not_visible_json(")),
        ("hidden", of_function(&sentences, "fn unmet_json(")),
        ("shape", of_function(&sentences, "pub fn shape_json(")),
        ("purpose", of_function(&sentences, "pub fn purpose_json(")),
        ("allan", of_function(&format!("{report}/allan/json.rs"), "fn reason_json(")),
        ("allan", of_function(&format!("{report}/allan/json.rs"), "fn in_degrees(")),
        ("allan_note", of_function(&format!("{report}/allan/words.rs"), "pub(super) fn note_json(")),
        ("drift", of_function(&format!("{report}/drift/words.rs"), "pub(super) fn warning_json(")),
        ("left_out", of_function(&format!("{report}/compensation.rs"), "fn not_compensated_json(")),
        ("absent", of_enum(note, "pub enum AbsenceReason {")),
        ("calibration", of_enum(note, "pub enum Remark {")),
        ("stage", of_enum(stage, "pub enum Stage {")),
        ("ask", of_enum(stage, "pub enum Request {")),
        ("ask", of_enum("stand-acquire/src/calibration_session/instruction.rs", "pub enum Action {")),
        ("stopped", of_enum(stage, "pub enum StopReason {")),
        ("fate", of_names(&format!("{report}/explanation/evidence.rs"), "pub fn name(self)")),
        ("strength", of_names(&format!("{report}/explanation/evidence.rs"), "pub fn strength(")),
        ("verdict", of_names("identification/src/identify/explain/answer/mod.rs", "pub fn name(self)")),
        ("coordinate", of_names("drive-model/src/coordinate.rs", "pub fn name(self)")),
        ("with", of_names("drive-model/src/coordinate.rs", "pub fn name(self)")),
        ("drift_parts", of_names(&format!("{report}/drift/words.rs"), "fn setup_part_kind(")),
        ("ask_orientation", of_enum("stand-acquire/src/calibration_session/device.rs", "pub enum Orientation {")),
    ];
    let mut all = BTreeMap::new();
    for (prefix, kinds) in families {
        assert!(!kinds.is_empty(), "{prefix}");
        all.extend(kinds.into_iter().map(|(kind, fields)| (format!("{prefix}_{kind}"), fields)));
    }
    // A misfit that differs from log to log has a sentence of its own; warnings about a log are sentences of the program.
    ["with_log", "allan_note_log", "drift_log"].iter().for_each(|key| assert!(all.remove(*key).is_some(), "{key}"));
    all
}

/// The arguments of a text: `{name}`.
fn arguments(text: &str) -> BTreeSet<String> {
    text.split('{').skip(1).map(|part| part.split('}').next().unwrap().to_owned()).collect()
}

#[test]
fn each_kind_of_the_program_has_a_key_with_the_arguments_that_the_program_gives() {
    let table: BTreeMap<String, [String; 2]> = table().into_iter().collect();
    // The page adds these: the limit with its unit, the name of the coordinate in the language.
    let of_page = ["below", "unit", "coordinate"].map(str::to_owned);
    let kinds = kinds();
    assert!(kinds.len() > 150 && kinds["form_torque_step"].contains("t_s") && kinds["stage_visit"].contains("visits"), "{kinds:?}");
    for (key, fields) in kinds {
        let texts = table.get(&key).unwrap_or_else(|| panic!("{key}: not in text.js"));
        for text in texts {
            let unknown: Vec<String> =
                arguments(text).into_iter().filter(|name| !fields.contains(name) && !of_page.contains(name)).collect();
            assert!(unknown.is_empty(), "{key}: {unknown:?} is not one of {fields:?}");
        }
    }
}

#[test]
fn both_languages_have_the_same_arguments() {
    for (key, [english, ukrainian]) in table() {
        assert_eq!(arguments(&english), arguments(&ukrainian), "{key}");
    }
}
